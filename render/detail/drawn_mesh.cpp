#include "render/detail/drawn_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/mesh.h"

namespace limber::render::detail {

namespace {

// Bit i of the lower 21 bits moves to bit 3i.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

std::vector<int> triangles_along_morton_curve(const Triangles& triangles, const Points& positions) {
  const Box box = bounding_box(positions);
  const double scale = (1 << 20) / std::max(box.size().maxCoeff(), 1e-300);
  std::vector<std::pair<std::uint64_t, int>> order(std::size_t(triangles.rows()));
  for (int t = 0; t < triangles.rows(); ++t) {
    const Vec3 middle =
        (positions.row(triangles(t, 0)) + positions.row(triangles(t, 1)) + positions.row(triangles(t, 2))) /
        3;
    const Vec3 cell = (middle - box.lower) * scale;
    order[t] = {spread(std::uint64_t(cell.x())) | spread(std::uint64_t(cell.y())) << 1 |
                    spread(std::uint64_t(cell.z())) << 2,
                t};
  }
  std::sort(order.begin(), order.end());
  std::vector<int> triangle_from_place(order.size());
  std::transform(order.begin(), order.end(), triangle_from_place.begin(),
                 [](const auto& entry) { return entry.second; });
  return triangle_from_place;
}

Vec3 area_vector(const Triangles& triangles, const Points& positions, int t) {
  const Vec3 a = positions.row(triangles(t, 0)), b = positions.row(triangles(t, 1)),
             c = positions.row(triangles(t, 2));
  return 0.5 * (b - a).cross(c - a);
}

// For each corner 3t + i, the least corner of its group: corners of one vertex that no crease parts.
std::vector<int> smoothing_groups(const Triangles& triangles, const Points& positions,
                                  double crease_angle_deg) {
  std::vector<int> parent(std::size_t(3 * triangles.rows()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int c) {
    while (parent[c] != c) c = parent[c] = parent[parent[c]];
    return c;
  };
  const auto join = [&](int a, int b) {
    a = root(a), b = root(b);
    parent[std::max(a, b)] = std::min(a, b);
  };

  struct Edge {
    int low, high, corner;  // corner: where the edge starts in its triangle
    auto operator<=>(const Edge&) const = default;
  };
  std::vector<Edge> edges;
  edges.reserve(parent.size());
  for (int t = 0; t < triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      const int a = triangles(t, i), b = triangles(t, (i + 1) % 3);
      edges.push_back({std::min(a, b), std::max(a, b), 3 * t + i});
    }
  std::sort(edges.begin(), edges.end());

  const double least_cosine = std::cos(crease_angle_deg * std::numbers::pi / 180);
  const auto vertex = [&](int corner) { return triangles(corner / 3, corner % 3); };
  const auto next = [](int corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
  for (std::size_t begin = 0, end; begin < edges.size(); begin = end) {
    for (end = begin + 1;
         end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high;)
      ++end;
    if (end - begin != 2) continue;  // a border, or more than two sheets: each its own
    const int a = edges[begin].corner, b = edges[begin + 1].corner;
    const bool same_way = vertex(a) == vertex(b);  // then the two are wound against each other
    const Vec3 na = area_vector(triangles, positions, a / 3), nb = area_vector(triangles, positions, b / 3);
    if ((same_way ? -1 : 1) * na.dot(nb) < least_cosine * na.norm() * nb.norm() || same_way) continue;
    join(a, next(b)), join(next(a), b);
  }
  std::vector<int> group(parent.size());
  for (int c = 0; c < int(parent.size()); ++c) group[c] = root(c);
  return group;
}

}  // namespace

DrawnMesh order_for_drawing(const Triangles& triangles, const Points& rest_positions,
                            double crease_angle_deg) {
  const bool split = crease_angle_deg < 180;
  const std::vector<int> group =
      split ? smoothing_groups(triangles, rest_positions, crease_angle_deg) : std::vector<int>();

  DrawnMesh mesh;
  mesh.corners.reserve(std::size_t(3 * triangles.rows()));
  std::vector<int> drawn_from_key(split ? group.size() : std::size_t(rest_positions.rows()), -1);
  std::vector<int> copies(std::size_t(rest_positions.rows()), 0);
  for (const int t : triangles_along_morton_curve(triangles, rest_positions))
    for (int i = 0; i < 3; ++i) {
      const int vertex = triangles(t, i);
      int& drawn = drawn_from_key[split ? group[3 * t + i] : vertex];
      if (drawn < 0) {
        drawn = int(mesh.vertex_from_drawn.size());
        mesh.vertex_from_drawn.push_back(vertex);
        ++copies[vertex];
      }
      mesh.corners.push_back(std::uint32_t(drawn));
    }
  for (const int vertex : mesh.vertex_from_drawn) mesh.at_crease.push_back(copies[vertex] > 1);
  for (int t = 0; t < int(mesh.corners.size() / 3); ++t)
    if (mesh.at_crease[mesh.corners[3 * t]] || mesh.at_crease[mesh.corners[3 * t + 1]] ||
        mesh.at_crease[mesh.corners[3 * t + 2]])
      mesh.crease_triangles.push_back(t);
  mesh.positions.resize(3 * mesh.vertex_from_drawn.size());
  mesh.normals.resize(3 * mesh.vertex_from_drawn.size());
  return mesh;
}

void deform(DrawnMesh& mesh, const Points& positions, const Points& normals) {
  using Rows = Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>>;
  const auto count = Eigen::Index(mesh.vertex_from_drawn.size());
  Rows drawn_positions(mesh.positions.data(), count, 3), drawn_normals(mesh.normals.data(), count, 3);
  const bool given = normals.rows() > 0;
  for (Eigen::Index d = 0; d < count; ++d)
    drawn_positions.row(d) = positions.row(mesh.vertex_from_drawn[d]).cast<float>();
  for (Eigen::Index d = 0; d < count; ++d)
    if (given && !mesh.at_crease[d])
      drawn_normals.row(d) = normals.row(mesh.vertex_from_drawn[d]).cast<float>();
    else
      drawn_normals.row(d).setZero();

  const auto add_area_vector = [&](int t) {
    const std::uint32_t* c = &mesh.corners[std::size_t(3 * t)];
    const auto p = [&](int i) { return Vec3(positions.row(mesh.vertex_from_drawn[c[i]])); };
    const Vec3f area = (p(1) - p(0)).cross(p(2) - p(0)).cast<float>();
    for (int i = 0; i < 3; ++i)
      if (!given || mesh.at_crease[c[i]]) drawn_normals.row(c[i]) += area;
  };
  if (given)
    for (const int t : mesh.crease_triangles) add_area_vector(t);
  else
    for (int t = 0; t < int(mesh.corners.size() / 3); ++t) add_area_vector(t);
  for (Eigen::Index d = 0; d < count; ++d)
    if (!given || mesh.at_crease[d]) {
      const float length = drawn_normals.row(d).norm();
      if (length > 0) drawn_normals.row(d) /= length;
    }
}

}  // namespace limber::render::detail
