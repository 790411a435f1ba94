// The promises that limber makes of a planned folder, or of a body's.
#pragma once

#include <optional>

#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/verify/promises.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/scene_world.h"

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

struct Verified {
  Promises promises;
  std::optional<MotionFigures>
      motion;  // of the replay; nothing of a body, and of a plan that cannot be replayed
  std::optional<Verdict::Scene> scene;  // likewise
};

// Checks every promise of a work folder; `figures` are overwritten by those of the replay.
Verified verify_plan(const fs::path& folder, const PlanFolder&, const std::vector<PreparedBody>&,
                     const fem::World&, MotionFigures& figures, const VerifyDepth& = {});

// Of a work folder, or of one that prepare has written. Throws InputError where it is neither. `trusted`,
// where it is there, in place of the scene that the options name.
Verified verify(const VerifyOptions&, std::optional<TrustedScene> trusted = {});

}  // namespace limber::detail
