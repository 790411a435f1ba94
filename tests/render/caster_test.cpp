// A coarse stand-in for a fine surface.
#include "render/caster.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <set>

#include "tests/render/shapes.h"

namespace limber::render {
namespace {

TEST(Caster, IsOfTheFineSurfacesVerticesAndNearlyOfItsSize) {
  const SurfaceMesh ball = sphere_mesh({0.3, -0.2, 0.7}, 0.5, 150);
  const Caster caster = coarse_caster(ball, 4000);
  EXPECT_LE(caster.triangles.rows(), 4000);
  EXPECT_GT(caster.triangles.rows(), 2000);
  EXPECT_EQ(std::set(caster.vertices.begin(), caster.vertices.end()).size(), caster.vertices.size());
  const SurfaceMesh coarse{caster.positions(ball.positions), caster.triangles};
  for (std::size_t i = 0; i < caster.vertices.size(); ++i)
    EXPECT_EQ(coarse.positions.row(Eigen::Index(i)), ball.positions.row(caster.vertices[i]));
  EXPECT_NEAR(volume(coarse), 4 * std::numbers::pi / 3 * std::pow(0.5, 3), 0.01 * volume(ball));
}

TEST(Caster, WhatWasClosedStaysClosed) {
  for (const SurfaceMesh& fine : {sphere_mesh({0, 0, 0}, 1, 60), box_mesh({0, 0, 0}, {1, 2, 3})}) {
    const Caster caster = coarse_caster(fine, 1000);
    std::map<std::pair<int, int>, int> triangles_of_edge;
    for (Eigen::Index t = 0; t < caster.triangles.rows(); ++t)
      for (int i = 0; i < 3; ++i)
        ++triangles_of_edge[std::minmax({caster.triangles(t, i), caster.triangles(t, (i + 1) % 3)})];
    for (const auto& [edge, count] : triangles_of_edge) EXPECT_EQ(count % 2, 0);
    EXPECT_GE(caster.triangles.rows(), 12);
  }
}

}  // namespace
}  // namespace limber::render
