// Several searches of one query side by side, that differ in their seeds; the quickest wins. Method:
// docs/planning.md.
#pragma once

#include <vector>

#include "plan/search.h"

namespace limber::plan {

struct PortfolioReport {
  struct Search {
    std::uint64_t seed = 0;
    std::int64_t iterations = 0;
    bool solved = false;
  };
  std::vector<Search> searches;  // ascending by seed
  std::int64_t iterations = 0;   // of all together
  double cpu_s = 0, wall_s = 0;
};
Json json_of(const PortfolioReport&);

// The plan of that seed among settings.seed … settings.seed + searches − 1 (2 … 1000 of them) whose search
// solves the query in the fewest iterations, the least seed of equals: the plan that `plan` makes with that
// seed. None is decided by the clock, so the plan is the same for any number of threads. All searches take
// turns, each up to 16, 32, 64 … iterations, and none goes on for longer than what already won would leave
// it. settings.max_iterations is the limit of each; the time limit and a signal end all. Where none solves
// it, the plan whose best node got farthest (by goals reached, then by distance).
Plan portfolio(const System&, const Settings&, int searches, PortfolioReport* = nullptr);

}  // namespace limber::plan
