// Draws the boundary of a cage towards the surface that it holds, and never lets the surface out
// (docs/cage.md, step 8).
#pragma once

#include "meshing/quality.h"
#include "meshing/surface_tree.h"

namespace limber::meshing::detail {

struct FitLimits {
  double gap_m;    // aimed at between cage and surface
  TetLimits tets;  // kept by every tet; one that is lower already does not get lower
};

// Moves vertices of `mesh`, whose boundary must not meet the surface and whose tets must keep the limits. A
// vertex moves only where what its boundary triangles sweep does not meet the surface: so what was inside
// stays inside. Returns the number of passes made.
int shrink_fit(const SurfaceTree& surface, const FitLimits& limits, TetMesh& mesh);

}  // namespace limber::meshing::detail
