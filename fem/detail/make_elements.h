// From a body's material to the elements of its cage, whose forces the kernels compute (kernels.h has the
// laws). The order in build_world: bodies, then their shares of stiffness, which are found from elements of
// share 1, then elements with that share, then the largest step that these allow. Only deformable bodies
// that move have elements. Formulas and sources: make_elements.cpp and docs/dynamics.md.
#pragma once

#include <vector>

#include "fem/detail/tables.h"
#include "fem/world.h"

namespace limber::fem::detail {

// On the body's own node numbers, without blocks. Needs stiffness_share.
ElementLists make_elements(const Body&);
// Sets stiffness_share of all bodies where it is 0, in parallel: 1 unless mesh_independent.
void find_stiffness_shares(std::vector<Body>&);
// Of the damped elastic body, seconds.
double largest_stable_step(const Body&, const ElementLists&);

}  // namespace limber::fem::detail
