#include "core/split_at_seams.h"

#include <array>
#include <map>
#include <utility>

namespace limber {

SplitAtSeams split_at_seams(const SurfaceMesh& surface, const Appearance& a) {
  using Shown = std::array<double, 5>;
  const auto shown_at = [&](Eigen::Index t, int c) {
    Shown shown{0, 0, 1, 1, 1};
    if (a.material_from_triangle[std::size_t(t)] < 0) return shown;
    for (int k = 0; k < 2 && a.uv.rows() > 0; ++k) shown[std::size_t(k)] = a.uv(3 * t + c, k);
    for (int k = 0; k < 3 && a.colors.rows() > 0; ++k) shown[std::size_t(2 + k)] = a.colors(3 * t + c, k);
    return shown;
  };
  SplitAtSeams split;
  split.triangles = surface.triangles;
  const Eigen::Index vertices = surface.positions.rows();
  std::vector<Shown> shown(std::size_t(vertices), Shown{0, 0, 1, 1, 1});
  std::vector<bool> seen(std::size_t(vertices), false);
  for (int v = 0; v < vertices; ++v) split.vertex_from_row.push_back(v);
  std::map<std::pair<int, Shown>, int> copies;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      const int vertex = surface.triangles(t, c);
      const auto v = std::size_t(vertex);
      const Shown here = shown_at(t, c);
      if (!seen[v]) shown[v] = here, seen[v] = true;
      if (shown[v] == here) continue;
      const auto [at, fresh] = copies.try_emplace({vertex, here}, int(shown.size()));
      if (fresh) split.vertex_from_row.push_back(vertex), shown.push_back(here);
      split.triangles(t, c) = at->second;
    }
  const Eigen::Index rows = std::ssize(shown);
  if (a.uv.rows() > 0) split.uv.resize(rows, 2);
  if (a.colors.rows() > 0) split.colors.resize(rows, 3);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Shown& s = shown[std::size_t(row)];
    if (a.uv.rows() > 0) split.uv.row(row) << s[0], s[1];
    if (a.colors.rows() > 0) split.colors.row(row) << s[2], s[3], s[4];
  }
  return split;
}

}  // namespace limber
