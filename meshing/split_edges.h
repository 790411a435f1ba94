// A triangle stays flat between its corners, however its cage bends. So what is seen of a coarse model would
// leave the body that is simulated, and its contact: a box of twelve triangles could not bend at all.
#pragma once

#include "core/appearance.h"
#include "core/mesh.h"

namespace limber::meshing {

struct SplitSettings {
  double share = 0.15;             // of √(area / tets^⅔): about a fifth of an edge of a solid's cage
  int max_new_vertices = 200'000;  // where more would be needed, longer edges stay
};

// How long edges of a surface may be that is to be in a cage of so many tets. tets > 0.
double longest_edge(const SurfaceMesh&, int tets, const SplitSettings& = {});

// The same surface with edges cut at their middle until none is longer than `longest_m` > 0, or than its
// least multiple by a power of two that makes no more than max_new_vertices. Vertices keep their numbers;
// new ones follow, on the edges of the old. `corners`, where given, is overwritten.
SurfaceMesh split_long_edges(const SurfaceMesh&, double longest_m, const SplitSettings& = {},
                             CornerMap* corners = nullptr);

}  // namespace limber::meshing
