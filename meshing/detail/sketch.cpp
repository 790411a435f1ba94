#include "meshing/detail/sketch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace limber::meshing::detail {

namespace {

void keep_each_once(std::vector<std::array<int, 2>>& edges) {
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
}

}  // namespace

Sketch thinned(Sketch sketch, int most) {
  if (int(sketch.points.size()) <= most) return sketch;
  // A smooth sheet of area A meets about 1.6 A / h² cells of side h.
  constexpr double cells_per_area = 1.6;
  const double cell = std::sqrt(cells_per_area * sketch.area / most);
  Box box;
  for (const Vec3& p : sketch.points) box.include(p);
  if (!(cell > 1e-6 * box.diagonal())) return sketch;

  std::vector<std::pair<std::uint64_t, int>> by_cell;
  for (std::size_t i = 0; i < sketch.points.size(); ++i) {
    const Eigen::Array3d at = ((sketch.points[i] - box.lower) / cell).array().floor();
    by_cell.emplace_back(
        (std::uint64_t(at.x()) << 42) + (std::uint64_t(at.y()) << 21) + std::uint64_t(at.z()), int(i));
  }
  std::sort(by_cell.begin(), by_cell.end());
  // The one that stands out: not buried, and the farthest from the middle.
  const Vec3 center = box.center();
  const auto prominence = [&](int i) {
    return sketch.buried[std::size_t(i)] ? -1.0 : (sketch.points[std::size_t(i)] - center).squaredNorm();
  };
  Sketch thin;
  thin.area = sketch.area;
  std::vector<int> row(sketch.points.size());
  for (std::size_t begin = 0, end; begin < by_cell.size(); begin = end) {
    int chosen = by_cell[begin].second;
    for (end = begin; end < by_cell.size() && by_cell[end].first == by_cell[begin].first; ++end) {
      const int i = by_cell[end].second;
      row[std::size_t(i)] = int(thin.points.size());
      if (prominence(i) > prominence(chosen)) chosen = i;
    }
    thin.points.push_back(sketch.points[std::size_t(chosen)]);
    thin.buried.push_back(sketch.buried[std::size_t(chosen)]);
  }
  for (const auto& [a, b] : sketch.edges)
    if (const auto [low, high] = std::minmax(row[std::size_t(a)], row[std::size_t(b)]); low < high)
      thin.edges.push_back({low, high});
  keep_each_once(thin.edges);
  return thin;
}

Sketch sketch_of(const Model& model, const Part& part, int most) {
  Sketch sketch;
  std::vector<int> row(model.points.size(), -1);
  for (int p : part.surface.corners) {
    if (row[std::size_t(p)] >= 0) continue;
    row[std::size_t(p)] = int(sketch.points.size());
    sketch.points.push_back(model.points[std::size_t(p)]);
    sketch.buried.push_back(model.buried[std::size_t(p)]);
  }
  for (int i = 0; i < part.surface.count(); ++i) {
    const int begin = part.surface.first[std::size_t(i)], end = part.surface.first[std::size_t(i) + 1];
    for (int k = begin; k < end; ++k) {
      const int a = part.surface.corners[std::size_t(k)];
      const int b = part.surface.corners[std::size_t(k + 1 < end ? k + 1 : begin)];
      const auto [low, high] = std::minmax(row[std::size_t(a)], row[std::size_t(b)]);
      sketch.edges.push_back({low, high});
    }
    sketch.area += area_vector(model, part.surface, i).norm();
  }
  if (int(sketch.points.size()) > most) return thinned(std::move(sketch), most);
  keep_each_once(sketch.edges);
  return sketch;
}

}  // namespace limber::meshing::detail
