#include "fem/control_forces.h"

#include "fem/detail/stepper.h"

namespace limber::fem {

std::vector<Vec3> control_forces_n(const World& world, const State& state, const Control& control) {
  detail::Stepper<float> stepper(world, 1, detail::best_isa());
  stepper.load(0, state.step, state.positions.data(), state.velocities.data(), control, false);
  std::vector<Vec3> forces = stepper.pushes_m_s2(0);
  const Body& robot = world.bodies[std::size_t(world.robot)];
  for (std::size_t n = 0; n < forces.size(); ++n) forces[n] *= robot.node_mass_kg[n];
  return forces;
}

}  // namespace limber::fem
