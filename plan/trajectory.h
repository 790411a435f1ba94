// A way through the tree as it is simulated: controls from the start, and the states they lead to.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "plan/expansion.h"
#include "plan/tree.h"

namespace limber::plan {

struct Trajectory {
  std::vector<Control> controls;  // from the start; with settle_steps > 0 the last one is the settle
  std::int32_t settle_steps = 0;
  double frames_per_second = 30;
  std::vector<State>
      frames;  // [f]: the state at the whole step nearest to f / frames_per_second, up to the end
  State end;   // after the last control
};
std::uint64_t hash_of(const Trajectory&);  // of its controls, frames and end

// Throws InputError where steps of this length would give other frames, or more of them: so a replay has as
// many frames as the file that it is read from. `what` begins the text.
void require_frame_times(const Trajectory&, double dt_s, const std::string& what);

// Applies the controls to the system's start. Where the dynamics diverge it stops, and the frames end there.
// Throws Interrupted after a stop signal.
Trajectory simulate(const System&, const std::vector<Control>&, double frames_per_second);

// Whether the settle brings the robot to rest within its time, with its centre of mass in the goal and as the
// goal asks. Where no settle is asked for (its duration is 0), whether it is as the goal asks.
bool comes_to_rest(const System&, const Settings&, const State& in_goal);

// The simulated path to a node; `settle` adds interpolation towards the goal until the robot rests or the
// settle's time is up. An InternalError when the simulation does not end in the node's very state.
Trajectory trajectory_to(const System&, const Settings&, const Tree&, int node, bool settle);

// The same without a settle, and after a stop signal for at most so long: nothing where that is too short.
std::optional<Trajectory> trajectory_within(double grace_s, const System&, const Settings&, const Tree&,
                                            int node);

}  // namespace limber::plan
