// Exact signs of determinants of doubles: a floating-point filter first, integers of GMP where it cannot
// tell.
#pragma once

#include "tools/check_cage/files.h"

namespace check {

// The sign of det(b − a, c − a, d − a): 1 where (a, b, c, d) is a tet of positive volume.
int orientation(const Point& a, const Point& b, const Point& c, const Point& d);

using Corners = std::array<Point, 3>;

enum class Meeting {
  none,
  touching,  // closed triangles have a point in common
  crossing   // and an edge of one pierces the inside of the other, its ends strictly to either side
};
Meeting meet(const Corners&, const Corners&);

// Whether the closed segment and the closed triangle have a point in common; triangles may be degenerate.
Meeting meet(const Point& p, const Point& q, const Corners&);

}  // namespace check
