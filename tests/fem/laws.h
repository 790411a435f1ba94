// The laws of an elastic body that hold for any mesh, grids and cages alike, as proofs (tests/fem/proofs.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "fem/batch.h"
#include "fem/detail/timestep.h"
#include "fem/observe.h"
#include "fem/reference.h"
#include "tests/fem/proofs.h"
#include "tests/fem/worlds.h"

namespace limber::fem::testing {

inline constexpr MaterialModel both_models[] = {MaterialModel::springs, MaterialModel::neo_hookean};

inline std::string called(MaterialModel model) {
  return model == MaterialModel::springs ? "springs" : "Neo-Hookean";
}

inline BodySpec soft(TetMesh mesh, Material material = {}) {
  return {"soft", std::move(mesh), material, {}, BodyKind::deformable};
}

inline ReferenceState at_rest(const World& world) { return reference_state(rest_state(world)); }

inline void shake(ReferenceState& state, double amount, Rng& rng) {
  for (double& x : state.positions) x += rng.uniform(-amount, amount);
  for (double& v : state.velocities) v += rng.uniform(-amount, amount);
}

inline Vec3 row(const std::vector<double>& v, int n) { return {v[3 * n], v[3 * n + 1], v[3 * n + 2]}; }

inline double largest(const std::vector<double>& v) {
  double most = 0;
  for (double x : v) most = std::max(most, std::abs(x));
  return most;
}

inline double size_of(const World& world) {
  return bounding_box(world.bodies[0].cage.positions).size().maxCoeff();
}

inline double mean_edge(const World& world) {
  return std::cbrt(8.5 * world.bodies[0].rest_volume_m3 / double(world.bodies[0].cage.tets.rows()));
}

// Momentum and angular momentum about the origin.
inline Eigen::Matrix<double, 6, 1> momenta(const World& world, const State& s) {
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
  for (int n = 0; n < world.moving_nodes; ++n) {
    const Vec3 x = Eigen::Map<const Vec3f>(&s.positions[3 * n]).cast<double>();
    const Vec3 p = world.tables64.node_mass[n] * Eigen::Map<const Vec3f>(&s.velocities[3 * n]).cast<double>();
    sum.head<3>() += p, sum.tail<3>() += x.cross(p);
  }
  return sum;
}

// Shaken a little, turned inside out, and flattened: the energy's gradient is the force everywhere.
inline void prove_force_is_minus_the_gradient(const std::string& name, const World& world) {
  Rng rng(11, 0);
  int inverted = 0;
  double worst = 0;
  for (const double amount : {0.02, 0.2, 1.2}) {
    ReferenceState state = at_rest(world);
    shake(state, amount * mean_edge(world), rng);
    std::fill(state.velocities.begin(), state.velocities.end(), 0.0);
    const State single{0,
                       {state.positions.begin(), state.positions.end()},
                       {state.velocities.begin(), state.velocities.end()}};
    inverted += inverted_tets(world, single);
    const std::vector<double> force = elastic_forces(world, state);
    const double scale = largest(force), h = 2e-6 * mean_edge(world);
    for (std::size_t k = 0; k < force.size(); ++k) {
      const double x = state.positions[k];
      state.positions[k] = x + h;
      const double above = elastic_energy_j(world, state);
      state.positions[k] = x - h;
      const double below = elastic_energy_j(world, state);
      state.positions[k] = x;
      worst = std::max(worst, std::abs(force[k] + (above - below) / (2 * h)) / scale);
    }
  }
  EXPECT_GT(inverted, 10);
  prove_at_most(1, "force + ∇E by differences, of the largest force", name, worst, 1e-6);
}

// The power of damping over that of forces as large as its largest.
inline void prove_damping_takes_energy(const std::string& name, const World& world) {
  Rng rng(12, 0);
  double worst = -1;
  for (int trial = 0; trial < 50; ++trial) {
    ReferenceState moving = at_rest(world);
    shake(moving, 0.6 * mean_edge(world), rng);
    ReferenceState still = moving;
    std::fill(still.velocities.begin(), still.velocities.end(), 0.0);
    const auto with = elastic_forces(world, moving), without = elastic_forces(world, still);
    double power = 0, most = 0;
    for (std::size_t k = 0; k < with.size(); ++k) {
      power += (with[k] - without[k]) * moving.velocities[k];
      most += std::abs((with[k] - without[k]) * moving.velocities[k]);
    }
    worst = std::max(worst, power / most);
  }
  prove_at_most(1, "power of damping, of the sum of its parts' sizes", name, worst, 0);
}

inline void prove_forces_sum_to_zero(const std::string& name, const World& world) {
  Rng rng(13, 0);
  ReferenceState state = at_rest(world);
  shake(state, 0.3 * mean_edge(world), rng);
  const auto sums = [&](const auto& force) {
    double sizes = 0;
    Vec3 sum = Vec3::Zero(), torque = Vec3::Zero(), middle = Vec3::Zero();
    for (int n = 0; n < world.nodes; ++n) middle += row(state.positions, n) / world.nodes;
    for (int n = 0; n < world.nodes; ++n) {
      const Vec3 f(force(n, 0), force(n, 1), force(n, 2));
      sum += f, torque += (row(state.positions, n) - middle).cross(f), sizes += f.norm();
    }
    return std::max(sum.norm(), torque.norm() / size_of(world)) / sizes;
  };
  const auto exact = elastic_forces(world, state);
  prove_at_most(2, "sums of forces and torques, double", name,
                sums([&](int n, int c) { return exact[3 * n + c]; }), 1e-13);
  const detail::Layout layout = detail::state_layout(1), force_layout = detail::force_layout(1);
  std::vector<float> records(std::size_t(world.nodes * layout.node)),
      force(std::size_t(world.nodes * force_layout.node));
  for (int n = 0; n < world.nodes; ++n)
    for (int c = 0; c < 3; ++c) {
      records[layout.at(n, c)] = float(state.positions[3 * n + c]);
      records[layout.at(n, c) + 4] = float(state.velocities[3 * n + c]);
      state.positions[3 * n + c] = records[layout.at(n, c)];
    }
  detail::kernels<float>(detail::best_isa(), 1)
      .elastic(elements_of(world.tables.elements), records.data(), records.data() + 4, force.data());
  prove_at_most(2, "sums of forces and torques, float", name,
                sums([&](int n, int c) { return force[force_layout.at(n, c)]; }), 1e-6);
}

inline void prove_rigid_motion_gives_no_force(const std::string& name, const World& world) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -3).normalized()).toRotationMatrix();
  const Vec3 spin(0.3, -0.5, 0.7);
  ReferenceState state = at_rest(world);
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 p = turn * row(state.positions, n) + Vec3(4, 5, 6) * size_of(world),
               v = spin.cross(p) + Vec3(1, 2, 3) * size_of(world);
    for (int c = 0; c < 3; ++c) state.positions[3 * n + c] = p[c], state.velocities[3 * n + c] = v[c];
  }
  ReferenceState stretched = at_rest(world);
  for (double& x : stretched.positions) x *= 1.01;
  prove_at_most(3, "force of a turned, moved, spinning body, of that of 1 % stretch", name,
                largest(elastic_forces(world, state)) / largest(elastic_forces(world, stretched)), 1e-9);
}

inline void prove_momenta_are_kept(const std::string& name, const World& world) {
  State state = rest_state(world);
  const Vec3 middle = center_of_mass_m(world, state, 0);
  Rng rng(14, 0);
  for (int n = 0; n < world.nodes; ++n)
    for (int c = 0; c < 3; ++c) {
      state.positions[3 * n + c] -= float(middle[c]);
      state.velocities[3 * n + c] = float(size_of(world) * rng.uniform(-0.1, 0.1));
    }
  for (int n = 0; n < world.nodes; ++n) state.velocities[3 * n] += state.positions[3 * n + 1];
  Control coast;
  coast.steps = 10000;
  const Rollout rollout = propagate(world, state, coast);
  EXPECT_EQ(rollout.outcome.status, RunStatus::ok) << rollout.outcome.reason;
  const auto lost = (momenta(world, rollout.end) - momenta(world, state)).eval();
  const double moving = mean_speed_m_s(world, state, 0) * world.bodies[0].mass_kg;
  prove_at_most(4, "momentum lost in 10⁴ steps, of Σ mv", name, lost.head<3>().norm() / moving, 1e-5);
  prove_at_most(4, "angular momentum lost in 10⁴ steps, of Σ mv × half its size", name,
                lost.tail<3>().norm() / (moving * size_of(world) / 2), 1e-4);
}

// Total energy over the kinetic peak, step by step, from a stretch of 10 % along z. Velocities belong to the
// middle of a step, so energy is summed with the mean of those before and after.
inline std::vector<double> energies(World world, double share_of_limit, double seconds) {
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
}

inline double spread(const std::vector<double>& e, std::size_t first, std::size_t last) {
  const auto [low, high] =
      std::minmax_element(e.begin() + std::ptrdiff_t(first), e.begin() + std::ptrdiff_t(last));
  return *high - *low;
}

inline void prove_energy_is_kept(const std::string& name, const World& undamped, double seconds) {
  const auto e = energies(undamped, 0.06, seconds);
  const double all = spread(e, 0, e.size());
  prove_at_most(5, "energy's spread over its kinetic peak at 0.06 of the limit", name, all, 4e-3);
  prove_at_most(5, "drift: spread of energy over that of the first half", name,
                all / spread(e, 0, e.size() / 2), 1.3);
}

inline void prove_energy_falls(const std::string& name, const World& damped, double seconds) {
  const auto e = energies(damped, 0.06, seconds);
  double rise = 0;
  for (std::size_t k = 1; k < e.size(); ++k) rise = std::max(rise, e[k] - e[k - 1]);
  prove_at_most(5, "damped, largest rise of energy in a step over the kinetic peak", name, rise, 1e-3);
}

inline void prove_the_step_estimate(const std::string& name, World world) {
  const auto energy_after = [&](double share_of_limit) {
    world.dt_s = share_of_limit * world.bodies[0].elastic_dt_limit_s;
    ReferenceState state = at_rest(world);
    Rng rng(15, 0);
    for (double& v : state.velocities) v = size_of(world) * rng.uniform(-1e-6, 1e-6);
    Control coast;
    coast.steps = 3000;
    advance(world, coast, state);
    const double energy = elastic_energy_j(world, state);
    return std::isfinite(energy) ? energy : std::numeric_limits<double>::infinity();
  };
  const double scale = world.bodies[0].mass_kg * 1e-10 * std::pow(size_of(world), 2);
  prove_at_most(6, "energy after 3,000 steps at 0.9 of the estimate, in what stirred it up", name,
                energy_after(0.9) / scale, 1);
  prove_at_least(6, "energy after 3,000 steps at 1.1 of the estimate", name, energy_after(1.1) / scale, 1);
}

// A share of the speed of sound.
inline double still_m_s(const World& world) {
  const Material& material = world.bodies[0].material;
  return 1.5e-5 * std::sqrt(material.youngs_modulus_pa / material.density_kg_m3);
}

// The state of balance: velocities are dropped whenever kinetic energy begins to fall. `take` takes 20 steps;
// works on State and ReferenceState.
template <class AnyState>
struct Settled {
  AnyState state;
  double speed;  // mass-weighted mean when it last was dropped
  int rounds;    // of 20 steps
};
template <class AnyState, class Take>
Settled<AnyState> settled(const World& world, AnyState state, int max_rounds, const Take& take) {
  double before = 0, speed = 1;
  int round = 0;
  for (; round < max_rounds && speed > still_m_s(world); ++round) {
    take(state);
    double kinetic = 0, momentum = 0;
    for (int n = 0; n < world.nodes; ++n) {
      const Vec3 v(state.velocities[3 * n], state.velocities[3 * n + 1], state.velocities[3 * n + 2]);
      kinetic += world.tables64.node_mass[n] * v.squaredNorm(),
          momentum += world.tables64.node_mass[n] * v.norm();
    }
    if (kinetic < before) {
      speed = momentum / world.bodies[0].mass_kg;
      std::fill(state.velocities.begin(), state.velocities.end(), 0);
      before = 0;
    } else {
      before = kinetic;
    }
  }
  return {std::move(state), speed, round};
}
inline Settled<State> settled(const World& world, const State& state, int max_rounds) {
  Control few;
  few.steps = 20;
  return settled(world, state, max_rounds, [&](State& s) { s = propagate(world, s, few).end; });
}
inline Settled<ReferenceState> settled(const World& world, const ReferenceState& state, int max_rounds) {
  Control few;
  few.steps = 20;
  return settled(world, state, max_rounds, [&](ReferenceState& s) { advance(world, few, s); });
}

// Largest way of a node from where it is at rest.
template <class AnyState>
double farthest_from_rest(const World& world, const AnyState& state) {
  double farthest = 0;
  for (int n = 0; n < world.moving_nodes; ++n) {
    const Vec3 p(state.positions[3 * n], state.positions[3 * n + 1], state.positions[3 * n + 2]);
    farthest = std::max(farthest, (p - row(world.tables64.rest_positions, n)).norm());
  }
  return farthest;
}

// Held at one side and hanging by a weight that moves it by some per cent of its size.
inline void prove_sag_is_that_of_double(const std::string& name, TetMesh mesh, const Material& material) {
  BodySpec body = soft(std::move(mesh), material);
  const Box box = bounding_box(body.cage.positions);
  body.fixed_nodes =
      nodes_where(body.cage, [&](const Vec3& p) { return p.x() < box.lower.x() + 0.15 * box.size().x(); });
  WorldSpec spec = alone(body);
  const double size = box.size().maxCoeff();
  spec.gravity_m_s2 = {0, 0, -0.02 * material.youngs_modulus_pa / (material.density_kg_m3 * size)};
  const World world = build_world(spec);
  // Float has a floor of speed, which is seen in the sag or not; so it gets three times as long as double
  // took.
  const auto exactly = settled(world, at_rest(world), 3000);
  EXPECT_LT(exactly.speed, still_m_s(world)) << name;
  const double exact = farthest_from_rest(world, exactly.state);
  const double single =
      farthest_from_rest(world, settled(world, rest_state(world), 3 * exactly.rounds).state);
  EXPECT_GT(exact, 0.01 * size);
  prove_at_most(9, "sag, float over double − 1", name, std::abs(single / exact - 1), 5e-3);
}

// Positions after a third of a second of swinging, at steps h, h/2, h/4; velocities begin half a step early,
// as the scheme has them.
inline double convergence_ratio(World world, double seconds) {
  const double h = 0.1 * world.bodies[0].elastic_dt_limit_s;
  const auto end = [&](int parts) {
    world.dt_s = h / parts;
    ReferenceState state = at_rest(world);
    for (std::size_t k = 0; k < state.positions.size(); ++k) state.positions[k] *= 1 + 0.02 * double(k % 3);
    const auto force = elastic_forces(world, state);
    for (std::size_t k = 0; k < force.size(); ++k)
      state.velocities[k] = -world.dt_s / 2 * force[k] * world.tables64.inverse_mass[k / 3];
    Control coast;
    coast.steps = parts * int(seconds / h);
    advance(world, coast, state);
    return state.positions;
  };
  const auto coarse = end(1), middle = end(2), fine = end(4);
  double first = 0, second = 0;
  for (std::size_t k = 0; k < coarse.size(); ++k) {
    first += std::pow(coarse[k] - middle[k], 2), second += std::pow(middle[k] - fine[k], 2);
  }
  return std::sqrt(first / second);
}
inline void prove_convergence(const std::string& name, const TetMesh& mesh, Material material) {
  const double size = bounding_box(mesh.positions).size().maxCoeff();
  const double seconds = 2 * size / std::sqrt(material.youngs_modulus_pa / material.density_kg_m3);
  material.damping_ratio = 0;
  prove_at_most(17, "(x_h − x_h/2)/(x_h/2 − x_h/4) from 4, undamped", name,
                std::abs(convergence_ratio(build_world(alone(soft(mesh, material))), seconds) - 4), 0.4);
  material.damping_ratio = 0.1;
  prove_at_least(17, "(x_h − x_h/2)/(x_h/2 − x_h/4), damped", name,
                 convergence_ratio(build_world(alone(soft(mesh, material))), seconds), 1.8);
}

// All of them for one mesh in both materials.
inline void prove_laws_of_any_mesh(const std::string& mesh_name, const TetMesh& mesh,
                                   double seconds_of_energy) {
  for (const MaterialModel model : both_models) {
    Material material;
    material.model = model;
    const std::string name = mesh_name + ", " + called(model);
    SCOPED_TRACE(name);
    const auto world = [&](double damping) {
      material.damping_ratio = damping;
      return build_world(alone(soft(mesh, material)));
    };
    const World undamped = world(0), damped = world(0.3);
    prove_force_is_minus_the_gradient(name, undamped);
    prove_damping_takes_energy(name, damped);
    prove_forces_sum_to_zero(name, damped);
    prove_rigid_motion_gives_no_force(name, damped);
    prove_momenta_are_kept(name, world(0.05));
    prove_energy_is_kept(name, undamped, seconds_of_energy);
    prove_energy_falls(name, world(0.1), seconds_of_energy / 4);
    prove_the_step_estimate(name, damped);
    prove_the_step_estimate(name + ", undamped", undamped);
    prove_sag_is_that_of_double(name, mesh, material);
    prove_convergence(name, mesh, material);
  }
}

}  // namespace limber::fem::testing
