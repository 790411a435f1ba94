#include "meshing/surface_tree.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/progress.h"

#include "meshing/detail/closest_point.h"

namespace limber::meshing {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using ExactPoint = Kernel::Point_3;

ExactPoint exact(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

bool disjoint(const Box& a, const Box& b) {
  return (a.lower.array() > b.upper.array()).any() || (b.lower.array() > a.upper.array()).any();
}

template <std::size_t N>
Box box_of(const std::array<Vec3, N>& corners) {
  Box box;
  for (const Vec3& p : corners) box.include(p);
  return box;
}

// +1 or −1 when all are that, else 0.
template <class... Signs>
int common(int first, Signs... rest) {
  return ((first == rest) && ...) ? first : 0;
}

using Tri = std::array<Vec3, 3>;
using detail::closest_on_triangle;
using Tet = std::array<Vec3, 4>;

// Two convex bodies are disjoint when some plane has one on one side and the other beyond it: one through a
// face of either, or else one through an edge of the tet, turned about that edge until it meets a corner of
// the triangle. Every sign below is that of four corners, so no plane is ever computed. In general position
// this finds all disjoint pairs; a pair that shares a plane may go unproved.
bool proved_disjoint(const Tet& tet, const Tri& tri) {
  // side[i][m]: where tri[m] lies of the face opposite tet[i]; positive where tet[i] would be in a positive
  // tet.
  static constexpr int face[4][3] = {{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};
  const int own = orientation(tet[0], tet[1], tet[2], tet[3]);
  int side[4][3];
  for (int m = 0; m < 3; ++m) {
    bool within = own != 0;
    for (int i = 0; i < 4; ++i) {
      side[i][m] = orientation(tet[face[i][0]], tet[face[i][1]], tet[face[i][2]], tri[m]);
      within = within && side[i][m] != -own;
    }
    if (within) return false;  // a corner of the triangle is in the tet
  }
  for (int i = 0; i < 4; ++i) {
    const int all = common(side[i][0], side[i][1], side[i][2]);
    if (all != 0 && all != own) return true;
  }
  const auto of_tri_plane = [&](int i) { return orientation(tri[0], tri[1], tri[2], tet[i]); };
  const int beyond[4] = {of_tri_plane(0), of_tri_plane(1), of_tri_plane(2), of_tri_plane(3)};
  if (common(beyond[0], beyond[1], beyond[2], beyond[3]) != 0) return true;

  // mixed[e][m]: the edge e of the tet with the edge of the triangle opposite tri[m].
  static constexpr int edge[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2},
                                     {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
  int mixed[6][3];
  for (int e = 0; e < 6; ++e)
    for (int m = 0; m < 3; ++m)
      mixed[e][m] = orientation(tet[edge[e][0]], tet[edge[e][1]], tri[(m + 1) % 3], tri[(m + 2) % 3]);

  // Sign of (p q r x) for an edge pq of the tet and its corner x, from the face sides above.
  const auto tet_corner = [&](int p, int q, int r, int x) {
    const int i = 6 - p - q - x;  // the corner that is not in the face p q x
    // face[i] is some rotation or reflection of (p, x, q), and (p q r x) has the sign of (p x q r).
    for (int k = 0; k < 3; ++k)
      if (face[i][k] == p) return face[i][(k + 1) % 3] == x ? side[i][r] : -side[i][r];
    return 0;
  };
  for (int e = 0; e < 6; ++e) {
    const auto [p, q, x, y] = std::array{edge[e][0], edge[e][1], edge[e][2], edge[e][3]};
    for (int r = 0; r < 3; ++r) {
      const int tri_side = common(mixed[e][(r + 2) % 3], -mixed[e][(r + 1) % 3]);
      if (tri_side != 0 && common(tet_corner(p, q, r, x), tet_corner(p, q, r, y)) == -tri_side) return true;
    }
  }
  return false;
}

bool flat(const Tri& t) { return CGAL::collinear(exact(t[0]), exact(t[1]), exact(t[2])); }

// Exact; at least one of the two is not flat.
bool triangles_meet(const Tri& a, const Tri& b) {
  const auto side_of = [](const Tri& plane, const Tri& t) {
    return common(orientation(plane[0], plane[1], plane[2], t[0]),
                  orientation(plane[0], plane[1], plane[2], t[1]),
                  orientation(plane[0], plane[1], plane[2], t[2]));
  };
  if (side_of(a, b) != 0 || side_of(b, a) != 0) return false;
  const bool b_flat = flat(b);
  const Tri& full = b_flat ? a : b;
  const Tri& other = b_flat ? b : a;
  const Kernel::Triangle_3 triangle(exact(full[0]), exact(full[1]), exact(full[2]));
  if (!b_flat && !flat(other))
    return CGAL::do_intersect(triangle, Kernel::Triangle_3(exact(a[0]), exact(a[1]), exact(a[2])));
  Tri sorted = other;
  std::sort(sorted.begin(), sorted.end(), [](const Vec3& p, const Vec3& q) {
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  });
  if (sorted[0] == sorted[2]) return triangle.has_on(exact(sorted[0]));
  return CGAL::do_intersect(triangle, Kernel::Segment_3(exact(sorted[0]), exact(sorted[2])));
}

void widen(Box& box, double by) { box.lower.array() -= by, box.upper.array() += by; }

double largest_coordinate(const Box& box) {
  return box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()).maxCoeff();
}

template <std::size_t N>
std::array<Vec3, N> along(const detail::Axes& axes, std::array<Vec3, N> corners) {
  for (Vec3& p : corners) p = axes.along(p);
  return corners;
}

// Of corners along the axes.
template <std::size_t N>
Box box_of(const std::array<Vec3, N>& corners, const detail::Axes& axes) {
  Box box = box_of(corners);
  widen(box, axes.rounding(largest_coordinate(box)));
  return box;
}

Tri corners(const Points& positions, const Triangles& triangles, int f) {
  return {positions.row(triangles(f, 0)), positions.row(triangles(f, 1)), positions.row(triangles(f, 2))};
}

// Rejects boxes along the axes that lie beyond one of the tet's faces, and, where needles lie along turned
// axes, those that a plane through an edge of the tet and along an axis parts from it: without, each needle
// of a bundle is asked about a tet that passes it askew. A rounding margin keeps it from rejecting too much.
class TetRejects {
 public:
  TetRejects(const detail::Axes& axes, const Tet& tet) {
    const Tet t = along(axes, tet);
    box_ = box_of(t, axes);
    static constexpr int face[4][3] = {{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};
    for (int i = 0; i < 4; ++i) {
      const Vec3& a = t[face[i][0]];
      const Vec3 n = (t[face[i][1]] - a).cross(t[face[i][2]] - a);
      add(n.dot(t[i] - a) > 0 ? Vec3(-n) : n, t);
    }
    for (int i = 0; axes.turned() && i < 4; ++i)
      for (int j = 0; j < i; ++j)
        for (int axis = 0; axis < 3; ++axis) {
          const Vec3 n = (t[i] - t[j]).cross(Vec3::Unit(axis));
          add(n, t), add(-n, t);
        }
  }
  // Of the other box only what lies in the tet's own counts: of a needle's box, which is long, a short part.
  bool operator()(const Box& other) const {
    const Vec3 lower = box_.lower.cwiseMax(other.lower), upper = box_.upper.cwiseMin(other.upper);
    if ((lower.array() > upper.array()).any()) return true;
    for (int i = 0; i < count_; ++i) {
      const Vec3& n = bounds_[i].normal;
      const double nearest = n.x() * (n.x() > 0 ? lower.x() : upper.x()) +
                             n.y() * (n.y() > 0 ? lower.y() : upper.y()) +
                             n.z() * (n.z() > 0 ? lower.z() : upper.z());
      if (nearest > bounds_[i].farthest) return true;
    }
    return false;
  }

 private:
  struct Bound {
    Vec3 normal;
    double farthest;  // normal·x of the tet, plus the margin
  };
  void add(const Vec3& n, const Tet& t) {
    bounds_[count_++] = {n, std::max({n.dot(t[0]), n.dot(t[1]), n.dot(t[2]), n.dot(t[3])}) +
                                1e-13 * n.cwiseAbs().sum() * largest_coordinate(box_)};
  }

  Box box_;
  std::array<Bound, 4 + 2 * 6 * 3> bounds_;
  int count_ = 0;
};

// Which triangles a question was put to; now and then it forgets one, and that is asked again.
class Asked {
 public:
  Asked() { last_.fill(-1); }
  bool first_time(int triangle) {
    return std::exchange(last_[std::size_t(triangle) % last_.size()], triangle) != triangle;
  }

 private:
  std::array<int, 4096> last_;
};

}  // namespace

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double ax = a.x() - d.x(), ay = a.y() - d.y(), az = a.z() - d.z();
  const double bx = b.x() - d.x(), by = b.y() - d.y(), bz = b.z() - d.z();
  const double cx = c.x() - d.x(), cy = c.y() - d.y(), cz = c.z() - d.z();
  const double bxcy = bx * cy, cxby = cx * by, cxay = cx * ay, axcy = ax * cy, axby = ax * by, bxay = bx * ay;
  const double det = az * (bxcy - cxby) + bz * (cxay - axcy) + cz * (axby - bxay);
  const double size = (std::abs(bxcy) + std::abs(cxby)) * std::abs(az) +
                      (std::abs(cxay) + std::abs(axcy)) * std::abs(bz) +
                      (std::abs(axby) + std::abs(bxay)) * std::abs(cz);
  // Shewchuk 1997, bound A of orient3d; below it, and where products underflow, CGAL decides.
  const double bound = 7.7715611723761027e-16 * size;
  if (size > 1e-280) {
    if (det > bound) return -1;
    if (det < -bound) return 1;
  }
  return int(CGAL::orientation(exact(a), exact(b), exact(c), exact(d)));
}

bool tet_holds(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, const Vec3& p) {
  return orientation(a, b, c, p) >= 0 && orientation(a, c, d, p) >= 0 && orientation(a, d, b, p) >= 0 &&
         orientation(b, d, c, p) >= 0;
}

SurfaceTree::SurfaceTree(const Points& positions, const Triangles& triangles)
    : positions_(positions),
      triangles_(triangles),
      axes_(positions, triangles),
      pieces_(detail::pieces_along(axes_, positions, triangles)),
      tree_(detail::boxes_of(pieces_)) {}

bool SurfaceTree::meets_triangle(const Vec3& a, const Vec3& b, const Vec3& c) const {
  throw_if_stopped();
  const Tri query{a, b, c};
  const Box box = box_of(along(axes_, query), axes_);
  return tree_.any([&](const Box& other) { return disjoint(box, other); },
                   [&](int p) {
                     return !disjoint(box, pieces_[p].box) &&
                            triangles_meet(query, corners(positions_, triangles_, pieces_[p].triangle));
                   });
}

bool SurfaceTree::meets_tet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) const {
  throw_if_stopped();
  const Tet query{a, b, c, d};
  const TetRejects rejects(axes_, query);
  const auto meets = [&](int f) { return !proved_disjoint(query, corners(positions_, triangles_, f)); };
  if (pieces_.size() == std::size_t(triangles_.rows()))
    return tree_.any(rejects, [&](int f) { return !rejects(pieces_[f].box) && meets(f); });
  Asked asked;
  return tree_.any(rejects, [&](int p) {
    const int f = pieces_[p].triangle;
    return !rejects(pieces_[p].box) && asked.first_time(f) && meets(f);
  });
}

std::vector<int> SurfaceTree::triangles_meeting_tet(const Vec3& a, const Vec3& b, const Vec3& c,
                                                    const Vec3& d) const {
  throw_if_stopped();
  const Tet query{a, b, c, d};
  const TetRejects rejects(axes_, query);
  Asked asked;
  std::vector<int> found;
  tree_.any(rejects, [&](int p) {
    const int f = pieces_[p].triangle;
    if (!rejects(pieces_[p].box) && asked.first_time(f) &&
        !proved_disjoint(query, corners(positions_, triangles_, f)))
      found.push_back(f);
    return false;
  });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

Vec3 SurfaceTree::closest_point(const Vec3& p) const { return *closest_point_within(p, 1e150); }

std::optional<Vec3> SurfaceTree::closest_point_within(const Vec3& p, double distance) const {
  throw_if_stopped();
  std::optional<Vec3> best;
  double best_squared = distance * distance;
  const auto wins = [&](const Vec3& q, double squared) {
    if (squared != best_squared) return squared < best_squared;
    return !best || std::lexicographical_compare(q.begin(), q.end(), best->begin(), best->end());
  };
  tree_.nearest(axes_.along(p), best_squared, [&](int piece) {
    const Vec3 q = closest_on_triangle(corners(positions_, triangles_, pieces_[piece].triangle), p);
    const double squared = (q - p).squaredNorm();
    if (wins(q, squared)) best_squared = squared, best = q;
    return best_squared * (1 + 1e-9);  // the slack visits every tie, whatever the rounding of a box
  });
  return best;
}

double SurfaceTree::free_share(const Vec3& p, const Vec3& q) const {
  const Vec3 way = q - p, from = axes_.along(p), inverse = axes_.along(way).cwiseInverse();
  double free = 1;
  const auto rejects = [&](const Box& box) {
    const Eigen::Array3d a = (box.lower - from).cwiseProduct(inverse),
                         b = (box.upper - from).cwiseProduct(inverse);
    return !(a.min(b).maxCoeff() <= std::min(a.max(b).minCoeff(), free)) || a.max(b).minCoeff() < 0;
  };
  tree_.any(rejects, [&](int piece) {
    // Moeller and Trumbore 1997.
    const auto [a, b, c] = corners(positions_, triangles_, pieces_[piece].triangle);
    const Vec3 ab = b - a, ac = c - a, n = way.cross(ac), from_a = p - a, m = from_a.cross(ab);
    const double det = ab.dot(n), u = from_a.dot(n) / det, v = way.dot(m) / det, t = ac.dot(m) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && t >= 0) free = std::min(free, t);
    return false;
  });
  return free;
}

}  // namespace limber::meshing
