// Proves anew, with exact predicates and from the two meshes alone, that a cage encloses a surface.
#pragma once

#include <cstdint>

#include "core/mesh.h"

namespace limber::meshing {

struct Certificate {
  std::int64_t vertices = 0;          // of the surface
  std::int64_t vertices_outside = 0;  // in no tet
  std::int64_t triangles = 0;
  std::int64_t triangles_crossing = 0;  // that meet the cage's boundary, if only in a point
  int nonmanifold_edges = 0;            // of the cage's boundary: not two triangles
  int nonmanifold_vertices = 0;         // of the cage's boundary: not one fan of triangles
  int inverted_tets = 0;                // volume not positive, exactly
  double min_dihedral_deg = 0, max_dihedral_deg = 0;
  std::uint64_t surface_hash = 0, cage_hash = 0;

  // Every point of every surface triangle is inside the cage, whose tets are positive and whose boundary is a
  // manifold: a triangle whose corners are inside and which nowhere meets the boundary cannot leave. (The
  // dihedrals are stated, not judged.)
  bool holds() const;
};

// Needs validate() of both.
Certificate certify(const SurfaceMesh&, const TetMesh& cage);

}  // namespace limber::meshing
