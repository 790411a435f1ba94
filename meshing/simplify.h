// Fewer triangles for what is only seen. Lindstrom and Turk, "Fast and memory efficient polygonal
// simplification" (Visualization 1998), by CGAL.
#pragma once

#include "core/mesh.h"

namespace limber::meshing {

// About `triangles` of them, or as few as can be without a fold; the same mesh where it has no more. A vertex
// or edge where the surface is no manifold is parted. Same input, same bytes.
SurfaceMesh simplify(const SurfaceMesh&, int triangles);

}  // namespace limber::meshing
