// Arrows that stand for vectors, and rods: closed surfaces, lit and shadowed like all else.
#pragma once

#include "core/mesh.h"

namespace limber::render {

// A shaft with a cone at its end, a closed surface that looks outward. All arrows share the triangles; only
// their corners differ.
Triangles arrow_triangles();
// From `from` to the tip at `to`, metres. Longer than 8 radii the head keeps its size; a shorter arrow
// shrinks as a whole. Of no length all corners are `from`.
Points arrow(const Vec3& from, const Vec3& to, double shaft_radius_m);

// A rod from one place to another, with a little of a cone at either end, in the same way.
Triangles rod_triangles();
Points rod(const Vec3& from, const Vec3& to, double radius_m);

}  // namespace limber::render
