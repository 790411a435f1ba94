#include "fem/detail/overlap.h"

#include <algorithm>
#include <set>
#include <vector>

#include "core/highest_along.h"

namespace limber::fem::detail {
namespace {

bool meet(const Box& a, const Box& b) {
  return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}

template <class Row>
Box box_of(const Points& p, const Row& corners) {
  Box box;
  for (int i = 0; i < corners.size(); ++i) box.include(Vec3(p.row(corners[i])));
  return box;
}

Vec3 nearest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0;
  return a + t * (b - a);
}

// Whether p, moved along the normal n of (a b c), comes to lie in it.
bool is_above(const Vec3& p, const Vec3& n, const Vec3& a, const Vec3& b, const Vec3& c) {
  return n.squaredNorm() > 0 && n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
         n.dot((a - c).cross(p - c)) >= 0;
}

}  // namespace

Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  if (is_above(p, n, a, b, c)) return p - n.dot(p - a) / n.squaredNorm() * n;
  Vec3 nearest = nearest_on_segment(p, a, b);
  for (const Vec3& other : {nearest_on_segment(p, b, c), nearest_on_segment(p, c, a)})
    if ((p - other).norm() < (p - nearest).norm()) nearest = other;
  return nearest;
}

double distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  if (is_above(p, n, a, b, c)) return std::abs(n.dot(p - a)) / n.norm();
  return std::min({(p - nearest_on_segment(p, a, b)).norm(), (p - nearest_on_segment(p, b, c)).norm(),
                   (p - nearest_on_segment(p, c, a)).norm()});
}

namespace {

// The part of a body near a box.
struct Near {
  const Shape& shape;
  std::vector<int> tets, triangles;
  std::vector<Box> tet_boxes, triangle_boxes;
  std::vector<Box> surface_boxes;  // of all triangles

  Near(const Shape& s, const Box& region) : shape(s) {
    for (int t = 0; t < s.tets.rows(); ++t)
      if (const Box box = box_of(s.positions, s.tets.row(t)); meet(box, region))
        tets.push_back(t), tet_boxes.push_back(box);
    for (int f = 0; f < s.surface.rows(); ++f) {
      const Box& box = surface_boxes.emplace_back(box_of(s.positions, s.surface.row(f)));
      if (meet(box, region)) triangles.push_back(f), triangle_boxes.push_back(box);
    }
  }
  Vec3 corner(int node) const { return shape.positions.row(node); }

  bool contains(const Vec3& p) const {
    for (std::size_t k = 0; k < tets.size(); ++k) {
      if (!meet(tet_boxes[k], {p, p})) continue;
      const auto t = shape.tets.row(tets[k]);
      const Vec3 a = corner(t[0]), b = corner(t[1]), c = corner(t[2]), d = corner(t[3]);
      if (signed_volume(p, b, c, d) >= 0 && signed_volume(a, p, c, d) >= 0 &&
          signed_volume(a, b, p, d) >= 0 && signed_volume(a, b, c, p) >= 0)
        return true;
    }
    return false;
  }

  // Any distance to a triangle that is not above `enough` will do.
  double depth(const Vec3& p, double enough) const {
    double nearest = 1e300;
    for (int f = 0; f < shape.surface.rows() && nearest > enough; ++f) {
      const Box& box = surface_boxes[std::size_t(f)];
      if ((box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0).squaredNorm() >= nearest * nearest) continue;
      const auto t = shape.surface.row(f);
      nearest = std::min(nearest, distance_to_triangle(p, corner(t[0]), corner(t[1]), corner(t[2])));
    }
    return nearest;
  }

  Vec3 way_out(const Vec3& p) const {
    Vec3 nearest = Vec3::Constant(1e300);
    for (int f = 0; f < shape.surface.rows(); ++f) {
      const auto t = shape.surface.row(f);
      const Vec3 q = nearest_on_triangle(p, corner(t[0]), corner(t[1]), corner(t[2]));
      if ((p - q).norm() < (p - nearest).norm()) nearest = q;
    }
    return nearest - p;
  }

  // Where from a (0) to b (1) the segment crosses the surface, ascending.
  std::vector<double> crossings(const Vec3& a, const Vec3& b) const {
    std::vector<double> at;
    Box box;
    box.include(a), box.include(b);
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      if (!meet(triangle_boxes[k], box)) continue;
      const auto f = shape.surface.row(triangles[k]);
      const Vec3 u = corner(f[0]), v = corner(f[1]), w = corner(f[2]);
      const double da = signed_volume(a, u, v, w), db = signed_volume(b, u, v, w);
      if ((da > 0) == (db > 0)) continue;
      const double su = signed_volume(a, b, v, w), sv = signed_volume(a, b, w, u),
                   sw = signed_volume(a, b, u, v);
      if ((su >= 0 && sv >= 0 && sw >= 0) || (su <= 0 && sv <= 0 && sw <= 0)) at.push_back(da / (da - db));
    }
    std::sort(at.begin(), at.end());
    return at;
  }
};

std::set<std::pair<int, int>> edges_of(const Shape& shape) {
  std::set<std::pair<int, int>> edges;
  for (int f = 0; f < shape.surface.rows(); ++f)
    for (int i = 0; i < 3; ++i) edges.insert(std::minmax(shape.surface(f, i), shape.surface(f, (i + 1) % 3)));
  return edges;
}

// Calls each(p, q, places) for the edges of a that cross the surface of b: from p (0) to q (1), ascending.
template <class Each>
void for_each_crossing_edge(const Shape& a, const Near& near, const Box& region, const Each& each) {
  for (const auto& [i, j] : edges_of(a)) {
    const Vec3 p = a.positions.row(i), q = a.positions.row(j);
    Box box;
    box.include(p), box.include(q);
    if (!meet(box, region)) continue;
    if (const std::vector<double> at = near.crossings(p, q); !at.empty()) each(p, q, at);
  }
}

constexpr int halvings = 7;  // of a stretch inside, in search of its deepest point

// `side` is 1 where the overlap's way is a's, −1 where it is told for b.
void include_points_of(const Shape& a, const Shape& b, const Box& region, double side, Overlap& deepest) {
  const Near near(b, region);
  const auto include = [&](const Vec3& p, double depth) {
    if (depth > deepest.depth_m) deepest = {depth, p, side * near.way_out(p)};
  };
  const auto is_inside = [&](const Vec3& p) { return meet(region, {p, p}) && near.contains(p); };
  for (int v : vertices_of(a.surface))
    if (const Vec3 p = a.positions.row(v); is_inside(p)) include(p, near.depth(p, deepest.depth_m));
  for_each_crossing_edge(a, near, region, [&](const Vec3& p, const Vec3& q, std::vector<double> at) {
    at.insert(at.begin(), 0.0), at.push_back(1.0);
    const double length = (q - p).norm();
    const auto place = [&](double share) -> Vec3 { return p + share * (q - p); };
    Highest highest;
    const auto depth = [&](double share) { return near.depth(place(share), highest.value); };
    for (std::size_t k = 0; k + 1 < at.size(); ++k) {
      if (!is_inside(place(0.5 * (at[k] + at[k + 1])))) continue;
      highest = {deepest.depth_m, 0};
      // Where it crosses it is on the surface.
      const double from = k == 0 ? depth(0) : 0, to = k + 2 == at.size() ? depth(1) : 0;
      raise_along(at[k], from, at[k + 1], to, length, halvings, depth, highest);
      include(place(highest.at), highest.value);
    }
  });
}

int count_passing_edges(const Shape& a, const Shape& b, const Box& region) {
  const Near near(b, region);
  int count = 0;
  for_each_crossing_edge(a, near, region, [&](const Vec3& p, const Vec3& q, const std::vector<double>& at) {
    const auto is_inside = [&](double share) { return near.contains(p + share * (q - p)); };
    bool passes = false;
    for (std::size_t k = 0; k + 1 < at.size(); ++k) passes |= is_inside(0.5 * (at[k] + at[k + 1]));
    count += passes && !is_inside(0) && !is_inside(1);
  });
  return count;
}

// Where the boxes of two bodies overlap; lower above upper when they do not.
Box common_box(const Shape& a, const Shape& b) {
  const Box box_a = bounding_box(a.positions), box_b = bounding_box(b.positions);
  return {box_a.lower.cwiseMax(box_b.lower), box_a.upper.cwiseMin(box_b.upper)};
}
bool is_empty(const Box& box) { return (box.lower.array() > box.upper.array()).any(); }

}  // namespace

bool can_overlap(const Box& a, const Box& b) {
  return !is_empty({a.lower.cwiseMax(b.lower), a.upper.cwiseMin(b.upper)});
}

Overlap deepest_overlap(const Shape& a, const Shape& b) {
  Overlap deepest;
  const Box region = common_box(a, b);
  if (is_empty(region)) return deepest;
  include_points_of(a, b, region, 1, deepest);
  include_points_of(b, a, region, -1, deepest);
  return deepest;
}

int passing_edges(const Shape& a, const Shape& b) {
  const Box region = common_box(a, b);
  if (is_empty(region)) return 0;
  return count_passing_edges(a, b, region) + count_passing_edges(b, a, region);
}

}  // namespace limber::fem::detail
