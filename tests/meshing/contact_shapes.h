// Bodies with their contact shapes, for the tests of these.
#pragma once

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/random.h"
#include "meshing/contact_shape.h"
#include "tests/meshing/cage_models.h"

namespace limber::meshing {

// A box of n × n × n cells, six tets each about the diagonal (Kuhn).
inline TetMesh box_cage(const Box& box, int n) {
  TetMesh cage{Points((n + 1) * (n + 1) * (n + 1), 3), Tets(6 * n * n * n, 4)};
  const auto node = [&](const Eigen::Vector3i& at) { return (at[2] * (n + 1) + at[1]) * (n + 1) + at[0]; };
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        cage.positions.row(node({i, j, k})) = box.lower + Vec3(i, j, k).cwiseProduct(box.size()) / n;
  int t = 0;
  for (int cell = 0; cell < n * n * n; ++cell)
    for (const auto& order : {std::array{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}) {
      Eigen::Vector3i at(cell % n, cell / n % n, cell / (n * n));
      for (int c = 0; c < 4; ++c) {
        cage.tets(t, c) = node(at);
        if (c < 3) ++at[order[std::size_t(c)]];
      }
      const auto corner = [&](int c) { return Vec3(cage.positions.row(cage.tets(t, c))); };
      if (signed_volume(corner(0), corner(1), corner(2), corner(3)) < 0)
        std::swap(cage.tets(t, 2), cage.tets(t, 3));
      ++t;
    }
  return cage;
}

// A cage that stands off the surface by a tenth of its size.
inline TetMesh cage_of(const SurfaceMesh& surface, int n = 5) {
  Box box = bounding_box(surface.positions);
  const Vec3 margin = Vec3::Constant(0.1 * box.size().maxCoeff());
  box.lower -= margin, box.upper += margin;
  return box_cage(box, n);
}

inline double size_of(const SurfaceMesh& surface) {
  return bounding_box(surface.positions).size().maxCoeff();
}

struct Made {
  SurfaceMesh surface;
  TetMesh cage;
  ContactShapeReport report;
  ContactShape shape;
  explicit Made(SurfaceMesh s) : surface(std::move(s)), cage(cage_of(surface)) {
    shape = make_contact_shape(surface, cage, {}, &report);
  }
};

inline Vec3 point_of(const Box& box, Rng& rng) {
  return box.lower + Vec3(rng.uniform(), rng.uniform(), rng.uniform()).cwiseProduct(box.size());
}

// Evenly over the triangles, whatever their area.
inline Vec3 surface_point(const SurfaceMesh& s, Rng& rng) {
  const auto t = s.triangles.row(rng.below(int(s.triangles.rows())));
  double u = rng.uniform(), v = rng.uniform();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return (1 - u - v) * s.positions.row(t[0]) + u * s.positions.row(t[1]) + v * s.positions.row(t[2]);
}

inline double distance_to_box(const Vec3& p, const Vec3& size) {
  const Vec3 beyond = (p - 0.5 * size).cwiseAbs() - 0.5 * size;
  return beyond.cwiseMax(0).norm() + std::min(0.0, beyond.maxCoeff());
}

}  // namespace limber::meshing
