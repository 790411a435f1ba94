// Meshes and worlds that tests and benchmarks share.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "fem/world.h"

namespace limber::fem::testing {

// The nodes of a box cut into nx × ny × nz cells, and its cells' tets by their corners: corner bits are x, y,
// z.
template <class Cut>
TetMesh grid_of(const Vec3& lower, const Vec3& size, int nx, int ny, int nz, int tets_a_cell,
                const Cut& cut) {
  TetMesh mesh;
  mesh.positions.resize((nx + 1) * (ny + 1) * (nz + 1), 3);
  mesh.tets.resize(tets_a_cell * nx * ny * nz, 4);
  const auto node = [&](int i, int j, int k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i)
        mesh.positions.row(node(i, j, k)) =
            (lower + size.cwiseProduct(Vec3(double(i) / nx, double(j) / ny, double(k) / nz))).transpose();
  int t = 0;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        cut((i + j + k) % 2 == 1, [&](const auto& corners) {
          Eigen::RowVector4i tet;
          for (int c = 0; c < 4; ++c)
            tet[c] = node(i + (corners[c] & 1), j + ((corners[c] >> 1) & 1), k + (corners[c] >> 2));
          const auto p = [&](int a) { return Vec3(mesh.positions.row(tet[a])); };
          if (signed_volume(p(0), p(1), p(2), p(3)) < 0) std::swap(tet[2], tet[3]);
          mesh.tets.row(t++) = tet;
        });
  return mesh;
}

// Five tets a cell; neighbouring cells are mirrored so that faces match.
inline TetMesh grid(const Vec3& lower, const Vec3& size, int nx, int ny, int nz) {
  return grid_of(lower, size, nx, ny, nz, 5, [](bool mirrored, const auto& add) {
    constexpr int five[5][4] = {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}};
    for (const auto& f : five) {
      const int flip = mirrored ? 1 : 0;
      add(std::array{f[0] ^ flip, f[1] ^ flip, f[2] ^ flip, f[3] ^ flip});
    }
  });
}

// Six tets a cell, all round the same diagonal: a mesh that leans, whose neighbourhoods have no symmetry but
// one.
inline TetMesh leaning_grid(const Vec3& lower, const Vec3& size, int nx, int ny, int nz) {
  return grid_of(lower, size, nx, ny, nz, 6, [](bool, const auto& add) {
    for (int first = 0; first < 3; ++first)
      for (int second = 0; second < 3; ++second)
        if (first != second) add(std::array{0, 1 << first, (1 << first) | (1 << second), 7});
  });
}

inline TetMesh cube(const Vec3& center, double edge, int cells) {
  return grid(center - Vec3::Constant(edge / 2), Vec3::Constant(edge), cells, cells, cells);
}

// A cube's grid pulled most of the way onto a ball; all the way, its corner tets would be flat.
inline TetMesh ball(const Vec3& center, double radius, int cells) {
  TetMesh mesh = cube(Vec3::Zero(), 2, cells);
  for (int n = 0; n < mesh.positions.rows(); ++n) {
    const Vec3 p = mesh.positions.row(n);
    const double length = p.norm();
    const double onto_ball = length > 0 ? p.cwiseAbs().maxCoeff() / length : 1;
    mesh.positions.row(n) = (center + radius * (0.7 * onto_ball + 0.3 * 0.7) * p).transpose();
  }
  return mesh;
}

inline std::vector<int> nodes_where(const TetMesh& mesh, const std::function<bool(const Vec3&)>& chosen) {
  std::vector<int> nodes;
  for (int n = 0; n < mesh.positions.rows(); ++n)
    if (chosen(mesh.positions.row(n))) nodes.push_back(n);
  return nodes;
}

// Free space round one body, no walls, no gravity.
inline WorldSpec alone(BodySpec body) {
  WorldSpec spec;
  spec.bodies = {std::move(body)};
  spec.bounds_m = {Vec3::Constant(-100), Vec3::Constant(100)};
  spec.walls = false;
  return spec;
}

// The paper's Barriers: a corridor 10 × 3 × 3, a soft cube of edge 1, and two soft plates that leave a gap of
// 0.8, one on the floor at x = 3.3, one under the ceiling at x = 6.3, their edges at the walls fixed.
// Fineness 1: 135 + 2 × 240 tets.
inline WorldSpec barriers(int fineness = 1, const Material& material = {}) {
  WorldSpec spec;
  spec.bounds_m = {Vec3(0, 0, 0), Vec3(10, 3, 3)};
  const int n = fineness == 1 ? 3 : 5;
  spec.bodies.push_back({"robot", cube({1, 1.5, 1.5}, 1, n), material, {}, BodyKind::deformable});
  for (const double x : {3.3, 6.3}) {
    const bool floor = x < 5;
    TetMesh plate = fineness == 1 ? grid({x, 0, floor ? 0 : 0.8}, {0.35, 3, 2.2}, 2, 6, 4)
                                  : grid({x, 0, floor ? 0 : 0.8}, {0.35, 3, 2.2}, 2, 11, 8);
    const auto fixed = nodes_where(plate, [&](const Vec3& p) {
      return p.y() < 1e-9 || p.y() > 3 - 1e-9 || (floor ? p.z() < 1e-9 : p.z() > 3 - 1e-9);
    });
    spec.bodies.push_back(
        {floor ? "floor_plate" : "ceiling_plate", plate, material, fixed, BodyKind::deformable});
  }
  return spec;
}

}  // namespace limber::fem::testing
