// How much of a cage joins what the model keeps apart.
#pragma once

#include "meshing/detail/lattice_cage.h"

namespace limber::meshing::detail {

// Whether two pieces of the surface lie in a tet that only the air joins. Pieces: triangles that meet the
// tet, joined over edges that meet it. Two pieces belong together when the middle between two near points of
// them is inside the model. An estimate: it asks one middle a pair of pieces.
bool is_glued(const CageModel&, const std::array<Vec3, 4>& tet);

struct GluedTets {
  std::vector<char> glued;  // of each tet
  int meeting = 0;          // tets that meet the surface
  double share() const;     // of these, that are glued
};
GluedTets glued_tets(const CageModel&, const TetMesh&);

}  // namespace limber::meshing::detail
