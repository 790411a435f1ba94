// Whether two triangles of a surface pass through each other, exactly.
#pragma once

#include <array>

#include "core/types.h"

namespace limber::meshing::detail {

// The triangles' corners are rows of positions; neighbours are those that name the same row.
// Neighbours count only where they meet in more than what they share: two faces of an edge when one lies
// folded on the other, two faces of a vertex when one cuts the other elsewhere, two copies of one face
// always. Filters in double precision decide nearly always, CGAL's exact predicates the rest.
bool meet_beyond_what_they_share(const Points& positions, const std::array<int, 3>& a,
                                 const std::array<int, 3>& b);

}  // namespace limber::meshing::detail
