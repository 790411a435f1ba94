// Models out of ellipsoids that flow into one another, and of hollows in them.
#pragma once

#include <span>

#include "core/mesh.h"

namespace limber::scenes {

struct Ellipsoid {
  Vec3 center, radii;   // metres
  double pitch_deg;     // about y: > 0 tips the top to the front
  double roll_deg;      // about x: > 0 tips the top to the right (−y)
  double blend_m;       // width over which it flows into what came before
  bool hollow = false;  // it is taken away from what came before
};

enum class Sides { one, both };  // both: those with y ≠ 0 stand on either side

// Their union, less the hollows, within `box`, cut from a grid of that cell; its middle is the origin, and it
// is 1 m high.
SurfaceMesh join(std::span<const Ellipsoid>, Sides, const Box& box, double cell_m);

}  // namespace limber::scenes
