// Checks of a plan against its scene: nothing that the plan says of itself is taken for granted.
#pragma once

#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/verify/promises.h"
#include "limber/detail/world/analysis.h"

namespace limber::detail {

// Replays the path and searches anew, by what the scene says; a simulation is replayed alone. `figures` are
// overwritten by those of the replay. Throws Interrupted after a stop signal.
void check_plan(const fs::path& folder, const PlanFolder&, const std::vector<PreparedBody>&,
                const fem::World&, MotionFigures& figures, Promises&);

// What is promised of every frame of any motion: volume, inverted tets, penetration or what is seen, stretch.
void check_shapes(const MotionFigures&, const fem::World&, Promises&);

// That the folder's other files show this plan: manifest.json, tree.svg, volume.svg, volume.png.
void check_pictures(const fs::path& folder, const PlanFolder&, const fem::World&, const MotionFigures&,
                    Promises&);

}  // namespace limber::detail
