#include "fem/reference.h"

#include <cmath>

#include "fem/detail/stepper.h"
#include "fem/detail/timestep.h"

namespace limber::fem {

ReferenceState reference_state(const State& s) {
  return {s.step, {s.positions.begin(), s.positions.end()}, {s.velocities.begin(), s.velocities.end()}};
}

void advance(const World& world, const Control& control, ReferenceState& state) {
  detail::Stepper<double> stepper(world, 1, detail::best_isa());
  stepper.load(0, state.step, state.positions.data(), state.velocities.data(), control, true);
  for (int s = 0; s < control.steps; ++s) stepper.step();
  stepper.store(0, state.positions.data(), state.velocities.data());
  state.step += control.steps;
}

std::vector<double> elastic_forces(const World& world, const ReferenceState& state) {
  return detail::forces_of(world.tables64.elements, state.positions, state.velocities);
}

double elastic_energy_j(const World& world, const ReferenceState& state) {
  double energy = 0;
  for (int b = 0; b < int(world.bodies.size()); ++b) energy += elastic_energy_j(world, state, b);
  return energy;
}

double elastic_energy_j(const World& world, const ReferenceState& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  const auto is_own = [&](int node) {
    return node >= body.first_node && node < body.first_node + body.node_count();
  };
  const auto& elements = world.elements;
  const auto at = [](const std::vector<double>& x, int n) { return Eigen::Map<const Vec3>(&x[3 * n]); };
  const auto volume6 = [&](const std::vector<double>& x, const int* node) {
    return 6 * signed_volume(at(x, node[0]), at(x, node[1]), at(x, node[2]), at(x, node[3]));
  };
  const auto of_volume = [](double v6, const detail::VolumeLaw<double>& law) {
    const double change = v6 - law.rest_volume6, inverted = std::min(v6, 0.0);
    return 0.5 * (law.stiffness * change * change + law.inverted_stiffness * inverted * inverted);
  };
  const auto& x = state.positions;
  double energy = 0;
  for (const auto& [node, law] : elements.springs) {
    if (!is_own(node[0])) continue;
    const double stretch = (at(x, node[1]) - at(x, node[0])).norm() - law.rest_length;
    energy += 0.5 * law.stiffness * stretch * stretch;
  }
  for (const auto& [node, law] : elements.volumes)
    if (is_own(node[0])) energy += of_volume(volume6(x, node), law);
  for (const auto& [node, law] : elements.neo_hookeans) {
    if (!is_own(node[0])) continue;
    // At rest its two parts hold each other in balance; only what is above that counts.
    const double at_rest = of_volume(volume6(world.tables64.rest_positions, node), law.volume);
    Eigen::Matrix3d edges, metric;
    for (int i = 0; i < 3; ++i) edges.col(i) = at(x, node[i + 1]) - at(x, node[0]);
    const double* m = law.metric;
    metric << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
    const double trace = (edges.transpose() * edges * metric).trace() / law.scale;
    energy += of_volume(volume6(x, node), law.volume) - at_rest +
              0.5 * law.scale * (trace - 3 - std::log((trace + 1) / 4));
  }
  return energy;
}

}  // namespace limber::fem
