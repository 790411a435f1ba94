// The faces of a tet mesh, sorted, so that what two tets share lies side by side.
#pragma once

#include <array>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

// One side of one tet: the face opposite `corner`.
struct TetFace {
  std::array<int, 3> vertices;  // ascending
  int tet, corner;
};

// Sorted by (vertices, tet); faces of two tets are successive.
std::vector<TetFace> tet_faces(const Tets&);

// For each tet, the lowest tet that it is joined to over shared faces.
std::vector<int> components(const Tets&);

// For each vertex of a mesh of `vertex_count`, the things (rows of `elements`) that name it: things[first[v]]
// … things[first[v + 1] − 1], ascending.
struct Stars {
  std::vector<int> first, things;
};
template <class Elements>
Stars stars(const Elements& elements, int vertex_count) {
  Stars s{std::vector<int>(std::size_t(vertex_count) + 1, 0), std::vector<int>(std::size_t(elements.size()))};
  for (Eigen::Index i = 0; i < elements.size(); ++i) ++s.first[elements.data()[i] + 1];
  for (int v = 0; v < vertex_count; ++v) s.first[v + 1] += s.first[v];
  std::vector<int> next(s.first.begin(), s.first.end() - 1);
  for (Eigen::Index e = 0; e < elements.rows(); ++e)
    for (Eigen::Index k = 0; k < elements.cols(); ++k) s.things[next[elements(e, k)]++] = int(e);
  return s;
}

}  // namespace limber::meshing::detail
