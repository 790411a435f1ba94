#include "fem/observe.h"

#include <algorithm>

#include "fem/detail/overlap.h"
#include "fem/reference.h"

namespace limber::fem {
namespace {

Vec3 velocity(const State& state, int node) {
  return Eigen::Map<const Vec3f>(&state.velocities[3 * node]).cast<double>();
}

}  // namespace

Points body_positions(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  if (!body.moving) return body.cage.positions;
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(&state.positions.at(std::size_t(3 * body.first_node)), body.node_count(), 3)
      .cast<double>();
}

double time_s(const World& world, const State& state) { return double(state.step) * world.dt_s; }

double volume_m3(const World& world, const State& state, int body) {
  return volume(TetMesh{body_positions(world, state, body), world.bodies[body].cage.tets});
}

double largest_volume_change(const World& world, const State& state) {
  double largest = 0;
  for (int b = 0; b < int(world.bodies.size()); ++b)
    if (world.bodies[b].moving)
      largest = std::max(largest, std::abs(volume_m3(world, state, b) / world.bodies[b].rest_volume_m3 - 1));
  return largest;
}

Vec3 center_of_mass_m(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  const Points positions = body_positions(world, state, index);
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < body.node_count(); ++n) sum += body.node_mass_kg[n] * positions.row(n).transpose();
  return sum / body.mass_kg;
}

double mean_speed_m_s(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  double sum = 0;
  for (int n = 0; n < body.node_count() && body.moving; ++n)
    sum += body.node_mass_kg[n] * velocity(state, body.first_node + n).norm();
  return sum / body.mass_kg;
}

double elastic_energy_j(const World& world, const State& state) {
  return elastic_energy_j(world, reference_state(state));
}

double kinetic_energy_j(const World& world, const State& state) {
  double energy = 0;
  for (int n = 0; n < world.moving_nodes; ++n)
    energy += 0.5 * world.tables64.node_mass[n] * velocity(state, n).squaredNorm();
  return energy;
}

int inverted_tets(const World& world, const State& state) {
  int count = 0;
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    if (!world.bodies[b].moving) continue;
    const Points p = body_positions(world, state, b);
    const Tets& tets = world.bodies[b].cage.tets;
    for (int t = 0; t < tets.rows(); ++t)
      count +=
          !(signed_volume(p.row(tets(t, 0)), p.row(tets(t, 1)), p.row(tets(t, 2)), p.row(tets(t, 3))) > 0);
  }
  return count;
}

Penetration deepest_penetration(const World& world, const State& state) {
  Penetration deepest;
  std::vector<Points> positions;
  for (int b = 0; b < int(world.bodies.size()); ++b) positions.push_back(body_positions(world, state, b));
  for (int a = 0; a < int(world.bodies.size()); ++a) {
    const Body& one = world.bodies[a];
    for (int b = a + 1; b < int(world.bodies.size()); ++b) {
      const Body& two = world.bodies[b];
      if (!one.moving && !two.moving) continue;
      const auto overlap = detail::deepest_overlap({positions[a], one.cage.tets, one.surface},
                                                   {positions[b], two.cage.tets, two.surface});
      if (overlap.depth_m > deepest.depth_m) deepest = {overlap.depth_m, a, b, overlap.place};
    }
    if (!world.walls || !one.moving) continue;
    for (int n = 0; n < one.node_count(); ++n) {
      const Vec3 p = positions[a].row(n);
      const double out =
          std::max((world.bounds_m.lower - p).maxCoeff(), (p - world.bounds_m.upper).maxCoeff());
      if (!one.fixed[n] && out > deepest.depth_m) deepest = {out, a, -1, p};
    }
  }
  return deepest;
}

}  // namespace limber::fem
