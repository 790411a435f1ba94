// Draws the boundary of a cage towards the surface that it holds, and never lets the surface out
// (docs/cage.md, step 7).
#pragma once

#include "meshing/surface_tree.h"

namespace limber::meshing::detail {

struct FitLimits {
  double gap_m;                               // aimed at between cage and surface
  double min_dihedral_deg, max_dihedral_deg;  // kept by every tet
};

// Moves vertices of `mesh`, whose boundary must not meet the surface and whose tets must keep the limits. A
// vertex moves only where what its boundary triangles sweep does not meet the surface: so what was inside
// stays inside. Returns the number of passes made.
int shrink_fit(const SurfaceTree& surface, const FitLimits& limits, TetMesh& mesh);

}  // namespace limber::meshing::detail
