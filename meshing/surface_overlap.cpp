#include "meshing/surface_overlap.h"

#include <Eigen/SVD>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/highest_along.h"
#include "meshing/detail/closest_point.h"

namespace limber::meshing {

namespace {

using Tri = detail::Corners3;

constexpr int halvings = 7;  // of an edge, in search of its deepest point

bool meet(const Box& a, const Box& b) {
  return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}
double squared_gap(const Box& a, const Box& b) {
  return (a.lower - b.upper).cwiseMax(b.lower - a.upper).cwiseMax(0.0).squaredNorm();
}
double squared_distance_outside(const Box& box, const Vec3& p) {
  return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0).squaredNorm();
}
// From one point of a to one of b at most.
double squared_reach(const Box& a, const Box& b) {
  return (a.upper - b.lower).cwiseMax(b.upper - a.lower).squaredNorm();
}
double squared_reach(const Box& box, const Vec3& p) {
  return (p - box.lower).cwiseMax(box.upper - p).squaredNorm();
}
Box box_of(const Tri& t) { return {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])}; }

// Calls leaves(node of a, node of b) for the pairs of leaves that, like all above them, are not rejected. Of
// a surface and itself each pair comes once, a leaf and itself too, and rejects(n, n) asks of the pairs
// within n.
template <class Rejects, class Leaves>
void for_each_pair_of_leaves(const PlacedSurface& a, const PlacedSurface& b, const Rejects& rejects,
                             const Leaves& leaves) {
  if (a.boxes().empty() || b.boxes().empty()) return;
  const bool same = &a == &b;
  std::vector<std::pair<int, int>> pending{{0, 0}};
  while (!pending.empty()) {
    const auto [m, n] = pending.back();
    pending.pop_back();
    if (rejects(m, n)) continue;
    const auto &p = a.shape().tree.nodes[std::size_t(m)], &q = b.shape().tree.nodes[std::size_t(n)];
    if (p.leaf() && q.leaf()) {
      leaves(m, n);
    } else if (same && m == n) {
      pending.insert(pending.end(), {{p.left, p.left}, {p.right, p.right}, {p.left, p.right}});
    } else if (!p.leaf() && (q.leaf() || p.end - p.begin >= q.end - q.begin)) {
      pending.insert(pending.end(), {{p.right, n}, {p.left, n}});
    } else {
      pending.insert(pending.end(), {{m, q.right}, {m, q.left}});
    }
  }
}

// An edge of a surface, from vertex v to vertex w, and where on the way it passes through a triangle.
struct Crossing {
  int v, w;
  double at;        // 0: at v, 1: at w
  int of, through;  // the edge's own triangle, and the one that it passes through
};

// Calls found(edge of a, share of the way) for the edges of a, those whose bits are set, that pass through b.
template <class Found>
void for_each_crossing_edge(const Tri& a, unsigned edges, const Tri& b, const Found& found) {
  const double side[3] = {signed_volume(a[0], b[0], b[1], b[2]), signed_volume(a[1], b[0], b[1], b[2]),
                          signed_volume(a[2], b[0], b[1], b[2])};
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    if (!(edges >> k & 1) || (side[k] > 0) == (side[l] > 0)) continue;
    const double u = signed_volume(a[k], a[l], b[1], b[2]), v = signed_volume(a[k], a[l], b[2], b[0]),
                 w = signed_volume(a[k], a[l], b[0], b[1]);
    if ((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) found(k, side[k] / (side[k] - side[l]));
  }
}

void note_crossings(const PlacedSurface& a, int triangle, const Tri& corners, int through, const Tri& other,
                    std::vector<Crossing>& crossings) {
  for_each_crossing_edge(corners, a.shape().own_edges[std::size_t(triangle)], other, [&](int k, double at) {
    const auto row = a.shape().triangles.row(triangle);
    crossings.push_back({row[k], row[(k + 1) % 3], at, triangle, through});
  });
}

// A point of a surface by its triangle and weights, so that it can be found wherever the surface is.
struct SurfacePoint {
  int triangle;
  Vec3 weights;
};

Vec3 place_of(const PlacedSurface& surface, const SurfacePoint& point) {
  const Tri t = surface.corners(point.triangle);
  return point.weights[0] * t[0] + point.weights[1] * t[1] + point.weights[2] * t[2];
}

int corner_of(const PlacedSurface& surface, int triangle, int vertex) {
  const auto row = surface.shape().triangles.row(triangle);
  return row[0] == vertex ? 0 : row[1] == vertex ? 1 : 2;
}

SurfacePoint at_vertex(const PlacedSurface& surface, int v) {
  const int triangle = surface.shape().triangle_from_vertex[std::size_t(v)];
  SurfacePoint point{triangle, Vec3::Zero()};
  point.weights[corner_of(surface, triangle, v)] = 1;
  return point;
}

SurfacePoint on_edge(const PlacedSurface& surface, int triangle, int v, int w, double at) {
  SurfacePoint point{triangle, Vec3::Zero()};
  point.weights[corner_of(surface, triangle, v)] = 1 - at;
  point.weights[corner_of(surface, triangle, w)] = at;
  return point;
}

// Deepest of the points of `surface` that `inside(SurfacePoint)` says to be inside, by
// `depth(SurfacePoint, above)`, which may tell any value up to `above` where it is not above that. They are
// found from the edges that cross, from those vertices of `seeds` that are inside, and from there along
// edges.
template <class Inside, class Depth>
void deepen(const PlacedSurface& surface, std::vector<Crossing> crossings, const std::vector<int>& seeds,
            const Inside& inside, const Depth& depth, SurfaceOverlap& deepest) {
  const SurfaceShape& shape = surface.shape();
  enum State : std::uint8_t { unknown, outside, within };
  std::vector<State> state(std::size_t(shape.vertices), unknown);
  std::vector<int> region;
  const auto reach = [&](int v) {
    State& s = state[std::size_t(v)];
    if (s != unknown) return;
    s = inside(at_vertex(surface, v)) ? within : outside;
    if (s == within) region.push_back(v);
  };
  for (const Crossing& c : crossings) reach(c.v), reach(c.w);
  for (const int v : seeds) reach(v);
  for (std::size_t i = 0; i < region.size(); ++i)
    for (int n = shape.first_neighbour[std::size_t(region[i])];
         n < shape.first_neighbour[std::size_t(region[i]) + 1]; ++n)
      reach(shape.neighbours[std::size_t(n)]);

  const auto include = [&](const SurfacePoint& point, double value) {
    if (value > deepest.depth_m) deepest = {value, place_of(surface, point)};
  };
  std::vector<double> depth_of(region.empty() ? 0 : state.size(), 0.0);  // at most
  for (const int v : region) {
    const SurfacePoint point = at_vertex(surface, v);
    const double value = depth(point, deepest.depth_m);
    depth_of[std::size_t(v)] = value;
    include(point, value);
  }
  const auto along = [&](int triangle, int v, int w, double from, double to) {
    const auto end = [&](double at, int vertex) {
      if (at != 0 && at != 1) return 0.0;  // on the other surface
      return depth_of.empty() ? 0.0 : depth_of[std::size_t(vertex)];
    };
    const double length = (surface.vertex(w) - surface.vertex(v)).norm();
    Highest best{deepest.depth_m, 0};
    raise_along(
        from, end(from, v), to, end(to, w), length, halvings,
        [&](double at) { return depth(on_edge(surface, triangle, v, w, at), best.value); }, best);
    include(on_edge(surface, triangle, v, w, best.at), best.value);
  };
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& x, const Crossing& y) {
    return std::tie(x.v, x.w, x.at, x.through) < std::tie(y.v, y.w, y.at, y.through);
  });
  for (std::size_t first = 0, last; first < crossings.size(); first = last) {
    const Crossing& edge = crossings[first];
    std::vector<double> ends{0.0};
    for (last = first; last < crossings.size() && crossings[last].v == edge.v && crossings[last].w == edge.w;
         ++last)
      ends.push_back(crossings[last].at);
    ends.push_back(1.0);
    for (std::size_t k = 0; k + 1 < ends.size(); ++k)
      if (inside(on_edge(surface, edge.of, edge.v, edge.w, 0.5 * (ends[k] + ends[k + 1]))))
        along(edge.of, edge.v, edge.w, ends[k], ends[k + 1]);
  }
  // Edges of coarse triangles between two vertices inside, deepest on the way.
  for (int t = 0; t < int(shape.triangles.rows()) && !region.empty(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int v = shape.triangles(t, k), w = shape.triangles(t, (k + 1) % 3);
      if ((shape.own_edges[std::size_t(t)] >> k & 1) && state[std::size_t(v)] == within &&
          state[std::size_t(w)] == within &&
          !std::binary_search(
              crossings.begin(), crossings.end(), Crossing{v, w, 0, 0, 0},
              [](const Crossing& x, const Crossing& y) { return std::tie(x.v, x.w) < std::tie(y.v, y.w); }))
        along(t, v, w, 0, 1);
    }
}

std::vector<int> seeds_of(const PlacedSurface& surface, const PlacedSurface& other) {
  std::vector<int> seeds;
  for (const int v : surface.shape().vertex_of_component)
    if (const Vec3 p = surface.vertex(v); meet(other.box(), {p, p})) seeds.push_back(v);
  return seeds;
}

void include_points_of(const PlacedSurface& a, const PlacedSurface& b, const std::vector<Crossing>& crossings,
                       std::vector<int> seeds, SurfaceOverlap& deepest) {
  deepen(
      a, crossings, seeds, [&](const SurfacePoint& p) { return b.winding(place_of(a, p)) > 0.5; },
      [&](const SurfacePoint& p, double above) { return b.distance(place_of(a, p), above); }, deepest);
}

// As far, at least, must one of them go to leave the other.
void include_ball_in_both(const PlacedSurface& a, const PlacedSurface& b, SurfaceOverlap& deepest) {
  for (const Vec3& p : a.inner_places()) {
    if (!meet(b.box(), {p, p}) || !(b.winding(p) > 0.5 && a.winding(p) > 0.5)) continue;
    const double diameter = 2 * std::min(a.distance(p), b.distance(p));
    if (diameter > deepest.depth_m) deepest = {diameter, p};
  }
}

// What is less is of rounding.
double min_depth(const PlacedSurface& surface) { return 1e-9 * surface.shape().size_m(); }

}  // namespace

SurfaceOverlap overlap(const PlacedSurface& a, const PlacedSurface& b) {
  if (!meet(a.box(), b.box())) return {};
  std::vector<Crossing> of_a, of_b;
  std::vector<int> seeds_a = seeds_of(a, b), seeds_b = seeds_of(b, a);
  for_each_pair_of_leaves(
      a, b, [&](int m, int n) { return !meet(a.boxes()[std::size_t(m)], b.boxes()[std::size_t(n)]); },
      [&](int m, int n) {
        const auto &p = a.shape().tree.nodes[std::size_t(m)], &q = b.shape().tree.nodes[std::size_t(n)];
        for (int t = p.begin; t < p.end; ++t) {
          const Tri one = a.corners(t);
          const Box box = box_of(one);
          if (!meet(box, b.boxes()[std::size_t(n)])) continue;
          for (int u = q.begin; u < q.end; ++u) {
            const Tri other = b.corners(u);
            if (!meet(box, box_of(other))) continue;
            const std::size_t before = of_a.size(), before_b = of_b.size();
            note_crossings(a, t, one, u, other, of_a);
            note_crossings(b, u, other, t, one, of_b);
            // The corners of what is passed through may be inside too.
            if (of_a.size() > before)
              for (int k = 0; k < 3; ++k) seeds_b.push_back(b.shape().triangles(u, k));
            if (of_b.size() > before_b)
              for (int k = 0; k < 3; ++k) seeds_a.push_back(a.shape().triangles(t, k));
          }
        }
      });
  const double least = std::max(min_depth(a), min_depth(b));
  SurfaceOverlap deepest{least, Vec3::Zero()};
  if (!of_a.empty() || !seeds_a.empty()) include_points_of(a, b, of_a, seeds_a, deepest);
  if (!of_b.empty() || !seeds_b.empty()) include_points_of(b, a, of_b, seeds_b, deepest);
  include_ball_in_both(a, b, deepest);
  include_ball_in_both(b, a, deepest);
  return deepest.depth_m > least ? deepest : SurfaceOverlap{};
}

SurfaceGap gap(const PlacedSurface& a, const PlacedSurface& b, double farthest_m) {
  detail::Nearest nearest;
  nearest.squared_distance = farthest_m * farthest_m;
  const double before = nearest.squared_distance;
  for_each_pair_of_leaves(
      a, b,
      [&](int m, int n) {
        return squared_gap(a.boxes()[std::size_t(m)], b.boxes()[std::size_t(n)]) >= nearest.squared_distance;
      },
      [&](int m, int n) {
        const auto &p = a.shape().tree.nodes[std::size_t(m)], &q = b.shape().tree.nodes[std::size_t(n)];
        for (int t = p.begin; t < p.end; ++t)
          for (int u = q.begin; u < q.end; ++u) {
            const Tri one = a.corners(t), other = b.corners(u);
            if (squared_gap(box_of(one), box_of(other)) >= nearest.squared_distance) continue;
            bool cross = false;
            for_each_crossing_edge(one, 7, other, [&](int, double) { cross = true; });
            for_each_crossing_edge(other, 7, one, [&](int, double) { cross = true; });
            if (cross)
              nearest = {0, one[0], one[0]};
            else
              detail::include_triangles(one, other, nearest);
          }
      });
  if (a.boxes().empty() || b.boxes().empty()) return {farthest_m, Vec3::Zero()};
  if (nearest.squared_distance == before)
    nearest.on_a = a.vertex(a.shape().triangles(0, 0)), nearest.on_b = b.vertex(b.shape().triangles(0, 0));
  const bool enclosed = b.winding(nearest.on_a) > 0.5 || a.winding(nearest.on_b) > 0.5;
  return {enclosed ? 0 : std::sqrt(nearest.squared_distance), 0.5 * (nearest.on_a + nearest.on_b)};
}

namespace {

// Between 0 and π, by cosine and sine: no function of angles need be asked.
struct Angle {
  double cos = 1, sin = 0;
  static Angle of(double cosine) {
    const double c = std::clamp(cosine, -1.0, 1.0);
    return {c, std::sqrt(1 - c * c)};
  }
  static Angle straight() { return {-1, 0}; }
};
Angle operator+(const Angle& a, const Angle& b) {  // π where it would be more
  const double sin = a.sin * b.cos + a.cos * b.sin;
  const bool more = sin < 0 || (a.cos < 0 && b.cos < 0);
  return more ? Angle::straight() : Angle{a.cos * b.cos - a.sin * b.sin, sin};
}

// That holds the normals of a node's triangles. A piece of surface all of whose normals have a common
// half-space hardly ever passes through itself (Volino and Magnenat-Thalmann 1994).
struct Cone {
  Vec3 area_vector = Vec3::Zero(), axis = Vec3::Zero();
  Angle half_angle;
};
bool in_one_half(const Cone& a, const Cone& b) {
  const Angle both = a.half_angle + b.half_angle;
  return both.cos > -1 && a.axis.dot(b.axis) > -both.cos;
}

// Made when they are asked for, with those below them.
class Cones {
 public:
  explicit Cones(const PlacedSurface& surface)
      : surface_(surface), cones_(surface.boxes().size()), known_(cones_.size(), 0) {}

  const Cone& of(int node) {
    Cone& cone = cones_[std::size_t(node)];
    if (known_[std::size_t(node)]) return cone;
    known_[std::size_t(node)] = 1;
    const auto& place = surface_.shape().tree.nodes[std::size_t(node)];
    double least = 1;  // cosine
    if (place.leaf()) {
      for (int t = place.begin; t < place.end; ++t) cone.area_vector += area_vector(t);
      cone.axis = cone.area_vector.normalized();
      for (int t = place.begin; t < place.end; ++t) {
        const Vec3 area = area_vector(t);
        least = std::min(least, cone.axis.dot(area) / area.norm());
      }
    } else {
      const Cone* const parts[] = {&of(place.left), &of(place.right)};
      cone.area_vector = parts[0]->area_vector + parts[1]->area_vector;
      cone.axis = cone.area_vector.normalized();
      for (const Cone* part : parts)
        least = std::min(least, (Angle::of(cone.axis.dot(part->axis)) + part->half_angle).cos);
    }
    cone.half_angle = least > -1 ? Angle::of(least) : Angle::straight();
    return cone;
  }

 private:
  Vec3 area_vector(int triangle) const {
    const Tri t = surface_.corners(triangle);
    return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]);
  }
  const PlacedSurface& surface_;
  std::vector<Cone> cones_;
  std::vector<char> known_;
};

// A surface and where it was at rest.
class OwnSurface {
 public:
  OwnSurface(const PlacedSurface& now, const PlacedSurface& at_rest)
      : now_(now), rest_(at_rest), near_m_(own_neighbourhood * at_rest.box().size().maxCoeff()) {}

  // Whether every vertex is so near to where some rigid motion takes it from rest that no two places meet
  // which were not near there. Of triangles it then holds, too, however the vertices were moved.
  bool keeps_its_shape() {
    const Points &rest = rest_.positions(), &now = now_.positions();
    if (rest.rows() == 0) return true;
    const Eigen::RowVector3d rest_center = rest.colwise().mean(), center = now.colwise().mean();
    // Kabsch, A solution for the best rotation to relate two sets of vectors (1976).
    const Eigen::Matrix3d covariance = (rest.rowwise() - rest_center).transpose() * (now.rowwise() - center);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();  // of rows, from the right
    if (turn.determinant() < 0) {
      Eigen::Matrix3d u = svd.matrixU();
      u.col(2) = -u.col(2);
      turn = u * svd.matrixV().transpose();
    }
    const double most = 0.499 * near_m_;
    off_.resize(rest.rows(), 3);
    double farthest = 0;  // squared
    for (Eigen::Index v = 0; v < rest.rows(); ++v) {
      off_.row(v) = now.row(v) - center - (rest.row(v) - rest_center) * turn;
      farthest = std::max(farthest, off_.row(v).squaredNorm());
    }
    if (farthest <= most * most) return true;
    if (farthest <= useful_offs * useful_offs * near_m_ * near_m_)
      off_boxes_ = boxes_of(now_.shape().tree, now_.shape().triangles, off_);
    return false;
  }

  std::vector<Crossing> crossings(std::vector<int>& corners) const {
    std::vector<Crossing> found;
    Cones cones(now_);
    const double near2 = near_m_ * near_m_;
    for_each_pair_of_leaves(
        now_, now_,
        [&](int m, int n) {
          const std::size_t i = std::size_t(m), k = std::size_t(n);
          if (!meet(now_.boxes()[i], now_.boxes()[k])) return true;
          const Box a = rest_.boxes()[i], b = rest_.boxes()[k];
          const double gap2 = squared_gap(a, b);
          if (!off_boxes_.empty() && squared_reach(off_boxes_[i], off_boxes_[k]) < std::max(near2, gap2))
            return true;
          if (gap2 > near2) return false;
          return squared_reach(a, b) <= near2 ||
                 (is_a_part(m) && is_a_part(n) && in_one_half(cones.of(m), cones.of(n)));
        },
        [&](int m, int n) {
          const auto &p = now_.shape().tree.nodes[std::size_t(m)],
                     &q = now_.shape().tree.nodes[std::size_t(n)];
          for (int t = p.begin; t < p.end; ++t)
            for (int u = m == n ? t + 1 : q.begin; u < q.end; ++u) note_pair(t, u, found, corners);
        });
    return found;
  }

  // Whether other parts enclose the point once more than at rest. A vertex has many normals, so the question
  // is asked of a point beside it, within one triangle and a little off it.
  bool inside(const SurfacePoint& point) const {
    const SurfacePoint beside{point.triangle, 0.97 * point.weights + 0.03 * Vec3::Constant(1.0 / 3)};
    return now_.winding(above(now_, beside)) - rest_.winding(above(rest_, beside)) > 0.5;
  }

  // To the nearest surface of a part that is not near at rest and that the point is behind; 0 where there is
  // none.
  double depth(const SurfacePoint& point, double enough) const {
    const Vec3 p = place_of(now_, point), p_rest = place_of(rest_, point);
    const Tri own = rest_.corners(point.triangle);
    const Vec3 normal_rest = (own[1] - own[0]).cross(own[2] - own[0]).normalized();
    struct Pending {
      int node;
      double squared;
    };
    std::vector<Pending> stack{{0, squared_distance_outside(now_.box(), p)}};
    double best = 1e300;
    while (!stack.empty()) {
      const Pending top = stack.back();
      stack.pop_back();
      if (top.squared >= best ||
          squared_reach(rest_.boxes()[std::size_t(top.node)], p_rest) <= near_m_ * near_m_)
        continue;
      const auto& place = now_.shape().tree.nodes[std::size_t(top.node)];
      if (!place.leaf()) {
        Pending one{place.left, squared_distance_outside(now_.boxes()[std::size_t(place.left)], p)},
            other{place.right, squared_distance_outside(now_.boxes()[std::size_t(place.right)], p)};
        if (one.squared < other.squared) std::swap(one, other);
        stack.push_back(one), stack.push_back(other);
        continue;
      }
      for (int t = place.begin; t < place.end; ++t) {
        const Tri tri = now_.corners(t);
        const Vec3 to = detail::closest_on_triangle(tri, p) - p;
        const double squared = to.squaredNorm();
        if (squared >= best || to.dot((tri[1] - tri[0]).cross(tri[2] - tri[0])) < 0) continue;
        const Vec3 to_rest = detail::closest_on_triangle(rest_.corners(t), p_rest) - p_rest;
        const double rest = to_rest.norm();
        // The body's other side, straight behind the point, is only counted where it has come twice as near.
        const bool own_back = to_rest.dot(normal_rest) < -0.5 * rest;
        if (rest <= near_m_ || (own_back && 4 * squared > rest * rest)) continue;
        best = squared;
      }
      if (best <= enough * enough) break;
    }
    return best < 1e300 ? std::sqrt(best) : 0;
  }

 private:
  // What is larger hardly ever has its normals in one half, and would want the cones of all that is in it;
  // where offs tell of most, those are hardly ever wanted.
  bool is_a_part(int node) const {
    const auto& place = now_.shape().tree.nodes[std::size_t(node)];
    const Eigen::Index parts = off_boxes_.empty() ? 8 : 128;
    return parts * (place.end - place.begin) <= now_.shape().triangles.rows();
  }

  void note_pair(int t, int u, std::vector<Crossing>& found, std::vector<int>& corners) const {
    const auto one = now_.shape().triangles.row(t), other = now_.shape().triangles.row(u);
    for (const int v : one)
      for (const int w : other)
        if (v == w) return;
    const Tri a = now_.corners(t), b = now_.corners(u);
    if (!meet(box_of(a), box_of(b))) return;
    const std::size_t before = found.size();
    note_crossings(now_, t, a, u, b, found);
    note_crossings(now_, u, b, t, a, found);
    if (found.size() == before) return;
    detail::Nearest at_rest;
    detail::include_triangles(rest_.corners(t), rest_.corners(u), at_rest);
    if (at_rest.squared_distance <= near_m_ * near_m_)
      found.resize(before);
    else
      for (const auto& row : {one, other}) corners.insert(corners.end(), row.begin(), row.end());
  }

  // Off the surface by a thousandth of the way to the nearest side of the point's triangle, or less.
  static Vec3 above(const PlacedSurface& surface, const SurfacePoint& point) {
    const Tri t = surface.corners(point.triangle);
    const Vec3 area = (t[1] - t[0]).cross(t[2] - t[0]);
    const double longest = std::sqrt(
        std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()}));
    if (!(area.norm() > 0)) return place_of(surface, point);
    return place_of(surface, point) + 1e-5 / longest * area;
  }

  const PlacedSurface &now_, &rest_;
  double near_m_;
  // How far each vertex is from where the rigid motion takes it. Two places whose offs differ by less than
  // they were apart at rest do not meet. Boxes of the tree's nodes; none where they would tell nothing.
  static constexpr double useful_offs = 8;  // times what is near
  Points off_;
  std::vector<OuterBox> off_boxes_;
};

}  // namespace

SurfaceOverlap self_overlap(const PlacedSurface& now, const PlacedSurface& at_rest) {
  LIMBER_CHECK(&now.shape() == &at_rest.shape());
  OwnSurface own(now, at_rest);
  if (own.keeps_its_shape()) return {};
  std::vector<int> seeds;
  const std::vector<Crossing> crossings = own.crossings(seeds);
  if (crossings.empty()) return {};
  const double least = min_depth(now);
  SurfaceOverlap deepest{least, Vec3::Zero()};
  deepen(
      now, crossings, seeds, [&](const SurfacePoint& p) { return own.inside(p); },
      [&](const SurfacePoint& p, double above) { return own.depth(p, above); }, deepest);
  return deepest.depth_m > least ? deepest : SurfaceOverlap{};
}

}  // namespace limber::meshing
