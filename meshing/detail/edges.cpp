#include "meshing/detail/edges.h"

#include <algorithm>
#include <tuple>

namespace limber::meshing::detail {

std::vector<EdgeUse> edge_uses(const Triangles& triangles) {
  // A counting sort by the lower vertex, then a sort of the few sides at each.
  const std::size_t vertices = triangles.size() > 0 ? std::size_t(triangles.maxCoeff()) + 1 : 0;
  const auto for_each_side = [&](auto visit) {
    for (int t = 0; t < triangles.rows(); ++t)
      for (int side = 0; side < 3; ++side) {
        const int a = triangles(t, side), b = triangles(t, (side + 1) % 3);
        if (a != b) visit(EdgeUse{std::min(a, b), std::max(a, b), t, side, a < b});
      }
  };
  std::vector<int> end(vertices + 1, 0);
  for_each_side([&](const EdgeUse& use) { ++end[use.lower + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<EdgeUse> uses(std::size_t(end.back()));
  std::vector<int> next(end.begin(), end.end() - 1);
  for_each_side([&](const EdgeUse& use) { uses[next[use.lower]++] = use; });
  for (std::size_t v = 0; v < vertices; ++v)
    std::sort(uses.begin() + end[v], uses.begin() + end[v + 1], [](const EdgeUse& x, const EdgeUse& y) {
      return std::tie(x.upper, x.triangle, x.side) < std::tie(y.upper, y.triangle, y.side);
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
