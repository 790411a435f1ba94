#include "meshing/self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <tuple>

namespace limber::meshing {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Corners = std::array<int, 3>;
using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, int>;

struct LimitReached {};

// The corners of t, turned so that `vertex` comes first.
Corners turned(const Corners& t, int vertex) {
  const int i = int(std::find(t.begin(), t.end(), vertex) - t.begin());
  return {t[i], t[(i + 1) % 3], t[(i + 2) % 3]};
}

class PairTest {
 public:
  explicit PairTest(const SurfaceMesh& surface) : surface_(surface) {
    points_.reserve(std::size_t(surface.positions.rows()));
    for (Eigen::Index v = 0; v < surface.positions.rows(); ++v)
      points_.emplace_back(surface.positions(v, 0), surface.positions(v, 1), surface.positions(v, 2));
  }

  TriangleBox box(int t) const {
    CGAL::Bbox_3 bounds;
    for (const int v : corners(t)) bounds += points_[v].bbox();
    return {bounds, t};
  }

  bool meet_beyond_what_they_share(int s, int t) const {
    const Corners a = corners(s), b = corners(t);
    std::vector<int> shared;
    for (const int v : a)
      if (std::find(b.begin(), b.end(), v) != b.end()) shared.push_back(v);
    switch (shared.size()) {
      case 0:
        return CGAL::do_intersect(triangle(a), triangle(b));
      case 1: {
        const Corners p = turned(a, shared[0]), q = turned(b, shared[0]);
        return CGAL::do_intersect(segment(p[1], p[2]), triangle(b)) ||
               CGAL::do_intersect(segment(q[1], q[2]), triangle(a));
      }
      case 2: {
        const auto& [e, f] = std::tie(points_[shared[0]], points_[shared[1]]);
        const auto &p = points_[third(a, shared)], &q = points_[third(b, shared)];
        return CGAL::coplanar(e, f, p, q) && CGAL::coplanar_orientation(e, f, p, q) == CGAL::POSITIVE;
      }
      default:
        return true;
    }
  }

 private:
  Corners corners(int t) const {
    return {surface_.triangles(t, 0), surface_.triangles(t, 1), surface_.triangles(t, 2)};
  }
  Kernel::Triangle_3 triangle(const Corners& t) const {
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }
  Kernel::Segment_3 segment(int a, int b) const { return {points_[a], points_[b]}; }
  static int third(const Corners& t, const std::vector<int>& edge) {
    return *std::find_if(t.begin(), t.end(), [&](int v) { return v != edge[0] && v != edge[1]; });
  }

  const SurfaceMesh& surface_;
  std::vector<Kernel::Point_3> points_;
};

}  // namespace

SelfIntersections self_intersections(const SurfaceMesh& surface, std::size_t limit) {
  const PairTest test(surface);
  std::vector<TriangleBox> boxes;
  boxes.reserve(std::size_t(surface.triangles.rows()));
  for (int t = 0; t < surface.triangles.rows(); ++t) boxes.push_back(test.box(t));

  SelfIntersections found;
  const auto visit = [&](const TriangleBox& s, const TriangleBox& t) {
    if (!test.meet_beyond_what_they_share(s.info(), t.info())) return;
    if (found.pairs.size() == limit) throw LimitReached{};
    found.pairs.push_back({std::min(s.info(), t.info()), std::max(s.info(), t.info())});
  };
  try {
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), visit);
  } catch (const LimitReached&) {
    found.complete = false;
  }
  std::sort(found.pairs.begin(), found.pairs.end());
  return found;
}

}  // namespace limber::meshing
