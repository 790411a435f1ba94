#include "meshing/winding_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/progress.h"

namespace limber::meshing {

namespace {
// A group is far when the point is this many radii away; what error that leaves: docs/decomposition.md.
constexpr double dipole_radii = 2.5;
constexpr int dipole_leaf_size = 8;
constexpr double four_pi = 4.0 * std::numbers::pi;
}  // namespace

double solid_angle_share(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point) {
  const Vec3 u = a - point, v = b - point, w = c - point;
  const double lu = u.norm(), lv = v.norm(), lw = w.norm();
  const double numerator = u.dot(v.cross(w));
  const double denominator = lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv;
  // In the plane of the triangle, and inside it, the angle is ±2π by the sign of a zero: take the mean.
  return numerator == 0 ? 0.0 : 2.0 * std::atan2(numerator, denominator) / four_pi;
}

WindingNumber::WindingNumber(const Points& positions, const Triangles& triangles)
    : bvh_(detail::build_triangle_bvh(positions, triangles, dipole_leaf_size)),
      expansions_(bvh_.nodes.size()) {
  corners_.reserve(bvh_.order.size());
  for (int t : bvh_.order) {
    corners_.push_back(
        {positions.row(triangles(t, 0)), positions.row(triangles(t, 1)), positions.row(triangles(t, 2))});
  }
  for (std::size_t n = 0; n < bvh_.nodes.size(); ++n) {
    const auto& node = bvh_.nodes[n];
    Expansion& e = expansions_[n];
    double area = 0;
    for (int i = node.begin; i < node.end; ++i) {
      const auto& [a, b, c] = corners_[std::size_t(i)];
      const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
      area += area_vector.norm();
      e.center += area_vector.norm() * (a + b + c) / 3.0;
      e.area_vector += area_vector;
    }
    e.center = area > 0 ? Vec3(e.center / area) : node.box.center();
    for (int i = node.begin; i < node.end; ++i) {
      const Vec3 a = corners_[std::size_t(i)][0] - e.center, b = corners_[std::size_t(i)][1] - e.center,
                 c = corners_[std::size_t(i)][2] - e.center, sum = a + b + c;
      const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
      const Eigen::Matrix3d mean_square =
          (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose()) / 12.0;
      e.moment += sum / 3.0 * area_vector.transpose();
      e.contracted += mean_square.trace() * area_vector + 2.0 * mean_square * area_vector;
      for (int k = 0; k < 3; ++k) e.second_moment[std::size_t(k)] += mean_square * area_vector[k];
      e.radius_squared = std::max({e.radius_squared, a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
    }
  }
}

double WindingNumber::at(const Vec3& point) const {
  throw_if_stopped();
  if (bvh_.nodes.empty()) return 0;
  std::array<int, 64> stack;  // median splits: the depth is below 32
  std::size_t depth = 0;
  stack[depth++] = 0;
  double sum = 0;
  while (depth > 0) {
    const std::size_t n = std::size_t(stack[--depth]);
    const auto& node = bvh_.nodes[n];
    const Expansion& e = expansions_[n];
    const Vec3 r = e.center - point;
    const double r2 = r.squaredNorm();
    if (r2 > dipole_radii * dipole_radii * e.radius_squared) {
      // The kernel r / |r|³ and its two derivatives, contracted with the moments.
      double cubic = 0;
      for (int k = 0; k < 3; ++k) cubic += r[k] * r.dot(e.second_moment[std::size_t(k)] * r);
      const double dipole = e.area_vector.dot(r);
      const double first = e.moment.trace() - 3.0 * r.dot(e.moment * r) / r2;
      const double second = (-1.5 * e.contracted.dot(r) + 7.5 * cubic / r2) / r2;
      sum += (dipole + first + second) / (r2 * std::sqrt(r2) * four_pi);
    } else if (node.leaf()) {
      for (int i = node.begin; i < node.end; ++i) {
        const auto& [a, b, c] = corners_[std::size_t(i)];
        sum += solid_angle_share(a, b, c, point);
      }
    } else {
      stack[depth++] = node.right;
      stack[depth++] = node.left;
    }
  }
  return sum;
}

}  // namespace limber::meshing
