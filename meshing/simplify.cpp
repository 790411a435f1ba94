#include "meshing/simplify.h"

#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <array>
#include <vector>

namespace limber::meshing {

namespace PMP = CGAL::Polygon_mesh_processing;
using Mesh = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;

SurfaceMesh simplify(const SurfaceMesh& fine, int triangles) {
  if (fine.triangles.rows() <= triangles) return fine;
  std::vector<Mesh::Point> points;
  for (Eigen::Index v = 0; v < fine.positions.rows(); ++v)
    points.emplace_back(fine.positions(v, 0), fine.positions(v, 1), fine.positions(v, 2));
  std::vector<std::array<std::size_t, 3>> soup;
  for (Eigen::Index t = 0; t < fine.triangles.rows(); ++t)
    soup.push_back({std::size_t(fine.triangles(t, 0)), std::size_t(fine.triangles(t, 1)),
                    std::size_t(fine.triangles(t, 2))});
  if (!PMP::is_polygon_soup_a_polygon_mesh(soup)) PMP::orient_polygon_soup(points, soup);
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, soup, mesh);
  // A closed surface has three edges to two triangles.
  CGAL::Surface_mesh_simplification::edge_collapse(
      mesh, CGAL::Surface_mesh_simplification::Count_stop_predicate<Mesh>(std::size_t(triangles) * 3 / 2));
  mesh.collect_garbage();
  SurfaceMesh coarse{Points(Eigen::Index(mesh.number_of_vertices()), 3),
                     Triangles(Eigen::Index(mesh.number_of_faces()), 3)};
  for (const auto v : mesh.vertices())
    for (int c = 0; c < 3; ++c) coarse.positions(Eigen::Index(v.idx()), c) = mesh.point(v)[c];
  for (const auto f : mesh.faces()) {
    int corner = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f)))
      coarse.triangles(Eigen::Index(f.idx()), corner++) = int(v.idx());
  }
  return coarse;
}

}  // namespace limber::meshing
