// What is true of a tet mesh as a cage of a surface.
#pragma once

#include "tools/check_cage/solid.h"

namespace check {

struct CageFacts {
  std::size_t surface_vertices = 0, surface_triangles = 0;
  std::size_t vertices_outside = 0;  // in no closed tet; exact
  std::size_t triangles_crossing =
      0;  // an edge pierces the inside of a boundary triangle, or the other way; exact
  std::size_t triangles_meeting =
      0;  // have a point in common with the boundary, those that cross included; exact
  std::size_t tets = 0, tets_not_positive = 0;  // exact
  // Faces that more than two tets name, or two from the same side.
  std::size_t faces_overfull = 0;
  std::size_t boundary_triangles = 0, boundary_edges_not_manifold = 0, boundary_vertices_not_manifold = 0;
  // Pairs of boundary triangles without a common node that cross: the cage overlaps itself; exact.
  std::size_t boundary_pairs_crossing = 0;
  int components = 0;  // of tets joined by faces
  double volume = 0, surface_volume = 0;
  bool surface_closed = false;  // each edge is used as often in one direction as in the other
  double min_dihedral_deg = 0, max_dihedral_deg = 0,
         median_dihedral_deg = 0;  // the median of each tet's smallest
  std::size_t tets_at_surface = 0, tets_glued = 0;

  // No vertex outside, nothing crossing or meeting the boundary, positive tets, faces as they should be, a
  // manifold boundary that does not cross itself.
  bool holds() const;
};
// Where all tets turn the other way round, that is the program's convention, and they are turned first.
CageFacts judge_cage(const Solid&, TetMesh);

// Tets that meet the surface, and those of them in which two pieces of it lie that only the air joins.
// Estimated (in double precision, at sample points), and so that a doubt counts as glued:
//  - Pieces: the triangles that meet the tet, joined where they share an edge that meets it.
//  - Chords inside the tet, between near samples of two pieces and from each sample inwards along the normal,
//  are cut
//    where they hit the surface. The pieces at both ends of a cut belong together when its middle is inside
//    the solid.
//  - The tet is glued if its pieces do not all belong together then.
struct GluedFacts {
  std::size_t tets_at_surface = 0, tets_glued = 0;
};
GluedFacts find_glued(const Solid&, const TetMesh&);

}  // namespace check
