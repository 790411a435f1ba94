// Linear tets bend and change shape too stiffly, and the more so the fewer they are. How much, for one body.
#pragma once

#include <vector>

#include "core/mesh.h"
#include "fem/detail/tables.h"

namespace limber::fem::detail {

struct Lame {
  double mu, lambda;  // Pa
};

// How far the elements give way to loads, as a share of how far their material would: multiplied by it their
// stiffness is the material's. The loads are a uniform force along each axis where nodes are fixed, and
// otherwise those that excite the four softest modes; the one that moves the body farthest counts most. The
// material's answer is that of quadratic tets (up to 1,500 tets also with each cut in eight, and
// extrapolated). Meshes of more than 20,000 tets are taken to be fine enough: 1. A multiple of 1/512. Method:
// docs/dynamics.md.
struct LockingShare {
  double share = 1;
  bool is_found = true;  // false: the solves did not get as near as they should, and it is a guess
};
LockingShare locking_share(const TetMesh& rest, const std::vector<bool>& fixed,
                           const std::vector<Lame>& of_tet, const std::vector<double>& node_mass,
                           const ElementLists& elements);

}  // namespace limber::fem::detail
