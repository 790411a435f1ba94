// Controls run one after the other, several courses side by side, as far as the robot's rest in the goal.
// Method: docs/planning.md.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "plan/settings.h"

namespace limber::plan {

// What a motion costs, its settle included.
struct Costs {
  double duration_s = 0;       // since the system's start
  double effort_n_s = 0;       // ∫|f|dt; of an interpolation the most that it may exert
  double strain_energy_j = 0;  // the largest on the way, as is
  double volume_change = 0;    // this; of System::measures at every frame time
};
enum class CostKind { duration, effort, strain, volume };
double cost_in(const Costs&, CostKind);
const char* name_of(CostKind);
CostKind cost_kind_from(const std::string& name);  // throws InputError naming those that there are
Json json_of(const Costs&);

struct ControlRollout {
  State from;
  std::vector<Control> controls;  // in; out: those that were run, with the one that reaches for the goal
  // Instead: asked at the start and at each control's end for the next, from the state reached; nothing: they
  // are over. A control has a step at least.
  std::function<std::optional<Control>(const State&)> next = {};
  Costs costs;  // in: of what led to `from`; out: of all
  std::int64_t last_step = std::numeric_limits<std::int64_t>::max();  // who lasts longer ends as too_costly
  // Where the controls end outside the goal, interpolation of at most this force goes on until the robot is
  // in it; it wants a last_step. 0: it does not.
  double reach_force_n = 0;

  enum Result { rests_in_goal, ends_elsewhere, not_acceptable, diverged, too_costly } result = diverged;
  std::vector<State> states;           // out: after each of `controls`, as far as they were run
  std::vector<Costs> costs_of_states;  // out: of all that led to each of `states`
  int settle_steps = 0;                // out: of the settle that follows them
  std::vector<State> frames;           // out: at the frame times from `from` on, as Trajectory::frames
  State end;                           // out: the last state
};

struct ControlRolloutOptions {
  enum Settle { never, in_goal, anywhere } settle = in_goal;  // where the controls may end for it to begin
  bool keep_frames = false;
  // At frame times, and at the ends of controls.
  bool ask_acceptable = true;
  bool measure = false;  // fills strain_energy_j and volume_change
  // A course ends as too_costly once it costs more than this, or than one that rests in the goal.
  CostKind cost = CostKind::duration;
  double most = std::numeric_limits<double>::infinity();
  bool race = false;
  // Throws Interrupted soon after a stop signal, as where there is nothing_to_keep(); else whoever calls has
  // something to keep. With a grace it goes on that long after the signal.
  bool stoppable = false;
  double grace_s = 0;
  std::function<void(const State&)> on_progress = {};  // called with every frame that is kept
};

// Fills what is out. A course depends on itself and the options alone, save that `race` ends losers sooner or
// later: the cheapest of them, and the first of equals, is the same for any number of lanes and threads.
void run(const System&, const Settings&, std::span<ControlRollout>, const ControlRolloutOptions&);

// Rest is no moment without speed, as where a robot turns back: what is slow now must be so at five looks in
// the next 0.05 s, under what holds it. Where no settle is asked for, all is at rest.
bool rests(const System&, const Settle&, const State&, Control held_by);

// Whether System::first_refused lets all frames of a course that was run and rests in the goal pass. Runs it
// again. Throws Interrupted.
bool may_be_shown(const System&, const Settings&, const ControlRollout&);

}  // namespace limber::plan
