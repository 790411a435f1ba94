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

inline SurfaceMesh made_box(const Vec3& size) {
  SurfaceMesh mesh;
  mesh.positions.resize(8, 3);
  for (int v = 0; v < 8; ++v)
    mesh.positions.row(v) << (v & 1) * size.x(), (v >> 1 & 1) * size.y(), (v >> 2) * size.z();
  mesh.triangles.resize(12, 3);
  mesh.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2,
      1, 3, 7, 1, 7, 5;
  return mesh;
}

// An L of arms 3 and 2 long and 1 wide, and 1.5 high: volume 6.
inline SurfaceMesh made_l_prism() {
  const double outline[6][2] = {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2}, {0, 2}};
  const int cap[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}};
  SurfaceMesh mesh;
  mesh.positions.resize(12, 3);
  mesh.triangles.resize(20, 3);
  int t = 0;
  for (int i = 0; i < 6; ++i) {
    const int next = (i + 1) % 6;
    mesh.positions.row(i) << outline[i][0], outline[i][1], 0;
    mesh.positions.row(i + 6) << outline[i][0], outline[i][1], 1.5;
    mesh.triangles.row(t++) << i, next, next + 6;
    mesh.triangles.row(t++) << i, next + 6, i + 6;
  }
  for (const auto& c : cap) {
    mesh.triangles.row(t++) << c[0], c[2], c[1];
    mesh.triangles.row(t++) << c[0] + 6, c[1] + 6, c[2] + 6;
  }
  return mesh;
}

// About the z axis, the middle of the tube 1 from it.
inline SurfaceMesh made_torus(double tube_radius, int around, int across) {
  SurfaceMesh mesh;
  mesh.positions.resize(around * across, 3);
  mesh.triangles.resize(2 * around * across, 3);
  const auto at = [&](int i, int j) { return i % around * across + j % across; };
  int t = 0;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double a = 2 * std::numbers::pi * i / around, b = 2 * std::numbers::pi * j / across;
      const double radius = 1 + tube_radius * std::cos(b);
      mesh.positions.row(at(i, j)) << radius * std::cos(a), radius * std::sin(a), tube_radius * std::sin(b);
      mesh.triangles.row(t++) << at(i, j), at(i + 1, j), at(i + 1, j + 1);
      mesh.triangles.row(t++) << at(i, j), at(i + 1, j + 1), at(i, j + 1);
    }
  return mesh;
}

// A rod askew, of needles as long as itself: no question to a tree of boxes may have to ask all of them.
inline SurfaceMesh rod_of_needles(int sides, double radius) {
  SurfaceMesh rod{Points(2 * sides, 3), Triangles(4 * sides - 4, 3)};
  const Vec3 along = Vec3(0.5, 1, 0.1), u = along.cross(Vec3::UnitX()).normalized(),
             v = along.cross(u).normalized();
  for (int i = 0; i < sides; ++i) {
    const double turn = 2 * std::numbers::pi * i / sides;
    const Vec3 out = radius * (std::cos(turn) * u + std::sin(turn) * v);
    rod.positions.row(i) = (Vec3(-2.9, 1, 0.6) + out).transpose();
    rod.positions.row(sides + i) = (Vec3(-2.9, 1, 0.6) + along + out).transpose();
    const int next = (i + 1) % sides;
    rod.triangles.row(2 * i) << i, next, sides + next;
    rod.triangles.row(2 * i + 1) << i, sides + next, sides + i;
  }
  for (int i = 1; i + 1 < sides; ++i) {
    rod.triangles.row(2 * sides + i - 1) << 0, i + 1, i;
    rod.triangles.row(3 * sides + i - 3) << sides, sides + i, sides + i + 1;
  }
  return rod;
}

}  // namespace limber::meshing
