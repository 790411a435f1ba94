// CGAL's Delaunay triangulation of a few points.
#pragma once

#include <array>
#include <vector>

#include "core/types.h"

namespace limber::meshing::detail {

// Rows of `points`, each tet positive (tets without volume are left out), in the order of their sorted
// corners.
std::vector<std::array<int, 4>> delaunay_tets(const Points& points);

}  // namespace limber::meshing::detail
