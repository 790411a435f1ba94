#include "limber/farm.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"
#include "limber/detail/farm/farm.h"
#include "limber/detail/farm/work.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"

namespace limber {

using detail::working_for;

std::string name_of(Stage stage) {
  detail::require_in("the stage's number", int(stage), 0, int(stage_names.size()) - 1);
  return stage_names[std::size_t(stage)];
}

Stage stage_named(const std::string& name) {
  const auto found = std::find(stage_names.begin(), stage_names.end(), name);
  if (found == stage_names.end())
    throw InputError(fmt::format("{} is no stage; they are {}", name, fmt::join(stage_names, ", ")));
  return Stage(found - stage_names.begin());
}

std::string name_of(FarmStatus::State state) {
  constexpr const char* names[] = {"done", "at work", "failed", "cancelled", "stopped"};
  return names[std::size_t(state)];
}

FarmStatus farm_status(const std::filesystem::path& work_folder, const Context& context) {
  return working_for(context, [&] { return detail::farm_status(work_folder); });
}

Submitted submit_to_farm(const FarmOptions& options, const Context& context) {
  detail::require_limber_itself(context, "limber farm");
  detail::require_one_of("keep_tree", options.plan.keep_tree, {"all", "path"});
  return working_for(context, [&] { return detail::submit(options); });
}

Cancelled cancel_farm(const std::filesystem::path& work_folder, const Context& context) {
  return working_for(context, [&] { return detail::cancel_farm(work_folder); });
}

WorkDone work_at_farm(const WorkOptions& options, const Context& context) {
  return working_for(context, [&] { return detail::work(options); });
}

}  // namespace limber
