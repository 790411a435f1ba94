// A simulation that begins where another motion was.
#pragma once

#include "app/plan_folder.h"

namespace limber::app {

// Frame `frame` of the plan or simulation in `folder`, as plan.npz has it, positions and velocities bit for
// bit: of each body that moves in both worlds, at the step nearest to the time of that frame. Bodies that the
// other world lacks, or holds, are where the scene has them, kinematic ones where their keyframes have them
// then. Throws InputError where there is no such frame, nothing that can be pushed here can be there, a body
// has another cage there, or a kinematic body was elsewhere.
State start_from(const fs::path& folder, const PlanFolder& other, int frame, const scenes::Scene&,
                 const fem::World&);

}  // namespace limber::app
