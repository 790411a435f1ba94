// Models with known answers, for the tests of cages and of what they ask of a surface.
#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/random.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {

inline SurfaceMesh box_at_origin(const Vec3& size) {
  SurfaceMesh m{Points(8, 3), Triangles(12, 3)};
  for (int i = 0; i < 8; ++i)
    m.positions.row(i) << (i & 1) * size.x(), (i >> 1 & 1) * size.y(), (i >> 2) * size.z();
  m.triangles << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1,
      3, 5, 3, 7, 5;
  return m;
}

// A tube bent to a ring of radius 1: `thickness` its own radius.
inline SurfaceMesh made_ring(double thickness, int around, int across) {
  SurfaceMesh m{Points(around * across, 3), Triangles(2 * around * across, 3)};
  const double turn = 2 * std::numbers::pi;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double a = turn * i / around, b = turn * j / across, r = 1 + thickness * std::cos(b);
      m.positions.row(i * across + j) << r * std::cos(a), r * std::sin(a), thickness * std::sin(b);
      const int p = i * across + j, q = (i + 1) % around * across + j, s = i * across + (j + 1) % across,
                t = (i + 1) % around * across + (j + 1) % across;
      m.triangles.row(2 * (i * across + j)) << p, q, t;
      m.triangles.row(2 * (i * across + j) + 1) << p, t, s;
    }
  return m;
}

inline SurfaceMesh joined(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh m{Points(a.positions.rows() + b.positions.rows(), 3),
                Triangles(a.triangles.rows() + b.triangles.rows(), 3)};
  m.positions << a.positions, b.positions;
  m.triangles << a.triangles, b.triangles.array() + int(a.positions.rows());
  return m;
}

inline SurfaceMesh moved(SurfaceMesh m, const Vec3& by) {
  m.positions.rowwise() += by.transpose();
  return m;
}

// Without the vertices that no triangle names.
inline SurfaceMesh compact(const SurfaceMesh& m) {
  const std::vector<int> used = vertices_of(m.triangles);
  std::vector<int> row(std::size_t(m.positions.rows()), -1);
  SurfaceMesh c{Points(Eigen::Index(used.size()), 3), m.triangles};
  for (std::size_t i = 0; i < used.size(); ++i)
    c.positions.row(Eigen::Index(i)) = m.positions.row(used[i]), row[used[i]] = int(i);
  for (Eigen::Index i = 0; i < c.triangles.size(); ++i) c.triangles.data()[i] = row[c.triangles.data()[i]];
  return c;
}

// Triangles thrown about: open, crossing one another, no inside.
inline SurfaceMesh made_soup(int count) {
  Rng rng(11, 0);
  SurfaceMesh m{Points(3 * count, 3), Triangles(count, 3)};
  for (int f = 0; f < count; ++f) {
    const Vec3 center = 2 * rng.direction();
    for (int k = 0; k < 3; ++k) {
      m.positions.row(3 * f + k) = center + 0.4 * rng.direction();
      m.triangles(f, k) = 3 * f + k;
    }
  }
  return m;
}

// Add a model: every law gains a witness.
inline std::map<std::string, SurfaceMesh> models() {
  return {{"sphere", made_sphere(12)},
          {"box", box_at_origin({1, 2, 3})},
          {"torus", made_ring(0.25, 24, 10)},
          {"hemisphere", compact(made_hemisphere(8))},
          {"two spheres", joined(made_sphere(6), moved(made_sphere(6), {3, 0.2, 0.1}))},
          {"needle", box_at_origin({0.01, 0.01, 5})},
          {"soup", made_soup(60)}};
}

}  // namespace limber::meshing
