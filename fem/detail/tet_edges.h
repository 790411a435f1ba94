// The six edges of a tet, by its own node numbers. Sums over edges go in this order, and so do the bits of
// their results.
#pragma once

namespace limber::fem::detail {

inline constexpr int tet_edges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

}  // namespace limber::fem::detail
