#include "core/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace limber {

namespace {

void require_finite(const Points& positions, std::string_view what) {
  for (Eigen::Index v = 0; v < positions.rows(); ++v)
    if (!positions.row(v).allFinite())
      throw InputError(fmt::format("{}: vertex {} is not finite ({} {} {})", what, v, positions(v, 0),
                                   positions(v, 1), positions(v, 2)));
}

template <class Rows>
void require_indices(const Rows& rows, Eigen::Index vertices, std::string_view what,
                     std::string_view element) {
  if (rows.rows() == 0) throw InputError(fmt::format("{}: holds no {}", what, element));
  for (Eigen::Index r = 0; r < rows.rows(); ++r)
    for (int i = 0; i < rows.cols(); ++i) {
      if (rows(r, i) < 0 || rows(r, i) >= vertices)
        throw InputError(fmt::format("{}: {} {} names vertex {}, but there are {} vertices", what, element, r,
                                     rows(r, i), vertices));
      for (int j = 0; j < i; ++j)
        if (rows(r, i) == rows(r, j))
          throw InputError(fmt::format("{}: {} {} names vertex {} twice", what, element, r, rows(r, i)));
    }
}

void validate_surface(const Points& positions, const Triangles& triangles, std::string_view what) {
  require_finite(positions, what);
  require_indices(triangles, positions.rows(), what, "triangle");
}

}  // namespace

void validate(const SurfaceMesh& mesh, std::string_view what) {
  validate_surface(mesh.positions, mesh.triangles, what);
}
void validate(const ConvexShell& shell, std::string_view what) {
  validate_surface(shell.vertices, shell.triangles, what);
}

void validate(const TetMesh& mesh, std::string_view what) {
  require_finite(mesh.positions, what);
  require_indices(mesh.tets, mesh.positions.rows(), what, "tet");
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t) {
    const auto p = [&](int i) { return Vec3(mesh.positions.row(mesh.tets(t, i))); };
    const double volume = signed_volume(p(0), p(1), p(2), p(3));
    if (!(volume > 0))
      throw InputError(
          fmt::format("{}: tet {} (vertices {} {} {} {}) has volume {:.3e}; {}", what, t, mesh.tets(t, 0),
                      mesh.tets(t, 1), mesh.tets(t, 2), mesh.tets(t, 3), volume,
                      volume < 0 ? "swap two of its vertices" : "its corners lie in a plane: leave it out"));
  }
}

Box bounding_box(const Points& positions) {
  Box box;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) box.include(Vec3(positions.row(v)));
  return box;
}

double signed_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6;
}

double volume(const TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t) {
    const auto p = [&](int i) { return Vec3(mesh.positions.row(mesh.tets(t, i))); };
    sum += signed_volume(p(0), p(1), p(2), p(3));
  }
  return sum;
}

double volume(const SurfaceMesh& mesh) {
  if (mesh.positions.rows() == 0) return 0;
  const Vec3 origin = mesh.positions.row(0);  // near the surface: no cancellation far from zero
  double sum = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const auto p = [&](int i) { return Vec3(mesh.positions.row(mesh.triangles(f, i))); };
    sum += signed_volume(origin, p(0), p(1), p(2));
  }
  return sum;
}

double area(const SurfaceMesh& mesh) {
  double sum = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const auto p = [&](int i) { return Vec3(mesh.positions.row(mesh.triangles(f, i))); };
    sum += 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).norm();
  }
  return sum;
}

Triangles boundary_triangles(const Tets& tets) {
  // Faces of a positive tet (a b c d), counter-clockwise from outside; face i misses vertex i.
  constexpr int face[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  struct Face {
    std::array<int, 3> key;
    int tet, side;
  };
  std::vector<Face> faces;
  faces.reserve(std::size_t(tets.rows()) * 4);
  for (int t = 0; t < tets.rows(); ++t)
    for (int i = 0; i < 4; ++i) {
      std::array<int, 3> key{tets(t, face[i][0]), tets(t, face[i][1]), tets(t, face[i][2])};
      std::sort(key.begin(), key.end());
      faces.push_back({key, t, i});
    }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return std::tie(a.key, a.tet, a.side) < std::tie(b.key, b.tet, b.side);
  });
  std::vector<std::array<int, 2>> single;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end].key == faces[i].key) ++end;
    if (end == i + 1) single.push_back({faces[i].tet, faces[i].side});
    i = end;
  }
  std::sort(single.begin(), single.end());
  Triangles triangles(Eigen::Index(single.size()), 3);
  for (std::size_t i = 0; i < single.size(); ++i)
    for (int k = 0; k < 3; ++k) triangles(Eigen::Index(i), k) = tets(single[i][0], face[single[i][1]][k]);
  return triangles;
}

std::vector<int> tets_without_interior_vertex(const Tets& tets) {
  std::vector<bool> outside(std::size_t(tets.rows() == 0 ? 0 : tets.maxCoeff() + 1), false);
  for (const int v : vertices_of(boundary_triangles(tets))) outside[std::size_t(v)] = true;
  std::vector<int> found;
  for (int t = 0; t < tets.rows(); ++t) {
    const auto at = [&](int corner) { return outside[std::size_t(tets(t, corner))]; };
    if (at(0) && at(1) && at(2) && at(3)) found.push_back(t);
  }
  return found;
}

TetMesh with_interior_vertices(TetMesh mesh) {
  const std::vector<int> cut = tets_without_interior_vertex(mesh.tets);
  Eigen::Index vertex = mesh.positions.rows(), tet = mesh.tets.rows();
  mesh.positions.conservativeResize(vertex + Eigen::Index(cut.size()), 3);
  mesh.tets.conservativeResize(tet + 3 * Eigen::Index(cut.size()), 4);
  for (const int t : cut) {
    const Eigen::RowVector4i corners = mesh.tets.row(t);
    mesh.positions.row(vertex).setZero();
    for (int c = 0; c < 4; ++c) mesh.positions.row(vertex) += mesh.positions.row(corners[c]) / 4;
    for (int c = 0; c < 4; ++c) {
      const Eigen::Index row = c == 0 ? t : tet++;
      mesh.tets.row(row) = corners;
      mesh.tets(row, c) = int(vertex);
    }
    ++vertex;
  }
  return mesh;
}

std::vector<int> vertices_of(const Triangles& triangles) {
  std::vector<int> vertices(triangles.data(), triangles.data() + triangles.size());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

Points vertex_normals(const Points& positions, const Triangles& triangles) {
  Points normals = Points::Zero(positions.rows(), 3);
  for (Eigen::Index f = 0; f < triangles.rows(); ++f) {
    const Vec3 a = positions.row(triangles(f, 0)), b = positions.row(triangles(f, 1)),
               c = positions.row(triangles(f, 2));
    const Eigen::RowVector3d twice_area = (b - a).cross(c - a).transpose();
    for (int i = 0; i < 3; ++i) normals.row(triangles(f, i)) += twice_area;
  }
  for (Eigen::Index v = 0; v < normals.rows(); ++v)
    if (const double length = normals.row(v).norm(); length > 0) normals.row(v) /= length;
  return normals;
}

}  // namespace limber
