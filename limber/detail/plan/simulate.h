// Scenes left to themselves, and motions that begin where another one was.
#pragma once

#include "limber/detail/plan/plan.h"

namespace limber::detail {

// Initial velocities, forces and motions that the scene tells; no search. Throws as plan().
KeptPlan simulate(const SimulateOptions&);

// Frame `frame` of the plan or simulation in `folder`, as plan.npz has it, positions and velocities bit for
// bit: of each body that moves in both worlds, at the step nearest to the time of that frame. Bodies that the
// other world lacks, or holds, are where the scene has them, kinematic ones where their keyframes have them
// then. Throws InputError where there is no such frame, nothing that can be pushed here can be there, a body
// has another cage there, or a kinematic body was elsewhere.
State start_from(const fs::path& folder, const PlanFolder& other, int frame, const scenes::Scene&,
                 const fem::World&);

struct Beginning {
  std::optional<State> start;         // nothing: the scene's
  std::optional<BeginningTold> from;  // what the summary tells of it; nothing likewise
};
// The motion that another begins from, and which of its frames: without a number the last. Nothing where
// `from` is empty; then there is no frame either. Throws InputError.
struct OtherMotion {
  fs::path folder;
  PlanFolder planned;
  int frame;
};
std::optional<OtherMotion> read_other_motion(const fs::path& from, std::optional<int> frame);
// The summary is of a motion in `out`. Throws as start_from.
Beginning beginning_of(const std::optional<OtherMotion>&, const fs::path& out, const scenes::Scene&,
                       const fem::World&);
// Throws InputError where they are one: what begins there would write over it.
void require_other_folder(const fs::path& from, const fs::path& out);

}  // namespace limber::detail
