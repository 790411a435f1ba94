#include "meshing/winding_number.h"

#include <emmintrin.h>

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
      expansions_(bvh_.nodes.size()),
      first_pair_(bvh_.nodes.size(), -1) {
  std::vector<std::array<Vec3, 3>> corners;
  for (int t : bvh_.order)
    corners.push_back(
        {positions.row(triangles(t, 0)), positions.row(triangles(t, 1)), positions.row(triangles(t, 2))});
  for (std::size_t n = 0; n < bvh_.nodes.size(); ++n) {
    const auto& node = bvh_.nodes[n];
    Expansion& e = expansions_[n];
    if (node.leaf()) {
      first_pair_[n] = int(pairs_.size());
      for (int i = node.begin; i < node.end; i += 2) {
        const auto& one = corners[std::size_t(i)];
        const std::array<Vec3, 3> other =
            i + 1 < node.end ? corners[std::size_t(i) + 1] : std::array{one[0], one[0], one[0]};
        Pair& pair = pairs_.emplace_back();
        for (std::size_t k = 0; k < 3; ++k)
          for (int axis = 0; axis < 3; ++axis) pair.corners[k][axis] = Two{one[k][axis], other[k][axis]};
      }
    }
    double area = 0;
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();  // ∫ x nᵀ dA
    std::array<Eigen::Matrix3d, 3> second_moment;      // ∫ x xᵀ n_k dA, one matrix a component k of n
    second_moment.fill(Eigen::Matrix3d::Zero());
    for (int i = node.begin; i < node.end; ++i) {
      const auto& [a, b, c] = corners[std::size_t(i)];
      const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
      area += area_vector.norm();
      e.center += area_vector.norm() * (a + b + c) / 3.0;
      e.area_vector += area_vector;
    }
    e.center = area > 0 ? Vec3(e.center / area) : node.box.center();
    for (int i = node.begin; i < node.end; ++i) {
      const Vec3 a = corners[std::size_t(i)][0] - e.center, b = corners[std::size_t(i)][1] - e.center,
                 c = corners[std::size_t(i)][2] - e.center, sum = a + b + c;
      const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
      const Eigen::Matrix3d mean_square =
          (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose()) / 12.0;
      moment += sum / 3.0 * area_vector.transpose();
      e.contracted += mean_square.trace() * area_vector + 2.0 * mean_square * area_vector;
      for (int k = 0; k < 3; ++k) second_moment[std::size_t(k)] += mean_square * area_vector[k];
      e.radius_squared = std::max({e.radius_squared, a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
    }
    const auto& m = moment;
    const auto& [sx, sy, sz] = second_moment;
    e.trace = m.trace();
    e.quadratic = {m(0, 0), m(0, 1) + m(1, 0), m(0, 2) + m(2, 0), m(1, 1), m(1, 2) + m(2, 1), m(2, 2)};
    e.cubic = {sx(0, 0),
               2 * sx(0, 1) + sy(0, 0),
               2 * sx(0, 2) + sz(0, 0),
               sx(1, 1) + 2 * sy(0, 1),
               2 * (sx(1, 2) + sy(0, 2) + sz(0, 1)),
               sx(2, 2) + 2 * sz(0, 2),
               sy(1, 1),
               2 * sy(1, 2) + sz(1, 1),
               sy(2, 2) + 2 * sz(1, 2),
               sz(2, 2)};
  }
}

void WindingNumber::Angles::add(const Pair& pair, const Vec3& point) {
  struct Way {
    Two x, y, z;
    Two dot(const Way& o) const { return x * o.x + y * o.y + z * o.z; }
    Way cross(const Way& o) const { return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x}; }
    Two norm() const { return _mm_sqrt_pd(dot(*this)); }
  };
  const auto way_to = [&](const Two(&corner)[3]) {
    return Way{corner[0] - point[0], corner[1] - point[1], corner[2] - point[2]};
  };
  const Way u = way_to(pair.corners[0]), v = way_to(pair.corners[1]), w = way_to(pair.corners[2]);
  const Two lu = u.norm(), lv = v.norm(), lw = w.norm();
  const Two numerator = u.dot(v.cross(w)), zero = {0, 0}, one = {1, 1};
  const Two denominator = lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv;
  const Two d = numerator == 0 ? one : denominator;
  const Two re = re_ * d - im_ * numerator, im = re_ * numerator + im_ * d;
  // An argument of π counts as above the axis.
  turns_ += ((im_ >= 0) & (numerator > 0) & (im < 0)) ? one : zero;
  turns_ -= ((im_ < 0) & (numerator < 0) & (im >= 0)) ? one : zero;
  const Two size = (re < 0 ? -re : re) + (im < 0 ? -im : im);
  re_ = re / size, im_ = im / size;
}

double WindingNumber::Angles::share() const {
  double sum = 0;
  for (int k = 0; k < 2; ++k) sum += std::atan2(im_[k] + 0.0, re_[k]) + 2 * std::numbers::pi * turns_[k];
  return 2 * sum / four_pi;
}

double WindingNumber::at(const Vec3& point) const {
  throw_if_stopped();
  if (bvh_.nodes.empty()) return 0;
  std::array<int, 64> stack;  // median splits: the depth is below 32
  std::size_t depth = 0;
  stack[depth++] = 0;
  double sum = 0;
  Angles angles;
  while (depth > 0) {
    const std::size_t n = std::size_t(stack[--depth]);
    const auto& node = bvh_.nodes[n];
    const Expansion& e = expansions_[n];
    const Vec3 r = e.center - point;
    const double r2 = r.squaredNorm();
    if (r2 > dipole_radii * dipole_radii * e.radius_squared) {
      // The kernel r / |r|³ and its two derivatives, contracted with the moments.
      const double x = r[0], y = r[1], z = r[2], xx = x * x, xy = x * y, xz = x * z, yy = y * y, yz = y * z,
                   zz = z * z;
      const auto& q = e.quadratic;
      const auto& c = e.cubic;
      const double quadratic = q[0] * xx + q[1] * xy + q[2] * xz + (q[3] * yy + q[4] * yz + q[5] * zz);
      const double cubic = x * (c[0] * xx + c[1] * xy + c[2] * xz + (c[3] * yy + c[4] * yz + c[5] * zz)) +
                           (y * (c[6] * yy + c[7] * yz + c[8] * zz) + z * (c[9] * zz));
      const double first = e.trace - 3.0 * quadratic / r2;
      const double second = (-1.5 * e.contracted.dot(r) + 7.5 * cubic / r2) / r2;
      sum += (e.area_vector.dot(r) + first + second) / (r2 * std::sqrt(r2) * four_pi);
    } else if (node.leaf()) {
      const int pairs = (node.end - node.begin + 1) / 2;
      for (int i = 0; i < pairs; ++i) angles.add(pairs_[std::size_t(first_pair_[n] + i)], point);
    } else {
      stack[depth++] = node.right;
      stack[depth++] = node.left;
    }
  }
  return sum + angles.share();
}

}  // namespace limber::meshing
