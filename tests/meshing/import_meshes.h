// Meshes made by rule, and ways to spoil them. All closed ones face outward.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh.h"
#include "core/random.h"

namespace limber::meshing {

inline SurfaceMesh cube() {  // unit, corner at the origin; vertex = x + 2y + 4z
  SurfaceMesh m{Points(8, 3), Triangles(12, 3)};
  for (int v = 0; v < 8; ++v) m.positions.row(v) << (v & 1), (v >> 1 & 1), (v >> 2 & 1);
  m.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1,
      3, 7, 1, 7, 5;
  return m;
}

inline SurfaceMesh sphere(
    int subdivisions) {  // unit radius, an octahedron refined: 8·4^subdivisions triangles
  std::vector<Vec3> p{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<int, 3>> f{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                    {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int round = 0; round < subdivisions; ++round) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [it, is_new] = middles.try_emplace(std::minmax(a, b), int(p.size()));
      if (is_new) p.push_back((p[a] + p[b]).normalized());
      return it->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : f) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    f = std::move(finer);
  }
  SurfaceMesh m{Points(p.size(), 3), Triangles(f.size(), 3)};
  for (std::size_t v = 0; v < p.size(); ++v) m.positions.row(v) = p[v];
  for (std::size_t t = 0; t < f.size(); ++t) m.triangles.row(t) << f[t][0], f[t][1], f[t][2];
  return m;
}

// A grid of around × across quads, joined at both ends by the rules given.
inline SurfaceMesh torus(int around = 24, int across = 12) {
  SurfaceMesh m{Points(around * across, 3), Triangles(2 * around * across, 3)};
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * j / across;
      m.positions.row(i * across + j) << (2 + 0.7 * std::cos(v)) * std::cos(u),
          (2 + 0.7 * std::cos(v)) * std::sin(u), 0.7 * std::sin(v);
      const int a = i * across + j, b = (i + 1) % around * across + j,
                c = (i + 1) % around * across + (j + 1) % across, d = i * across + (j + 1) % across;
      m.triangles.row(2 * a) << a, b, c;
      m.triangles.row(2 * a + 1) << a, c, d;
    }
  return m;
}

inline SurfaceMesh moebius_strip(int n = 24) {
  SurfaceMesh m{Points(2 * n, 3), Triangles(2 * n, 3)};
  for (int i = 0; i < n; ++i) {
    const double u = 2 * std::numbers::pi * i / n;
    for (int side = 0; side < 2; ++side) {
      const double s = (side ? 0.4 : -0.4), r = 2 + s * std::cos(u / 2);
      m.positions.row(2 * i + side) << r * std::cos(u), r * std::sin(u), s * std::sin(u / 2);
    }
    const bool last = i == n - 1;  // the ends meet upside down
    const int a = 2 * i, b = 2 * i + 1, c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
    m.triangles.row(2 * i) << a, c, b;
    m.triangles.row(2 * i + 1) << b, c, d;
  }
  return m;
}

inline SurfaceMesh merged(const std::vector<SurfaceMesh>& parts) {
  SurfaceMesh all{Points(0, 3), Triangles(0, 3)};
  for (const SurfaceMesh& part : parts) {
    const Eigen::Index v = all.positions.rows(), t = all.triangles.rows();
    all.positions.conservativeResize(v + part.positions.rows(), 3);
    all.positions.bottomRows(part.positions.rows()) = part.positions;
    all.triangles.conservativeResize(t + part.triangles.rows(), 3);
    all.triangles.bottomRows(part.triangles.rows()) = (part.triangles.array() + int(v)).matrix();
  }
  return all;
}

inline SurfaceMesh moved(SurfaceMesh m, const Vec3& by) {
  m.positions.rowwise() += by.transpose();
  return m;
}
inline SurfaceMesh scaled(SurfaceMesh m, double by) {
  m.positions *= by;
  return m;
}
inline SurfaceMesh turned_inside_out(SurfaceMesh m) {
  m.triangles.col(1).swap(m.triangles.col(2));
  return m;
}
inline SurfaceMesh without_triangle(SurfaceMesh m, int t) {
  m.triangles.row(t) = m.triangles.row(m.triangles.rows() - 1).eval();
  m.triangles.conservativeResize(m.triangles.rows() - 1, 3);
  return m;
}
inline SurfaceMesh lower_half(const SurfaceMesh& m) {
  SurfaceMesh half{m.positions, Triangles(m.triangles.rows(), 3)};
  int kept = 0;
  for (int t = 0; t < m.triangles.rows(); ++t)
    if (m.positions(m.triangles(t, 0), 2) + m.positions(m.triangles(t, 1), 2) +
            m.positions(m.triangles(t, 2), 2) <
        0)
      half.triangles.row(kept++) = m.triangles.row(t);
  half.triangles.conservativeResize(kept, 3);
  return half;
}

// Each triangle with three vertices of its own, as STL has it.
inline SurfaceMesh exploded(const SurfaceMesh& m) {
  SurfaceMesh soup{Points(m.triangles.size(), 3), Triangles(m.triangles.rows(), 3)};
  for (int t = 0; t < m.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      soup.positions.row(3 * t + c) = m.positions.row(m.triangles(t, c));
      soup.triangles(t, c) = 3 * t + c;
    }
  return soup;
}

inline std::vector<int> permutation(int n, int seed) {
  Rng rng(std::uint64_t(seed), 0);
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  for (int i = n - 1; i > 0; --i) std::swap(order[i], order[rng.below(i + 1)]);
  return order;
}
inline SurfaceMesh shuffled(const SurfaceMesh& m, int seed) {  // vertices, triangles, and where each begins
  const std::vector<int> v = permutation(int(m.positions.rows()), seed),
                         t = permutation(int(m.triangles.rows()), seed + 1);
  SurfaceMesh out = m;
  for (int i = 0; i < int(v.size()); ++i) out.positions.row(v[i]) = m.positions.row(i);
  for (int i = 0; i < int(t.size()); ++i)
    for (int c = 0; c < 3; ++c) out.triangles(t[i], (c + i) % 3) = v[m.triangles(i, c)];
  return out;
}
inline SurfaceMesh jittered(SurfaceMesh m, double by, int seed) {
  Rng rng(std::uint64_t(seed), 0);
  for (int v = 0; v < m.positions.rows(); ++v) m.positions.row(v) += by * rng.direction();
  return m;
}
inline SurfaceMesh with_random_flips(SurfaceMesh m, int seed) {
  Rng rng(std::uint64_t(seed), 0);
  for (int t = 0; t < m.triangles.rows(); ++t)
    if (rng.uniform() < 0.4) std::swap(m.triangles(t, 0), m.triangles(t, 1));
  return m;
}

inline bool runs_along(const SurfaceMesh& m, int t, int a, int b) {
  for (int c = 0; c < 3; ++c)
    if (m.triangles(t, c) == a && m.triangles(t, (c + 1) % 3) == b) return true;
  return false;
}
inline std::pair<int, int> triangles_at_edge(const SurfaceMesh& m, int a, int b) {
  std::vector<int> at;
  for (int t = 0; t < m.triangles.rows(); ++t)
    if (runs_along(m, t, a, b) || runs_along(m, t, b, a)) at.push_back(t);
  return {at.at(0), at.at(1)};
}
// Triangle t becomes two, with `middle` on its side a–b.
inline SurfaceMesh split_side(SurfaceMesh m, int t, int a, int b, int middle) {
  const Eigen::RowVector3i old = m.triangles.row(t);
  m.triangles.conservativeResize(m.triangles.rows() + 1, 3);
  for (int c = 0; c < 3; ++c) {
    m.triangles(t, c) = old[c] == a ? middle : old[c];
    m.triangles(m.triangles.rows() - 1, c) = old[c] == b ? middle : old[c];
  }
  return m;
}

// Simple polygons, counter-clockwise; the last has a hole that a double edge joins to its rim.
inline std::vector<std::pair<std::string, std::vector<Eigen::Vector2d>>> polygons() {
  std::vector<std::pair<std::string, std::vector<Eigen::Vector2d>>> all{
      {"concave quad", {{0, 0}, {2, 0}, {0.5, 0.5}, {0, 2}}},
      {"concave quad from its reflex corner", {{0.5, 0.5}, {0, 2}, {0, 0}, {2, 0}}},
      {"L", {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}},
      {"U", {{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}}};
  std::vector<Eigen::Vector2d> comb, circle, star;
  for (int i = 0; i < 20; ++i) comb.emplace_back(i, 0);
  for (int i = 19; i >= 0; --i) comb.emplace_back(i + 0.1, i % 2 ? 5 : 0.5);
  for (int i = 0; i < 100; ++i) {
    const double a = 2 * std::numbers::pi * i / 100;
    circle.emplace_back(std::cos(a), std::sin(a));
    star.emplace_back((i % 2 ? 1 : 3) * std::cos(a), (i % 2 ? 1 : 3) * std::sin(a));
  }
  all.emplace_back("circle", circle), all.emplace_back("star", star);
  all.emplace_back("frame",
                   std::vector<Eigen::Vector2d>{
                       {0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}});
  return all;
}

}  // namespace limber::meshing
