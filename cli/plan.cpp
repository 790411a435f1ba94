#include "limber/detail/plan/plan.h"

#include "cli/kept_plan.h"
#include "limber/detail/plan/refine.h"

namespace limber::cli {

Outcome plan(const detail::PlanOptions& options) {
  const detail::KeptPlan kept = detail::plan(options);
  return outcome_of(kept, text_of_beginning(kept, options.from));
}

Outcome refine(const detail::RefineOptions& options) { return outcome_of(detail::refine(options)); }

}  // namespace limber::cli
