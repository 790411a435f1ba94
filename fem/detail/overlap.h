// How deep two tet bodies are in one another, measured slowly and plainly, apart from the contact code of the
// steppers.
#pragma once

#include "core/mesh.h"

namespace limber::fem::detail {

// Whether two boxes meet: else what is in them does not overlap.
bool can_overlap(const Box&, const Box&);

struct Shape {
  Points positions;
  const Tets& tets;
  const Triangles& surface;
};

Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);
double distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

struct Overlap {
  double depth_m = 0;  // 0: apart
  Vec3 place = Vec3::Zero();
  Vec3 way_m =
      Vec3::Zero();  // of that length: a moved by it, or b by its opposite, has that place no longer inside
};

// The largest distance to the other body's surface, to a hundredth of it, over the points of each body's
// surface edges that cross the other's surface and over its vertices, where they are inside the other.
Overlap deepest_overlap(const Shape& a, const Shape& b);

// Surface edges of either body that pass through the other with no end inside.
int passing_edges(const Shape& a, const Shape& b);

}  // namespace limber::fem::detail
