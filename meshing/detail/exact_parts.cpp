#include "meshing/detail/exact_parts.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Nef_polyhedron_3.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_decomposition_3.h>

#include <cstring>
#include <string>

#include "core/error.h"
#include "meshing/detail/own_process.h"

namespace limber::meshing::detail {

namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Nef = CGAL::Nef_polyhedron_3<Kernel>;

// The points of a volume's outer shell.
struct PointCollector {
  std::vector<Vec3>& points;
  void visit(Nef::Vertex_const_handle v) {
    const auto& p = v->point();
    points.emplace_back(CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z()));
  }
  void visit(Nef::Halfedge_const_handle) {}
  void visit(Nef::Halffacet_const_handle) {}
  void visit(Nef::SHalfedge_const_handle) {}
  void visit(Nef::SHalfloop_const_handle) {}
  void visit(Nef::SFace_const_handle) {}
};

constexpr int cpu_seconds = 60;
constexpr Eigen::Index max_triangles = 2000;
constexpr const char* what_to_try = "; without --exact every model is taken";

Mesh mesh_of(const SurfaceMesh& surface) {
  Mesh mesh;
  for (Eigen::Index v = 0; v < surface.positions.rows(); ++v)
    mesh.add_vertex({surface.positions(v, 0), surface.positions(v, 1), surface.positions(v, 2)});
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const auto corner = [&](int k) { return Mesh::Vertex_index(std::uint32_t(surface.triangles(t, k))); };
    if (mesh.add_face(corner(0), corner(1), corner(2)) == Mesh::null_face())
      throw InputError(fmt::format("is not 2-manifold at triangle {}", t));
  }
  if (!CGAL::is_closed(mesh)) throw InputError("is not closed");
  if (CGAL::Polygon_mesh_processing::does_self_intersect(mesh)) throw InputError("intersects itself");
  CGAL::Polygon_mesh_processing::orient_to_bound_a_volume(mesh);
  return mesh;
}

// A part after the other: the number of its corners, then their coordinates.
std::string decomposed(const SurfaceMesh& surface) {
  Nef nef(mesh_of(surface));
  CGAL::convex_decomposition_3(nef);
  std::string bytes;
  const auto put = [&](double value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (auto volume = ++nef.volumes_begin(); volume != nef.volumes_end(); ++volume) {  // the first is outside
    if (!volume->mark()) continue;
    std::vector<Vec3> points;
    PointCollector collector{points};
    nef.visit_shell_objects(Nef::SFace_const_handle(volume->shells_begin()), collector);
    put(double(points.size()));
    for (const Vec3& p : points) put(p.x()), put(p.y()), put(p.z());
  }
  return bytes;
}

}  // namespace

std::vector<std::vector<Vec3>> exact_convex_parts(const SurfaceMesh& surface) {
  const auto refuse = [](const std::string& why) {
    throw InputError("the model to decompose exactly " + why + what_to_try);
  };
  if (surface.triangles.rows() > max_triangles)
    refuse(fmt::format("has {} triangles, and {} are the most", surface.triangles.rows(), max_triangles));
  // Its time grows with the square of the reflex edges, and nothing can stop it from inside.
  const OwnProcessResult result = run_in_own_process([&] { return decomposed(surface); }, cpu_seconds);
  if (!result.finished) refuse(result.bytes);
  std::vector<std::vector<Vec3>> parts;
  std::size_t at = 0;
  const auto get = [&] {
    double value = 0;
    std::memcpy(&value, result.bytes.data() + at, sizeof value);
    at += sizeof value;
    return value;
  };
  while (at < result.bytes.size()) {
    parts.emplace_back(std::size_t(get()));
    for (Vec3& p : parts.back())
      for (int k = 0; k < 3; ++k) p[k] = get();
  }
  return parts;
}

}  // namespace limber::meshing::detail
