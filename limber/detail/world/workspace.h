// What stands where at the start, on a grid.
#pragma once

#include <optional>

#include "fem/world.h"
#include "plan/system.h"

namespace limber::detail {

// The cells whose middle lies in a tet of another body than the robot: a quarter of the robot's inner radius
// wide, or as wide as it takes to have no more than 200,000 (with holes 40,000). `start`: nothing, where the
// world begins.
plan::Workspace workspace_of(const fem::World&, const std::optional<State>& start = std::nullopt,
                             const std::vector<plan::Hole>& = {});

}  // namespace limber::detail
