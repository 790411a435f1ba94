// A mesh in the order and with the vertices that the rasterizer wants: along a Morton curve, split at
// creases; where it has colors of its own also by material, and split at their seams.
#pragma once

#include <cstdint>
#include <vector>

#include "core/appearance.h"

namespace limber::render::detail {

struct DrawnMesh {
  std::vector<int> vertex_from_drawn;   // row of the caller's positions
  std::vector<std::uint32_t> corners;   // 3 drawn vertices a triangle
  std::vector<std::uint8_t> at_crease;  // (drawn) 1: one of several that share a row
  std::vector<int> crease_triangles;    // those with a corner at a crease
  std::vector<float> positions;         // (drawn × 3), metres
  std::vector<float> normals;           // (drawn × 3), unit

  // Of a mesh with an appearance:
  struct Batch {
    int material;  // −1: plain
    std::size_t first_corner, corners;
  };
  std::vector<Batch> batches;
  std::vector<int> seam_copies;       // the last so many drawn vertices: of which other each is a copy
  std::vector<float> uv;              // (drawn × 2), or none
  std::vector<std::uint16_t> colors;  // (drawn × 4), or none; 65535 is 1
};

// Two triangles at an edge belong together when their normals differ by less than the crease angle. Round a
// vertex, corners that belong together share one drawn vertex. 180 or more: no vertex is split.
// Copies at a seam of the appearance share their normal.
DrawnMesh order_for_drawing(const Triangles&, const Points& rest_positions, double crease_angle_deg,
                            const Appearance& = {});

// Fills positions and normals. Normals of split vertices, and all when `normals` is empty, are sums of area
// vectors.
void deform(DrawnMesh&, const Points& positions, const Points& normals);

}  // namespace limber::render::detail
