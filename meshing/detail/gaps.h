// Parts a cage where pieces of the model face each other over a gap that its tets bridge (docs/cage.md).
#pragma once

#include "meshing/detail/glued.h"

namespace limber::meshing::detail {

struct GapLimits {
  double spacing_m;  // of the lattice; wider gaps are left to it
  TetLimits tets;    // kept by what splitting makes
  int max_tets;      // no edge is split beyond that number
};

// Gives the edges of glued tets a vertex in the middle of the gap that they cross. The union of the tets
// stays what it was, but for the rounding of vertices on boundary edges, which is proved not to let the
// surface out.
void split_at_gaps(const CageModel&, const GapLimits&, TetMesh&);

// Without the tets of nothing but air, and disconnected over faces in the air: such a face meets no surface
// and lies outside the model. Where the boundary would be no manifold all stays as it was. `mesh` has a
// manifold boundary that meets no surface; so has the answer, and holds the surface as `mesh` does.
TetMesh open_gaps(const CageModel&, const TetMesh& mesh);

}  // namespace limber::meshing::detail
