// From what was asked for to a Body: its rest cage, masses, and what kind it is.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

// Checks the spec first. first_node, first_tet, stiffness_share and elastic_dt_limit_s are set later.
Body make_body(const BodySpec&);
// The centre of mass of a body whose nodes are there (N × 3).
Vec3 center_of(const Body&, const Points& positions);
double mean_edge(const Body&);  // of the rest cage's tets, metres; edges that tets share count for each

}  // namespace limber::fem::detail
