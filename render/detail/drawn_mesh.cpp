#include "render/detail/drawn_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
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

  const double min_cosine = std::cos(crease_angle_deg * std::numbers::pi / 180);
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
    if ((same_way ? -1 : 1) * na.dot(nb) < min_cosine * na.norm() * nb.norm() || same_way) continue;
    join(a, next(b)), join(next(a), b);
  }
  std::vector<int> group(parent.size());
  for (int c = 0; c < int(parent.size()); ++c) group[c] = root(c);
  return group;
}

}  // namespace

namespace {

// What a vertex shows; corners that show something else are copies of it.
using Shown = std::array<float, 5>;
Shown shown_at(const Appearance& a, Eigen::Index corner) {
  Shown shown{};
  if (a.uv.rows() > 0) shown[0] = float(a.uv(corner, 0)), shown[1] = float(a.uv(corner, 1));
  if (a.colors.rows() > 0)
    for (int c = 0; c < 3; ++c) shown[std::size_t(2 + c)] = float(a.colors(corner, c));
  return shown;
}

// `order`: of the triangles, sorted by material.
void split_at_seams(const std::vector<int>& order, const Appearance& a, DrawnMesh& mesh) {
  std::vector<Shown> shown(mesh.vertex_from_drawn.size());
  std::vector<char> seen(shown.size(), false);
  std::map<std::pair<std::uint32_t, Shown>, std::uint32_t> copies;
  for (std::size_t i = 0; i < mesh.corners.size(); ++i) {
    std::uint32_t& drawn = mesh.corners[i];
    const Shown here = shown_at(a, 3 * Eigen::Index(order[i / 3]) + Eigen::Index(i % 3));
    if (!seen[drawn]) shown[drawn] = here, seen[drawn] = true;
    if (shown[drawn] == here) continue;
    const auto [at, fresh] = copies.try_emplace({drawn, here}, std::uint32_t(shown.size()));
    if (fresh) {
      mesh.seam_copies.push_back(int(drawn));
      mesh.vertex_from_drawn.push_back(mesh.vertex_from_drawn[drawn]);
      mesh.at_crease.push_back(mesh.at_crease[drawn]);
      shown.push_back(here), seen.push_back(true);
    }
    drawn = at->second;
  }
  for (const Shown& s : shown) {
    if (a.uv.rows() > 0) mesh.uv.insert(mesh.uv.end(), {s[0], s[1]});
    for (std::size_t c = 2; c < 5 && a.colors.rows() > 0; ++c)
      mesh.colors.push_back(std::uint16_t(65535 * std::clamp(s[c], 0.f, 1.f) + 0.5f));
    if (a.colors.rows() > 0) mesh.colors.push_back(65535);
  }
  for (std::size_t t = 0; t < order.size(); ++t) {
    const int material = a.material_from_triangle[std::size_t(order[t])];
    if (mesh.batches.empty() || mesh.batches.back().material != material)
      mesh.batches.push_back({material, 3 * t, 0});
    mesh.batches.back().corners += 3;
  }
}

}  // namespace

DrawnMesh order_for_drawing(const Triangles& triangles, const Points& rest_positions, double crease_angle_deg,
                            const Appearance& appearance) {
  const bool split = crease_angle_deg < 180;
  const std::vector<int> group =
      split ? smoothing_groups(triangles, rest_positions, crease_angle_deg) : std::vector<int>();

  DrawnMesh mesh;
  mesh.corners.reserve(std::size_t(3 * triangles.rows()));
  std::vector<int> drawn_from_key(split ? group.size() : std::size_t(rest_positions.rows()), -1);
  std::vector<int> copies(std::size_t(rest_positions.rows()), 0);
  std::vector<int> order = triangles_along_morton_curve(triangles, rest_positions);
  if (!appearance.empty())
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return appearance.material_from_triangle[std::size_t(a)] <
             appearance.material_from_triangle[std::size_t(b)];
    });
  for (const int t : order)
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
  if (!appearance.empty()) split_at_seams(order, appearance, mesh);
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

  const Eigen::Index own = count - std::ssize(mesh.seam_copies);
  const auto add_area_vector = [&](int t) {
    std::array<std::uint32_t, 3> c;
    for (std::size_t i = 0; i < 3; ++i) {
      c[i] = mesh.corners[std::size_t(3 * t) + i];
      if (c[i] >= own) c[i] = std::uint32_t(mesh.seam_copies[c[i] - std::size_t(own)]);
    }
    const auto p = [&](std::size_t i) { return Vec3(positions.row(mesh.vertex_from_drawn[c[i]])); };
    const Vec3f area = (p(1) - p(0)).cross(p(2) - p(0)).cast<float>();
    for (std::size_t i = 0; i < 3; ++i)
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
  for (Eigen::Index d = own; d < count; ++d)
    drawn_normals.row(d) = drawn_normals.row(mesh.seam_copies[std::size_t(d - own)]);
}

}  // namespace limber::render::detail
