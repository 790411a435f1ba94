// From bodies to the flat arrays of the world that steppers read.
#pragma once

#include "fem/detail/tables.h"
#include "fem/world.h"

namespace limber::fem::detail {

// Appends the elements of a body to those of the world. Ranges are already there, one a body.
void append(const ElementTables<double>& of_body, int body, int first_node, ElementTables<double>& all);
// Appends masses and rest places of a body's nodes.
void append_nodes(const Body&, Tables<double>&);
RigidTable make_rigid(const Body&);
// The same in float, and with the elements in blocks, too.
Tables<float> single_precision(const Tables<double>&);

}  // namespace limber::fem::detail
