// A plan carried to finer cages of the same bodies, in another work folder.
#pragma once

#include "limber/detail/plan/plan.h"

namespace limber::detail {

// Throws InputError where the plan does not reach its goal, and as plan().
KeptPlan refine(const RefineOptions&);

}  // namespace limber::detail
