// From what materials give to edges and tets to what kernels walk: each edge goes with one tet that has it,
// all edges of a tet from its node 0, and few stay alone (kernels.h, StarLaw). A spring by itself loads two
// nodes' places, velocities and forces for 35 operations; in a star it loads nothing.
#pragma once

#include "fem/detail/tables.h"

namespace limber::fem::detail {

// Appends the elements of a body, node numbers raised by first_node, as the runs of body number `body`. The
// order is that of the tets, nearly: they are gathered into runs of a kind.
void append_stars(const ElementLists& of_body, int body, int first_node, ElementTables<double>& all);
// Those of one body by itself.
ElementTables<double> stars_of(const ElementLists&);

}  // namespace limber::fem::detail
