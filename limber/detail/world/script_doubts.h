// What a scene's script ([[forces]], [[pressures]], [[motions]]) says and does not come to.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "fem/world.h"
#include "scenes/scene.h"

namespace limber::detail {

// Of a motion from one time to another, a sentence each, with its place in the scene's text: what acts in no
// step of it, and keyframes that lead out of the bounds, where nothing stops a body. Bodies and world are the
// scene's.
std::vector<std::string> doubts_of_script(const scenes::Scene&, const fem::World&, double from_s = 0,
                                          double to_s = std::numeric_limits<double>::infinity());

}  // namespace limber::detail
