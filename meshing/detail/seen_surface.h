// The part of a surface that parts inside from outside. What lies within (chambers that are counted twice,
// the walls of overlapping parts) and what has nothing behind it (sheets, flaps) is not seen.
#pragma once

#include <array>
#include <vector>

#include "core/mesh.h"
#include "meshing/winding_number.h"

namespace limber::meshing::detail {

inline constexpr double offset_share =
    1e-4;  // of the size: how far beside a surface it is asked what is inside

struct SurfacePiece {
  std::array<Vec3, 3> corners;
  int triangle;  // of the model
  bool seen;
  Vec3 area_vector() const { return 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]); }
};

struct SeenSurface {
  std::vector<SurfacePiece> pieces;  // all of the model, in the order of its triangles
  std::vector<char> seen;            // (F) whether any piece of the triangle is
  double area_m2 = 0;                // of what is seen
  double open_share =
      0;  // of all area: where it is not clear what is inside, as near the hole of an open surface
};

// Pieces are whole triangles where these are no longer than `longest`; each is judged by the winding number
// at `offset` to either side of its middle, or goes by others that face the same way within `longest` / 4,
// where the first and the last of these agree. Same input, same bytes on any number of threads.
SeenSurface seen_surface(const SurfaceMesh&, const WindingNumber&, bool closed, double longest,
                         double offset);

// Whether a step of `offset` along the unit normal leads out, and against it in.
bool parts_inside_from_outside(const WindingNumber&, const Vec3& point, const Vec3& normal, double offset);

}  // namespace limber::meshing::detail
