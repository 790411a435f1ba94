#include "meshing/detail/manifold.h"

#include "meshing/detail/edges.h"
#include "meshing/detail/tet_faces.h"

namespace limber::meshing::detail {
namespace {

int shared_vertices(const Triangles& triangles, int f, int g) {
  int shared = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) shared += triangles(f, a) == triangles(g, b);
  return shared;
}

int fan_count(const Triangles& triangles, std::span<const int> round_vertex) {
  const int count = int(round_vertex.size());
  UnionFind fans(count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < i; ++j)
      if (shared_vertices(triangles, round_vertex[i], round_vertex[j]) >= 2) fans.join(i, j);
  int fan_count = 0;
  for (int i = 0; i < count; ++i) fan_count += fans.root(i) == i;
  return fan_count;
}

}  // namespace

ManifoldFaults manifold_faults(const Triangles& boundary, int vertex_count) {
  ManifoldFaults faults;
  for_each_edge(edge_uses(boundary), [&](std::span<const EdgeUse> uses) {
    if (uses.size() != 2) faults.edges.push_back({uses[0].lower, uses[0].upper});
  });
  const Stars stars = detail::stars(boundary, vertex_count);
  for (int v = 0; v < vertex_count; ++v)
    if (fan_count(boundary,
                  {stars.things.data() + stars.first[v], stars.things.data() + stars.first[v + 1]}) > 1)
      faults.vertices.push_back(v);
  return faults;
}

}  // namespace limber::meshing::detail
