// Cuts a polygon into triangles, also a concave one, and one with a hole that a double edge joins to the rim.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/types.h"

namespace limber::meshing::detail {

// Appends at least one triangle, at most size − 2, that turn the way the polygon does. corners (at least 3)
// are rows of positions, which must be finite. Of corners in a row at one place only the first is used; a
// polygon that has fewer than three places gives a triangle that names a vertex twice. A polygon that crosses
// itself is cut somehow. Ear clipping in the plane of the polygon's area vector (Meisters 1975), about linear
// for nearly convex polygons, quadratic at worst; above 5,000 corners a plain fan.
void triangulate(const Points& positions, std::span<const int> corners,
                 std::vector<std::array<int, 3>>& triangles);

}  // namespace limber::meshing::detail
