#include "plan/steering.h"

#include <cmath>

namespace limber::plan {

namespace {

// Where what is lacking falls from above 0 at `low` to below 0 at `high`.
template <class ShortBy>
double halved(double low, double high, const ShortBy& short_by) {
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (short_by(middle) > 0 ? low : high) = middle;
  }
  return high;
}

double min_time_undamped(double distance, double speed, double a) {
  return (-speed + std::sqrt(speed * speed + 2 * a * distance)) / a;
}

// Late enough that nothing is lacking: what drives grows as t, and drift ends.
template <class ShortBy>
double late_enough(double from, const ShortBy& short_by) {
  while (short_by(from) > 0) from *= 2;
  return from;
}

}  // namespace

double drift_m(const Drive& drive, double t) {
  const double alpha = drive.drag_per_s;
  return alpha == 0 ? t : -std::expm1(-alpha * t) / alpha;
}

double driven_m(const Drive& drive, double t) {
  const double alpha = drive.drag_per_s, a = drive.acceleration;
  // In small αt the closed form is a difference of what is nearly equal.
  if (alpha * t < 1e-4) return 0.5 * a * t * t * (1 - alpha * t / 3);
  return a * (t - drift_m(drive, t)) / alpha;
}

// |way − v t| − a t²/2 is positive at 0 and negative where a point that fled at |v| would be caught. Where
// something slows it, no time is shorter than without.
double min_time_to_go(double distance, double speed, const Drive& drive) {
  const double without = min_time_undamped(distance, speed, drive.acceleration);
  if (drive.drag_per_s == 0 || distance <= 0) return without;
  const auto short_by = [&](double t) { return distance - speed * drift_m(drive, t) - driven_m(drive, t); };
  // Thrown away from there, it is slowed as well: then it may take less.
  const double early = speed < 0 ? min_time_undamped(distance, 0, drive.acceleration) : without;
  return halved(early, late_enough(without, short_by), short_by);
}

double time_to_go(const Vec3& way, const Vec3& v, const Drive& drive) {
  const double distance = way.norm(), a = drive.acceleration;
  if (distance == 0) return 0;
  const double low = min_time_undamped(distance, v.norm(), a),
               high = min_time_undamped(distance, -v.norm(), a);
  if (drive.drag_per_s == 0)
    return halved(low, high, [&](double t) { return (way - v * t).norm() - 0.5 * a * t * t; });
  const auto short_by = [&](double t) { return (way - v * drift_m(drive, t)).norm() - driven_m(drive, t); };
  return halved(low, late_enough(low, short_by), short_by);
}

double time_to_stop(double speed, const Drive& drive) {
  const double without = speed / drive.acceleration;
  return drive.drag_per_s == 0 ? without : std::log1p(drive.drag_per_s * without) / drive.drag_per_s;
}

Vec3 best_direction(const Vec3& way, const Vec3& v, const Drive& drive) {
  const Vec3 push = way - v * drift_m(drive, time_to_go(way, v, drive));
  const double length = push.norm();
  return length > 0 ? Vec3(push / length) : Vec3::Zero();
}

}  // namespace limber::plan
