// The coarse tet cage that encloses a model, in which it is simulated. Method, sources, figures:
// docs/cage.md.
#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing {

enum class CageMode {
  lattice,  // tets of a body-centred cubic lattice, warped, parted at gaps, drawn in to the surface and
            // coarsened: encloses, always
  fast,     // the lattice's tets as they are: encloses; dihedrals of 60 and 90 degrees exactly
  paper,    // Delaunay tets of each shell, welded where shells meet: the baseline; promises nothing
  conform   // CGAL's Mesh_3: the boundary follows the surface, so that some of its vertices lie outside
};

struct CageOptions {
  CageMode mode = CageMode::lattice;
  int tets = 1000;  // 24 … 200,000; met within 10 % where the lattice allows, else a note says so
  double min_dihedral_deg = 18;   // 1 … 45, kept by every tet of mode lattice
  double max_dihedral_deg = 162;  // 100 … 179
  double gap = 0.002;  // aimed at between cage and surface, over the model's diagonal; 1e-6 … 0.1
};

struct Cage {
  TetMesh mesh;
  std::vector<int>
      shell_from_tet;    // (T) the shell that holds the tet's middle most deeply; 0 when there are no shells
  double spacing_m = 0;  // edge of the lattice's cells; 0 in modes paper and conform
  int passes = 0;        // made while drawing in
  int components = 0;    // of tets joined by faces; one for a connected model
  double volume_ratio = 0;  // the cage's volume over the model's; 0 where the surface is not closed
  // Share of the tets that meet the surface in which two pieces of it lie that only the air joins: what moves
  // one moves the other.
  double glued_share = 0;
  std::vector<std::string> notes;  // what the user should know: a budget missed, a model of several pieces
};

// (T) The shell that holds each tet's middle most deeply, 0 when there are no shells.
std::vector<int> label_tets(const TetMesh&, const std::vector<ConvexShell>&);

// `surface` may be open, doubled, self-intersecting; the winding number says what is inside. It must pass
// validate(). `shells` may be empty, except in mode paper; in the other modes they only label the tets. Same
// input, same bytes, also when the triangles come in another order, or all coordinates times a power of two.
// Throws InputError when an option is out of range, the model has no size, mode paper gets no shells, or
// CGAL's mesher fails (mode conform).
Cage build_cage(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells, const CageOptions&);

}  // namespace limber::meshing
