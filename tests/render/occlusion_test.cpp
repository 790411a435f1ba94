#include "render/occlusion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/render/shapes.h"

namespace limber::render {
namespace {

double occlusion_at(const Vec3& point, const Vec3& normal, const std::vector<SurfaceMesh>& meshes,
                    const std::optional<Ground>& ground = {}) {
  std::vector<Occluder> occluders;
  for (const SurfaceMesh& mesh : meshes) occluders.push_back({mesh.positions, mesh.triangles});
  return sky_occlusion(point.transpose(), normal.normalized().transpose(), occluders, ground)[0];
}

SurfaceMesh square(const Vec3& middle, const Vec3& a, const Vec3& b) {
  return quad_mesh(middle - a - b, middle + a - b, middle + a + b, middle - a + b);
}

TEST(Occlusion, NothingHidesTheSkyOfAPlaneOrOfAConvexBody) {
  EXPECT_EQ(occlusion_at({0, 0, 0}, {0, 0, 1}, {}), 0);
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0.3, -0.2, 1), Vec3(1, 1, 0.1)}) {
    const Vec3 n = normal.normalized(), a = n.unitOrthogonal(), b = n.cross(a);
    for (const double place : {0.0, 0.31, -0.77})
      EXPECT_EQ(occlusion_at(place * a + 0.4 * b, n, {square({0, 0, 0}, a, b)}), 0) << n.transpose();
  }
  const SurfaceMesh ball = sphere_mesh({1, 2, 3}, 0.7, 24);
  const Eigen::VectorXd hidden = sky_occlusion(ball.positions, vertex_normals(ball.positions, ball.triangles),
                                               std::vector<Occluder>{{ball.positions, ball.triangles}});
  EXPECT_LT(hidden.maxCoeff(), 0.01);
}

// A wall hides the half of the sky on its side. Beside a strip of the height h, at the distance d from its
// foot, the share of a long wall is (1 − d/√(d²+h²))/2 (the form factor of a strip square to the plane).
TEST(Occlusion, AWallHidesHalfTheSkyAtItsFootAndLessFartherAway) {
  for (const double d : {0.5, 1.0, 2.0, 4.0, 8.0})
    EXPECT_NEAR(occlusion_at({d, 0.3, 0}, {0, 0, 1}, {square({0, 0, 8}, {0, 60, 0}, {0, 0, 8})}),
                0.5 * (1 - d / std::hypot(d, 16.0)), 0.05)
        << d;
  EXPECT_NEAR(occlusion_at({0.02, 0, 0}, {0, 0, 1}, {square({0, 0, 20}, {0, 20, 0}, {0, 0, 20})}), 0.5, 0.03);
}

TEST(Occlusion, InsideAClosedBoxThereIsNoSky) {
  const SurfaceMesh box = box_mesh({-1, -1, -1}, {1, 1, 1});
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0, 1, -2), Vec3(-1, -1, -1)})
    EXPECT_GT(occlusion_at({0.2, -0.1, 0.3}, normal, {box}), 0.999);
}

// Over a point of a plane, a ball of radius r in the height h hides r²/h² of the cosine-weighted sky.
TEST(Occlusion, ABallOverheadHidesItsFormFactor) {
  for (const double h : {1.0, 1.5, 2.5})
    EXPECT_NEAR(occlusion_at({0, 0, 0}, {0, 0, 1}, {sphere_mesh({0, 0, h}, 0.8, 30)}), 0.64 / (h * h), 0.06)
        << h;
}

TEST(Occlusion, TheGroundHidesWhatLooksDown) {
  const Ground ground{{0, 0, 1}, 0.5};
  EXPECT_EQ(occlusion_at({0, 0, 1}, {0, 0, 1}, {}, ground), 0);
  EXPECT_EQ(occlusion_at({0, 0, 1}, {0, 0, -1}, {}, ground), 1);
  EXPECT_NEAR(occlusion_at({0, 0, 1}, {1, 0, 0}, {}, ground), 0.5, 0.03);
  EXPECT_EQ(occlusion_at({0, 0, 0.2}, {0, 0, 1}, {}, ground), 1) << "below the ground";
}

TEST(Occlusion, NeitherWindingNorOrderMatters) {
  SurfaceMesh ball = sphere_mesh({0.4, 0.1, 1.2}, 0.6, 12);
  const double before = occlusion_at({0, 0, 0}, {0, 0, 1}, {ball});
  ball.triangles.col(0).swap(ball.triangles.col(1));
  ball.triangles.colwise().reverseInPlace();
  EXPECT_NEAR(occlusion_at({0, 0, 0}, {0, 0, 1}, {ball}), before, 1e-6);
}

}  // namespace
}  // namespace limber::render
