// Between the arrays of the interface and those of the modules: same layout, row by row.
#pragma once

#include <cstring>

#include "core/mesh.h"
#include "limber/mesh.h"

namespace limber::detail {

template <class Row, class Matrix>
std::vector<Row> rows_of(const Matrix& m) {
  static_assert(Matrix::IsRowMajor &&
                sizeof(Row) == Matrix::ColsAtCompileTime * sizeof(typename Matrix::Scalar));
  std::vector<Row> rows(std::size_t(m.rows()));
  if (!rows.empty()) std::memcpy(rows.data(), m.data(), rows.size() * sizeof(Row));
  return rows;
}

template <class Matrix, class Row>
Matrix matrix_of(const std::vector<Row>& rows) {
  static_assert(Matrix::IsRowMajor &&
                sizeof(Row) == Matrix::ColsAtCompileTime * sizeof(typename Matrix::Scalar));
  Matrix m(Eigen::Index(rows.size()), Matrix::ColsAtCompileTime);
  if (!rows.empty()) std::memcpy(m.data(), rows.data(), rows.size() * sizeof(Row));
  return m;
}

inline Vertices vertices_of(const Points& p) { return rows_of<std::array<double, 3>>(p); }
inline Points points_of(const Vertices& v) { return matrix_of<Points>(v); }

inline Mesh mesh_of(const SurfaceMesh& s) {
  return {vertices_of(s.positions), rows_of<std::array<int, 3>>(s.triangles)};
}
inline Mesh mesh_of(const ConvexShell& s) {
  return {vertices_of(s.vertices), rows_of<std::array<int, 3>>(s.triangles)};
}
inline SurfaceMesh surface_of(const Mesh& m) {
  return {points_of(m.vertices), matrix_of<Triangles>(m.faces)};
}
inline TetMesh tet_mesh_of(const Cage& c) { return {points_of(c.nodes), matrix_of<Tets>(c.tets)}; }
std::vector<ConvexShell> shells_of(const std::vector<Mesh>& hulls);

}  // namespace limber::detail
