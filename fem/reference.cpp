#include "fem/reference.h"

#include "fem/detail/stepper.h"

namespace limber::fem {

ReferenceState reference_state(const State& s) {
  return {s.step, {s.positions.begin(), s.positions.end()}, {s.velocities.begin(), s.velocities.end()}};
}

void advance(const World& world, const Control& control, ReferenceState& state) {
  detail::Stepper<double> stepper(world, 1, detail::best_isa());
  stepper.load(0, state.positions.data(), state.velocities.data(), control, true);
  for (int s = 0; s < control.steps; ++s) stepper.step();
  stepper.store(0, state.positions.data(), state.velocities.data());
  state.step += control.steps;
}

std::vector<double> elastic_forces(const World& world, const ReferenceState& state) {
  const auto place = detail::state_layout(1), push = detail::force_layout(1);
  const int nodes = int(state.positions.size()) / 3;
  std::vector<double> records(std::size_t(nodes * place.node), 0.0), f(std::size_t(nodes * push.node), 0.0),
      forces;
  for (int n = 0; n < nodes; ++n)
    for (int c = 0; c < 3; ++c) {
      records[place.at(n, c)] = state.positions[3 * n + c];
      records[place.at(n, c) + 4] = state.velocities[3 * n + c];
    }
  detail::kernels<double>(detail::best_isa(), 1)
      .elastic(detail::elements_of(world.tables64), records.data(), records.data() + 4, f.data());
  for (int n = 0; n < nodes; ++n)
    for (int c = 0; c < 3; ++c) forces.push_back(f[push.at(n, c)]);
  return forces;
}

double elastic_energy_j(const World& world, const ReferenceState& state) {
  const auto at = [&](int n) { return Eigen::Map<const Vec3>(&state.positions[3 * n]); };
  double energy = 0;
  for (const auto& s : world.tables64.springs) {
    const double stretch = (at(s.j) - at(s.i)).norm() - s.rest_length;
    energy += 0.5 * s.stiffness * stretch * stretch;
  }
  for (const auto& q : world.tables64.volumes) {
    const double v6 = 6 * signed_volume(at(q.node[0]), at(q.node[1]), at(q.node[2]), at(q.node[3]));
    const double change = v6 - q.rest_volume6, inverted = std::min(v6, 0.0);
    energy += 0.5 * (q.stiffness * change * change + q.inverted_stiffness * inverted * inverted);
  }
  return energy;
}

}  // namespace limber::fem
