#include "meshing/certificate.h"

#include <algorithm>

#include "core/hash.h"
#include "core/progress.h"
#include "meshing/detail/box_tree.h"
#include "meshing/detail/manifold.h"
#include "meshing/quality.h"
#include "meshing/surface_tree.h"

namespace limber::meshing {
namespace {

std::int64_t count_outside(const Points& points, const TetMesh& cage) {
  std::vector<Box> boxes(std::size_t(cage.tets.rows()));
  const auto corner = [&](int t, int k) { return Vec3(cage.positions.row(cage.tets(t, k))); };
  for (std::size_t t = 0; t < boxes.size(); ++t)
    for (int k = 0; k < 4; ++k) boxes[t].include(corner(int(t), k));
  const detail::BoxTree tree(boxes);
  std::int64_t outside = 0;
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    throw_if_stopped();
    const Vec3 p = points.row(v);
    const auto rejects = [&](const Box& b) {
      return (p.array() < b.lower.array()).any() || (p.array() > b.upper.array()).any();
    };
    const bool found = tree.any(rejects, [&](int t) {
      return !rejects(boxes[t]) && tet_holds(corner(t, 0), corner(t, 1), corner(t, 2), corner(t, 3), p);
    });
    outside += !found;
  }
  return outside;
}

std::int64_t count_crossing(const SurfaceMesh& surface, const TetMesh& cage, const Triangles& boundary) {
  const SurfaceTree walls(cage.positions, boundary);
  std::int64_t crossing = 0;
  for (Eigen::Index f = 0; f < surface.triangles.rows(); ++f)
    crossing += walls.meets_triangle(surface.positions.row(surface.triangles(f, 0)),
                                     surface.positions.row(surface.triangles(f, 1)),
                                     surface.positions.row(surface.triangles(f, 2)));
  return crossing;
}

int count_inverted(const TetMesh& mesh) {
  int inverted = 0;
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t)
    inverted += orientation(mesh.positions.row(mesh.tets(t, 0)), mesh.positions.row(mesh.tets(t, 1)),
                            mesh.positions.row(mesh.tets(t, 2)), mesh.positions.row(mesh.tets(t, 3))) <= 0;
  return inverted;
}

}  // namespace

bool Certificate::holds() const {
  return vertices_outside == 0 && triangles_crossing == 0 && nonmanifold_edges == 0 &&
         nonmanifold_vertices == 0 && inverted_tets == 0;
}

Certificate certify(const SurfaceMesh& surface, const TetMesh& cage) {
  const Triangles boundary = boundary_triangles(cage.tets);
  const TetQuality quality = measure_quality(cage);
  Certificate c;
  c.vertices = surface.positions.rows();
  c.vertices_outside = count_outside(surface.positions, cage);
  c.triangles = surface.triangles.rows();
  c.triangles_crossing = count_crossing(surface, cage, boundary);
  const detail::ManifoldFaults faults = detail::manifold_faults(boundary, int(cage.positions.rows()));
  c.nonmanifold_edges = int(faults.edges.size());
  c.nonmanifold_vertices = int(faults.vertices.size());
  c.inverted_tets = count_inverted(cage);
  c.min_dihedral_deg = quality.min_dihedral_deg;
  c.max_dihedral_deg = quality.max_dihedral_deg;
  c.surface_hash = hash_of(surface);
  c.cage_hash = hash_of(cage);
  return c;
}

}  // namespace limber::meshing
