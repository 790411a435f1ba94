// Surfaces as voxels: the other way round from surface nets.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "core/mesh.h"
#include "imaging/label_map.h"

namespace limber::imaging {

// Label n + 1 where voxels' middles are inside surface n by the number of crossings along i; of several the
// first. Axes along those of the frame, `spacing_m` each, two voxels of nothing around.
inline LabelMap voxelized(const std::vector<SurfaceMesh>& surfaces, const Vec3& spacing_m) {
  Box box;
  for (const SurfaceMesh& surface : surfaces) box.include(bounding_box(surface.positions));
  LabelMap map;
  map.axes_m = spacing_m.asDiagonal();
  map.origin_m = box.lower - 2 * spacing_m;
  for (int c = 0; c < 3; ++c) map.size[std::size_t(c)] = int(box.size()[c] / spacing_m[c]) + 6;
  map.material.assign(std::size_t(map.voxels()), 0);
  // Rows do not meet edges or corners but by accident of this shift, a thousandth of a voxel.
  const Vec3 shift = Vec3(0, 1.03e-3, 0.97e-3).cwiseProduct(spacing_m);
  for (std::size_t n = 0; n < surfaces.size(); ++n) {
    map.labels.push_back(std::int64_t(n) + 1), map.names.emplace_back();
    const SurfaceMesh& s = surfaces[n];
    std::vector<std::vector<double>> crossings(std::size_t(map.size[1]) * std::size_t(map.size[2]));
    for (Eigen::Index t = 0; t < s.triangles.rows(); ++t) {
      Vec3 p[3];
      for (int c = 0; c < 3; ++c)
        p[c] = s.positions.row(s.triangles(t, c)).transpose() - map.origin_m - shift;
      const auto range = [&](int axis) {
        const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
        return std::pair(int(std::ceil(low / spacing_m[axis])), int(std::floor(high / spacing_m[axis])));
      };
      const auto [j0, j1] = range(1);
      const auto [k0, k1] = range(2);
      for (int k = k0; k <= k1; ++k)
        for (int j = j0; j <= j1; ++j) {
          const double y = j * spacing_m.y(), z = k * spacing_m.z();
          double weight[3], sum = 0;
          for (int c = 0; c < 3; ++c) {
            const Vec3 &a = p[(c + 1) % 3], &b = p[(c + 2) % 3];
            weight[c] = (a.y() - y) * (b.z() - z) - (a.z() - z) * (b.y() - y), sum += weight[c];
          }
          const bool inside = (weight[0] > 0 && weight[1] > 0 && weight[2] > 0) ||
                              (weight[0] < 0 && weight[1] < 0 && weight[2] < 0);
          if (!inside) continue;
          crossings[std::size_t(j + map.size[1] * k)].push_back(
              (weight[0] * p[0].x() + weight[1] * p[1].x() + weight[2] * p[2].x()) / sum);
        }
    }
    for (int k = 0; k < map.size[2]; ++k)
      for (int j = 0; j < map.size[1]; ++j) {
        std::vector<double>& row = crossings[std::size_t(j + map.size[1] * k)];
        std::sort(row.begin(), row.end());
        for (std::size_t c = 0; c + 1 < row.size(); c += 2)
          for (int i = int(std::ceil(row[c] / spacing_m.x())); i * spacing_m.x() <= row[c + 1]; ++i) {
            std::uint16_t& voxel =
                map.material[std::size_t(i) + std::size_t(map.size[0]) * std::size_t(j + map.size[1] * k)];
            if (voxel == 0) voxel = std::uint16_t(n + 1);
          }
      }
  }
  return map;
}

}  // namespace limber::imaging
