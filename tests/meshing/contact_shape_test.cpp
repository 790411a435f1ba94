#include <gtest/gtest.h>

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

// A long thin rod needs more cells along it than a ball, and gets them.
TEST(ContactShape, ThinWallsGetAFinerField) {
  const Made made(box_at_origin({0.02, 0.3, 2}));
  EXPECT_TRUE(made.shape.usable);
  EXPECT_LT(made.shape.field.at({0.01, 0.15, 1}), -0.006);
}

}  // namespace
}  // namespace limber::meshing
