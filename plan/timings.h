// What a run cost, told apart from what came of it: costs depend on the clock and on how many threads there
// were, so that they lie in a file of their own, and plan.npz of the same scene and seed has the same bytes.
#pragma once

#include "core/json.h"

namespace limber::plan {

// Within what is told of a plan: seconds, rollouts computed in vain and whatever stands in "dynamics".
bool is_timing(const std::string& key);

// The same without them, in the same order.
Json without_timings(const Json& told);

// Those alone, in the tables (and rows of lists) that they stand in; null where there are none.
Json timings_of(const Json& told);

// Puts them back, each at the end of its table. Tables that `told` has not get none.
Json with_timings(Json told, const Json& timings);

}  // namespace limber::plan
