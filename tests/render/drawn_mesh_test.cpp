#include "render/detail/drawn_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/random.h"
#include "tests/render/shapes.h"

namespace limber::render::detail {
namespace {

std::vector<std::array<int, 3>> sorted_triangles(const Triangles& triangles) {
  std::vector<std::array<int, 3>> rows;
  for (int t = 0; t < triangles.rows(); ++t)
    rows.push_back({triangles(t, 0), triangles(t, 1), triangles(t, 2)});
  std::sort(rows.begin(), rows.end());
  return rows;
}

TEST(DrawnMesh, IsTheSameSetOfTrianglesWithTheSameWinding) {
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0}, 1, 12);
  for (const double crease : {0.0, 40.0, 180.0}) {
    const DrawnMesh drawn = order_for_drawing(sphere.triangles, sphere.positions, crease);
    Triangles back(Eigen::Index(drawn.corners.size() / 3), 3);
    for (int c = 0; c < int(drawn.corners.size()); ++c)
      back(c / 3, c % 3) = drawn.vertex_from_drawn[drawn.corners[c]];
    EXPECT_EQ(sorted_triangles(back), sorted_triangles(sphere.triangles));
  }
}

TEST(DrawnMesh, ABoxHasThreeVerticesACornerAndFaceNormals) {
  const SurfaceMesh box = box_mesh({0, 0, 0}, {1, 2, 3});
  DrawnMesh drawn = order_for_drawing(box.triangles, box.positions, 40);
  EXPECT_EQ(drawn.vertex_from_drawn.size(), 24u);
  deform(drawn, box.positions, vertex_normals(box.positions, box.triangles));
  for (std::size_t c = 0; c < drawn.corners.size(); c += 3) {
    const auto p = [&](std::size_t i) {
      return Vec3(box.positions.row(drawn.vertex_from_drawn[drawn.corners[c + i]]));
    };
    const Vec3 face = (p(1) - p(0)).cross(p(2) - p(0)).normalized();
    for (std::size_t i = 0; i < 3; ++i) {
      const float* n = &drawn.normals[3 * drawn.corners[c + i]];
      EXPECT_LT((Vec3(n[0], n[1], n[2]) - face).norm(), 1e-6);
    }
  }
  EXPECT_EQ(order_for_drawing(box.triangles, box.positions, 95).vertex_from_drawn.size(), 8u);
}

// Two faces of a roof meet at the ridge: parted where they differ by more than the crease angle.
TEST(DrawnMesh, ARidgeIsSplitExactlyAboveTheCreaseAngle) {
  for (const double angle_deg : {10.0, 39.0, 41.0, 80.0}) {
    const double half = 0.5 * angle_deg * std::numbers::pi / 180;
    SurfaceMesh roof{Points(4, 3), Triangles(2, 3)};
    roof.positions << 0, 0, 0, 0, 1, 0, -std::cos(half), 0.5, -std::sin(half), std::cos(half), 0.5,
        -std::sin(half);
    roof.triangles << 0, 1, 2, 1, 0, 3;
    EXPECT_EQ(order_for_drawing(roof.triangles, roof.positions, 40).vertex_from_drawn.size(),
              angle_deg > 40 ? 6u : 4u)
        << angle_deg;
  }
}

TEST(DrawnMesh, ComputedNormalsAreThoseOfCore) {
  const SurfaceMesh sphere = sphere_mesh({1, 2, 3}, 0.7, 15);
  const Points normals = vertex_normals(sphere.positions, sphere.triangles);
  DrawnMesh given = order_for_drawing(sphere.triangles, sphere.positions, 180), computed = given;
  deform(given, sphere.positions, normals);
  deform(computed, sphere.positions, Points());
  ASSERT_EQ(given.normals.size(), computed.normals.size());
  for (std::size_t i = 0; i < given.normals.size(); ++i)
    EXPECT_NEAR(given.normals[i], computed.normals[i], 1e-5);
}

TEST(DrawnMesh, NeighboursAreNearInMemory) {
  SurfaceMesh sphere = sphere_mesh({0, 0, 0}, 1, 60);
  Rng rng(31, 0);  // shuffled, as scanners and exporters leave it
  for (int t = int(sphere.triangles.rows()) - 1; t > 0; --t)
    sphere.triangles.row(t).swap(sphere.triangles.row(rng.below(t + 1)));
  const DrawnMesh drawn = order_for_drawing(sphere.triangles, sphere.positions, 180);
  double jumps = 0;
  for (std::size_t c = 0; c < drawn.corners.size(); c += 3) {
    const auto [low, high] = std::minmax({drawn.corners[c], drawn.corners[c + 1], drawn.corners[c + 2]});
    jumps += high - low;
  }
  EXPECT_LT(jumps / (double(drawn.corners.size()) / 3), 0.05 * double(sphere.positions.rows()));
}

}  // namespace
}  // namespace limber::render::detail
