// The exact convex parts of a closed solid.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

// The corners of each part, rounded to doubles. Walls are put in at every reflex edge (Chazelle 1984; CGAL's
// Nef polyhedra, Hachenberger 2007), so the parts are convex, do not overlap, and together are the solid.
// Throws InputError for a mesh that is open, not 2-manifold, intersects itself, has more than 2,000
// triangles, or takes more than 60 s.
std::vector<std::vector<Vec3>> exact_convex_parts(const SurfaceMesh&);

}  // namespace limber::meshing::detail
