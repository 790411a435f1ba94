// From cages to the connectivity that contact between cages reads (Topology in tables.h): faces of tets and
// the tets behind them, contact points with their mesh edges, and what a body that touches itself needs.
// Contact on fine surfaces reads tets of it, too. It depends on the meshes and the rest shape alone. Throws
// InputError where a face joins three tets.
#pragma once

#include "fem/detail/tables.h"
#include "fem/world.h"

namespace limber::fem::detail {

// Appends a body's tets and contact points. Its first_node and first_tet, and a place for it in
// topology.bodies, are there.
void append_topology(const Body&, int index, Topology&);

}  // namespace limber::fem::detail
