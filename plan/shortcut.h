// Makes a path that solves the query shorter, or gentler, by trying changes of its controls and simulating
// what they lead to. Method and figures: docs/planning.md.
#pragma once

#include "plan/control_rollout.h"
#include "plan/search.h"

namespace limber::plan {

struct ShortcutSettings {
  int rounds = 0;       // of sixteen changes each, side by side
  int rounds_done = 0;  // of an earlier call, from whose path this one goes on
  int keep = 0;         // so many controls at the beginning stay as they are
  CostKind cost = CostKind::duration;
};

struct ShortcutReport {
  ShortcutSettings settings;  // rounds_done with those that are done now: less than rounds after a signal
  int accepted = 0;           // changes
  Costs before, after;
  double cpu_s = 0, wall_s = 0;
};
Json json_of(const ShortcutReport&);

// The controls from the start as a course that is measured; the settle follows by itself.
ControlRollout path_of(const System&, const Settings&, const std::vector<Control>&);

// Each round takes the cheapest of its changes, where it costs less than the path and lasts no longer, rests
// in the goal, and is acceptable at every frame time; so neither cost nor duration ever grows. `path` is one
// of path_of() that rests in the goal. Changes are drawn from (settings.seed, round): the same bytes for any
// number of threads. A signal (core/progress.h) ends it between rounds.
ControlRollout shortcut(const System&, const Settings&, const ShortcutSettings&, ControlRollout path,
                        ShortcutReport&);

// The same for a solved plan, on the last of its legs: the new path becomes a branch of its tree (iteration
// −1), the new goal_node its end. Nothing happens where there are no rounds to do.
ShortcutReport shorten(const System&, Plan&, const ShortcutSettings&);

// How many controls of the path to best_node come before each leg.
std::vector<int> controls_before_legs(const Plan&);

// Makes a path from the tree's start that rests in the goal the plan's own, its legs beginning after so many
// controls; nodes that it shares with the path to best_node are shared.
void adopt(const System&, Plan&, const ControlRollout&, const std::vector<int>& controls_before_legs);

}  // namespace limber::plan
