#include "ffd/detail/tet_locator.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

#include <Eigen/LU>

namespace limber::ffd::detail {

namespace {

constexpr int tets_in_a_leaf = 4;
// A walk through a mesh that is not Delaunay may run in circles; this is far more than any that arrives.
constexpr int max_walk = 200;

// The corners of the face opposite to corner k.
constexpr int face_of[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};

double squared_distance(const Box& box, const Vec3& p) {
  return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0).squaredNorm();
}

// Weights (for a and b; the rest is c's or none's) of the point of a segment or triangle nearest to p.
double nearest_on_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 along = b - a;
  return 1 - std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
}

Vec3 nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  const double wa = (b - p).cross(c - p).dot(normal) / area2, wb = (c - p).cross(a - p).dot(normal) / area2;
  if (wa >= 0 && wb >= 0 && wa + wb <= 1) return {wa, wb, 1 - wa - wb};
  const double ab = nearest_on_segment(a, b, p), bc = nearest_on_segment(b, c, p),
               ca = nearest_on_segment(c, a, p);
  const std::array<Vec3, 3> candidates = {Vec3(ab, 1 - ab, 0), Vec3(0, bc, 1 - bc), Vec3(1 - ca, 0, ca)};
  return *std::min_element(candidates.begin(), candidates.end(), [&](const Vec3& u, const Vec3& v) {
    return (u[0] * a + u[1] * b + u[2] * c - p).squaredNorm() <
           (v[0] * a + v[1] * b + v[2] * c - p).squaredNorm();
  });
}

}  // namespace

TetLocator::TetLocator(const TetMesh& mesh) : mesh_(mesh), tets_(std::size_t(mesh.tets.rows())) {
  const int count = int(mesh.tets.rows());
  for (int t = 0; t < count; ++t) {
    Tet& tet = tets_[std::size_t(t)];
    tet.d = corner(t, 3);
    Eigen::Matrix3d edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = corner(t, k) - tet.d;
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(tet.to_weights) = edges.inverse();
  }
  link_neighbours();
  order_.resize(tets_.size());
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(tets_.size());
  nodes_.emplace_back();
  split(0, 0, count);
}

void TetLocator::link_neighbours() {
  struct Face {
    std::array<int, 3> nodes;  // ascending
    int tet, k;
  };
  std::vector<Face> faces;
  faces.reserve(4 * tets_.size());
  for (int t = 0; t < int(tets_.size()); ++t)
    for (int k = 0; k < 4; ++k) {
      Face face{{}, t, k};
      for (int i = 0; i < 3; ++i) face.nodes[std::size_t(i)] = mesh_.tets(t, face_of[k][i]);
      std::sort(face.nodes.begin(), face.nodes.end());
      faces.push_back(face);
      tets_[std::size_t(t)].across[k] = -1;
    }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return std::tie(a.nodes, a.tet) < std::tie(b.nodes, b.tet); });
  for (std::size_t i = 1; i < faces.size(); ++i) {
    const Face &a = faces[i - 1], &b = faces[i];
    if (a.nodes != b.nodes) continue;
    tets_[std::size_t(a.tet)].across[a.k] = b.tet;
    tets_[std::size_t(b.tet)].across[b.k] = a.tet;
  }
}

void TetLocator::split(int node, int first, int count) {
  Box box, centers;
  const auto center = [&](int t) { return Vec3(corner(t, 0) + corner(t, 1) + corner(t, 2) + corner(t, 3)); };
  for (int i = first; i < first + count; ++i) {
    const int t = order_[std::size_t(i)];
    for (int k = 0; k < 4; ++k) box.include(corner(t, k));
    centers.include(center(t));
  }
  if (count <= tets_in_a_leaf) {
    nodes_[std::size_t(node)] = {box, first, count};
    return;
  }
  int axis = 0;
  centers.size().maxCoeff(&axis);
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [&](int s, int t) {
    return std::pair(center(s)[axis], s) < std::pair(center(t)[axis], t);
  });
  const int child = int(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[std::size_t(node)] = {box, child, 0};
  split(child, first, count / 2);
  split(child + 1, first + count / 2, count - count / 2);
}

// One step of iterative refinement removes the error of the inverse, which matters in flat tets.
Weights4 TetLocator::weights(int tet, const Vec3& p) const {
  const Tet& t = tets_[std::size_t(tet)];
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> to_weights(t.to_weights);
  const Vec3 rough = to_weights * (p - t.d);
  Vec3 missed = p - t.d;
  for (int k = 0; k < 3; ++k) missed -= rough[k] * (corner(tet, k) - t.d);
  const Vec3 w = rough + to_weights * missed;
  return {w[0], w[1], w[2], 1 - w[0] - w[1] - w[2]};
}

int TetLocator::walk(int from, const Vec3& p) const {
  int tet = from;
  for (int step = 0; step < max_walk; ++step) {
    const Tet& t = tets_[std::size_t(tet)];
    const double x = p[0] - t.d[0], y = p[1] - t.d[1], z = p[2] - t.d[2];
    const double* m = t.to_weights;
    double w[4] = {m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z,
                   m[6] * x + m[7] * y + m[8] * z, 0};
    w[3] = 1 - w[0] - w[1] - w[2];
    // Out through the most negative face that has a tet behind it.
    int exit = -1;
    double least = -tolerance;
    bool is_inside = true;
    for (int k = 0; k < 4; ++k) {
      if (w[k] >= -tolerance) continue;
      is_inside = false;
      if (w[k] < least && t.across[k] >= 0) exit = k, least = w[k];
    }
    if (is_inside) return tet;
    if (exit < 0) return -1;
    tet = t.across[exit];
  }
  return -1;
}

TetLocator::Nearest TetLocator::nearest_in(int tet, const Vec3& p) const {
  const Weights4 w = weights(tet, p);
  if (inside(w)) return {tet, 0, w};
  Nearest best;
  for (int k = 0; k < 4; ++k) {
    if (w[k] >= 0) continue;  // p is on the inner side of this face
    const int* f = face_of[k];
    const Vec3 on_face = nearest_on_triangle(corner(tet, f[0]), corner(tet, f[1]), corner(tet, f[2]), p);
    Nearest n{tet, 0, Weights4::Zero()};
    Vec3 point = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      n.weights[f[i]] = on_face[i];
      point += on_face[i] * corner(tet, f[i]);
    }
    n.distance2 = (point - p).squaredNorm();
    if (n.distance2 < best.distance2) best = n;
  }
  return best;
}

TetLocator::Nearest TetLocator::nearest(const Vec3& p) const {
  Nearest best;
  const auto better = [&](const Nearest& n) {
    if (n.distance2 != best.distance2) return n.distance2 < best.distance2;
    const double depth = n.weights.minCoeff(), best_depth = best.weights.minCoeff();
    return depth != best_depth ? depth > best_depth : n.tet < best.tet;
  };
  std::vector<std::pair<double, int>> open{{squared_distance(nodes_[0].box, p), 0}};
  while (!open.empty()) {
    const auto [distance2, index] = open.back();
    open.pop_back();
    if (distance2 > best.distance2) continue;
    const Node& node = nodes_[std::size_t(index)];
    for (int i = node.first; i < node.first + node.count; ++i)
      if (const Nearest n = nearest_in(order_[std::size_t(i)], p); better(n)) best = n;
    if (node.count > 0) continue;
    std::pair<double, int> near{squared_distance(nodes_[std::size_t(node.first)].box, p), node.first};
    std::pair<double, int> far{squared_distance(nodes_[std::size_t(node.first + 1)].box, p), node.first + 1};
    if (far < near) std::swap(near, far);
    open.push_back(far);
    open.push_back(near);
  }
  return best;
}

}  // namespace limber::ffd::detail
