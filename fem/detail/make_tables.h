// From bodies to the flat arrays of the world that steppers read (tables.h). They are made in double, body
// after body, moving bodies first; the float ones are their roundings, made once at the end. A rigid body
// has a table of its own in double alone, since its steps are computed in double whatever its nodes are in.
// Tables of fine surfaces are made elsewhere (make_surface_tables.h).
#pragma once

#include "fem/detail/tables.h"
#include "fem/world.h"

namespace limber::fem::detail {

// Appends the elements of a body to those of the world, whose node numbers are higher by first_node.
void append(const ElementLists& of_body, int first_node, ElementLists& all);
// Appends masses and rest places of a body's nodes.
void append_nodes(const Body&, Tables<double>&);
RigidTable make_rigid(const Body&);
// The same in float, and with the elements in blocks, too.
Tables<float> single_precision(const Tables<double>&);

}  // namespace limber::fem::detail
