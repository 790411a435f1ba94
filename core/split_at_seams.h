// A surface and its appearance for formats that have one of each a vertex.
#pragma once

#include <vector>

#include "core/appearance.h"

namespace limber {

// A vertex with corners that show different things becomes several. Its own rows come first, in their order.
// Plain corners are white, at (0 0).
struct SplitAtSeams {
  std::vector<int> vertex_from_row;
  Triangles triangles;  // of rows
  Uvs uv;               // (rows × 2), or none
  Points colors;        // (rows × 3), or none
};
SplitAtSeams split_at_seams(const SurfaceMesh&, const Appearance&);

}  // namespace limber
