// What is seen of surfaces that touch: how deep one is in another, how far they are apart, how deep a body's
// surface is in itself. Method, and what is not seen: docs/seen.md.
#pragma once

#include "meshing/placed_surface.h"

namespace limber::meshing {

struct SurfaceOverlap {
  double depth_m = 0;  // 0: apart
  Vec3 place_m = Vec3::Zero();
};

// The largest distance to the other surface over the points of either's edges that are inside the other
// (winding number above a half), to a hundredth of it. Or, where that is more, the diameter of the largest
// ball round one of either's inner places that lies in both: bodies that fill the same place have surfaces
// that are near one another all over. Does not depend on the order of the two.
SurfaceOverlap overlap(const PlacedSurface&, const PlacedSurface&);

struct SurfaceGap {
  double distance_m = 0;        // 0: they pass through one another, or one is inside the other
  Vec3 place_m = Vec3::Zero();  // midway
};
// `farthest_m` where they are not nearer than that.
SurfaceGap gap(const PlacedSurface&, const PlacedSurface&, double farthest_m);

// Parts of a surface that are nearer than this share of its size at rest are not measured against one
// another.
constexpr double own_neighbourhood = 0.02;

// How deep a surface is in itself beyond what it is at rest (`at_rest`, of the same shape): over points that
// other parts of it now enclose once more than at rest, the distance to the nearest surface of such a part.
SurfaceOverlap self_overlap(const PlacedSurface& now, const PlacedSurface& at_rest);

}  // namespace limber::meshing
