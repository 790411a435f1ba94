// A bar twisted between its held ends: by little against Saint-Venant's torsion, and by a full turn.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fem/batch.h"
#include "fem/reference.h"
#include "tests/fem/laws.h"
#include "tests/fem/proofs.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::both_models;
using testing::called;
using testing::prove_at_most;

constexpr double edge = 1;  // m, about the x axis

World bar(MaterialModel model, double length, int cells) {
  Material material;
  material.model = model;
  material.poisson_ratio = model == MaterialModel::springs ? 0.25 : 0.3;
  material.damping_ratio = 0.7;
  BodySpec body{
      "bar",
      testing::grid({0, -edge / 2, -edge / 2}, {length, edge, edge}, int(length) * cells, cells, cells),
      material,
      {}};
  body.fixed_nodes =
      testing::nodes_where(body.cage, [&](const Vec3& p) { return p.x() < 1e-9 || p.x() > length - 1e-9; });
  return build_world(testing::alone(body));
}

// Every cross-section turned, the last by the whole angle.
ReferenceState twisted(const World& world, double length, double angle) {
  ReferenceState state = reference_state(rest_state(world));
  for (std::size_t k = 0; k < state.positions.size(); k += 3) {
    double* p = &state.positions[k];
    const double a = angle * p[0] / length, y = p[1], z = p[2];
    p[1] = std::cos(a) * y - std::sin(a) * z, p[2] = std::sin(a) * y + std::cos(a) * z;
  }
  return state;
}

// That holds the end at x = 0, once the bar is at rest.
double torque_nm(MaterialModel model, double length, int cells, double angle) {
  const World world = bar(model, length, cells);
  ReferenceState state = twisted(world, length, angle);
  Control rest;
  rest.steps = int(4 / world.dt_s);
  advance(world, rest, state);
  std::fill(state.velocities.begin(), state.velocities.end(), 0.0);
  const std::vector<double> f = elastic_forces(world, state);
  double torque = 0;
  for (std::size_t k = 0; k < f.size(); k += 3)
    if (state.positions[k] < 1e-9)
      torque += state.positions[k + 1] * f[k + 2] - state.positions[k + 2] * f[k + 1];
  return torque;
}

// GJ of a square is 0.1406 G a⁴. Two lengths, so that the ends, which cannot warp, cancel out; two meshes, so
// that what falls with the square of their cells does.
TEST(Twist_slow, ABarTurnsAsSaintVenantSays) {
  constexpr double angle = 0.02;
  for (const MaterialModel model : both_models) {
    const auto stiffness = [&](int cells) {
      return 2 / (angle / torque_nm(model, 4, cells, angle) - angle / torque_nm(model, 2, cells, angle));
    };
    const Material material = bar(model, 2, 1).bodies[0].material;
    const double shear = material.youngs_modulus_pa / (2 * (1 + material.poisson_ratio));
    const double coarse = stiffness(3), fine = stiffness(6), exact = 0.1406 * shear * std::pow(edge, 4);
    const double limit = fine + (fine - coarse) / 3;
    fmt::print("{}: GJ over the closed form {:.4f} with 3 cells, {:.4f} with 6, {:.4f} in the limit\n",
               called(model), coarse / exact, fine / exact, limit / exact);
    prove_at_most(15, "bar twisted by 0.02: limit of refinement over GJθ/L, − 1", called(model),
                  std::abs(limit / exact - 1), model == MaterialModel::springs ? 0.11 : 0.03);
  }
}

TEST(Twist, AFullTurnLeavesNothingInvertedAndGainsNoEnergy) {
  for (const MaterialModel model : both_models) {
    const World world = bar(model, 4, 3);
    const ReferenceState start = twisted(world, 4, 2 * std::numbers::pi);
    State state = rest_state(world);
    std::copy(start.positions.begin(), start.positions.end(), state.positions.begin());
    Control part;
    part.steps = 20;
    const auto energy = [&] {
      const ReferenceState now = reference_state(state);
      double kinetic = 0;
      for (std::size_t k = 0; k < now.velocities.size(); ++k)
        kinetic += 0.5 * world.tables64.node_mass[k / 3] * now.velocities[k] * now.velocities[k];
      return elastic_energy_j(world, now) + kinetic;
    };
    const double first = energy();
    double most = first;
    for (double t = 0; t < 4; t += part.steps * world.dt_s) {
      const Rollout next = propagate(world, state, part);
      ASSERT_EQ(next.outcome.status, RunStatus::ok) << next.outcome.reason;
      state = next.end;
      most = std::max(most, energy());
    }
    int inverted = 0;
    const Points at = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>>(
                          state.positions.data(), world.nodes, 3)
                          .cast<double>();
    for (const auto& q : world.bodies[0].cage.tets.rowwise())
      inverted += signed_volume(at.row(q[0]), at.row(q[1]), at.row(q[2]), at.row(q[3])) <= 0;
    prove_at_most(15, "bar twisted by a full turn: inverted tets afterwards", called(model), inverted, 0);
    prove_at_most(15, "bar twisted by a full turn: most energy over that at first", called(model),
                  most / first, 1.001);
  }
}

}  // namespace
}  // namespace limber::fem
