#include "meshing/placed_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "meshing/detail/closest_point.h"
#include "meshing/winding_number.h"

namespace limber::meshing {

namespace {

constexpr int leaf_size = 4;
constexpr int max_depth = 64;    // median splits: the tree's depth is below 32
constexpr double far_radii = 3;  // a group is a dipole to points this many radii away
constexpr int inner_triangles = 16, most_inner_components = 64;

double squared_distance(const Box& box, const Vec3& p) {
  return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0).squaredNorm();
}

}  // namespace

std::vector<OuterBox> boxes_of(const detail::TriangleBvh& tree, const Triangles& triangles,
                               const Points& positions) {
  using Four = OuterBox::Four;
  std::vector<Four> at(std::size_t(positions.rows()));
  for (std::size_t v = 0; v < at.size(); ++v) {
    const double* const p = positions.data() + 3 * v;
    at[v] = Four{float(p[0]), float(p[1]), float(p[2]), 0};
  }
  const auto lesser = [](const Four& a, const Four& b) { return a < b ? a : b; };
  const auto greater = [](const Four& a, const Four& b) { return a > b ? a : b; };
  // More than what rounding to single precision takes from a coordinate and from the sum here.
  const auto rounding = [&](const Four& x) { return 4 * (1.0f / (1 << 24)) * greater(x, -x) + 1e-37f; };
  std::vector<OuterBox> boxes(tree.nodes.size());
  for (std::size_t n = boxes.size(); n-- > 0;) {
    const auto& place = tree.nodes[n];
    if (place.leaf()) {
      const int *v = triangles.data() + 3 * place.begin, *const last = triangles.data() + 3 * place.end;
      Four lower = at[std::size_t(*v)], upper = lower;
      while (++v != last) {
        const Four& p = at[std::size_t(*v)];
        lower = lesser(lower, p), upper = greater(upper, p);
      }
      boxes[n] = {lower - rounding(lower), upper + rounding(upper)};
    } else {
      const OuterBox &left = boxes[std::size_t(place.left)], &right = boxes[std::size_t(place.right)];
      boxes[n] = {lesser(left.lower, right.lower), greater(left.upper, right.upper)};
    }
  }
  return boxes;
}

SurfaceShape::SurfaceShape(const Points& rest, const Triangles& given)
    : triangles(given.rows(), 3),
      tree(detail::build_triangle_bvh(rest, given, leaf_size)),
      vertices(int(rest.rows())),
      own_edges(std::size_t(given.rows()), 0),
      triangle_from_vertex(std::size_t(vertices), -1),
      first_neighbour(std::size_t(vertices) + 1, 0),
      box(bounding_box(rest)) {
  for (Eigen::Index t = 0; t < given.rows(); ++t) triangles.row(t) = given.row(tree.order[std::size_t(t)]);
  std::iota(tree.order.begin(), tree.order.end(), 0);

  struct Edge {
    int low, high, triangle, corner;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * own_edges.size());
  std::vector<double> largest(std::size_t(vertices), -1.0);
  for (int t = 0; t < int(triangles.rows()); ++t) {
    const auto row = triangles.row(t);
    const Vec3 a = rest.row(row[0]), b = rest.row(row[1]), c = rest.row(row[2]);
    const double area = (b - a).cross(c - a).norm();
    for (int k = 0; k < 3; ++k) {
      const int v = row[k], w = row[(k + 1) % 3];
      edges.push_back({std::min(v, w), std::max(v, w), t, k});
      if (area > largest[std::size_t(v)])
        largest[std::size_t(v)] = area, triangle_from_vertex[std::size_t(v)] = t;
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return std::tie(x.low, x.high, x.triangle, x.corner) < std::tie(y.low, y.high, y.triangle, y.corner);
  });
  const auto is_new = [&](std::size_t i) {
    return i == 0 || edges[i].low != edges[i - 1].low || edges[i].high != edges[i - 1].high;
  };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!is_new(i)) continue;
    own_edges[std::size_t(edges[i].triangle)] |= std::uint8_t(1 << edges[i].corner);
    ++first_neighbour[std::size_t(edges[i].low) + 1], ++first_neighbour[std::size_t(edges[i].high) + 1];
  }
  std::partial_sum(first_neighbour.begin(), first_neighbour.end(), first_neighbour.begin());
  neighbours.resize(std::size_t(first_neighbour.back()));
  std::vector<int> next(first_neighbour.begin(), first_neighbour.end() - 1);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!is_new(i)) continue;
    neighbours[std::size_t(next[std::size_t(edges[i].low)]++)] = edges[i].high;
    neighbours[std::size_t(next[std::size_t(edges[i].high)]++)] = edges[i].low;
  }

  std::vector<bool> seen(std::size_t(vertices), false);
  std::vector<int> open;
  for (int v = 0; v < vertices; ++v) {
    if (seen[std::size_t(v)] || triangle_from_vertex[std::size_t(v)] < 0) continue;
    vertex_of_component.push_back(v);
    seen[std::size_t(v)] = true;
    open.push_back(v);
    while (!open.empty()) {
      const std::size_t at = std::size_t(open.back());
      open.pop_back();
      for (int n = first_neighbour[at]; n < first_neighbour[at + 1]; ++n)
        if (const int w = neighbours[std::size_t(n)]; !seen[std::size_t(w)])
          seen[std::size_t(w)] = true, open.push_back(w);
    }
  }
}

PlacedSurface::PlacedSurface(const SurfaceShape& shape, Points positions)
    : shape_(&shape), positions_(std::move(positions)) {
  LIMBER_CHECK(int(positions_.rows()) == shape.vertices, positions_.rows(), shape.vertices);
  boxes_ = boxes_of(shape.tree, shape.triangles, positions_);
  for (int v = 0; v < shape.vertices; ++v)
    if (shape.triangle_from_vertex[std::size_t(v)] >= 0) box_.include(vertex(v));
}

void PlacedSurface::make_dipoles() const {
  dipoles_.resize(boxes_.size());
  std::vector<Box> boxes(boxes_.size());
  for (std::size_t n = dipoles_.size(); n-- > 0;) {
    const auto& place = shape_->tree.nodes[n];
    Box& box = boxes[n];
    Dipole& node = dipoles_[n];
    const auto add = [&](const Vec3& center, const Vec3& area_vector, double area) {
      node.center += area * center;
      node.area_vector += area_vector;
      node.area += area;
    };
    if (place.leaf()) {
      for (int t = place.begin; t < place.end; ++t) {
        const auto [a, b, c] = corners(t);
        box.include(a), box.include(b), box.include(c);
        const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
        add((a + b + c) / 3, area_vector, area_vector.norm());
      }
    } else {
      for (const int child : {place.left, place.right}) {
        const Dipole& part = dipoles_[std::size_t(child)];
        box.include(boxes[std::size_t(child)]);
        add(part.center, part.area_vector, part.area);
      }
    }
    node.center = node.area > 0 ? Vec3(node.center / node.area) : box.center();
    node.squared_radius = (node.center - box.lower).cwiseMax(box.upper - node.center).squaredNorm();
  }
}

double PlacedSurface::winding(const Vec3& point) const {
  if (boxes_.empty()) return 0;
  std::call_once(dipoles_asked_, [&] { make_dipoles(); });
  int stack[max_depth];
  int count = 0;
  stack[count++] = 0;
  double sum = 0;
  while (count > 0) {
    const int n = stack[--count];
    const Dipole& node = dipoles_[std::size_t(n)];
    const auto& place = shape_->tree.nodes[std::size_t(n)];
    const Vec3 r = node.center - point;
    const double r2 = r.squaredNorm();
    if (r2 > far_radii * far_radii * node.squared_radius) {
      sum += node.area_vector.dot(r) / (4 * std::numbers::pi * r2 * std::sqrt(r2));
    } else if (place.leaf()) {
      for (int t = place.begin; t < place.end; ++t) {
        const auto [a, b, c] = corners(t);
        sum += solid_angle_share(a, b, c, point);
      }
    } else {
      stack[count++] = place.right;
      stack[count++] = place.left;
    }
  }
  return sum;
}

const std::vector<Vec3>& PlacedSurface::inner_places() const {
  std::call_once(inner_places_asked_, [&] {
    std::vector<int> triangles;
    const std::int64_t all = shape_->triangles.rows();
    for (int k = 0; k < inner_triangles && all > 0; ++k)
      triangles.push_back(int(all * (2 * k + 1) / (2 * inner_triangles)));
    const auto& components = shape_->vertex_of_component;
    for (int k = 0; k < std::min(int(components.size()), most_inner_components); ++k)
      triangles.push_back(shape_->triangle_from_vertex[std::size_t(components[std::size_t(k)])]);
    std::sort(triangles.begin(), triangles.end());
    triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
    for (const int t : triangles) {
      const auto [a, b, c] = corners(t);
      const Vec3 middle = (a + b + c) / 3, normal = (b - a).cross(c - a).normalized();
      if (const double way = way_out(middle, -normal); normal.norm() > 0 && std::isfinite(way))
        inner_places_.push_back(middle - 0.5 * way * normal);
    }
  });
  return inner_places_;
}

double PlacedSurface::way_out(const Vec3& from, const Vec3& direction) const {
  const Vec3 inverse = direction.cwiseInverse();
  double nearest = std::numeric_limits<double>::infinity();
  const auto rejects = [&](const Box& box) {
    const Eigen::Array3d a = (box.lower - from).cwiseProduct(inverse),
                         b = (box.upper - from).cwiseProduct(inverse);
    return !(a.min(b).maxCoeff() <= std::min(a.max(b).minCoeff(), nearest)) || a.max(b).minCoeff() < 0;
  };
  int stack[max_depth];
  int count = 0;
  if (!boxes_.empty()) stack[count++] = 0;
  while (count > 0) {
    const int n = stack[--count];
    if (rejects(boxes_[std::size_t(n)])) continue;
    const auto& place = shape_->tree.nodes[std::size_t(n)];
    if (!place.leaf()) {
      stack[count++] = place.right;
      stack[count++] = place.left;
      continue;
    }
    for (int t = place.begin; t < place.end; ++t) {
      // Moeller and Trumbore 1997, of triangles that face along the direction.
      const auto [a, b, c] = corners(t);
      const Vec3 ab = b - a, ac = c - a, across = direction.cross(ac), from_a = from - a,
                 along = from_a.cross(ab);
      const double det = ab.dot(across);
      if (!(det < 0)) continue;
      const double u = from_a.dot(across) / det, v = direction.dot(along) / det, way = ac.dot(along) / det;
      if (u >= 0 && v >= 0 && u + v <= 1 && way > 0) nearest = std::min(nearest, way);
    }
  }
  return nearest;
}

Vec3 PlacedSurface::closest_point(const Vec3& point, double above) const {
  struct Pending {
    int node;
    double squared;
  } stack[max_depth];
  int count = 0;
  double best = 1e300;
  Vec3 closest = point;
  if (!boxes_.empty()) stack[count++] = {0, squared_distance(boxes_[0], point)};
  while (count > 0) {
    const Pending top = stack[--count];
    if (top.squared >= best) continue;
    const auto& place = shape_->tree.nodes[std::size_t(top.node)];
    if (place.leaf()) {
      for (int t = place.begin; t < place.end; ++t)
        if (const Vec3 q = detail::closest_on_triangle(corners(t), point); (q - point).squaredNorm() < best)
          best = (q - point).squaredNorm(), closest = q;
      if (best <= above * above) break;
      continue;
    }
    Pending one{place.left, squared_distance(boxes_[std::size_t(place.left)], point)},
        other{place.right, squared_distance(boxes_[std::size_t(place.right)], point)};
    if (one.squared < other.squared) std::swap(one, other);
    stack[count++] = one;
    stack[count++] = other;
  }
  return closest;
}

}  // namespace limber::meshing
