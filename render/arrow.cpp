#include "render/arrow.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace limber::render {

namespace {

constexpr int sides = 20;
constexpr int rod_rings = 4, rod_tail = rod_rings * sides, rod_tip = rod_tail + 1;
// Rings from the tail: the shaft's two ends, the head's base; then the tail's middle and the tip.
constexpr int rings = 3, tail = rings * sides, tip = tail + 1;
constexpr double head_radius = 2.4, head_length = 6, min_length = 8;  // in radii of the shaft

}  // namespace

Triangles arrow_triangles() {
  Triangles triangles((2 * rings) * sides, 3);
  Eigen::Index row = 0;
  for (int i = 0; i < sides; ++i) {
    const int j = (i + 1) % sides;
    triangles.row(row++) << tail, j, i;
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = r * sides;
      triangles.row(row++) << a + i, a + j, a + sides + j;
      triangles.row(row++) << a + i, a + sides + j, a + sides + i;
    }
    triangles.row(row++) << (rings - 1) * sides + i, (rings - 1) * sides + j, tip;
  }
  return triangles;
}

Points arrow(const Vec3& from, const Vec3& to, double shaft_radius_m) {
  const double length = (to - from).norm();
  Points points(tip + 1, 3);
  points.rowwise() = from.transpose();
  if (length == 0) return points;
  const double radius = std::min(shaft_radius_m, length / min_length);
  const Vec3 along = (to - from) / length, across = along.unitOrthogonal(), up = along.cross(across);
  const double neck = length - head_length * radius;
  const double at[rings] = {0, neck, neck}, wide[rings] = {radius, radius, head_radius * radius};
  for (int r = 0; r < rings; ++r)
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      points.row(r * sides + i) =
          (from + at[r] * along + wide[r] * (std::cos(angle) * across + std::sin(angle) * up)).transpose();
    }
  points.row(tip) = to.transpose();
  return points;
}

Triangles rod_triangles() {
  Triangles triangles(2 * rod_rings * sides, 3);
  Eigen::Index row = 0;
  for (int i = 0; i < sides; ++i) {
    const int j = (i + 1) % sides, last = (rod_rings - 1) * sides;
    triangles.row(row++) << rod_tail, j, i;
    for (int a = 0; a < last; a += sides) {
      triangles.row(row++) << a + i, a + j, a + sides + j;
      triangles.row(row++) << a + i, a + sides + j, a + sides + i;
    }
    triangles.row(row++) << last + i, last + j, rod_tip;
  }
  return triangles;
}

Points rod(const Vec3& from, const Vec3& to, double radius_m) {
  const double length = (to - from).norm();
  Points points(rod_tip + 1, 3);
  points.rowwise() = from.transpose();
  points.row(rod_tip) = to.transpose();
  if (length == 0) return points;
  const double round = std::min(0.5 * radius_m, 0.25 * length);
  const Vec3 along = (to - from) / length, across = along.unitOrthogonal(), up = along.cross(across);
  const double at[rod_rings] = {0, round, length - round, length},
               wide[rod_rings] = {0.7 * radius_m, radius_m, radius_m, 0.7 * radius_m};
  for (int r = 0; r < rod_rings; ++r)
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      points.row(r * sides + i) =
          (from + at[r] * along + wide[r] * (std::cos(angle) * across + std::sin(angle) * up)).transpose();
    }
  return points;
}

}  // namespace limber::render
