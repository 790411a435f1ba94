// Makes a cage of fewer tets by collapsing edges, and never lets the surface out (docs/cage.md).
#pragma once

#include "meshing/detail/glued.h"

namespace limber::meshing::detail {

// Collapses edges, shortest first, until there are no more than `tets`, or none is left that may be: every
// tet keeps the limits, none that was not glued becomes so, and the boundary moves only inwards, where what
// it sweeps does not meet the surface.
void coarsen(const CageModel&, const TetLimits&, int tets, TetMesh& mesh);

}  // namespace limber::meshing::detail
