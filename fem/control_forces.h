// What a control does to the robot: seen from outside, as observe.h sees the bodies.
#pragma once

#include <vector>

#include "core/state.h"
#include "fem/world.h"

namespace limber::fem {

// On each node of the robot in the step that starts here, newtons, by the code that steps.
std::vector<Vec3> control_forces_n(const World&, const State&, const Control&);

}  // namespace limber::fem
