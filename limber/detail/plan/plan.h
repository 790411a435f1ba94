// Plans of scenes: searched, made better, kept in a work folder.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "limber/motion.h"
#include "plan/anytime.h"
#include "plan/portfolio.h"
#include "plan/refine.h"

namespace limber::detail {

// What `limber plan` finds before it keeps it: a search, or several, and what makes their path better.
// `extra` goes into the summary. `earlier` and its summary: the plan that this one goes on from.
struct Found {
  plan::Plan plan;
  Json extra;
  std::vector<std::string> also_done;  // as of KeptPlan
};
Found find_plan(const scenes::Scene&, const FemSystem&, const PlanOptions&,
                std::optional<plan::Plan> earlier = std::nullopt, const Json& earlier_summary = {});
// The part that comes after the search, or after those of a portfolio.
Found make_better(const scenes::Scene&, const FemSystem&, const PlanOptions&, plan::Plan searched,
                  const std::optional<plan::PortfolioReport>&, const Json& earlier_summary = {});

// Measures the plan's motion, writes plan.npz, volume.svg and the manifest; after a stop signal writes it
// unmeasured. `extra` goes into the summary. With `path_alone` as by leave_path_alone().
KeptPlan keep_plan(const fs::path& folder, const scenes::Scene&, const std::vector<PreparedBody>&,
                   const fem::World&, const FemSystem&, plan::Plan&, const Json& extra,
                   bool path_alone = false);

// Cuts the plan's tree to its path, unless a search can still go on from it (it is not finished, or a signal
// came), or it was carried to finer cages, as `extra` tells. A simulation has no more than its path.
void leave_path_alone(plan::Plan&, const Json& extra, const fs::path& folder);
// Throws InputError where that is asked for, and the scene's film shows the tree.
void require_tree_for_film(const std::string& keep_tree, const scenes::Scene&);

// The same of a motion that is measured already.
KeptPlan keep_measured_plan(const fs::path& folder, const scenes::Scene&, const std::vector<PreparedBody>&,
                            const fem::World&, const FemSystem&, const plan::Plan&, const MotionFigures&,
                            const Json& extra);

scenes::Scene read_scene(const PlanOptions&);
plan::Settings settings_of(const scenes::Scene&, const PlanOptions&);
bool plan_is_up_to_date(const PlanOptions&, const scenes::Scene&);
// Throws InputError where plan.npz cannot be written.
void tell_what_is_replaced(const std::filesystem::path& folder);
// Throws InputError, DiskError, and Interrupted once what was found by then is kept.
KeptPlan plan(const PlanOptions&);
// Of that scene, whatever is there.
KeptPlan plan(const PlanOptions&, const scenes::Scene&);

}  // namespace limber::detail
