#include "cli/kept_plan.h"

namespace limber::cli {

Outcome plan(const PlanOptions& options) {
  return outcome_of(plan_scene(options, at_terminal()),
                    [&](const Json& summary) { return text_of_beginning(summary, options.from); });
}

Outcome refine(const RefineOptions& options) { return outcome_of(refine_plan(options, at_terminal())); }

}  // namespace limber::cli
