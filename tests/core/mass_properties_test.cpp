// Masses and moments of inertia, against closed forms.
#include "core/mass_properties.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/core/five_tet_cube.h"

namespace limber {
namespace {

TEST(MassProperties, ASurfaceIsClosedWhereEveryEdgeIsRunAlongBothWays) {
  const TetMesh cube = five_tet_cube();
  const SurfaceMesh closed{cube.positions, boundary_triangles(cube.tets)};
  EXPECT_TRUE(is_closed(closed.triangles));
  EXPECT_TRUE(is_closed(Triangles(0, 3)));
  SurfaceMesh twice = closed;  // no manifold, and closed all the same
  twice.triangles.conservativeResize(24, 3);
  twice.triangles.bottomRows(12) = closed.triangles;
  EXPECT_TRUE(is_closed(twice.triangles));
  for (int f = 0; f < 12; ++f) {
    SurfaceMesh turned = closed, open = closed;
    std::swap(turned.triangles(f, 0), turned.triangles(f, 1));
    EXPECT_FALSE(is_closed(turned.triangles));
    open.triangles.row(f) = closed.triangles.row(11);
    open.triangles.conservativeResize(11, 3);
    EXPECT_FALSE(is_closed(open.triangles));
  }
}

// A brick a × b × c has V/12 (b² + c²) and so on; turned by R, R I Rᵀ; moved, the same about its centre.
TEST(MassProperties, OfATurnedBrickFarAwayAreThoseOfTheBook) {
  TetMesh brick = five_tet_cube();
  const Vec3 size(2, 3, 0.5), place(1e3, -2e3, 500);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  for (int v = 0; v < 8; ++v)
    brick.positions.row(v) =
        (place + turn * size.cwiseProduct(Vec3(brick.positions.row(v)) - Vec3::Constant(0.5))).transpose();
  const Vec3 square = size.cwiseAbs2();
  const Eigen::Matrix3d wanted =
      turn * (size.prod() / 12 * (Vec3::Constant(square.sum()) - square)).asDiagonal() * turn.transpose();
  for (const MassProperties& m :
       {mass_properties(brick), mass_properties(brick.positions, boundary_triangles(brick.tets))}) {
    EXPECT_NEAR(m.volume_m3, 3, 1e-9);
    EXPECT_LT((m.center_m - place).norm(), 1e-9);
    EXPECT_LT((m.inertia_m5 - wanted).norm(), 1e-9);
  }
}

// Of a tet with corners at 0 and at 1 on each axis: V = 1/6, centre ¼, ∫x² = 1/60, ∫xy = 1/120.
TEST(MassProperties, OfATetAreThoseOfTheBook) {
  TetMesh tet;
  tet.positions.resize(4, 3);
  tet.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  tet.tets.resize(1, 4);
  tet.tets << 0, 1, 2, 3;
  const MassProperties m = mass_properties(tet);
  EXPECT_DOUBLE_EQ(m.volume_m3, 1. / 6);
  EXPECT_LT((m.center_m - Vec3::Constant(0.25)).norm(), 1e-15);
  const double square = 1. / 60 - 1. / 96, product = 1. / 120 - 1. / 96;
  EXPECT_NEAR(m.inertia_m5(0, 0), 2 * square, 1e-15);
  EXPECT_NEAR(m.inertia_m5(0, 1), -product, 1e-15);
}

TEST(MassProperties, OfNothingAreNothing) {
  EXPECT_EQ(mass_properties(TetMesh{}).volume_m3, 0);
  EXPECT_EQ(mass_properties(Points(0, 3), Triangles(0, 3)).volume_m3, 0);
}

}  // namespace
}  // namespace limber
