#include "meshing/split_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "meshing/detail/edges.h"

namespace limber::meshing {

namespace {

using Edge = std::pair<int, int>;  // lower vertex first

double length(const std::vector<Vec3>& points, int a, int b) {
  return (points[std::size_t(std::max(a, b))] - points[std::size_t(std::min(a, b))]).norm();
}

// Within a factor of two, how many vertices it takes to cut all edges down to that length, and triangles that
// are longer both ways.
double vertices_needed(const SurfaceMesh& surface, double longest_m) {
  double needed = area(surface) / (longest_m * longest_m);
  detail::for_each_edge(detail::edge_uses(surface.triangles), [&](auto uses) {
    const double edge = (surface.positions.row(uses[0].upper) - surface.positions.row(uses[0].lower)).norm();
    needed += edge > longest_m ? edge / longest_m : 0;
  });
  return needed;
}

// Of one triangle whose corners are `v`, and the middles of its sides `m` (side k goes from corner k), −1
// where a side is not cut.
void cut(const std::vector<Vec3>& points, const std::array<int, 3>& v, const std::array<int, 3>& m,
         std::vector<std::array<int, 3>>& out) {
  const int cuts = (m[0] >= 0) + (m[1] >= 0) + (m[2] >= 0);
  if (cuts == 0) {
    out.push_back(v);
  } else if (cuts == 3) {
    out.insert(out.end(), {{v[0], m[0], m[2]}, {v[1], m[1], m[0]}, {v[2], m[2], m[1]}, m});
  } else if (cuts == 1) {
    const int k = m[0] >= 0 ? 0 : m[1] >= 0 ? 1 : 2;
    const int a = v[std::size_t(k)], b = v[std::size_t((k + 1) % 3)], c = v[std::size_t((k + 2) % 3)];
    const int middle = m[std::size_t(k)];
    out.insert(out.end(), {{a, middle, c}, {middle, b, c}});
  } else {
    // Side k is whole, from a to b; what is left beside c's corner is a quadrangle, cut by its shorter way.
    const int k = m[0] < 0 ? 0 : m[1] < 0 ? 1 : 2;
    const int a = v[std::size_t(k)], b = v[std::size_t((k + 1) % 3)], c = v[std::size_t((k + 2) % 3)];
    const int of_bc = m[std::size_t((k + 1) % 3)], of_ca = m[std::size_t((k + 2) % 3)];
    out.push_back({of_bc, c, of_ca});
    const double from_a = length(points, a, of_bc), from_b = length(points, b, of_ca);
    if (from_a < from_b || (from_a == from_b && a < b))
      out.insert(out.end(), {{a, b, of_bc}, {a, of_bc, of_ca}});
    else
      out.insert(out.end(), {{a, b, of_ca}, {b, of_bc, of_ca}});
  }
}

// Where the corners of a triangle were at the beginning: row i is of corner i.
struct OldCorners {
  int triangle;
  Eigen::Matrix3d weights;
};

// Of a piece of the triangle that cut() was given.
OldCorners of_piece(const std::array<int, 3>& piece, const std::array<int, 3>& v, const std::array<int, 3>& m,
                    const OldCorners& whole) {
  OldCorners of{whole.triangle, {}};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      if (piece[std::size_t(i)] == v[std::size_t(k)]) of.weights.row(i) = whole.weights.row(k);
      if (piece[std::size_t(i)] == m[std::size_t(k)])
        of.weights.row(i) = 0.5 * (whole.weights.row(k) + whole.weights.row((k + 1) % 3));
    }
  return of;
}

struct CutSurface {
  std::vector<Vec3> points;
  std::vector<std::array<int, 3>> triangles;
  std::vector<OldCorners> old_corners;  // of triangles, where they are wanted
};

// Nothing where it would take more new vertices than that: the cuts of a needle leave needles, whose sides
// nobody counts beforehand.
std::optional<CutSurface> cut_to(const SurfaceMesh& surface, double longest_m, int max_new_vertices,
                                 bool with_old_corners) {
  CutSurface now, next;
  for (Eigen::Index i = 0; i < surface.positions.rows(); ++i)
    now.points.emplace_back(surface.positions.row(i));
  const std::size_t max_points = now.points.size() + std::size_t(max_new_vertices);
  for (Eigen::Index i = 0; i < surface.triangles.rows(); ++i)
    now.triangles.push_back({surface.triangles(i, 0), surface.triangles(i, 1), surface.triangles(i, 2)});
  for (int t = 0; with_old_corners && t < int(now.triangles.size()); ++t)
    now.old_corners.push_back({t, Eigen::Matrix3d::Identity()});

  for (bool cut_some = true; cut_some;) {
    throw_if_stopped();
    std::map<Edge, int> middles;
    next.triangles.clear();
    next.old_corners.clear();
    cut_some = false;
    for (std::size_t t = 0; t < now.triangles.size(); ++t) {
      const std::array<int, 3>& v = now.triangles[t];
      std::array<int, 3> m{-1, -1, -1};
      for (std::size_t k = 0; k < 3; ++k) {
        const int a = v[k], b = v[(k + 1) % 3];
        if (length(now.points, a, b) <= longest_m) continue;
        const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), int(now.points.size()));
        if (fresh) now.points.push_back(0.5 * (now.points[std::size_t(a)] + now.points[std::size_t(b)]));
        m[k] = at->second, cut_some = true;
      }
      const std::size_t first = next.triangles.size();
      cut(now.points, v, m, next.triangles);
      for (std::size_t i = first; with_old_corners && i < next.triangles.size(); ++i)
        next.old_corners.push_back(of_piece(next.triangles[i], v, m, now.old_corners[t]));
    }
    if (now.points.size() > max_points) return std::nullopt;
    now.triangles.swap(next.triangles);
    now.old_corners.swap(next.old_corners);
  }
  return now;
}

}  // namespace

double longest_edge(const SurfaceMesh& surface, int tets, const SplitSettings& settings) {
  return settings.share * std::sqrt(area(surface)) / std::cbrt(double(tets));
}

SurfaceMesh split_long_edges(const SurfaceMesh& surface, double longest_m, const SplitSettings& settings,
                             CornerMap* corners) {
  while (vertices_needed(surface, longest_m) > settings.max_new_vertices) longest_m *= 2;
  std::optional<CutSurface> cut;
  for (; !cut; longest_m *= 2) cut = cut_to(surface, longest_m, settings.max_new_vertices, corners);
  SurfaceMesh out{Points(cut->points.size(), 3), Triangles(cut->triangles.size(), 3)};
  for (std::size_t i = 0; i < cut->points.size(); ++i) out.positions.row(Eigen::Index(i)) = cut->points[i];
  for (std::size_t i = 0; i < cut->triangles.size(); ++i)
    out.triangles.row(Eigen::Index(i)) << cut->triangles[i][0], cut->triangles[i][1], cut->triangles[i][2];
  if (!corners) return out;
  corners->triangle.clear();
  corners->weights.resize(3 * out.triangles.rows(), 3);
  for (const OldCorners& old : cut->old_corners) {
    corners->weights.middleRows<3>(3 * Eigen::Index(corners->triangle.size())) = old.weights;
    corners->triangle.push_back(old.triangle);
  }
  return out;
}

}  // namespace limber::meshing
