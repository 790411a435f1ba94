// Goes on after the first solution: searches again under a bound on the cost, and keeps the best path.
// Method: docs/planning.md.
#pragma once

#include "plan/shortcut.h"

namespace limber::plan {

struct AnytimeSettings {
  CostKind cost = CostKind::duration;
  int shortcut_rounds = 0;  // of each path that a search finds
};

struct Improvement {
  double wall_s = 0;            // since improving began
  std::int64_t iterations = 0;  // of all searches so far, the first included
  int search = 0;               // 1 is the first that follows the plan's own
  Costs costs;
};

struct AnytimeReport {
  AnytimeSettings settings;
  Costs first;
  std::vector<Improvement> improvements;  // each cheaper than the one before
  int searches = 0, solved = 0;
  std::int64_t iterations = 0;
  Ending ending = Ending::iterations;  // what ended it: iterations, time or a signal
  double cpu_s = 0, wall_s = 0;
};
Json json_of(const AnytimeReport&);

// The plan is solved. Search k draws from seed + k; where the cost is the duration, it takes no node whose
// time and the time that it needs to the goal at least (as a mass that only the largest force drives) reach
// the bound: the best path's duration, half as long again where shortcuts follow. Each search is given twice
// the iterations of the plan's own, 200 at least, until settings.max_iterations are used up by all together,
// the time limit has passed since `improve` began, or a signal came. The best path becomes a branch of the
// plan's tree. The same bytes for any number of threads, unless time or a signal ended it.
AnytimeReport improve(const System&, Plan&, const AnytimeSettings&);

}  // namespace limber::plan
