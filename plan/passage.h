// How wide the widest way to the goal is, as far as rigid bodies and walls go: what a search cannot change.
#pragma once

#include "plan/settings.h"
#include "plan/system.h"

namespace limber::plan {

// Radius, in metres, of the largest ball that gets from `from` into the goal between what is rigid and, where
// there are any, the walls; at most half a cell below 0 where not even a point does. Openings narrower than a
// cell are not seen, and bodies thinner than a cell may not be. (The path whose narrowest place is widest, by
// Dijkstra's order; 26 neighbours.)
double widest_passage_m(const Workspace&, const Vec3& from, const Goal&);

}  // namespace limber::plan
