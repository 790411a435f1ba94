#include "meshing/detail/edges.h"

#include <algorithm>
#include <tuple>

namespace limber::meshing::detail {

std::vector<EdgeUse> edge_uses(const Triangles& triangles) {
  std::vector<EdgeUse> uses;
  uses.reserve(std::size_t(triangles.size()));
  for (int t = 0; t < triangles.rows(); ++t)
    for (int side = 0; side < 3; ++side) {
      const int a = triangles(t, side), b = triangles(t, (side + 1) % 3);
      if (a != b) uses.push_back({std::min(a, b), std::max(a, b), t, side, a < b});
    }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& x, const EdgeUse& y) {
    return std::tie(x.lower, x.upper, x.triangle, x.side) < std::tie(y.lower, y.upper, y.triangle, y.side);
  });
  return uses;
}

std::vector<int> components(const Triangles& triangles, const std::vector<EdgeUse>& uses) {
  UnionFind joined(int(triangles.rows()));
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    for (const EdgeUse& use : edge) joined.join(edge[0].triangle, use.triangle);
  });
  std::vector<int> component(std::size_t(triangles.rows()));
  for (int t = 0; t < triangles.rows(); ++t) component[t] = joined.root(t);
  return component;
}

}  // namespace limber::meshing::detail
