#include "limber/motion.h"

#include <fmt/format.h>

#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"
#include "limber/detail/plan/refine.h"
#include "limber/detail/plan/simulate.h"
#include "limber/detail/world/prepare_scene.h"
#include "plan/settings.h"

namespace limber {

using detail::require_in;
using detail::working_for;

namespace {

void require_limits(const std::optional<std::int64_t>& iterations, int in_flight) {
  if (iterations) require_in("iterations", *iterations, 0, plan::iteration_limit);
  require_in("in_flight", in_flight, 0, 4096);
}

void require_out(const std::filesystem::path& out) {
  if (out.empty()) throw InputError("out is empty; name the work folder");
}

}  // namespace

KeptPlan plan_scene(const PlanOptions& options, const Context& context) {
  require_out(options.out);
  if (options.seed) require_in("seed", *options.seed, 0, std::int64_t{1} << 53);
  require_in("portfolio", options.portfolio, 1, 1000);
  require_limits(options.iterations, options.in_flight);
  detail::require_one_of("keep_tree", options.keep_tree, {"all", "path"});
  if (options.shortcut_rounds) require_in("shortcut_rounds", *options.shortcut_rounds, 0, 100'000);
  return working_for(context, [&] { return detail::plan(options); });
}

KeptPlan simulate_scene(const SimulateOptions& options, const Context& context) {
  require_out(options.out);
  return working_for(context, [&] { return detail::simulate(options); });
}

KeptPlan refine_plan(const RefineOptions& options, const Context& context) {
  require_out(options.out);
  require_in("tets_factor", options.tets_factor, 0.1, 1000);
  require_limits(options.iterations, options.in_flight);
  return working_for(context, [&] { return detail::refine(options); });
}

PreparedScene prepare_scene_bodies(const ScenePrepareOptions& options, const Context& context) {
  require_out(options.out);
  return working_for(context, [&] { return detail::prepare_scene(options); });
}

}  // namespace limber
