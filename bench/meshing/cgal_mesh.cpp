// cgal_mesh IN.off OUT.mesh TETS: CGAL's Mesh_3 on a closed surface, with sizes for about so many tets.
#define CGAL_MESH_3_NO_DEPRECATED_SURFACE_INDEX
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_polyhedron_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/polygon_mesh_to_polygon_soup.h>
#include <CGAL/Polyhedral_mesh_domain_3.h>
#include <CGAL/Polyhedron_3.h>
#include <CGAL/make_mesh_3.h>

#include <cmath>
#include <fstream>
#include <iostream>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polyhedron = CGAL::Polyhedron_3<Kernel>;
using Domain = CGAL::Polyhedral_mesh_domain_3<Polyhedron, Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

int main(int argc, char** argv) try {
  if (argc != 4) throw std::runtime_error("usage: cgal_mesh IN.off OUT.mesh TETS");
  Polyhedron surface;
  std::ifstream in(argv[1]);
  if (!(in >> surface) || surface.empty()) throw std::runtime_error("not a manifold surface");
  if (!CGAL::is_closed(surface)) throw std::runtime_error("the surface is not closed");
  if (!CGAL::is_triangle_mesh(surface)) throw std::runtime_error("not of triangles");
  const double volume = std::abs(CGAL::to_double(CGAL::Polygon_mesh_processing::volume(surface)));
  // A regular tet of edge h has the volume h³ / (6 √2).
  const double h = std::cbrt(6 * std::sqrt(2.0) * volume / std::atof(argv[3]));
  const Domain domain(surface);
  namespace p = CGAL::parameters;
  const Criteria criteria(p::facet_angle = 25, p::facet_size = h, p::facet_distance = 0.2 * h,
                          p::cell_radius_edge_ratio = 3, p::cell_size = h);
  const Complex mesh = CGAL::make_mesh_3<Complex>(domain, criteria);
  std::ofstream out(argv[2]);
  out.precision(17);
  mesh.output_to_medit(out);
  if (mesh.number_of_cells_in_complex() == 0) throw std::runtime_error("no tets");
} catch (const std::exception& error) {
  std::cerr << "cgal_mesh: " << error.what() << "\n";
  return 1;
}
