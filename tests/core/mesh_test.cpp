#include "core/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "core/error.h"
#include "tests/core/five_tet_cube.h"

namespace limber {
namespace {

// The unit cube cut into five tets: four corners and the middle.
TEST(Mesh, TheFiveTetsOfACubeFillItAndTheirBoundaryIsItsSurface) {
  const TetMesh cube = five_tet_cube();
  validate(cube, "cube");
  EXPECT_DOUBLE_EQ(volume(cube), 1.0);
  const SurfaceMesh surface{cube.positions, boundary_triangles(cube.tets)};
  EXPECT_EQ(surface.triangles.rows(), 12);
  EXPECT_DOUBLE_EQ(volume(surface), 1.0);  // so the triangles face outwards
  EXPECT_DOUBLE_EQ(area(surface), 6.0);
  EXPECT_EQ(vertices_of(surface.triangles), (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(Mesh, VolumeOfASurfaceDoesNotDependOnWhereItStands) {
  const TetMesh cube = five_tet_cube();
  SurfaceMesh surface{cube.positions, boundary_triangles(cube.tets)};
  surface.positions.rowwise() += Eigen::RowVector3d(1e6, -2e6, 3e6);
  EXPECT_NEAR(volume(surface), 1.0, 1e-9);
}

TEST(Mesh, VertexNormalsOfACubeCornerPointAlongItsDiagonals) {
  const TetMesh cube = five_tet_cube();
  const Points normals = vertex_normals(cube.positions, boundary_triangles(cube.tets));
  for (int v = 0; v < 8; ++v) {
    const Vec3 outward = Vec3(cube.positions.row(v)) - Vec3::Constant(0.5);
    EXPECT_NEAR(normals.row(v).norm(), 1, 1e-15);
    for (int i = 0; i < 3; ++i) EXPECT_GT(normals(v, i) * outward(i), 0);
  }
}

TEST(Mesh, ValidateNamesTheFirstBadElement) {
  const auto complaint = [](const TetMesh& mesh) -> std::string {
    try {
      validate(mesh, "cage");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  TetMesh inverted = five_tet_cube();
  std::swap(inverted.tets(3, 0), inverted.tets(3, 1));
  EXPECT_NE(complaint(inverted).find("cage: tet 3 (vertices 7 6 4 2) has volume -1.667e-01"),
            std::string::npos)
      << complaint(inverted);
  TetMesh not_finite = five_tet_cube();
  not_finite.positions(6, 1) = std::nan("");
  EXPECT_NE(complaint(not_finite).find("vertex 6 is not finite"), std::string::npos);
  TetMesh out_of_range = five_tet_cube();
  out_of_range.tets(2, 3) = 8;
  EXPECT_NE(complaint(out_of_range).find("tet 2 names vertex 8, but there are 8 vertices"),
            std::string::npos);
  TetMesh repeated = five_tet_cube();
  repeated.tets(1, 0) = repeated.tets(1, 2);
  EXPECT_NE(complaint(repeated).find("tet 1 names vertex"), std::string::npos);
  EXPECT_NE(complaint(TetMesh{}).find("holds no tet"), std::string::npos);
  EXPECT_EQ(complaint(five_tet_cube()), "");
}

// A cube of 3 × 3 × 3 cells of six tets each has eight nodes within.
TetMesh cube_of_cells() {
  constexpr int n = 3;
  TetMesh mesh{Points((n + 1) * (n + 1) * (n + 1), 3), Tets(6 * n * n * n, 4)};
  const auto node = [](int i, int j, int k) { return i + (n + 1) * (j + (n + 1) * k); };
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) mesh.positions.row(node(i, j, k)) << i, j, k;
  int tet = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        for (const auto& [a, b] : {std::pair(0, 1), {1, 2}, {2, 0}, {1, 0}, {2, 1}, {0, 2}}) {
          std::array<int, 3> at{i, j, k};
          std::array<int, 4> corner;
          corner[0] = node(at[0], at[1], at[2]), ++at[std::size_t(a)];
          corner[1] = node(at[0], at[1], at[2]), ++at[std::size_t(b)];
          corner[2] = node(at[0], at[1], at[2]), ++at[std::size_t(3 - a - b)];
          corner[3] = node(at[0], at[1], at[2]);
          const bool odd = (b - a + 3) % 3 != 1;
          mesh.tets.row(tet++) << corner[0], corner[std::size_t(1 + odd)], corner[std::size_t(2 - odd)],
              corner[3];
        }
  return mesh;
}

TEST(Mesh, InteriorVerticesLeaveVolumeAndBoundaryAsTheyAre) {
  const TetMesh mesh = cube_of_cells();
  ASSERT_NEAR(volume(mesh), 27, 1e-12);
  const std::vector<int> cut = tets_without_interior_vertex(mesh.tets);
  ASSERT_GT(cut.size(), 0u);
  ASSERT_LT(Eigen::Index(cut.size()), mesh.tets.rows());
  for (const int t : cut)
    for (int c = 0; c < 4; ++c) {
      const Vec3 p = mesh.positions.row(mesh.tets(t, c));
      EXPECT_TRUE(p.minCoeff() == 0 || p.maxCoeff() == 3);
    }
  const TetMesh mended = with_interior_vertices(mesh);
  EXPECT_EQ(tets_without_interior_vertex(mended.tets), std::vector<int>{});
  EXPECT_EQ(mended.tets.rows(), mesh.tets.rows() + 3 * Eigen::Index(cut.size()));
  EXPECT_EQ(mended.positions.topRows(mesh.positions.rows()), mesh.positions);
  EXPECT_NEAR(volume(mended), 27, 1e-12);
  double least = 1;
  for (Eigen::Index t = 0; t < mended.tets.rows(); ++t) {
    const auto p = [&](int c) { return Vec3(mended.positions.row(mended.tets(t, c))); };
    least = std::min(least, signed_volume(p(0), p(1), p(2), p(3)));
  }
  EXPECT_NEAR(least, 1.0 / 24, 1e-12);
  const auto sorted = [](const Triangles& triangles) {
    std::set<std::array<int, 3>> all;
    for (const auto& row : triangles.rowwise()) {
      std::array<int, 3> one{row[0], row[1], row[2]};
      std::rotate(one.begin(), std::min_element(one.begin(), one.end()), one.end());
      all.insert(one);
    }
    return all;
  };
  EXPECT_EQ(sorted(boundary_triangles(mended.tets)), sorted(boundary_triangles(mesh.tets)));
}

}  // namespace
}  // namespace limber
