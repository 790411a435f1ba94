// How much of a cage joins what the model keeps apart.
#pragma once

#include "meshing/detail/lattice_cage.h"

namespace limber::meshing::detail {

// Share of the tets that meet the surface in which two pieces of it lie that only the air joins. Pieces:
// triangles that meet the tet, joined over edges that meet it. Two pieces belong together when the middle
// between two near points of them is inside the model. An estimate: it asks one middle a pair of pieces.
double glued_share(const CageModel&, const SurfaceMesh&, const TetMesh&);

}  // namespace limber::meshing::detail
