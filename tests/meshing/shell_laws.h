// What every convex shell must be, checked another way than it was made: in long double, with no word of
// meshing.
#pragma once

#include <gtest/gtest.h>

#include <map>

#include "core/mesh.h"

namespace limber::meshing {

using Long3 = Eigen::Matrix<long double, 3, 1>;

// Positive when p is on the outer side of face f.
inline long double beyond(const ConvexShell& shell, Eigen::Index f, const Long3& p) {
  const Long3 a = shell.vertices.row(shell.triangles(f, 0)).transpose().cast<long double>();
  const Long3 b = shell.vertices.row(shell.triangles(f, 1)).transpose().cast<long double>();
  const Long3 c = shell.vertices.row(shell.triangles(f, 2)).transpose().cast<long double>();
  return (b - a).cross(c - a).dot(p - a);
}

inline bool holds(const ConvexShell& shell, const Long3& p) {
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f)
    if (beyond(shell, f, p) > 0) return false;
  return true;
}

// Valid, closed, of one piece with the topology of a sphere, and convex.
inline void expect_convex(const ConvexShell& shell) {
  validate(shell, "shell");
  std::map<std::pair<int, int>, int> sides;
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f)
    for (int k = 0; k < 3; ++k) ++sides[{shell.triangles(f, k), shell.triangles(f, (k + 1) % 3)}];
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(sides.count({side.second, side.first}));
  }
  EXPECT_EQ(shell.vertices.rows() - Eigen::Index(sides.size()) / 2 + shell.triangles.rows(), 2);
  EXPECT_EQ(vertices_of(shell.triangles).size(), std::size_t(shell.vertices.rows()));
  // Rounding of this check itself: 64-bit mantissas, products of three lengths.
  const long double size = bounding_box(shell.vertices).diagonal(),
                    reach = shell.vertices.cwiseAbs().maxCoeff() + size;
  const long double rounding = 1e-18L * size * size * reach;
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f)
    for (Eigen::Index v = 0; v < shell.vertices.rows(); ++v)
      EXPECT_LE(beyond(shell, f, shell.vertices.row(v).transpose().cast<long double>()), rounding)
          << "vertex " << v << " is beyond face " << f;
}

}  // namespace limber::meshing
