#include "plan/steering.h"

#include <cmath>

namespace limber::plan {

// |way − v t| − a t²/2 is positive at 0 and negative where a point that fled at |v| would be caught: halved.
double min_time_to_go(double distance, double speed, double a) {
  return (-speed + std::sqrt(speed * speed + 2 * a * distance)) / a;
}

double time_to_go(const Vec3& way, const Vec3& v, double a) {
  const double distance = way.norm();
  if (distance == 0) return 0;
  const auto short_by = [&](double t) { return (way - v * t).norm() - 0.5 * a * t * t; };
  double low = min_time_to_go(distance, v.norm(), a), high = min_time_to_go(distance, -v.norm(), a);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (short_by(middle) > 0 ? low : high) = middle;
  }
  return high;
}

Vec3 best_direction(const Vec3& way, const Vec3& v, double a) {
  const double t = time_to_go(way, v, a);
  const Vec3 push = way - v * t;
  const double length = push.norm();
  return length > 0 ? Vec3(push / length) : Vec3::Zero();
}

}  // namespace limber::plan
