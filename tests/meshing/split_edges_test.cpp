#include "meshing/split_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/hash.h"
#include "meshing/import.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {
namespace {

double longest(const SurfaceMesh& mesh) {
  double most = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k)
      most = std::max(most, (mesh.positions.row(mesh.triangles(t, k)) -
                             mesh.positions.row(mesh.triangles(t, (k + 1) % 3)))
                                .norm());
  return most;
}

SurfaceMesh first_of(const SurfaceMesh& mesh, Eigen::Index vertices) {
  return {mesh.positions.topRows(vertices), mesh.triangles};
}

TEST(SplitEdges, IsTheSameClosedSurfaceAndNoEdgeIsLonger) {
  const SurfaceMesh box = made_box({2, 1.4, 0.2});
  const SurfaceMesh split = split_long_edges(box, 0.17);
  validate(split, "split");
  EXPECT_LE(longest(split), 0.17);
  EXPECT_NEAR(area(split), area(box), 1e-12);
  EXPECT_NEAR(volume(split), volume(box), 1e-12);
  EXPECT_TRUE(clean(split).left.closed());
  EXPECT_EQ(hash_of(first_of({split.positions, box.triangles}, 8)), hash_of(box));
  // New vertices lie on the faces of the box.
  for (Eigen::Index i = 8; i < split.positions.rows(); ++i) {
    const Vec3 p = split.positions.row(i);
    EXPECT_NEAR(std::min({p.x(), 2 - p.x(), p.y(), 1.4 - p.y(), p.z(), 0.2 - p.z()}), 0, 1e-15) << i;
  }
  // An equilateral triangle of that side has 0.0125 m²; the cuts halve, so four times as many may be needed.
  EXPECT_LT(double(split.triangles.rows()), 4 * area(box) / 0.0125);
}

TEST(SplitEdges, WhatIsFineStaysAsItIs) {
  const SurfaceMesh sphere = made_sphere(12);
  EXPECT_EQ(hash_of(split_long_edges(sphere, longest(sphere))), hash_of(sphere));
}

// Three faces at an edge, needles, and a length that would take millions of vertices.
TEST(SplitEdges, TakesWhatIsNoManifoldAndEnds) {
  SurfaceMesh fins;
  fins.positions.resize(5, 3);
  fins.positions << 0, 0, 0, 1, 0, 0, 0.5, 1, 0, 0.5, 0, 1, 0.5, -1e-9, -1e-9;
  fins.triangles.resize(3, 3);
  fins.triangles << 0, 1, 2, 0, 1, 3, 0, 1, 4;
  const SurfaceMesh split = split_long_edges(fins, 0.1);
  validate(split, "split");
  EXPECT_LE(longest(split), 0.1);
  // Along the shared edge the three have the same vertices.
  int on_edge = 0;
  for (Eigen::Index i = 0; i < split.positions.rows(); ++i)
    on_edge += split.positions(i, 1) == 0 && split.positions(i, 2) == 0;
  EXPECT_EQ(on_edge, 17);

  const SurfaceMesh bounded = split_long_edges(fins, 1e-7, {.max_new_vertices = 5'000});
  EXPECT_LE(bounded.positions.rows(), 5 + 5'000);
  EXPECT_GT(bounded.positions.rows(), 500);
}

// A rod of needles: cuts of a needle leave needles, which are cut again, many times as often as their sides'
// length would say.
TEST(SplitEdges, ARodOfNeedlesKeepsToTheBoundToo) {
  constexpr int sides = 600;
  SurfaceMesh rod{Points(2 * sides, 3), Triangles(2 * sides, 3)};
  for (int i = 0; i < sides; ++i) {
    const double turn = 2 * std::numbers::pi * i / sides;
    rod.positions.row(i) << 0.01 * std::cos(turn), 0.01 * std::sin(turn), 0;
    rod.positions.row(sides + i) << 0.01 * std::cos(turn), 0.01 * std::sin(turn), 10;
    const int next = (i + 1) % sides;
    rod.triangles.row(2 * i) << i, next, sides + next;
    rod.triangles.row(2 * i + 1) << i, sides + next, sides + i;
  }
  for (const double longest_m : {0.3, 0.02, 1e-6}) {
    const SurfaceMesh split = split_long_edges(rod, longest_m, {.max_new_vertices = 40'000});
    EXPECT_LE(split.positions.rows(), 2 * sides + 40'000) << longest_m;
    EXPECT_GT(split.positions.rows(), 2 * sides + 5'000) << longest_m;
    EXPECT_NEAR(area(split), area(rod), 1e-12) << longest_m;
  }
}

// Solids of one shape ask for edges of the same share of those of their cage, however large and fine it is.
TEST(SplitEdges, LengthGoesWithTheSizeAndTheCubeRootOfTets) {
  const double one = longest_edge(made_box({1, 1, 1}), 100);
  EXPECT_DOUBLE_EQ(longest_edge(made_box({3, 3, 3}), 100), 3 * one);
  EXPECT_DOUBLE_EQ(longest_edge(made_box({1, 1, 1}), 800), one / 2);
}

}  // namespace
}  // namespace limber::meshing
