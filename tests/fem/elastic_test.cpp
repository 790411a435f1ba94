// The laws of elastic bodies without contact (docs/dynamics.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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
using testing::grid;
using testing::nodes_where;

BodySpec soft(TetMesh mesh, Material material = {}) {
  return {"soft", std::move(mesh), material, {}, BodyKind::deformable};
}

constexpr MaterialModel both_models[] = {MaterialModel::springs, MaterialModel::neo_hookean};

TetMesh one_tet() {
  TetMesh mesh;
  mesh.positions.resize(4, 3);
  mesh.positions << 0, 0, 0, 1, 0.1, 0, 0.2, 0.9, 0, 0.3, 0.2, 1.1;
  mesh.tets.resize(1, 4);
  mesh.tets << 0, 1, 2, 3;
  return mesh;
}

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
  for (const auto& [model, poisson] :
       {std::pair(MaterialModel::springs, 0.25), std::pair(MaterialModel::springs, 0.45),
        std::pair(MaterialModel::neo_hookean, 0.0), std::pair(MaterialModel::neo_hookean, 0.45)}) {
    Material material;
    material.model = model;
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
  for (const MaterialModel model : both_models)
    for (const double poisson : {0.25, 0.45}) {  // at 0.25 springs and dashpots alone
      Material material;
      material.model = model;
      material.poisson_ratio = poisson;
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
}

TEST(Elastic, InternalForcesAndTorquesSumToZero) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
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
}

TEST(Elastic, RigidMotionGivesNoForce) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    material.damping_ratio = 0.3;
    const World world = build_world(alone(soft(ball({0, 0, 0}, 1, 3), material)));
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -3).normalized()).toRotationMatrix();
    const Vec3 spin(0.3, -0.5, 0.7);
    ReferenceState state = at_rest(world);
    for (int n = 0; n < world.nodes; ++n) {
      const Vec3 p = turn * row(state.positions, n) + Vec3(4, 5, 6), v = spin.cross(p) + Vec3(1, 2, 3);
      for (int c = 0; c < 3; ++c) state.positions[3 * n + c] = p[c], state.velocities[3 * n + c] = v[c];
    }
    ReferenceState stretched = at_rest(world);
    for (double& x : stretched.positions) x *= 1.01;
    EXPECT_LT(largest(elastic_forces(world, state)), 1e-9 * largest(elastic_forces(world, stretched)));
  }
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
    EXPECT_NEAR(2 * M_PI * 10 / (falls.back() - falls.front()) / frequency, 1, 5e-3);
  }
}

TEST(Elastic, AFreeBodyKeepsMomentumAndAngularMomentum) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    const World world = build_world(alone(soft(ball({0, 0, 0}, 0.5, 3), material)));
    State state = rest_state(world);
    Rng rng(14, 0);
    for (int n = 0; n < world.nodes; ++n)
      for (int c = 0; c < 3; ++c)
        state.velocities[3 * n + c] =
            float(rng.uniform(-0.1, 0.1) + (c == 0 ? state.positions[3 * n + 1] : 0));
    const auto momenta = [&](const State& s) {
      Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
      for (int n = 0; n < world.nodes; ++n) {
        const Vec3 x = Eigen::Map<const Vec3f>(&s.positions[3 * n]).cast<double>();
        const Vec3 p =
            world.tables64.node_mass[n] * Eigen::Map<const Vec3f>(&s.velocities[3 * n]).cast<double>();
        sum.head<3>() += p, sum.tail<3>() += x.cross(p);
      }
      return sum;
    };
    Control coast;
    coast.steps = 10000;
    const Rollout rollout = propagate(world, state, coast);
    ASSERT_EQ(rollout.outcome.status, RunStatus::ok);
    const auto before = momenta(state), after = momenta(rollout.end);
    const double moving = mean_speed_m_s(world, state, 0) * world.bodies[0].mass_kg;
    EXPECT_LT((after - before).head<3>().norm(), 1e-5 * moving);
    EXPECT_LT((after - before).tail<3>().norm(), 1e-4 * moving * 0.5);
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
  EXPECT_NEAR(center_of_mass_m(world, end, 0).z(), -fallen, 1e-5 * fallen);
}

// Velocities belong to the middle of a step, so energy is summed with the mean of those before and after.
TEST(Elastic, EnergyIsKeptUndampedAndFallsDamped) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    const auto run = [&](double damping, double share_of_limit, double seconds) {
      material.damping_ratio = damping;
      World world = build_world(alone(soft(cube({0, 0, 0}, 1, 2), material)));
      world.dt_s = share_of_limit * world.bodies[0].elastic_dt_limit_s;
      ReferenceState state = at_rest(world);
      for (std::size_t k = 2; k < state.positions.size(); k += 3) state.positions[k] *= 1.1;
      std::vector<double> energies;
      double kinetic_peak = 0;
      Control one_step;
      one_step.steps = 1;
      while (double(state.step) * world.dt_s < seconds) {
        const ReferenceState before = state;
        advance(world, one_step, state);
        double kinetic = 0;
        for (int n = 0; n < world.nodes; ++n)
          kinetic += 0.125 * world.tables64.node_mass[n] *
                     (row(before.velocities, n) + row(state.velocities, n)).squaredNorm();
        kinetic_peak = std::max(kinetic_peak, kinetic);
        energies.push_back(kinetic + elastic_energy_j(world, before));
      }
      for (double& e : energies) e /= kinetic_peak;
      return energies;
    };
    const auto spread = [](const std::vector<double>& e, std::size_t first, std::size_t last) {
      const auto [low, high] =
          std::minmax_element(e.begin() + std::ptrdiff_t(first), e.begin() + std::ptrdiff_t(last));
      return *high - *low;
    };
    const auto coarse = run(0, 0.06, 10), fine = run(0, 0.03, 10);
    const double all = spread(coarse, 0, coarse.size());
    EXPECT_LT(all, 4e-3);
    EXPECT_NEAR(spread(fine, 0, fine.size()) / all, 0.25, 0.08);
    EXPECT_LT(all, 1.3 * spread(coarse, 0, coarse.size() / 2));  // no drift
    const auto damped = run(0.1, 0.06, 2);
    for (std::size_t k = 1; k < damped.size(); ++k) EXPECT_LT(damped[k], damped[k - 1] + 1e-3);
    EXPECT_LT(damped.back(), 0.01 * damped.front());
  }
}

TEST(Elastic, TheStepEstimateIsTheEdgeOfStability) {
  for (const MaterialModel model : both_models) {
    for (const auto& mesh : {cube({0, 0, 0}, 1, 2), cube({0, 0, 0}, 1, 4), ball({0, 0, 0}, 0.5, 4),
                             grid({0, 0, 0}, {2, 0.3, 0.5}, 8, 2, 2)})
      for (const double damping : {0.0, 0.2}) {
        Material material;
        material.model = model;
        material.damping_ratio = damping;
        World world = build_world(alone(soft(mesh, material)));
        const auto energy_after = [&](double share_of_limit) {
          world.dt_s = share_of_limit * world.bodies[0].elastic_dt_limit_s;
          ReferenceState state = at_rest(world);
          Rng rng(15, 0);
          for (double& v : state.velocities) v = rng.uniform(-1e-6, 1e-6);
          Control coast;
          coast.steps = 3000;
          advance(world, coast, state);
          return elastic_energy_j(world, state);
        };
        const double limit = world.bodies[0].mass_kg * 1e-10;
        EXPECT_LT(energy_after(0.9), limit) << damping;
        EXPECT_FALSE(energy_after(1.1) < limit) << damping;  // NaN, or growing
      }
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
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 wanted = map * Vec3(body.cage.positions.row(n));
    EXPECT_LT((Eigen::Map<const Vec3f>(&end.positions[3 * n]).cast<double>() - wanted).norm(), 1e-5);
  }
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
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 wanted = map * Vec3(body.cage.positions.row(n));
    EXPECT_LT((Eigen::Map<const Vec3f>(&end.positions[3 * n]).cast<double>() - wanted).norm(), 1e-5);
  }
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

// The state of balance: velocities are dropped whenever kinetic energy begins to fall.
State settled(const World& world, State state) {
  Control few;
  few.steps = 20;
  double before = 0, speed = 1;
  for (int round = 0; round < 3000 && speed > 1e-4; ++round) {
    state = propagate(world, state, few).end;
    const double kinetic = kinetic_energy_j(world, state);
    if (kinetic < before) {
      speed = mean_speed_m_s(world, state, 0);
      std::fill(state.velocities.begin(), state.velocities.end(), 0.f);
      before = 0;
    } else {
      before = kinetic;
    }
  }
  EXPECT_LE(speed, 1e-4);
  return state;
}

// A bar under its own weight, held at one end: the same sag whatever the mesh, within what coarse bending
// costs.
TEST(Elastic, ABarSagsAlikeOnTwoMeshes) {
  std::vector<double> sag;
  for (const int cells : {2, 3, 4}) {
    Material material;
    material.poisson_ratio = 0.3;
    material.damping_ratio = 0.5;
    BodySpec body = soft(grid({0, 0, 0}, {3, 1, 1}, 3 * cells, cells, cells), material);
    body.fixed_nodes = nodes_where(body.cage, [](const Vec3& p) { return p.x() < 1e-9; });
    WorldSpec spec = alone(body);
    spec.gravity_m_s2 = {0, 0, -0.2};
    const World world = build_world(spec);
    const State end = settled(world, rest_state(world));
    double tip = 0;
    const auto last = nodes_where(body.cage, [](const Vec3& p) { return p.x() > 3 - 1e-9; });
    for (int n : last) tip -= (end.positions[3 * n + 2] - body.cage.positions(n, 2)) / double(last.size());
    sag.push_back(tip);
  }
  // Euler and Bernoulli with shear: q L⁴/8EI + q L²/2κGA, for the grid's moduli between 0.83 and 1.25 of the
  // material's.
  const double q = 100 * 0.2, young = 5e3, shear = young / 2.6;
  const double beam = q * 81 / (8 * young / 12) + q * 9 / (2 * 5.0 / 6 * shear);
  EXPECT_GT(sag[2], 0.75 * beam);
  EXPECT_LT(sag[2], 1.1 * beam);
  EXPECT_NEAR(sag[2] / sag[1], 1, 0.03);
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
    EXPECT_LT(largest_volume_change(world, state), 0.03);
    EXPECT_GT(bounding_box(body_positions(world, state, 0)).size().x(), 1.3);
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
      EXPECT_EQ(recovered, 999) << poisson;
    }
  }
}

}  // namespace
}  // namespace limber::fem
