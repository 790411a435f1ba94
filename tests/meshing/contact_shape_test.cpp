#include <gtest/gtest.h>

#include "meshing/contact_check.h"
#include "meshing/detail/spot_falls.h"
#include "tests/meshing/contact_shapes.h"

namespace limber::meshing {
namespace {

// The upper half of a sphere, without its floor: the field has a floor.
TEST(ContactShape, AHoleIsClosed) {
  const Made made(compact(made_hemisphere(40)));
  ASSERT_TRUE(made.shape.usable);
  const double cell = made.shape.field.cell_m;
  Rng rng(3, 0);
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 p = point_of(bounding_box(made.cage.positions), rng);
    const double exact = std::max(p.norm() - 1, -p.z());  // the distance, except beyond the rim
    if (p.head<2>().norm() > 0.95) continue;
    EXPECT_NEAR(made.shape.field.at(p), exact, 1.5 * cell + 0.03 * std::abs(exact)) << p.transpose();
  }
}

// Four at a time, with whatever instructions there are: to the bit what one after the other says, of any
// range.
TEST(ContactShape, FallsOfSpotsAreThoseOfOneAfterTheOther) {
  Rng rng(7, 0);
  std::vector<detail::SurfaceSpot> spots;
  for (int i = 0; i < 203; ++i)
    spots.push_back({point_of({Vec3::Constant(-1), Vec3::Constant(1)}, rng), rng.direction()});
  const detail::SpotBlocks blocks(spots);
  const detail::FallLimits limits{1.5, 0.05, 0.01};
  int changed = 0;
  for (int turn = 0; turn < 2000; ++turn) {
    const detail::SurfaceSpot at{point_of({Vec3::Constant(-1), Vec3::Constant(1)}, rng), rng.direction()};
    const int first = rng.below(203), end = first + 1 + rng.below(203 - first);
    const detail::Falls before{rng.uniform(0, 0.1), rng.uniform(0, 1)},
        found = blocks.falls_from(at, first, end, limits, before);
    detail::Falls expected = before;
    for (int n = first / 4 * 4; n < std::min((end + 3) / 4 * 4, 203); ++n) {
      const Vec3 way = spots[std::size_t(n)].position - at.position;
      const double squared = way.squaredNorm(), fall = -way.dot(at.normal);
      if (squared > limits.farthest_m2 || spots[std::size_t(n)].normal.dot(at.normal) <= detail::same_side)
        continue;
      expected.bend_m = std::max(expected.bend_m, std::abs(fall));
      if (fall > 0 && squared >= limits.least_m2)
        expected.min_squared_m2 = std::min(expected.min_squared_m2, squared * 2 * limits.missed_m / fall);
    }
    EXPECT_EQ(found.min_squared_m2, expected.min_squared_m2) << turn;
    EXPECT_EQ(found.bend_m, expected.bend_m) << turn;
    changed += found.min_squared_m2 < before.min_squared_m2 && found.bend_m > before.bend_m;
  }
  EXPECT_GT(changed, 200);
}

// Solids that fill one place twice: the volume of the model counts that twice, the field does not. A cavity,
// and what lies in it, are no such thing.
TEST(ContactShape, WhatIsFilledTwiceIsTold) {
  const auto ball = [](double radius, double at, bool hollow = false) {
    SurfaceMesh mesh = made_sphere(16);
    mesh.positions *= radius;
    mesh.positions.col(0).array() += at;
    if (hollow) mesh.triangles.col(1).swap(mesh.triangles.col(2));
    return mesh;
  };
  const auto warnings = [](const SurfaceMesh& mesh) { return Made(mesh).report.warnings; };
  EXPECT_EQ(warnings(ball(1, 0)).size(), 0u);
  EXPECT_EQ(warnings(joined(ball(1, 0), ball(1, 2.2))).size(), 0u);
  const SurfaceMesh shell = joined(ball(1, 0), ball(0.7, 0, true));
  EXPECT_EQ(warnings(shell).size(), 0u);
  EXPECT_EQ(warnings(joined(shell, ball(0.5, 0))).size(), 0u);
  // Of two balls a radius apart a lens of 5/16 of one is common: 5/32 of both.
  const auto told_twice = [&](const SurfaceMesh& mesh) {
    const auto all = warnings(mesh);
    EXPECT_EQ(all.size(), 1u);
    const std::size_t at = all.empty() ? std::string::npos : all[0].find(" has ");
    return at == std::string::npos ? -1 : std::stod(all[0].substr(at + 5));
  };
  EXPECT_NEAR(told_twice(joined(ball(1, 0), ball(1, 1))), 100 * 5 / 32., 1);
  EXPECT_NEAR(told_twice(joined(ball(1, 0), ball(0.7, 0))), 100 * 0.343 / 1.343, 1);
}

// A cage that leaves most of the surface outside: no weight is wild, and each sample goes with the tet next
// to it.
TEST(ContactShape, OutsideTheCageWeightsAreClamped) {
  const SurfaceMesh surface = made_sphere(30);
  const TetMesh cage = box_cage({Vec3::Constant(-0.6), Vec3::Constant(0.6)}, 12);
  const SurfaceSamples s = make_contact_shape(surface, cage).samples;
  ASSERT_GT(s.weights.rows(), 500);
  EXPECT_GE(s.weights.minCoeff(), -1 - 1e-12);
  for (Eigen::Index i = 0; i < s.weights.rows(); ++i) {
    EXPECT_NEAR(s.weights.row(i).sum(), 1, 1e-9);
    double nearest = 1e300, own = 1e300;
    for (int k = 0; k < 4; ++k) {
      const int node = cage.tets(s.tet_from_sample[i], k);
      own = std::min(own, (cage.positions.row(node) - s.positions_m.row(i)).norm());
    }
    nearest = (cage.positions.rowwise() - s.positions_m.row(i)).rowwise().norm().minCoeff();
    EXPECT_LT(own, nearest + 0.1);
  }
}

// A ball without samples on a cap of it is told, whoever stands for the cap's area: all others, one beside
// it, or one far off.
TEST(ContactCheck, APlaceWithoutSamplesIsTold) {
  const Made made(made_sphere(30));
  EXPECT_EQ(check_contact_shape(made.shape, made.surface, made.cage).sample_fault, "");
  for (const int heir : {-1, 0, 1}) {
    ContactShape shape = made.shape;
    SurfaceSamples &all = shape.samples, kept = all;
    Eigen::Index count = 0, beside = 0, opposite = 0;
    double lost_m2 = 0;
    for (Eigen::Index s = 0; s < all.area_m2.size(); ++s) {
      const double z = all.positions_m(s, 2);
      if (z > 0.8) {
        lost_m2 += all.area_m2[s];
        continue;
      }
      kept.positions_m.row(count) = all.positions_m.row(s), kept.weights.row(count) = all.weights.row(s);
      kept.area_m2[count] = all.area_m2[s], kept.tet_from_sample[count] = all.tet_from_sample[s];
      if (z > kept.positions_m(beside, 2)) beside = count;
      if (z < kept.positions_m(opposite, 2)) opposite = count;
      ++count;
    }
    kept.positions_m.conservativeResize(count, 3), kept.weights.conservativeResize(count, 4);
    kept.area_m2.conservativeResize(count), kept.tet_from_sample.conservativeResize(count);
    if (heir < 0)
      kept.area_m2 *= (kept.area_m2.sum() + lost_m2) / kept.area_m2.sum();
    else
      kept.area_m2[heir == 0 ? beside : opposite] += lost_m2;
    all = kept;
    EXPECT_NE(check_contact_shape(shape, made.surface, made.cage).sample_fault.find("spacings away"),
              std::string::npos)
        << heir;
  }
}

// A long thin rod needs more cells along it than a ball, and gets them.
TEST(ContactShape, ThinWallsGetAFinerField) {
  const Made made(box_at_origin({0.02, 0.3, 2}));
  EXPECT_TRUE(made.shape.usable);
  EXPECT_LT(made.shape.field.at({0.01, 0.15, 1}), -0.006);
}

}  // namespace
}  // namespace limber::meshing
