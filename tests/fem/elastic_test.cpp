// The laws of elastic bodies without contact (docs/dynamics.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "fem/reference.h"
#include "tests/fem/laws.h"
#include "tests/fem/proofs.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::at_rest;
using testing::ball;
using testing::both_models;
using testing::called;
using testing::cube;
using testing::grid;
using testing::nodes_where;
using testing::prove_at_least;
using testing::prove_at_most;
using testing::row;
using testing::soft;

TetMesh one_tet() {
  TetMesh mesh;
  mesh.positions.resize(4, 3);
  mesh.positions << 0, 0, 0, 1, 0.1, 0, 0.2, 0.9, 0, 0.3, 0.2, 1.1;
  mesh.tets.resize(1, 4);
  mesh.tets << 0, 1, 2, 3;
  return mesh;
}

// Meshes of every kind: a grid with symmetry, one without, a ball.
TEST(Elastic_slow, LawsOfAnyMeshOnGridsAndABall) {
  testing::prove_laws_of_any_mesh("cube of 5 tets a cell", cube({0, 0, 0}, 1, 2), 10);
  testing::prove_laws_of_any_mesh("bar of 6 tets a cell",
                                  testing::leaning_grid({0, 0, 0}, {2, 0.7, 0.5}, 4, 2, 2), 2);
  testing::prove_laws_of_any_mesh("ball", ball({0, 0, 0}, 0.5, 4), 1);
}

// One regular tet breathing: ω² = (9λ + 6μ) V / Σ m r², since every edge and the volume change together.
TEST(Elastic, ATetBreathesAtItsFrequency) {
  for (const MaterialModel model : both_models) {
    TetMesh mesh;
    mesh.positions.resize(4, 3);
    mesh.positions << 1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1;
    mesh.positions /= 2;
    mesh.tets.resize(1, 4);
    mesh.tets << 0, 2, 1, 3;
    if (volume(mesh) < 0) std::swap(mesh.tets(0, 0), mesh.tets(0, 1));
    Material material;
    material.model = model;
    material.damping_ratio = 0;
    WorldSpec spec = alone(soft(mesh, material));
    spec.max_dt_s = 2e-4;
    const World world = build_world(spec);
    const double young = material.youngs_modulus_pa, poisson = material.poisson_ratio;
    const double mu = young / (2 * (1 + poisson)),
                 lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
    const double inertia = world.bodies[0].mass_kg * 0.75;  // every node is √3/2 from the centre
    const double frequency = std::sqrt((9 * lambda + 6 * mu) * world.bodies[0].rest_volume_m3 / inertia);

    ReferenceState state = at_rest(world);
    for (double& x : state.positions) x *= 1.001;
    Control one_step;
    one_step.steps = 1;
    std::vector<double> falls;  // times at which node 0 comes back through its rest place
    double before = state.positions[0] - 0.5;
    while (falls.size() < 11 && state.step < 1'000'000) {
      advance(world, one_step, state);
      const double now = state.positions[0] - 0.5, time = double(state.step) * world.dt_s;
      if (before > 0 && now <= 0) falls.push_back(time - world.dt_s * now / (now - before));
      before = now;
    }
    ASSERT_EQ(falls.size(), 11u);
    prove_at_most(8, "one tet: frequency over that of the moduli − 1", called(model),
                  std::abs(2 * M_PI * 10 / (falls.back() - falls.front()) / frequency - 1), 5e-3);
  }
}

// Kick-drift from rest: after n steps a body fell g h² n (n+1)/2.
TEST(Elastic, FreeFallFollowsTheScheme) {
  WorldSpec spec = alone(soft(cube({0, 0, 0}, 1, 2)));
  spec.gravity_m_s2 = {0, 0, -9.81};
  const World world = build_world(spec);
  Control coast;
  coast.steps = 300;
  const State end = propagate(world, rest_state(world), coast).end;
  const double fallen = 9.81 * world.dt_s * world.dt_s * 300 * 301 / 2;
  prove_at_most(4, "free fall of 300 steps over g h² n (n+1)/2, − 1", "cube",
                std::abs(center_of_mass_m(world, end, 0).z() / -fallen - 1), 1e-5);
}

// Damping by mass, k = e^(−αh) a step: after n steps a body that drifts has gone h v (k + … + kⁿ) and keeps
// kⁿ of its momentum and of its spin; one that falls reaches k h g / (1 − k), by a gravity of its own that
// the world does not have. Soft and rigid.
TEST(Elastic, DampingByMassIsExponential) {
  for (const BodyKind kind : {BodyKind::deformable, BodyKind::rigid}) {
    BodySpec body = soft(cube({0, 0, 0}, 1, 2));
    body.kind = kind;
    body.material.mass_damping_per_s = 1.5;
    body.velocity_m_s = {0.3, -0.1, 0.2}, body.angular_velocity_rad_s = {0, 0, 0.02};
    BodySpec falling = body;
    falling.name = "falling", falling.cage.positions.rowwise() += Vec3(5, 0, 0).transpose();
    falling.velocity_m_s.setZero(), falling.angular_velocity_rad_s.setZero();
    falling.gravity_m_s2 = Vec3(0, 0, -2);
    WorldSpec spec = alone(body);
    spec.bodies.push_back(falling);
    const World world = build_world(spec);
    const std::string where = kind == BodyKind::rigid ? "rigid cube" : "soft cube";
    Control coast;
    coast.steps = int(2 / world.dt_s);
    const double k = std::exp(-1.5 * world.dt_s), left = std::pow(k, coast.steps);
    const State end = propagate(world, start_state(world), coast).end;
    const Vec3 gone = world.dt_s * body.velocity_m_s * k * (1 - left) / (1 - k);
    prove_at_most(4, "drift with damping by mass, from h v Σ kⁿ, m", where,
                  (center_of_mass_m(world, end, 0) - gone).norm(), 1e-5);
    prove_at_most(4, "velocity left over e^(−αt), − 1", where,
                  (center_velocity_m_s(world, end, 0) / left - body.velocity_m_s).norm() / 0.37, 1e-4);
    const auto spin = [&](const State& state) {
      const Points from_center =
          body_positions(world, state, 0).rowwise() - center_of_mass_m(world, state, 0).transpose();
      double sum = 0;
      for (int n = 0; n < world.bodies[0].node_count(); ++n) {
        const Vec3 v = Eigen::Map<const Vec3f>(&state.velocities[3 * n]).cast<double>();
        sum += world.bodies[0].node_mass_kg[n] * Vec3(from_center.row(n)).cross(v).z();
      }
      return sum;
    };
    prove_at_most(4, "spin left over e^(−αt), − 1", where,
                  std::abs(spin(end) / (left * spin(start_state(world))) - 1), 1e-3);
    const double fastest = k * world.dt_s * 2 / (1 - k);
    prove_at_most(4, "speed of a fall over k h g (1 − kⁿ)/(1 − k), − 1", where,
                  std::abs(-center_velocity_m_s(world, end, 1).z() / (fastest * (1 - left)) - 1), 1e-4);
  }
}

// Fascia draws all of a body alike, so its centre of mass is a damped oscillator of its own, whatever it does
// within: after n steps it is where v += h (−ω² x − 2 ζ ω v − g), x += h v leads. It comes to hang g/ω² below
// its place, and a held node is not drawn. Soft and rigid.
TEST(Elastic, FasciaMakesACentreOfMassADampedOscillator) {
  for (const BodyKind kind : {BodyKind::deformable, BodyKind::rigid})
    for (const double ratio : {0.05, 1.0}) {
      BodySpec body = soft(cube({0.4, 0.2, 0.3}, 1, 2));
      body.kind = kind;
      body.material.fascia_hz = 2, body.material.fascia_damping_ratio = ratio;
      body.velocity_m_s = {0.3, -0.1, 0.2}, body.angular_velocity_rad_s = {0, 0, 0.02};
      WorldSpec spec = alone(body);
      spec.gravity_m_s2 = {0, 0, -9.81};
      const World world = build_world(spec);
      const std::string where = fmt::format("{} cube, damped by {:g} of critical",
                                            kind == BodyKind::rigid ? "rigid" : "soft", ratio);
      const Vec3 place = center_of_mass_m(world, rest_state(world), 0);
      const double omega = 2 * std::numbers::pi * 2, h = world.dt_s;
      Control coast;
      coast.steps = int(0.7 / h);
      Vec3 x = Vec3::Zero(), v = body.velocity_m_s;
      for (int n = 0; n < coast.steps; ++n) {
        v += h * (-omega * omega * x - 2 * ratio * omega * v + spec.gravity_m_s2);
        x += h * v;
      }
      const State end = propagate(world, start_state(world), coast).end;
      prove_at_most(4, "place in fascia, from the oscillator's, m", where,
                    (center_of_mass_m(world, end, 0) - place - x).norm(), 2e-5);
      if (ratio < 1) continue;
      coast.steps = int(4 / h);
      const double hangs = (place - center_of_mass_m(world, propagate(world, end, coast).end, 0)).z();
      prove_at_most(4, "how low a body hangs over g/ω², − 1", where,
                    std::abs(hangs / (9.81 / (omega * omega)) - 1), 1e-3);
    }
}

// Half the step, a quarter of the error; and damping ends all motion.
TEST(Elastic, EnergyErrorsFallWithTheSquareOfTheStep) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    material.damping_ratio = 0;
    const World world = build_world(alone(soft(cube({0, 0, 0}, 1, 2), material)));
    const auto coarse = testing::energies(world, 0.06, 10), fine = testing::energies(world, 0.03, 10);
    const double ratio = testing::spread(fine, 0, fine.size()) / testing::spread(coarse, 0, coarse.size());
    prove_at_most(5, "spread of energy at half the step over that at the whole, − ¼", called(model),
                  std::abs(ratio - 0.25), 0.08);
    material.damping_ratio = 0.1;
    const auto damped = testing::energies(build_world(alone(soft(cube({0, 0, 0}, 1, 2), material))), 0.06, 2);
    EXPECT_LT(damped.back(), 0.01 * damped.front());
  }
}

// Three sizes of one block; bars and balls are among the meshes above, cages in cages_test.cpp.
TEST(Elastic, TheStepEstimateIsTheEdgeOfStability) {
  for (const MaterialModel model : both_models)
    for (const int cells : {2, 4, 6})
      for (const double damping : {0.0, 0.2}) {
        Material material;
        material.model = model;
        material.damping_ratio = damping;
        testing::prove_the_step_estimate(fmt::format("cube of {} cells, {}", cells, called(model)),
                                         build_world(alone(soft(cube({0, 0, 0}, 1, cells), material))));
      }
}

// Boundary held in an affine place: the inside settles in the same affine map. (On a grid, whose inner nodes
// see the same cells in all directions; a tet's six springs alone are not isotropic, so no such law holds on
// a mesh without symmetry.)
TEST(Elastic, PatchTest) {
  BodySpec body = soft(cube({0, 0, 0}, 1, 4));
  body.fixed_nodes = vertices_of(boundary_triangles(body.cage.tets));
  body.material.damping_ratio = 0.5;
  const World world = build_world(alone(body));
  Eigen::Matrix3d map;
  map << 1.05, 0.04, 0, 0, 0.97, 0.03, 0.02, 0, 1.02;
  State state = rest_state(world);
  for (int n = 0; n < world.nodes; ++n)
    if (world.bodies[0].fixed[n])
      Eigen::Map<Vec3f>(&state.positions[3 * n]) = (map * Vec3(body.cage.positions.row(n))).cast<float>();
  Control coast;
  coast.steps = 4000;
  const State end = propagate(world, state, coast).end;
  double farthest = 0;
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 wanted = map * Vec3(body.cage.positions.row(n));
    farthest =
        std::max(farthest, (Eigen::Map<const Vec3f>(&end.positions[3 * n]).cast<double>() - wanted).norm());
  }
  prove_at_most(7, "patch of 1 m: inside from the affine place, m", "springs, grid", farthest, 1e-5);
}

// Neo-Hookean tets of any shape are in balance under an affine map, and have the moduli of the table.
TEST(Elastic, NeoHookeanPassesThePatchTestOnAnyMesh) {
  BodySpec body = soft(ball({0, 0, 0}, 1, 4));
  Rng rng(17, 0);
  for (int n = 0; n < body.cage.positions.rows(); ++n)
    body.cage.positions.row(n) +=
        0.05 * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)).transpose();
  body.fixed_nodes = vertices_of(boundary_triangles(body.cage.tets));
  body.material.model = MaterialModel::neo_hookean;
  body.material.damping_ratio = 0.5;
  const World world = build_world(alone(body));
  Eigen::Matrix3d map;
  map << 1.3, 0.2, 0, 0, 0.8, 0.1, 0.1, 0, 1.1;
  State state = rest_state(world);
  for (int n = 0; n < world.nodes; ++n)
    if (world.bodies[0].fixed[n])
      Eigen::Map<Vec3f>(&state.positions[3 * n]) = (map * Vec3(body.cage.positions.row(n))).cast<float>();
  Control coast;
  coast.steps = 6000;
  const State end = propagate(world, state, coast).end;
  double farthest = 0;
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 wanted = map * Vec3(body.cage.positions.row(n));
    farthest =
        std::max(farthest, (Eigen::Map<const Vec3f>(&end.positions[3 * n]).cast<double>() - wanted).norm());
  }
  prove_at_most(7, "patch of 1 m: inside from the affine place, m", "Neo-Hookean, irregular ball", farthest,
                1e-5);
}

TEST(Elastic, NeoHookeanHasTheModuliOfItsMaterial) {
  for (const double poisson : {0.0, 0.3, 0.48}) {
    Material material;
    material.model = MaterialModel::neo_hookean;
    material.poisson_ratio = poisson;
    const World world = build_world(alone(soft(ball({0, 0, 0}, 1, 3), material)));
    const double mu = material.youngs_modulus_pa / (2 * (1 + poisson)),
                 lambda = material.youngs_modulus_pa * poisson / ((1 + poisson) * (1 - 2 * poisson));
    Rng rng(18, 0);
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::Matrix3d strain;
      for (int i = 0; i < 9; ++i) strain(i) = 1e-5 * rng.uniform(-1, 1);
      strain = (strain + strain.transpose()).eval() / 2;
      ReferenceState state = at_rest(world);
      for (int n = 0; n < world.nodes; ++n) {
        const Vec3 p = row(state.positions, n) + strain * row(state.positions, n);
        for (int c = 0; c < 3; ++c) state.positions[3 * n + c] = p[c];
      }
      const double density = mu * strain.squaredNorm() + 0.5 * lambda * strain.trace() * strain.trace();
      EXPECT_NEAR(elastic_energy_j(world, state) / (density * world.bodies[0].rest_volume_m3), 1, 1e-3);
    }
  }
}

// The energy of small affine strains: the bulk modulus is the material's, and shear along and across the grid
// near μ (docs/dynamics.md; springs of even shares would have 1.25 and 0.83).
TEST(Elastic, ModuliOfAGridAreTheMaterials) {
  for (const double poisson : {0.25, 0.4, 0.48}) {
    Material material;
    material.poisson_ratio = poisson;
    const World world = build_world(alone(soft(cube({0, 0, 0}, 1, 2), material)));
    const auto energy = [&](const Eigen::Matrix3d& strain) {
      ReferenceState state = at_rest(world);
      for (int n = 0; n < world.nodes; ++n) {
        const Vec3 p = row(state.positions, n) + strain * row(state.positions, n);
        for (int c = 0; c < 3; ++c) state.positions[3 * n + c] = p[c];
      }
      return elastic_energy_j(world, state);
    };
    const double mu = material.youngs_modulus_pa / (2 * (1 + poisson)), e = 1e-5;
    const double bulk = material.youngs_modulus_pa / (3 * (1 - 2 * poisson));
    EXPECT_NEAR(energy(e * Eigen::Matrix3d::Identity()) / (4.5 * bulk * e * e), 1, 1e-3);
    EXPECT_NEAR(energy(e * Vec3(1, -1, 0).asDiagonal()) / (2 * mu * e * e), 1, 0.13);
    Eigen::Matrix3d shear = Eigen::Matrix3d::Zero();
    shear(0, 1) = shear(1, 0) = e;
    EXPECT_NEAR(energy(shear) / (2 * mu * e * e), 1, 0.09);
  }
}

// The springs of any mesh resist shear in all directions nearly alike, and as μ says. Even shares spread from
// 0.90 to 1.11 here.
TEST(Elastic, SpringsOfABallAreNearlyIsotropic) {
  const World world = build_world(alone(soft(ball({0, 0, 0}, 1, 6))));
  const double mu = 5e3 / (2 * 1.45);
  Rng rng(19, 0);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix3d strain;
    for (int i = 0; i < 9; ++i) strain(i) = rng.uniform(-1, 1);
    strain = (strain + strain.transpose()).eval() / 2;
    strain -= strain.trace() / 3 * Eigen::Matrix3d::Identity();
    strain *= 1e-3 / strain.norm();
    ReferenceState state = at_rest(world);
    for (int n = 0; n < world.nodes; ++n) {
      const Vec3 p = row(state.positions, n) + strain * row(state.positions, n);
      for (int c = 0; c < 3; ++c) state.positions[3 * n + c] = p[c];
    }
    EXPECT_NEAR(elastic_energy_j(world, state) / (mu * 1e-6 * world.bodies[0].rest_volume_m3), 1, 0.09);
  }
}

// A nearly incompressible cube between smooth walls that close to half its height bulges, and keeps its
// volume.
TEST(Elastic, ASquashedCubeKeepsItsVolume) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    material.poisson_ratio = 0.495;
    material.friction = 0;
    material.damping_ratio = 0.1;
    WorldSpec spec = alone(soft(cube({0, 0, 0}, 1, 3), material));
    spec.bounds_m = {Vec3(-2, -2, -0.5), Vec3(2, 2, 0.5)};
    spec.walls = true;
    World world = build_world(spec);
    State state = rest_state(world);
    Control few;
    few.steps = int(2e-3 / world.dt_s);
    for (double height = 1; height > 0.5; height -= 5e-4) {
      world.bounds_m.upper.z() = height / 2, world.bounds_m.lower.z() = -height / 2;
      state = propagate(world, state, few).end;
    }
    EXPECT_LT(deepest_penetration(world, state).depth_m, 0.02);
    prove_at_most(10, "cube between walls at half its height: volume change", called(model),
                  largest_volume_change(world, state), 0.03);
    EXPECT_GT(bounding_box(body_positions(world, state, 0)).size().x(), 1.3);
    EXPECT_EQ(inverted_tets(world, state), 0);
  }
}

// The same with a ball, whose contact grows from a point.
TEST(Elastic, ABallPressedToHalfItsHeightKeepsItsVolume) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    material.poisson_ratio = 0.495;
    material.friction = 0;
    material.damping_ratio = 0.1;
    WorldSpec spec = alone(soft(ball({0, 0, 0}, 0.5, 4), material));
    spec.bounds_m = {Vec3(-2, -2, -0.5), Vec3(2, 2, 0.5)};
    spec.walls = true;
    World world = build_world(spec);
    State state = rest_state(world);
    const double whole = bounding_box(body_positions(world, state, 0)).size().z();
    Control few;
    few.steps = int(2e-3 / world.dt_s);
    for (double height = whole; height > 0.5 * whole; height -= 1e-3) {
      world.bounds_m.upper.z() = height / 2, world.bounds_m.lower.z() = -height / 2;
      state = propagate(world, state, few).end;
    }
    prove_at_most(10, "ball between walls: height over half of what it was", called(model),
                  bounding_box(body_positions(world, state, 0)).size().z() / (0.5 * whole), 1.05);
    prove_at_most(10, "ball between walls at half its height: volume change", called(model),
                  largest_volume_change(world, state), 0.03);
    EXPECT_EQ(inverted_tets(world, state), 0);
  }
}

// Random, flat and mirrored tets come back, whatever the Poisson ratio.
TEST(Elastic, TetsRecoverFromAnything) {
  for (const MaterialModel model : both_models) {
    for (const double poisson : {0.25, 0.35, 0.45}) {
      Material material;
      material.model = model;
      material.poisson_ratio = poisson;
      material.damping_ratio = 0.2;
      const World world = build_world(alone(soft(one_tet(), material)));
      Rng rng(16, 0);
      std::vector<State> starts;
      for (int trial = 0; trial < 999; ++trial) {
        State state = rest_state(world);
        for (std::size_t k = 0; k < 12; ++k) {
          float& x = state.positions[k];
          if (trial % 3 == 0) x = float(rng.uniform(-0.6, 0.6));
          if (trial % 3 == 1 && k % 3 == 2) x *= float(rng.uniform(-1e-3, 1e-3));
          if (trial % 3 == 2 && k % 3 == 2) x *= float(rng.uniform(-1.2, -0.8));
        }
        starts.push_back(state);
      }
      Control coast;
      coast.steps = int(30 / world.dt_s);
      std::vector<Rollout> rollouts;
      for (const State& s : starts) rollouts.push_back({&s, coast, {}, {}});
      Batch batch(world, 16);
      propagate(batch, rollouts);
      int recovered = 0;
      for (const Rollout& r : rollouts)  // some are left spinning, and stretched by that
        recovered += r.outcome.status == RunStatus::ok && inverted_tets(world, r.end) == 0;
      prove_at_least(11, "random, flat and mirrored tets that recover", called(model), recovered / 999.0,
                     0.999);
    }
  }
}

}  // namespace
}  // namespace limber::fem
