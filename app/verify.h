// The promises that limber makes of a planned folder.
#pragma once

#include "app/analysis.h"
#include "app/plan_folder.h"

namespace limber::app {

// Checks every promise, as `limber verify` prints them; `figures` are overwritten by those of the replay.
Outcome verify_plan(const PlanFolder&, const std::vector<PreparedBody>&, const fem::World&,
                    MotionFigures& figures);

}  // namespace limber::app
