// Bodies of which parts are stiffer, softer, heavier or lighter (docs/dynamics.md, "Parts").
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "fem/reference.h"
#include "tests/fem/laws.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::at_rest;
using testing::both_models;
using testing::called;
using testing::cube;
using testing::grid;
using testing::largest;
using testing::prove_force_is_minus_the_gradient;
using testing::row;
using testing::shake;

// A number for each tet by where its middle is.
std::vector<double> by_place(const TetMesh& mesh, const std::function<double(const Vec3&)>& value) {
  std::vector<double> values;
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    Vec3 middle = Vec3::Zero();
    for (int i = 0; i < 4; ++i) middle += mesh.positions.row(mesh.tets(t, i)).transpose() / 4;
    values.push_back(value(middle));
  }
  return values;
}

BodySpec bar_of_halves(MaterialModel model, double ratio) {
  Material material;
  material.model = model;
  material.poisson_ratio = 0.3;
  material.damping_ratio = 0.3;
  BodySpec spec{"bar", grid({-2, -0.5, -0.5}, {4, 1, 1}, 16, 4, 4), material, {}};
  spec.youngs_modulus_from_tet_pa = by_place(
      spec.cage, [&](const Vec3& p) { return material.youngs_modulus_pa * (p.x() < 0 ? 1 : ratio); });
  return spec;
}

// In series: under the same pull, each half stretches by pull/(area × modulus). Measured over the middle of
// each half, away from the ends and the joint.
TEST(Parts, HalvesInSeriesStretchAsTheirModuliSay) {
  for (const MaterialModel model : both_models) {
    double alone_stretch = 0;
    for (const double ratio : {1.0, 4.0}) {
      SCOPED_TRACE(ratio);
      const World world = build_world(alone(bar_of_halves(model, ratio)));
      const Body& body = world.bodies[0];
      const double pull = 25;  // N, over an area of 1 m²: half a percent of 5 kPa
      ReferenceState state = at_rest(world);
      // Forces at the two ends, opposite: the bar stays where it is. Rest is where they balance the elastic
      // ones.
      std::vector<double> outside(state.positions.size(), 0.0);
      double end_mass = 0;
      for (int n = 0; n < body.node_count(); ++n)
        if (body.cage.positions(n, 0) > 1.99)
          end_mass += body.node_mass_kg[n] / body.density_from_tet_kg_m3[0];
      for (int n = 0; n < body.node_count(); ++n)
        if (const double x = body.cage.positions(n, 0); std::abs(x) > 1.99)
          outside[3 * n] =
              (x > 0 ? 1 : -1) * pull * body.node_mass_kg[n] / body.density_from_tet_kg_m3[0] / end_mass;
      // Heavily damped steps towards it.
      const double dt = world.dt_s;
      double fastest = 1;
      for (int step = 0; step < 40'000 && fastest > 1e-9; ++step) {
        const std::vector<double> force = elastic_forces(world, state);
        fastest = 0;
        for (std::size_t k = 0; k < force.size(); ++k) {
          double& v = state.velocities[k];
          v = 0.995 * (v + dt * (force[k] + outside[k]) / body.node_mass_kg[k / 3]);
          state.positions[k] += dt * v;
          fastest = std::max(fastest, std::abs(v));
        }
      }
      ASSERT_LT(fastest, 1e-8);
      const auto mean_x = [&](double at) {
        double sum = 0;
        int count = 0;
        for (int n = 0; n < body.node_count(); ++n)
          if (std::abs(body.cage.positions(n, 0) - at) < 1e-3) sum += state.positions[3 * n], ++count;
        return sum / count;
      };
      const double soft = (mean_x(-0.75) - mean_x(-1.25)) / 0.5 - 1,
                   stiff = (mean_x(1.25) - mean_x(0.75)) / 0.5 - 1;
      EXPECT_NEAR(soft / stiff / ratio, 1, 0.02);
      // The soft half is as soft as if all were. (Springs along a grid are up to a tenth too stiff by
      // themselves.)
      if (ratio == 1) alone_stretch = soft;
      EXPECT_NEAR(soft / alone_stretch, 1, 0.005);
      if (model == MaterialModel::neo_hookean) {
        EXPECT_NEAR(soft * body.material.youngs_modulus_pa / pull, 1, 0.02);
      }
    }
  }
}

// Every tet told the same is the material told that, bit for bit.
TEST(Parts, AUniformModulusIsTheMaterials) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    BodySpec whole{"cube", cube({0, 0, 0}, 1, 3), material, {}}, parts = whole;
    whole.material.youngs_modulus_pa = 7321;
    parts.youngs_modulus_from_tet_pa.assign(std::size_t(parts.cage.tets.rows()), 7321);
    const World a = build_world(alone(whole)), b = build_world(alone(parts));
    EXPECT_EQ(a.dt_s, b.dt_s);
    State state = rest_state(a);
    Rng rng(61, 0);
    for (float& x : state.positions) x += float(rng.uniform(-0.05, 0.05));
    Control coast;
    coast.steps = 300;
    EXPECT_EQ(propagate(a, state, coast).end, propagate(b, state, coast).end);
  }
}

TEST(Parts, ForceIsMinusTheGradientOfEnergyAndSumsToZero) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    BodySpec spec{"cube", cube({0, 0, 0}, 1, 2), material, {}};
    spec.youngs_modulus_from_tet_pa =
        by_place(spec.cage, [](const Vec3& p) { return 5e3 * std::exp(3 * p.x() - 2 * p.y()); });
    spec.density_from_tet_kg_m3 =
        by_place(spec.cage, [](const Vec3& p) { return p.z() > 0 ? 400.0 : 100.0; });
    const World world = build_world(alone(spec));
    prove_force_is_minus_the_gradient("parts, " + called(model), world);
    Rng rng(62, 0);
    ReferenceState state = at_rest(world);
    shake(state, 0.1, rng);
    Vec3 sum = Vec3::Zero();
    const std::vector<double> force = elastic_forces(world, state);
    for (int n = 0; n < world.nodes; ++n) sum += row(force, n);
    EXPECT_LT(sum.norm(), 1e-12 * largest(force));
    EXPECT_NEAR(world.bodies[0].mass_kg, 250, 1e-4);
    EXPECT_NEAR(center_of_mass_m(world, rest_state(world), 0).z(), 0.15, 1e-6);
  }
}

// A part a hundred times stiffer: damped as it should be, the estimated step still holds, and energy falls.
TEST(Parts, AStiffPartIsStable) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    material.damping_ratio = 0.1;
    BodySpec spec{"cube", cube({0, 0, 0}, 1, 4), material, {}};
    spec.youngs_modulus_from_tet_pa =
        by_place(spec.cage, [](const Vec3& p) { return p.x() > 0 ? 5e5 : 5e3; });
    const World world = build_world(alone(spec));
    State state = rest_state(world);
    Rng rng(63, 0);
    for (float& x : state.positions) x += float(rng.uniform(-0.02, 0.02));
    double energy = elastic_energy_j(world, state);
    for (int i = 0; i < 20; ++i) {
      Control coast;
      coast.steps = int(0.1 / world.dt_s);
      state = propagate(world, state, coast).end;
      const double now = elastic_energy_j(world, state) + kinetic_energy_j(world, state);
      EXPECT_LT(now, energy);
      energy = now;
    }
    // The stiff half alone sets the step, to what its own damping leaves of it.
    BodySpec stiff = spec;
    stiff.youngs_modulus_from_tet_pa.clear(), stiff.material.youngs_modulus_pa = 5e5;
    EXPECT_GT(world.dt_s, 0.6 * build_world(alone(stiff)).dt_s);
  }
}

TEST(Parts, ANumberOutOfRangeNamesItsTet) {
  BodySpec spec{"cube", cube({0, 0, 0}, 1, 1), {}, {}};
  spec.youngs_modulus_from_tet_pa = {1, 1, 1, -1, 1};
  try {
    build_world(alone(spec));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("body cube: youngs_modulus_pa of tet 3 is -1"));
  }
}

}  // namespace
}  // namespace limber::fem
