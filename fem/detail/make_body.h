// From what was asked for to a Body: its rest cage in float32, its masses, what kind it is, and what
// follows from the mesh alone. Nothing here knows of other bodies, of the step or of contact; those parts
// of a Body are set by build_world, when all bodies are there. Also two measures of a body that several
// others ask for. Metres and kilograms.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

// Checks the spec first. first_node, first_tet, stiffness_share and elastic_dt_limit_s are set later.
Body make_body(const BodySpec&);
// The centre of mass of a body whose nodes are there (N × 3).
Vec3 center_of(const Body&, const Points& positions);
double mean_edge(const Body&);  // of the rest cage's tets, metres; edges that tets share count for each

}  // namespace limber::fem::detail
