// Plans of scenes: searched, made better, kept in a work folder.
#pragma once

#include <limits>
#include <optional>

#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "plan/anytime.h"
#include "plan/portfolio.h"
#include "plan/refine.h"

namespace limber::detail {

struct PlanOptions {
  SceneOptions scene;
  fs::path out;
  std::optional<std::int64_t> seed, iterations;
  int portfolio = 1;   // searches, with this seed and those after it, of which the quickest wins
  std::string preset;  // empty: the scene's
  double time_limit_s = std::numeric_limits<double>::infinity();
  int in_flight = 0;  // 0: chosen from threads and lanes
  bool resume = false;
  std::optional<fs::path> stats;  // JSON lines: how the search went
  fs::path from;                  // a folder with a plan or a simulation; empty: the scene's start
  std::optional<int> frame;       // of `from`; nothing: its last

  std::optional<int> shortcut_rounds;  // nothing: the scene's
  std::string cost = "duration";       // what shortcutting and improving make less of
  bool improve = false;                // go on after the first solution
};

// What came before the path that is kept, as far as this call did it.
struct HowFound {
  std::optional<plan::PortfolioReport> portfolio;
  std::optional<plan::ShortcutReport> shortcut;
  std::optional<plan::AnytimeReport> improve;
  std::optional<plan::RefineReport> refine;
};

// What `limber plan` finds before it keeps it: a search, or several, and what makes their path better.
// `extra` goes into the summary. `earlier` and its summary: the plan that this one goes on from.
struct Found {
  plan::Plan plan;
  Json extra;
  HowFound how;
};
Found find_plan(const scenes::Scene&, const FemSystem&, const PlanOptions&,
                std::optional<plan::Plan> earlier = std::nullopt, const Json& earlier_summary = {});
// The part that comes after the search, or after those of a portfolio.
Found make_better(const scenes::Scene&, const FemSystem&, const PlanOptions&, plan::Plan searched,
                  const std::optional<plan::PortfolioReport>&, const Json& earlier_summary = {});

// A plan or a simulation in its work folder.
struct KeptPlan {
  fs::path file;  // plan.npz
  Json summary;   // as plan.npz and manifest.json have it
  bool is_simulation = false;
  bool reached = false;     // its goal; of a simulation: it has not diverged
  bool measured = true;     // else a signal ended it, and its summary has no figures
  bool up_to_date = false;  // it was there
  HowFound how = {};
};

// Measures the plan's motion, writes plan.npz, volume.svg and the manifest; after a stop signal writes it
// unmeasured. `extra` goes into the summary.
KeptPlan keep_plan(const fs::path& folder, const scenes::Scene&, const std::vector<PreparedBody>&,
                   const fem::World&, const FemSystem&, plan::Plan&, const Json& extra);

// The same of a motion that is measured already.
KeptPlan keep_measured_plan(const fs::path& folder, const scenes::Scene&, const std::vector<PreparedBody>&,
                            const fem::World&, const FemSystem&, const plan::Plan&, const MotionFigures&,
                            const Json& extra);

scenes::Scene read_scene(const PlanOptions&);
plan::Settings settings_of(const scenes::Scene&, const PlanOptions&);
bool plan_is_up_to_date(const PlanOptions&, const scenes::Scene&);
// Throws InputError, DiskError, and Interrupted once what was found by then is kept.
KeptPlan plan(const PlanOptions&);
// Of that scene, whatever is there.
KeptPlan plan(const PlanOptions&, const scenes::Scene&);

}  // namespace limber::detail
