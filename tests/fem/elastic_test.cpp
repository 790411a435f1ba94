// The laws of elastic bodies without contact (docs/dynamics.md).
#include <gtest/gtest.h>

#include <numeric>

#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "fem/reference.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::ball;
using testing::cube;

BodySpec soft(TetMesh mesh, Material material = {}) { return {"soft", std::move(mesh), material, {}, false}; }

ReferenceState at_rest(const World& world) { return reference_state(rest_state(world)); }

void shake(ReferenceState& state, double amount, Rng& rng) {
  for (double& x : state.positions) x += rng.uniform(-amount, amount);
  for (double& v : state.velocities) v += rng.uniform(-amount, amount);
}

Vec3 row(const std::vector<double>& v, int n) { return {v[3 * n], v[3 * n + 1], v[3 * n + 2]}; }

double largest(const std::vector<double>& v) {
  double most = 0;
  for (double x : v) most = std::max(most, std::abs(x));
  return most;
}

// Shaken a little, turned inside out, and flattened: the energy's gradient is the force everywhere.
TEST(Elastic, ForceIsMinusTheGradientOfEnergyAlsoWhenInverted) {
  for (const double poisson : {0.25, 0.45}) {
    Material material;
    material.poisson_ratio = poisson;
    const World world = build_world(alone(soft(cube({0, 0, 0}, 1, 2), material)));
    Rng rng(11, 0);
    int inverted = 0;
    for (const double amount : {0.01, 0.1, 0.6}) {
      SCOPED_TRACE(amount);
      ReferenceState state = at_rest(world);
      shake(state, amount, rng);
      std::fill(state.velocities.begin(), state.velocities.end(), 0.0);
      State single{0,
                   {state.positions.begin(), state.positions.end()},
                   {state.velocities.begin(), state.velocities.end()}};
      inverted += inverted_tets(world, single);
      const std::vector<double> force = elastic_forces(world, state);
      const double scale = largest(force), h = 1e-6;
      for (std::size_t k = 0; k < force.size(); ++k) {
        const double x = state.positions[k];
        state.positions[k] = x + h;
        const double above = elastic_energy_j(world, state);
        state.positions[k] = x - h;
        const double below = elastic_energy_j(world, state);
        state.positions[k] = x;
        EXPECT_NEAR(force[k], -(above - below) / (2 * h), 1e-6 * scale);
      }
    }
    EXPECT_GT(inverted, 10);
  }
}

TEST(Elastic, DampingOnlyTakesEnergy) {
  Material material;
  material.damping_ratio = 0.5;
  const World world = build_world(alone(soft(cube({0, 0, 0}, 1, 2), material)));
  Rng rng(12, 0);
  for (int trial = 0; trial < 100; ++trial) {
    ReferenceState moving = at_rest(world);
    shake(moving, 0.3, rng);
    ReferenceState still = moving;
    std::fill(still.velocities.begin(), still.velocities.end(), 0.0);
    const auto with = elastic_forces(world, moving), without = elastic_forces(world, still);
    double power = 0;
    for (std::size_t k = 0; k < with.size(); ++k) power += (with[k] - without[k]) * moving.velocities[k];
    EXPECT_LT(power, 0);
  }
}

TEST(Elastic, InternalForcesAndTorquesSumToZero) {
  Material material;
  material.damping_ratio = 0.3;
  const World world = build_world(alone(soft(ball({0, 0, 0}, 1, 3), material)));
  Rng rng(13, 0);
  ReferenceState state = at_rest(world);
  shake(state, 0.2, rng);
  const auto force = elastic_forces(world, state);
  Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
  for (int n = 0; n < world.nodes; ++n)
    sum += row(force, n), torque += row(state.positions, n).cross(row(force, n));
  EXPECT_LT(sum.norm(), 1e-13 * largest(force) * world.nodes);
  EXPECT_LT(torque.norm(), 1e-13 * largest(force) * world.nodes);
}

TEST(Elastic, RigidMotionGivesNoForce) {
  Material material;
  material.damping_ratio = 0.3;
  const World world = build_world(alone(soft(ball({0, 0, 0}, 1, 3), material)));
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -3).normalized()).toRotationMatrix();
  const Vec3 spin(0.3, -0.5, 0.7);
  ReferenceState state = at_rest(world);
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 p = turn * row(state.positions, n) + Vec3(4, 5, 6), v = spin.cross(p) + Vec3(1, 2, 3);
    for (int c = 0; c < 3; ++c) state.positions[3 * n + c] = p[c], state.velocities[3 * n + c] = v[c];
  }
  const double stretched_by_a_hundredth = 0.01 * world.tables64.springs[0].stiffness;
  EXPECT_LT(largest(elastic_forces(world, state)), 1e-9 * stretched_by_a_hundredth);
}

}  // namespace
}  // namespace limber::fem
