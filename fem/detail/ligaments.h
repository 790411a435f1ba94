// From what was asked for to ligaments on nodes, and the longest step that they leave stable.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

// Bodies are numbered and have their nodes. Throws InputError naming ligament and body: no such body, none
// that moves, one body twice, a point away from its body, no node within its radius, numbers out of range.
Ligament make_ligament(const LigamentSpec&, const World&);

// The largest h at which velocity first, place second is stable for the damped springs alone; infinite
// without any.
double largest_stable_step(const std::vector<Ligament>&);

}  // namespace limber::fem::detail
