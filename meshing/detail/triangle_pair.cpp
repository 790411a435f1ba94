#include "meshing/detail/triangle_pair.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <cmath>

namespace limber::meshing::detail {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Corners = std::array<int, 3>;
using Tri = std::array<Vec3, 3>;

// ── filters: a sign, or 0 where rounding might decide (bounds A of Shewchuk 1997)
// ───────────────────────────

int sign_beyond(double value, double bound) { return value > bound ? 1 : value < -bound ? -1 : 0; }

// The plane of a triangle, to ask many points on which side of it they lie.
struct Plane {
  explicit Plane(const Tri& t) : base(t[0]) {
    const Vec3 u = t[1] - t[0], v = t[2] - t[0];
    const Vec3 positive(u.y() * v.z(), u.z() * v.x(), u.x() * v.y()),
        negative(u.z() * v.y(), u.x() * v.z(), u.y() * v.x());
    normal = positive - negative;
    size = positive.cwiseAbs() + negative.cwiseAbs();
  }
  int side(const Vec3& p) const {
    const Vec3 w = p - base;
    const double det = w.x() * normal.x() + w.y() * normal.y() + w.z() * normal.z();
    const double permanent = w.cwiseAbs().dot(size);
    return permanent > 1e-280 ? sign_beyond(det, 7.7715611723761027e-16 * permanent) : 0;
  }
  // +1 or −1 when all of t surely lies there.
  int side(const Tri& t) const {
    const int first = side(t[0]);
    return first != 0 && first == side(t[1]) && first == side(t[2]) ? first : 0;
  }
  int main_axis() const {
    int axis;
    normal.cwiseAbs().maxCoeff(&axis);
    return axis;
  }
  Vec3 base, normal, size;
};

// Triangles seen along a coordinate axis: coordinates u and v alone, so nothing is rounded.
struct Shadow {
  explicit Shadow(int axis) : u((axis + 1) % 3), v((axis + 2) % 3) {}
  int turn(const Vec3& a, const Vec3& b, const Vec3& c) const {
    const double left = (a[u] - c[u]) * (b[v] - c[v]), right = (a[v] - c[v]) * (b[u] - c[u]);
    const double permanent = std::abs(left) + std::abs(right);
    return permanent > 1e-290 ? sign_beyond(left - right, 3.3306690738754716e-16 * permanent) : 0;
  }
  // Surely on opposite sides of the line a b.
  bool splits(const Vec3& a, const Vec3& b, const Vec3& one, const Vec3& other) const {
    const int side = turn(a, b, one);
    return side != 0 && turn(a, b, other) == -side;
  }
  // A side of `t` has all of `other` strictly beyond it.
  bool apart_by_a_side_of(const Tri& t, const Tri& other) const {
    for (int i = 0; i < 3; ++i) {
      const Vec3 &a = t[i], &b = t[(i + 1) % 3];
      const int inner = turn(a, b, t[(i + 2) % 3]);
      if (inner != 0 && turn(a, b, other[0]) == -inner && turn(a, b, other[1]) == -inner &&
          turn(a, b, other[2]) == -inner)
        return true;
    }
    return false;
  }
  // The same for two triangles with a common first corner: a line through it with one on each side.
  bool apart_but_for_the_first(const Tri& t, const Tri& other) const {
    for (const auto& [p, q] : {std::array{1, 2}, std::array{2, 1}}) {
      const int inner = turn(t[0], t[p], t[q]);
      if (inner != 0 && turn(t[0], t[p], other[1]) == -inner && turn(t[0], t[p], other[2]) == -inner)
        return true;
    }
    return false;
  }
  int u, v;
};

// ── exact
// ────────────────────────────────────────────────────────────────────────────────────────────────────────

Kernel::Point_3 point(const Vec3& p) { return {p.x(), p.y(), p.z()}; }
Kernel::Triangle_3 triangle(const Tri& t) { return {point(t[0]), point(t[1]), point(t[2])}; }
Kernel::Segment_3 segment(const Vec3& a, const Vec3& b) { return {point(a), point(b)}; }

bool strangers_meet(const Tri& a, const Tri& b) {
  const Plane plane_a(a), plane_b(b);
  if (plane_a.side(b) != 0 || plane_b.side(a) != 0) return false;
  for (const int axis : {plane_a.main_axis(), plane_b.main_axis()}) {
    const Shadow shadow(axis);
    if (shadow.apart_by_a_side_of(a, b) || shadow.apart_by_a_side_of(b, a)) return false;
    if (plane_a.main_axis() == plane_b.main_axis()) break;
  }
  return CGAL::do_intersect(triangle(a), triangle(b));
}

// a[0] is b[0].
bool cut_each_other_beyond_the_first(const Tri& a, const Tri& b) {
  const auto one_side = [](const Plane& plane, const Tri& t) {
    const int side = plane.side(t[1]);
    return side != 0 && side == plane.side(t[2]);
  };
  const Plane plane_a(a), plane_b(b);
  if (one_side(plane_a, b) || one_side(plane_b, a)) return false;
  const Shadow shadow(plane_a.main_axis());
  if (shadow.apart_but_for_the_first(a, b) || shadow.apart_but_for_the_first(b, a)) return false;
  return CGAL::do_intersect(segment(a[1], a[2]), triangle(b)) ||
         CGAL::do_intersect(segment(b[1], b[2]), triangle(a));
}

// The triangles e f p and e f q.
bool folded(const Vec3& e, const Vec3& f, const Vec3& p, const Vec3& q) {
  const Plane plane({e, f, p});
  if (plane.side(q) != 0 || Shadow(plane.main_axis()).splits(e, f, p, q)) return false;
  return CGAL::coplanar(point(e), point(f), point(p), point(q)) &&
         CGAL::coplanar_orientation(point(e), point(f), point(p), point(q)) == CGAL::POSITIVE;
}

}  // namespace

bool meet_beyond_what_they_share(const Points& positions, const Corners& a, const Corners& b) {
  // Which corners of each the other names too.
  std::array<bool, 3> shared_a{}, shared_b{};
  int shared = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (a[i] == b[j]) shared_a[i] = shared_b[j] = true, ++shared;
  // The corners, turned so that the one which stands alone comes first.
  const auto turned = [&](const Corners& t, const std::array<bool, 3>& is_shared, bool alone) {
    int first = 0;
    while (is_shared[first] != alone) ++first;
    return Tri{positions.row(t[first]), positions.row(t[(first + 1) % 3]), positions.row(t[(first + 2) % 3])};
  };
  switch (shared) {
    case 0:
      return strangers_meet({positions.row(a[0]), positions.row(a[1]), positions.row(a[2])},
                            {positions.row(b[0]), positions.row(b[1]), positions.row(b[2])});
    case 1:
      return cut_each_other_beyond_the_first(turned(a, shared_a, true), turned(b, shared_b, true));
    case 2: {
      const Tri p = turned(a, shared_a, false), q = turned(b, shared_b, false);
      return folded(p[1], p[2], p[0], q[0]);
    }
    default:
      return true;
  }
}

}  // namespace limber::meshing::detail
