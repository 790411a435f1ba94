#include "meshing/winding_number.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {
namespace {

double sum_of_solid_angles(const SurfaceMesh& mesh, const Vec3& point) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    sum +=
        solid_angle_share(mesh.positions.row(mesh.triangles(t, 0)), mesh.positions.row(mesh.triangles(t, 1)),
                          mesh.positions.row(mesh.triangles(t, 2)), point);
  return sum;
}

TEST(WindingNumber, AnOctantOfTheSphereOfDirectionsIsAnEighth) {
  EXPECT_NEAR(solid_angle_share(Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ(), Vec3::Zero()), 0.125, 1e-15);
  EXPECT_NEAR(solid_angle_share(Vec3::UnitY(), Vec3::UnitX(), Vec3::UnitZ(), Vec3::Zero()), -0.125, 1e-15);
}

TEST(WindingNumber, IsOneInsideASphereAndZeroOutside) {
  const SurfaceMesh sphere = made_sphere(40);
  const WindingNumber winding(sphere.positions, sphere.triangles);
  Rng rng(1, 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 direction = rng.direction();
    EXPECT_NEAR(winding.at(rng.uniform(0.0, 0.99) * direction), 1.0, 1e-2);
    EXPECT_NEAR(winding.at(rng.uniform(1.001, 5.0) * direction), 0.0, 1e-2);
  }
}

TEST(WindingNumber, AgreesWithTheSumOfSolidAnglesOnASoup) {
  SurfaceMesh soup;
  Rng rng(2, 0);
  const int triangles = 3000;
  soup.positions.resize(3 * triangles, 3);
  soup.triangles.resize(triangles, 3);
  for (int t = 0; t < triangles; ++t) {
    const Vec3 center = rng.direction() * rng.uniform();
    for (int k = 0; k < 3; ++k) {
      soup.positions.row(3 * t + k) = center + 0.1 * rng.direction();
      soup.triangles(t, k) = 3 * t + k;
    }
  }
  const WindingNumber winding(soup.positions, soup.triangles);
  double sum_of_errors = 0;
  const int points = 500;
  for (int i = 0; i < points; ++i) {
    const Vec3 point = 1.5 * rng.uniform() * rng.direction();
    const double error = std::abs(winding.at(point) - sum_of_solid_angles(soup, point));
    EXPECT_LT(error, 1e-2);
    sum_of_errors += error;
  }
  EXPECT_LT(sum_of_errors / points, 2e-3);
}

// Of near triangles the angles are summed as the argument of a product, which goes round: eight on top of
// each other are each seen under nearly half of all directions, with either sign; at corners and in planes
// under none.
TEST(WindingNumber, NearTrianglesCountWithAllTheirTurns) {
  Rng rng(3, 0);
  double most = 0;
  for (int turn = 0; turn < 500; ++turn) {
    const int count = (turn % 2 == 0 ? 1 : 4) + rng.below(turn % 2 == 0 ? 8 : 5);  // so none are far
    SurfaceMesh stack{Points(3 * count, 3), Triangles(count, 3)};
    for (int t = 0; t < count; ++t) {
      const bool around = turn % 2 == 0;  // else anywhere
      for (int k = 0; k < 3; ++k) {
        const double at = 2 * std::numbers::pi * k / 3;
        stack.positions.row(3 * t + k) =
            around ? Vec3(std::cos(at), std::sin(at), 0.001 * rng.uniform()) : rng.direction();
        stack.triangles(t, k) = 3 * t + k;
      }
      if (rng.below(4) == 0) stack.triangles.row(t).reverseInPlace();
    }
    const WindingNumber winding(stack.positions, stack.triangles);
    for (int i = 0; i < 20; ++i) {
      Vec3 point = turn % 2 == 0 ? Vec3(0.2 * rng.uniform(), 0.2 * rng.uniform(), rng.uniform(-0.02, 0.02))
                                 : Vec3(0.4 * rng.direction());
      if (i == 0) point = stack.positions.row(0);
      const double expected = sum_of_solid_angles(stack, point);
      most = std::max(most, std::abs(expected));
      EXPECT_NEAR(winding.at(point), expected, 1e-12) << turn << " " << i;
    }
  }
  EXPECT_GT(most, 3.5);
}

// Seen from the axis, the missing half is the cone of its rim: the share is 1 − (1 − cos)/2.
TEST(WindingNumber, FollowsTheClosedFormOnTheAxisOfAnOpenHemisphere) {
  const SurfaceMesh upper = made_hemisphere(60);
  const WindingNumber winding(upper.positions, upper.triangles);
  for (double z : {-2.0, -0.5, -0.01, 0.3, 0.7}) {
    const double expected = 0.5 * (1 + z / std::sqrt(1 + z * z));
    EXPECT_NEAR(winding.at(Vec3(0, 0, z)), expected, 2e-3) << "at height " << z;
  }
  EXPECT_NEAR(winding.at(Vec3(0, 0, 1.5)), 0.5 * (1 + 1.5 / std::hypot(1, 1.5)) - 1, 2e-3);
}

TEST(WindingNumber, ASurfaceTurnedInsideOutWindsTheOtherWay) {
  SurfaceMesh sphere = made_sphere(10);
  sphere.triangles.col(1).swap(sphere.triangles.col(2));
  EXPECT_NEAR(WindingNumber(sphere.positions, sphere.triangles).at(Vec3(0.1, 0.2, 0.3)), -1.0, 1e-2);
}

TEST(WindingNumber, OfNothingIsZero) {
  EXPECT_EQ(WindingNumber(Points(0, 3), Triangles(0, 3)).at(Vec3::Zero()), 0.0);
}

}  // namespace
}  // namespace limber::meshing
