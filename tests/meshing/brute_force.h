// Enclosure judged a second way: long double arithmetic, every pair, no tree and none of the predicates under
// test.
#pragma once

#include <array>

#include "core/mesh.h"

namespace limber::meshing {

using LongVec3 = Eigen::Matrix<long double, 3, 1>;

inline LongVec3 long_row(const Points& p, int i) { return p.row(i).cast<long double>().transpose(); }

inline long double six_volumes(const LongVec3& a, const LongVec3& b, const LongVec3& c, const LongVec3& d) {
  return (b - a).cross(c - a).dot(d - a);
}

inline bool brute_tet_holds(const std::array<LongVec3, 4>& t, const LongVec3& p) {
  return six_volumes(p, t[1], t[2], t[3]) >= 0 && six_volumes(t[0], p, t[2], t[3]) >= 0 &&
         six_volumes(t[0], t[1], p, t[3]) >= 0 && six_volumes(t[0], t[1], t[2], p) >= 0;
}

inline bool brute_segment_meets(const LongVec3& p, const LongVec3& q, const std::array<LongVec3, 3>& t) {
  const long double sp = six_volumes(t[0], t[1], t[2], p), sq = six_volumes(t[0], t[1], t[2], q);
  if (sp * sq > 0) return false;
  const long double u = six_volumes(p, q, t[0], t[1]), v = six_volumes(p, q, t[1], t[2]),
                    w = six_volumes(p, q, t[2], t[0]);
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

inline bool brute_triangles_meet(const std::array<LongVec3, 3>& a, const std::array<LongVec3, 3>& b) {
  for (int k = 0; k < 3; ++k)
    if (brute_segment_meets(a[k], a[(k + 1) % 3], b) || brute_segment_meets(b[k], b[(k + 1) % 3], a))
      return true;
  return false;
}

struct BruteEnclosure {
  int vertices_outside = 0, triangles_crossing = 0;
};
inline BruteEnclosure brute_enclosure(const SurfaceMesh& surface, const TetMesh& cage) {
  BruteEnclosure found;
  for (int v = 0; v < surface.positions.rows(); ++v) {
    bool held = false;
    for (int t = 0; t < cage.tets.rows() && !held; ++t) {
      std::array<LongVec3, 4> corners;
      for (int k = 0; k < 4; ++k) corners[k] = long_row(cage.positions, cage.tets(t, k));
      held = brute_tet_holds(corners, long_row(surface.positions, v));
    }
    found.vertices_outside += !held;
  }
  const auto corners = [](const Points& p, const Triangles& t, int f) {
    return std::array{long_row(p, t(f, 0)), long_row(p, t(f, 1)), long_row(p, t(f, 2))};
  };
  const Triangles boundary = boundary_triangles(cage.tets);
  for (int f = 0; f < surface.triangles.rows(); ++f) {
    bool crosses = false;
    for (int g = 0; g < boundary.rows() && !crosses; ++g)
      crosses = brute_triangles_meet(corners(surface.positions, surface.triangles, f),
                                     corners(cage.positions, boundary, g));
    found.triangles_crossing += crosses;
  }
  return found;
}

}  // namespace limber::meshing
