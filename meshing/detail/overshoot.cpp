#include "meshing/detail/overshoot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/progress.h"
#include "core/random.h"

namespace limber::meshing::detail {

namespace {

double squared_distance_to_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp(along.dot(p - a) / length2, 0.0, 1.0) : 0.0;
  return (a + t * along - p).squaredNorm();
}

double squared_distance(const std::array<Vec3, 3>& triangle, const Vec3& p) {
  const auto& [a, b, c] = triangle;
  const Vec3 normal = (b - a).cross(c - a);
  const auto left_of = [&](const Vec3& from, const Vec3& to) {
    return normal.cross(to - from).dot(p - from) >= 0;
  };
  if (normal.squaredNorm() > 0 && left_of(a, b) && left_of(b, c) && left_of(c, a)) {
    const double height = normal.dot(p - a);
    return height * height / normal.squaredNorm();
  }
  return std::min({squared_distance_to_segment(a, b, p), squared_distance_to_segment(b, c, p),
                   squared_distance_to_segment(c, a, p)});
}

}  // namespace

SurfaceDistance::SurfaceDistance(const Points& positions, const Triangles& triangles)
    : axes_(positions, triangles),
      pieces_(pieces_along(axes_, positions, triangles)),
      tree_(boxes_of(pieces_)) {
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    corners_.push_back(
        {positions.row(triangles(t, 0)), positions.row(triangles(t, 1)), positions.row(triangles(t, 2))});
}

double SurfaceDistance::at(const Vec3& point) const {
  throw_if_stopped();
  double best = 1e300;
  tree_.nearest(axes_.along(point), best, [&](int piece) {
    best =
        std::min(best, squared_distance(corners_[std::size_t(pieces_[std::size_t(piece)].triangle)], point));
    return best * (1 + 1e-9);  // the slack leaves nothing to the rounding of boxes
  });
  return std::sqrt(best);
}

Eigen::Matrix<double, Eigen::Dynamic, 4> planes_of(const ConvexShell& shell) {
  Eigen::Matrix<double, Eigen::Dynamic, 4> planes(shell.triangles.rows(), 4);
  constexpr double min_altitude = 1e-9;
  const double size = bounding_box(shell.vertices).diagonal();
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f) {
    const Vec3 a = shell.vertices.row(shell.triangles(f, 0)), b = shell.vertices.row(shell.triangles(f, 1)),
               c = shell.vertices.row(shell.triangles(f, 2));
    const Vec3 cross = (b - a).cross(c - a);
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    if (!(cross.norm() > min_altitude * size * longest)) continue;
    const Vec3 normal = cross.normalized();
    planes.row(count++) << normal.transpose(), -normal.dot(a);
  }
  return planes.topRows(count);
}

std::vector<BoundarySample> boundary_samples(const std::vector<ConvexShell>& shells, double per_area) {
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 4>> planes;
  std::vector<Box> boxes;
  for (const ConvexShell& shell : shells) {
    planes.push_back(planes_of(shell));
    boxes.push_back(bounding_box(shell.vertices));
  }
  const auto inside = [&](std::size_t s, const Vec3& p) {
    if ((p.array() < boxes[s].lower.array()).any() || (p.array() > boxes[s].upper.array()).any())
      return false;
    return (planes[s].leftCols<3>() * p + planes[s].col(3)).maxCoeff() < 0;
  };
  std::vector<BoundarySample> samples;
  for (std::size_t s = 0; s < shells.size(); ++s) {
    Rng rng(20061, s);
    double due = 0.5;  // samples owed to the area walked over so far
    for (Eigen::Index f = 0; f < shells[s].triangles.rows(); ++f) {
      throw_if_stopped();
      const Vec3 a = shells[s].vertices.row(shells[s].triangles(f, 0));
      const Vec3 u = Vec3(shells[s].vertices.row(shells[s].triangles(f, 1))) - a;
      const Vec3 v = Vec3(shells[s].vertices.row(shells[s].triangles(f, 2))) - a;
      for (due += 0.5 * u.cross(v).norm() * per_area; due >= 1; due -= 1) {
        double x = rng.uniform(), y = rng.uniform();
        if (x + y > 1) x = 1 - x, y = 1 - y;
        const Vec3 p = a + x * u + y * v;
        bool covered = false;
        for (std::size_t other = 0; other < shells.size() && !covered; ++other)
          covered = other != s && inside(other, p);
        if (!covered) samples.push_back({int(s), p});
      }
    }
  }
  return samples;
}

}  // namespace limber::meshing::detail
