#include "limber/motion.h"

#include "limber/detail/interface/working_for.h"
#include "limber/detail/plan/refine.h"
#include "limber/detail/plan/simulate.h"
#include "limber/detail/world/prepare_scene.h"

namespace limber {

using detail::working_for;

KeptPlan plan_scene(const PlanOptions& options, const Context& context) {
  return working_for(context, [&] { return detail::plan(options); });
}

KeptPlan simulate_scene(const SimulateOptions& options, const Context& context) {
  return working_for(context, [&] { return detail::simulate(options); });
}

KeptPlan refine_plan(const RefineOptions& options, const Context& context) {
  return working_for(context, [&] { return detail::refine(options); });
}

PreparedScene prepare_scene_bodies(const ScenePrepareOptions& options, const Context& context) {
  return working_for(context, [&] { return detail::prepare_scene(options); });
}

}  // namespace limber
