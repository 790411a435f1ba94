// Pairs of triangles that pass through each other: a tree of boxes, and a test of pairs without rounding.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing {

struct SelfIntersections {
  std::vector<std::array<int, 2>> pairs;  // rows of triangles, the smaller first, ascending
  bool complete = true;  // false: stopped at `limit` pairs, or when the boxes of too many met
};

// Neighbours count only where they meet in more than what they share: two faces of an edge when one lies
// folded on the other, two faces of a vertex when one cuts the other elsewhere, two copies of one face
// always. Vertices are the same when their rows are, so weld first. Needs validate(surface).
SelfIntersections self_intersections(const SurfaceMesh& surface, std::size_t limit = 1'000'000);

}  // namespace limber::meshing
