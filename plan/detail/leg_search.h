// One search from the root of a plan's last leg to that leg's goal.
#pragma once

#include <chrono>
#include <optional>

#include "plan/search.h"

namespace limber::plan::detail {

using Clock = std::chrono::steady_clock;

// Grows the plan's tree until the goal, a limit or a stop ends the search, and tells in the plan how it
// ended. `system` and `settings` are those of the last leg; time limits count from `started`. Returns the
// trajectory to the goal where it was run to judge it. Throws what a rollout threw.
std::optional<Trajectory> search_leg(const System&, const Settings&, Plan&, const ProgressCallback&,
                                     Clock::time_point started);

}  // namespace limber::plan::detail
