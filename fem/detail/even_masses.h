// Masses of nodes with which a body steps faster and moves alike. A quarter of each tet's mass goes to each
// of its nodes, and where the cage has a corner of one or two small tets that node has a hundredth of what
// the others have: its oscillation is the fastest of the body, and of the world, and nobody sees it.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

// Moves up to 2 % of the mass of a deformable body to its lightest nodes, so that mass, centre of mass and
// inertia tensor of each of its pieces are what they were (to 1e-9). Nothing where the step would grow by
// less than a fifth. Method and figures: docs/dynamics.md, "Masses of nodes".
void even_masses(Body&);

}  // namespace limber::fem::detail
