// The part of a surface that parts inside from outside. What lies within (chambers that are counted twice,
// the walls of overlapping parts) and what has nothing behind it (sheets, flaps) is left out.
#pragma once

#include <vector>

#include "core/mesh.h"
#include "meshing/winding_number.h"

namespace limber::meshing::detail {

struct SeenSurface {
  SurfaceMesh mesh;        // its triangles are whole ones of the model, or pieces of them
  std::vector<char> seen;  // (F) whether any of the model's triangle is in it
  double area_m2 = 0;
  double open_share =
      0;  // of the area: where it is not clear what is inside, as near the hole of an open surface
};

// Triangles are judged whole where they are no longer than `piece`, else in pieces, by the winding number at
// `offset` to either side of their middles. Same input, same bytes on any number of threads.
SeenSurface seen_surface(const SurfaceMesh&, const WindingNumber&, double piece, double offset);

// Whether a step of `offset` along the unit normal leads out, and against it in.
bool parts_inside_from_outside(const WindingNumber&, const Vec3& point, const Vec3& normal, double offset);

}  // namespace limber::meshing::detail
