// A plan carried to finer cages of the same bodies, in another work folder.
#pragma once

#include "limber/detail/plan/plan.h"

namespace limber::detail {

struct RefineOptions {
  fs::path folder, out;
  double tets_factor = 4;
  std::vector<std::string> sets;  // after those of the plan and of the factor
  std::vector<fs::path> data;
  fs::path store;  // as of SceneOptions
  std::optional<std::int64_t> iterations;
  double time_limit_s = std::numeric_limits<double>::infinity();
  int in_flight = 0;
};
// Throws InputError where the plan does not reach its goal, and as plan().
KeptPlan refine(const RefineOptions&);

}  // namespace limber::detail
