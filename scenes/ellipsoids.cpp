// The union of ellipsoids, less some: f < 0 inside, polygonised by marching tetrahedra (each cell of a grid
// in six tets, Freudenthal), which always gives a closed manifold; then smoothed along the surface.
#include "scenes/detail/ellipsoids.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <unordered_map>
#include <vector>

#include "core/threads.h"

namespace limber::scenes {

namespace {

struct Placed {
  Eigen::Matrix3d own_from_world;
  Vec3 center, radii;
  double blend_m;
  bool hollow;

  // Whether g of this part is above a distance for sure: k1 ≤ k0 / r_min and k0 ≥ |p − center| / r_max, so g
  // ≥ (|p − center| / r_max − 1) r_min.
  bool is_beyond(double distance, const Vec3& p) const {
    const double reach = (1 + 1e-9) * (1 + std::max(distance, 0.0) / least_radius) * largest_radius;
    return (p - center).squaredNorm() > reach * reach;
  }
  double least_radius = radii.minCoeff(), largest_radius = radii.maxCoeff();
};

std::vector<Placed> placed(std::span<const Ellipsoid> parts, Sides sides) {
  std::vector<Placed> placed;
  for (const Ellipsoid& part : parts)
    for (const double side : {1.0, -1.0}) {
      if (side < 0 && (sides == Sides::one || part.center.y() == 0)) continue;
      const auto radians = [](double deg) { return deg * std::numbers::pi / 180; };
      const Eigen::Matrix3d turn = (Eigen::AngleAxisd(radians(part.roll_deg * side), Vec3::UnitX()) *
                                    Eigen::AngleAxisd(radians(part.pitch_deg), Vec3::UnitY()))
                                       .toRotationMatrix();
      placed.push_back({turn.transpose(),
                        {part.center.x(), side * part.center.y(), part.center.z()},
                        part.radii,
                        part.blend_m,
                        part.hollow});
    }
  return placed;
}

class Union {
 public:
  Union(std::span<const Ellipsoid> parts, Sides sides) : parts_(placed(parts, sides)) {}
  // About the distance to the surface, negative inside.
  double operator()(const Vec3& p) const {
    double f = 1e9;
    for (const Placed& part : parts_) {
      // From here on it changes nothing.
      if (part.is_beyond(part.blend_m + (part.hollow ? -f : f), p)) continue;
      const Vec3 q = (part.own_from_world * (p - part.center)).cwiseQuotient(part.radii);
      const double k0 = q.norm(), k1 = q.cwiseQuotient(part.radii).norm();
      const double g = k1 > 0 ? k0 * (k0 - 1) / k1 : -part.radii.minCoeff();
      const auto bend = [&](double apart) {
        const double near = std::max(part.blend_m - std::abs(apart), 0.0) / part.blend_m;
        return near * near * part.blend_m / 4;
      };
      f = part.hollow ? std::max(f, -g) + bend(f + g) : std::min(f, g) - bend(f - g);
    }
    return f;
  }
  Vec3 gradient(const Vec3& p) const {
    constexpr double h = 1e-5;
    Vec3 g;
    for (int i = 0; i < 3; ++i)
      g[i] = ((*this)(p + h * Vec3::Unit(i)) - (*this)(p - h * Vec3::Unit(i))) / (2 * h);
    return g;
  }
  Vec3 nearer(const Vec3& p) const {  // one Newton step towards the surface
    const Vec3 g = gradient(p);
    return p - g * ((*this)(p) / std::max(g.squaredNorm(), 1e-6));
  }

 private:
  std::vector<Placed> parts_;
};

class MarchingTets {
 public:
  MarchingTets(const Union& f, const Box& box, double cell) : box_(box), cell_(cell) {
    for (int i = 0; i < 3; ++i) count_[std::size_t(i)] = int(std::ceil(box.size()[i] / cell)) + 1;
    value_.resize(std::size_t(count_[0]) * std::size_t(count_[1]) * std::size_t(count_[2]));
    parallel_for_many(int(value_.size()), [&](int n) { value_[std::size_t(n)] = f(point(n)); });
    constexpr int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                 {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};  // three even, three odd
    const std::array<int, 3> step{1, count_[0], count_[0] * count_[1]};
    for (int k = 0; k + 1 < count_[2]; ++k)
      for (int j = 0; j + 1 < count_[1]; ++j)
        for (int i = 0; i + 1 < count_[0]; ++i)
          for (int o = 0; o < 6; ++o) {
            const int a = i * step[0] + j * step[1] + k * step[2];
            const int b = a + step[std::size_t(order[o][0])], c = b + step[std::size_t(order[o][1])];
            const int d = c + step[std::size_t(order[o][2])];
            if (o < 3)
              cut({a, b, c, d});
            else
              cut({a, b, d, c});
          }
  }
  std::vector<Vec3> positions;
  std::vector<Eigen::Vector3i> triangles;

 private:
  Vec3 point(int n) const {
    const int i = n % count_[0], j = n / count_[0] % count_[1], k = n / count_[0] / count_[1];
    return box_.lower + cell_ * Vec3(i, j, k);
  }
  int crossing(int a, int b) {
    if (a > b) std::swap(a, b);
    const auto [entry, is_new] =
        vertex_from_edge_.try_emplace(std::int64_t(a) << 32 | b, int(positions.size()));
    if (is_new) {
      const double fa = value_[std::size_t(a)], fb = value_[std::size_t(b)];
      // Off the ends, so that no triangle shrinks to nothing; smoothing puts the vertex back on the surface.
      const double t = std::clamp(fa / (fa - fb), 0.1, 0.9);
      positions.push_back((1 - t) * point(a) + t * point(b));
    }
    return entry->second;
  }
  // A positive tet; triangles face from f < 0 to f ≥ 0.
  void cut(const std::array<int, 4>& tet) {
    // Even permutations that bring the corner, or the pair, to the front.
    constexpr int single[4][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}};
    constexpr int pair[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2},
                                {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
    std::array<bool, 4> in{};
    int count = 0;
    for (std::size_t c = 0; c < 4; ++c) count += in[c] = value_[std::size_t(tet[c])] < 0;
    const auto corner = [&](int c) { return tet[std::size_t(c)]; };
    if (count == 1 || count == 3)
      for (const auto& p : single)
        if (in[std::size_t(p[0])] == (count == 1)) {
          const int x = crossing(corner(p[0]), corner(p[1])), y = crossing(corner(p[0]), corner(p[2])),
                    z = crossing(corner(p[0]), corner(p[3]));
          triangles.emplace_back(x, count == 1 ? y : z, count == 1 ? z : y);
        }
    if (count == 2)
      for (const auto& p : pair)
        if (in[std::size_t(p[0])] && in[std::size_t(p[1])]) {
          const int ac = crossing(corner(p[0]), corner(p[2])), ad = crossing(corner(p[0]), corner(p[3])),
                    bd = crossing(corner(p[1]), corner(p[3])), bc = crossing(corner(p[1]), corner(p[2]));
          triangles.emplace_back(ac, ad, bd);
          triangles.emplace_back(ac, bd, bc);
        }
  }

  Box box_;
  double cell_;
  std::array<int, 3> count_{};
  std::vector<double> value_;
  std::unordered_map<std::int64_t, int>
      vertex_from_edge_;  // looked up only; the order of vertices is that of the sweep
};

void smooth(const Union& f, std::vector<Vec3>& positions, const std::vector<Eigen::Vector3i>& triangles) {
  for (int pass = 0; pass < 6; ++pass) {
    std::vector<Vec3> sum(positions.size(), Vec3::Zero());
    std::vector<int> count(positions.size());
    for (const Eigen::Vector3i& t : triangles)
      for (int c = 0; c < 3; ++c) {
        sum[std::size_t(t[c])] += positions[std::size_t(t[(c + 1) % 3])];
        ++count[std::size_t(t[c])];
      }
    parallel_for_many(int(positions.size()), [&](int n) {
      const std::size_t v = std::size_t(n);
      positions[v] = f.nearer(0.4 * positions[v] + 0.6 * sum[v] / count[v]);
    });
  }
}

}  // namespace

SurfaceMesh join(std::span<const Ellipsoid> parts, Sides sides, const Box& within, double cell_m) {
  const Union f(parts, sides);
  MarchingTets surface(f, within, cell_m);
  smooth(f, surface.positions, surface.triangles);
  SurfaceMesh mesh{Points(surface.positions.size(), 3), Triangles(surface.triangles.size(), 3)};
  for (std::size_t v = 0; v < surface.positions.size(); ++v)
    mesh.positions.row(Eigen::Index(v)) = surface.positions[v];
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    mesh.triangles.row(Eigen::Index(t)) = surface.triangles[t];
  const Box box = bounding_box(mesh.positions);
  mesh.positions.rowwise() -= box.center().transpose();
  mesh.positions /= box.size().z();
  return mesh;
}

}  // namespace limber::scenes
