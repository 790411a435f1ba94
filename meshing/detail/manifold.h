// Where the boundary of a tet mesh is no manifold.
#pragma once

#include <array>
#include <vector>

#include "core/types.h"

namespace limber::meshing::detail {

struct ManifoldFaults {
  std::vector<std::array<int, 2>> edges;  // that have not two triangles
  std::vector<int> vertices;              // whose triangles are not one fan: joined over edges at the vertex
};
ManifoldFaults manifold_faults(const Triangles& boundary, int vertex_count);

}  // namespace limber::meshing::detail
