// The promises that limber makes of a planned folder.
#pragma once

#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/analysis.h"

namespace limber::detail {

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

}  // namespace limber::detail
