// Collects the vertices and triangles of a surface that is made.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/mesh.h"

namespace limber::scenes {

struct SurfaceBuilder {
  std::vector<Vec3> positions;
  std::vector<Eigen::Vector3i> triangles;

  int add(const Vec3& p) {
    positions.push_back(p);
    return int(positions.size()) - 1;
  }
  void quad(int a, int b, int c, int d, bool other_diagonal) {
    if (other_diagonal) {
      triangles.emplace_back(b, c, d);
      triangles.emplace_back(b, d, a);
    } else {
      triangles.emplace_back(a, b, c);
      triangles.emplace_back(a, c, d);
    }
  }
  SurfaceMesh mesh() const {
    SurfaceMesh made{Points(positions.size(), 3), Triangles(triangles.size(), 3)};
    for (std::size_t v = 0; v < positions.size(); ++v) made.positions.row(Eigen::Index(v)) = positions[v];
    for (std::size_t f = 0; f < triangles.size(); ++f) made.triangles.row(Eigen::Index(f)) = triangles[f];
    return made;
  }
};

// Equal pieces of a length, none of them longer than `longest`; at least one.
inline int pieces(double length, double longest) {
  return std::max(1, int(std::ceil(length / longest - 1e-9)));
}

}  // namespace limber::scenes
