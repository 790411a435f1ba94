// The promises that limber makes of a planned folder.
#pragma once

#include "app/analysis.h"
#include "app/plan_folder.h"

namespace limber::app {

// What is promised of what is seen, as shares of the robot's size (longest edge of its fine surface's box at
// rest), where contact is on the surfaces; and what the report marks of stretch, which a scene may promise.
struct SeenLimits {
  double overlap = 0.005, self_overlap = 0.005;
  double median_gap = 0.01, worst_gap = 0.02;
  double least_stretch = 0.5, largest_stretch = 2;
};

// A scene that whoever asks trusts, and the folders of its models.
struct TrustedScene {
  std::string name;  // as it was asked for
  scenes::Scene scene;
  std::vector<fs::path> data;
};

// What is asked beyond what the files say.
struct VerifyDepth {
  std::optional<TrustedScene> trusted;
  bool remake = false;  // shells, too, are made again, whatever that costs
};

// Checks every promise of a work folder, as `limber verify` prints them; `figures` are overwritten by those
// of the replay.
Outcome verify_plan(const fs::path& folder, const PlanFolder&, const std::vector<PreparedBody>&,
                    const fem::World&, MotionFigures& figures, const VerifyDepth& = {});

}  // namespace limber::app
