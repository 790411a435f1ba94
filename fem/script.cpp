#include "fem/script.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace limber::fem {
namespace {

// Of |x| ≤ π, to some 1e-15: its series.
double sine(double x) {
  double sum = 1;
  for (int n = 28; n >= 2; n -= 2) sum = 1 - x * x / (n * (n + 1)) * sum;
  return x * sum;
}

// Rodrigues' formula.
Eigen::Matrix3d rotation(const Vec3& turn_rad) {
  const double angle = turn_rad.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  const Vec3 n = turn_rad / angle;
  Eigen::Matrix3d across;
  across << 0, -n.z(), n.y(), n.z(), 0, -n.x(), -n.y(), n.x(), 0;
  constexpr double whole = 2 * std::numbers::pi;
  const double rest = angle - whole * std::floor(angle / whole + 0.5), half = sine(rest / 2);
  return Eigen::Matrix3d::Identity() + sine(rest) * across + 2 * half * half * (across * across);
}

}  // namespace

Pose pose_at(const Track& track, double time_s) {
  const auto next = std::upper_bound(track.keyframes.begin(), track.keyframes.end(), time_s,
                                     [](double time, const Keyframe& k) { return time < k.at_s; });
  const Keyframe before =
      next == track.keyframes.begin() ? Keyframe{0, track.pivot_m, Vec3::Zero()} : *std::prev(next);
  if (next == track.keyframes.end()) return {rotation(before.turn_rad), before.position_m};
  const double share = (time_s - before.at_s) / (next->at_s - before.at_s);
  return {rotation(before.turn_rad + share * (next->turn_rad - before.turn_rad)),
          before.position_m + share * (next->position_m - before.position_m)};
}

}  // namespace limber::fem
