// The promises that limber makes of a planned folder.
#pragma once

#include "app/analysis.h"
#include "app/plan_folder.h"

namespace limber::app {

// What is promised of what is seen, as shares of the robot's size (longest edge of its fine surface's box at
// rest) and as stretches. While `promised` is false, verify says what it measured and promises nothing.
struct SeenLimits {
  bool promised = false;
  double overlap = 0.005, self_overlap = 0.005;
  double median_gap = 0.01, worst_gap = 0.02;
  double least_stretch = 0.5, largest_stretch = 2;
};
inline constexpr SeenLimits seen_limits;

// Checks every promise, as `limber verify` prints them; `figures` are overwritten by those of the replay.
Outcome verify_plan(const PlanFolder&, const std::vector<PreparedBody>&, const fem::World&,
                    MotionFigures& figures);

}  // namespace limber::app
