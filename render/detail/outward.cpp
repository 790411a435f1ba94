#include "render/detail/outward.h"

#include <algorithm>
#include <vector>

#include "core/mass_properties.h"
#include "core/union_find.h"

namespace limber::render::detail {

bool looks_outward(const Points& positions, const Triangles& triangles) {
  if (triangles.rows() == 0 || !is_closed(triangles)) return false;
  UnionFind pieces(int(positions.rows()));
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 1; k < 3; ++k) pieces.join(triangles(t, 0), triangles(t, k));
  // Each from a point near it, or volumes of small pieces far from the origin would drown in rounding.
  std::vector<double> volume(std::size_t(positions.rows()), 0);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const int piece = pieces.root(triangles(t, 0));
    const Vec3 origin = positions.row(piece);
    const auto corner = [&](int k) { return Vec3(positions.row(triangles(t, k)).transpose() - origin); };
    volume[std::size_t(piece)] += corner(0).cross(corner(1)).dot(corner(2));
  }
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    if (!(volume[std::size_t(pieces.root(triangles(t, 0)))] > 0)) return false;
  return true;
}

}  // namespace limber::render::detail
