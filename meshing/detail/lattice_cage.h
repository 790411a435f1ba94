// The coarse start of a cage: the tets of a lattice that a model needs (docs/cage.md, steps 3 to 5).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "meshing/detail/lattice.h"
#include "meshing/quality.h"
#include "meshing/surface_tree.h"
#include "meshing/winding_number.h"

namespace limber::meshing::detail {

// What a cage must hold.
struct CageModel {
  explicit CageModel(const SurfaceMesh&);

  SurfaceMesh surface;
  Box box;  // of the triangles
  SurfaceTree tree;
  WindingNumber winding;
  // Sides are 3 triangle + which. Of each: the side before it at the same edge, triangles ascending; −1:
  // none.
  std::vector<int> side_before;
  bool closed;  // the winding number is whole, and the same wherever one can go without meeting the surface
};

struct Selection {
  Lattice lattice;
  std::vector<int> tets;      // of the lattice, ascending
  std::vector<bool> touched;  // for each of `tets`: it meets the surface
};

// The tets that meet the surface or lie inside it, and those that make their union a solid whose boundary is
// a manifold once build_mesh has split vertices. `phase` in cells shifts the lattice. With `warp_within`,
// nodes near the surface move as far as the dihedrals stay in that range. A spacing so small that the lattice
// would exceed max_cells gives no tets.
Selection select_tets(const CageModel&, double spacing, const Vec3& phase,
                      const std::optional<DihedralRange>& warp_within);
constexpr std::int64_t max_cells = 1'000'000;

// Tets that meet only in a vertex or an edge get their own copies of its vertices.
struct LatticeMesh {
  TetMesh mesh;  // tets in the order of the selection
  int split_vertices = 0;
};
LatticeMesh build_mesh(const Selection&);

}  // namespace limber::meshing::detail
