#include "limber/detail/film/film_time.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace limber::detail {

namespace {

std::vector<double> mean_of_neighbors(const std::vector<double>& values, int reach) {
  const int n = int(values.size());
  std::vector<double> means(values.size());
  for (int i = 0; i < n; ++i) {
    double sum = 0;
    for (int k = i - reach; k <= i + reach; ++k) sum += values[std::size_t(std::clamp(k, 0, n - 1))];
    means[std::size_t(i)] = sum / (2 * reach + 1);
  }
  return means;
}

// Of a function that is linear between whole numbers, from the first to each.
std::vector<double> integral_of(const std::vector<double>& values) {
  std::vector<double> sums{0};
  for (std::size_t i = 0; i + 1 < values.size(); ++i)
    sums.push_back(sums.back() + 0.5 * (values[i] + values[i + 1]));
  return sums;
}

}  // namespace

std::vector<double> eased(const std::vector<double>& shares, int frames) {
  const int n = int(shares.size()), reach = frames / 2;
  std::vector<double> largest(shares.size());
  for (int i = 0; i < n; ++i)
    largest[std::size_t(i)] = *std::max_element(shares.begin() + std::max(0, i - 2 * reach),
                                                shares.begin() + std::min(n, i + 2 * reach + 1));
  return mean_of_neighbors(mean_of_neighbors(largest, reach), reach);
}

std::vector<Moment> paced(const std::vector<double>& contact, const PaceRange& range,
                          std::optional<double> length) {
  LIMBER_CHECK(!contact.empty() && range.slowest > 0 && range.slowest <= range.quickest, contact.size(),
               range.slowest, range.quickest);
  if (contact.size() == 1) return {{0, 1}};
  const double least = 1 / range.quickest, most = 1 / range.slowest;
  std::vector<double> slowness;  // frames of the film a frame of the motion; linear between two of these
  for (const double c : contact) slowness.push_back(least + (most - least) * c);
  if (length) {
    const double whole = double(contact.size() - 1);
    LIMBER_CHECK(whole * least <= *length && *length <= whole * most, *length, whole * least, whole * most);
    const std::vector<double> plain = slowness;
    double lower = least / most, upper = most / least;
    for (int halving = 0; halving < 60; ++halving) {
      const double factor = 0.5 * (lower + upper);
      for (std::size_t i = 0; i < plain.size(); ++i) slowness[i] = std::clamp(factor * plain[i], least, most);
      (integral_of(slowness).back() < *length ? lower : upper) = factor;
    }
  }
  const std::vector<double> time = integral_of(slowness);
  const int steps = std::max(1, int(std::lround(time.back())));
  const double step = time.back() / steps;
  std::vector<Moment> moments;
  std::size_t i = 0;
  for (int k = 0; k <= steps; ++k) {
    const double t = k == steps ? time.back() : k * step;
    while (i + 2 < time.size() && time[i + 1] <= t) ++i;
    // a x + (b − a) x²/2 = d
    const double a = slowness[i], b = slowness[i + 1], d = t - time[i],
                 here = std::sqrt(std::max(0.0, a * a + 2 * (b - a) * d));
    moments.push_back({double(i) + std::min(1.0, 2 * d / (a + here)), step / here});
  }
  moments.back().at = double(contact.size() - 1);
  return moments;
}

State state_at(const std::vector<State>& frames, double dt_s, double moment) {
  const std::size_t f = std::min(std::size_t(moment), frames.size() - 1);
  const double s = moment - double(f);
  if (s <= 0 || f + 1 >= frames.size()) return frames[f];
  const State &from = frames[f], &to = frames[f + 1];
  const double h = double(to.step - from.step) * dt_s, r = 1 - s;
  State state = from;
  state.step += std::llround(s * double(to.step - from.step));
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    const double p = from.positions[i], q = to.positions[i], u = h * double(from.velocities[i]),
                 v = h * double(to.velocities[i]);
    // Hermite's cubic.
    state.positions[i] = float(r * r * (1 + 2 * s) * p + s * s * (3 - 2 * s) * q + s * r * (r * u - s * v));
    if (h > 0)
      state.velocities[i] = float((6 * s * r * (q - p) + r * (1 - 3 * s) * u + s * (3 * s - 2) * v) / h);
  }
  return state;
}

int first_at_rest(const std::vector<State>& frames, double tolerance_m) {
  const auto is_there = [&](const State& state) {
    const auto& last = frames.back().positions;
    for (std::size_t i = 0; i + 2 < last.size(); i += 3) {
      double square = 0;
      for (std::size_t c = i; c < i + 3; ++c)
        square +=
            (double(state.positions[c]) - double(last[c])) * (double(state.positions[c]) - double(last[c]));
      if (square > tolerance_m * tolerance_m) return false;
    }
    return true;
  };
  int first = int(frames.size()) - 1;
  while (first > 0 && is_there(frames[std::size_t(first - 1)])) --first;
  return first;
}

}  // namespace limber::detail
