#include "core/mesh.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace limber {
namespace {

// The unit cube cut into five tets: four corners and the middle.
TetMesh five_tet_cube() {
  TetMesh mesh;
  mesh.positions.resize(8, 3);
  for (int v = 0; v < 8; ++v) mesh.positions.row(v) << (v & 1), ((v >> 1) & 1), (v >> 2);
  mesh.tets.resize(5, 4);
  mesh.tets << 0, 1, 2, 4, 3, 2, 1, 7, 5, 4, 7, 1, 6, 7, 4, 2, 1, 2, 4, 7;
  return mesh;
}

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

}  // namespace
}  // namespace limber
