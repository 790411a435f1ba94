#include "render/detail/outward.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/mass_properties.h"

namespace limber::render::detail {

bool looks_outward(const Points& positions, const Triangles& triangles) {
  if (triangles.rows() == 0 || !is_closed(triangles)) return false;
  std::vector<int> parent(std::size_t(positions.rows()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[std::size_t(v)] != v)
      v = parent[std::size_t(v)] = parent[std::size_t(parent[std::size_t(v)])];
    return v;
  };
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 1; k < 3; ++k) {
      const int a = root(triangles(t, 0)), b = root(triangles(t, k));
      parent[std::size_t(std::max(a, b))] = std::min(a, b);
    }
  // Each from a point near it, or volumes of small pieces far from the origin would drown in rounding.
  std::vector<double> volume(parent.size(), 0);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const int piece = root(triangles(t, 0));
    const Vec3 origin = positions.row(piece);
    const auto corner = [&](int k) { return Vec3(positions.row(triangles(t, k)).transpose() - origin); };
    volume[std::size_t(piece)] += corner(0).cross(corner(1)).dot(corner(2));
  }
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    if (!(volume[std::size_t(root(triangles(t, 0)))] > 0)) return false;
  return true;
}

}  // namespace limber::render::detail
