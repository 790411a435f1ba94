// A tet mesh that grows and shrinks: for each vertex the tets round it, kept up to date.
#pragma once

#include <array>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

struct EditTets {
  explicit EditTets(const TetMesh&);

  std::vector<Vec3> positions;
  std::vector<std::array<int, 4>> tets;  // all −1 for one that was taken out
  std::vector<std::vector<int>> star;    // of each vertex, ascending
  int tet_count = 0;                     // not taken out

  // Without what was taken out, and without vertices of no tet.
  TetMesh mesh() const;
  std::array<Vec3, 4> corners(int tet) const;
  // The same with vertex v at another place.
  std::array<Vec3, 4> corners_with(int tet, int v, const Vec3& place) const;
  std::vector<int> tets_round(int v, int w) const;  // an edge; ascending
  // The two other vertices of each boundary triangle at v, so that (v, first, second) is seen counter-
  // clockwise from outside.
  std::vector<std::array<int, 2>> boundary_round(int v) const;
};

}  // namespace limber::meshing::detail
