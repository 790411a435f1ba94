// Tets whose boundary follows the surface, by CGAL's Mesh_3 (Delaunay refinement: Jamin, Alliez, Yvinec,
// Boissonnat, "CGALmesh", ACM TOMS 2015). In a process of its own: neither a hang nor a crash of the mesher
// reaches limber.
#pragma once

#include <string>

#include "core/mesh.h"

namespace limber::meshing::detail {

struct Conformed {
  TetMesh mesh;              // nodes in the order of their coordinates, each tet positive
  std::string wrapped;       // why the model was wrapped first, "is not closed"; empty: it was not
  double wrap_offset_m = 0;  // what the wrap stands off the model
  int sharp_edges = 0;  // of the model that the tets keep; 0 also where they would take more tets than asked
};

// About `tets` tets. Throws InputError, with why, when CGAL fails on the model or needs over five CPU
// minutes; Interrupted.
Conformed conform(const SurfaceMesh&, int tets);

}  // namespace limber::meshing::detail
