// From cages to the connectivity that contact reads.
#pragma once

#include "fem/detail/tables.h"
#include "fem/world.h"

namespace limber::fem::detail {

// Appends a body's tets and contact points. Its first_node and first_tet, and a place for it in
// topology.bodies, are there.
void append_topology(const Body&, int index, Topology&);

}  // namespace limber::fem::detail
