// Models with known answers, for the tests of meshing.
#pragma once

#include <cmath>
#include <numbers>

#include "core/mesh.h"

namespace limber::meshing {

// Unit sphere about the origin: `rings` bands from pole to pole, twice as many sectors; each pole is one
// vertex.
inline SurfaceMesh made_sphere(int rings) {
  const int sectors = 2 * rings;
  SurfaceMesh mesh;
  mesh.positions.resize(2 + (rings - 1) * sectors, 3);
  mesh.positions.row(0) << 0, 0, 1;
  mesh.positions.row(1) << 0, 0, -1;
  const auto at = [&](int ring, int sector) { return 2 + (ring - 1) * sectors + sector % sectors; };
  for (int r = 1; r < rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const double polar = std::numbers::pi * r / rings, around = 2 * std::numbers::pi * s / sectors;
      mesh.positions.row(at(r, s)) << std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
          std::cos(polar);
    }
  mesh.triangles.resize(2 * sectors * (rings - 1), 3);
  int t = 0;
  for (int s = 0; s < sectors; ++s) {
    mesh.triangles.row(t++) << 0, at(1, s), at(1, s + 1);
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.triangles.row(t++) << at(r, s), at(r + 1, s), at(r + 1, s + 1);
      mesh.triangles.row(t++) << at(r, s), at(r + 1, s + 1), at(r, s + 1);
    }
    mesh.triangles.row(t++) << 1, at(rings - 1, s + 1), at(rings - 1, s);
  }
  return mesh;
}

// The triangles of made_sphere(rings) above z = 0; `rings` even, so that the rim is the equator.
inline SurfaceMesh made_hemisphere(int rings) {
  SurfaceMesh mesh = made_sphere(rings);
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    double height = 0;
    for (int k = 0; k < 3; ++k) height += mesh.positions(mesh.triangles(t, k), 2);
    if (height > 1e-9) mesh.triangles.row(kept++) = mesh.triangles.row(t).eval();
  }
  mesh.triangles.conservativeResize(kept, 3);
  return mesh;
}

}  // namespace limber::meshing
