// Where along a segment a distance is largest. A distance to a fixed set rises by at most 1 a metre, so
// between two places its values there bound it, and what cannot hold the largest is left out (Piyavskii 1972,
// Shubert 1972).
#pragma once

namespace limber {

struct Highest {
  double value = 0;
  double at = 0;
};

// Raises `best` to the largest value(s) for s in [s0, s1], where it is v0 and v1 at the ends and rises by at
// most `slope` a unit of s. What would raise it by less than a hundredth is not looked for, and no stretch is
// halved more than `halvings` times: at most 2^halvings − 1 values are asked for.
template <class Value>
void raise_along(double s0, double v0, double s1, double v1, double slope, int halvings, const Value& value,
                 Highest& best) {
  if (halvings == 0 || !(0.5 * (v0 + v1 + slope * (s1 - s0)) > 1.01 * best.value)) return;
  const double s = 0.5 * (s0 + s1), v = value(s);
  if (v > best.value) best = {v, s};
  // The half that can hold more goes first.
  const bool first_left = v0 > v1;
  for (const bool left : {first_left, !first_left})
    left ? raise_along(s0, v0, s, v, slope, halvings - 1, value, best)
         : raise_along(s, v, s1, v1, slope, halvings - 1, value, best);
}

}  // namespace limber
