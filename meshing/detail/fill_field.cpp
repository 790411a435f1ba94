#include "meshing/detail/fill_field.h"

#include <algorithm>
#include <cmath>

#include "core/threads.h"

namespace limber::meshing::detail {

namespace {
constexpr double exact_cells = 4;
constexpr double largest_value = 32'000;
}  // namespace

DistanceField grid_over(const Box& box, double cell_m, std::int64_t most_nodes) {
  DistanceField field;
  while (true) {
    std::int64_t count = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double nodes = std::ceil(box.size()[axis] / cell_m) + 3;
      field.nodes[std::size_t(axis)] = int(std::min(nodes, 1e6));
      count *= std::min<std::int64_t>(field.nodes[std::size_t(axis)], most_nodes);
    }
    if (count <= most_nodes) break;
    cell_m *= 1.02;
  }
  field.cell_m = cell_m;
  // What is left of the last cell is shared by both sides.
  for (int axis = 0; axis < 3; ++axis)
    field.lower_m[axis] = box.center()[axis] - 0.5 * cell_m * (field.nodes[std::size_t(axis)] - 1);
  return field;
}

double fill(const NearestTriangle& surface, const WindingNumber& winding, bool closed, DistanceField& field) {
  const auto [columns, rows, slices] = field.nodes;
  const double cell = field.cell_m;
  std::vector<double> distances(std::size_t(columns) * rows * slices);
  std::vector<double> volumes(std::size_t(rows) * slices);
  std::vector<double> farthest(volumes.size());
  parallel_for(rows * slices, [&](int row) {
    double* const d = distances.data() + std::size_t(row) * columns;
    double before = 1e100;  // at the node before
    bool inside = false;
    double volume = 0;
    for (int i = 0; i < columns; ++i) {
      const Vec3 p = field.lower_m + cell * Vec3(i, row % rows, row / rows);
      const double bound = (before + cell) * (1 + 1e-9), exact = exact_cells * cell;
      const double distance = std::sqrt(surface.at(p, bound * bound, exact * exact).squared_distance);
      // No surface lies between this node and one farther from it than a cell.
      if (i == 0 || !closed || std::max(before, distance) <= 1.05 * cell) inside = winding.inside(p);
      before = distance;
      d[i] = inside ? -distance : distance;
      volume += std::clamp(0.5 - d[i] / cell, 0.0, 1.0);
      farthest[std::size_t(row)] = std::max(farthest[std::size_t(row)], distance);
    }
    volumes[std::size_t(row)] = volume;
  });
  double volume = 0, most = 0;
  for (std::size_t row = 0; row < volumes.size(); ++row)
    volume += volumes[row], most = std::max(most, farthest[row]);
  field.unit_m = most / largest_value;
  field.values.resize(distances.size());
  for (std::size_t i = 0; i < distances.size(); ++i)
    field.values[i] = std::int16_t(std::lround(distances[i] / field.unit_m));
  return volume * cell * cell * cell;
}

bool is_closed(const Triangles& triangles) {
  std::vector<std::array<int, 3>> edges;  // lesser end, greater end, 1 or −1
  edges.reserve(std::size_t(triangles.size()));
  for (const auto t : triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  std::sort(edges.begin(), edges.end());
  int turns = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    turns += edges[i][2];
    const bool last =
        i + 1 == edges.size() || edges[i + 1][0] != edges[i][0] || edges[i + 1][1] != edges[i][1];
    if (last && turns != 0) return false;
  }
  return true;
}

}  // namespace limber::meshing::detail
