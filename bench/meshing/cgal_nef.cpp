// cgal_nef IN.off OUT.obj: CGAL's exact convex decomposition of a closed surface; one group a part, its
// hull's faces.
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Nef_polyhedron_3.h>
#include <CGAL/Polyhedron_3.h>
#include <CGAL/convex_decomposition_3.h>
#include <CGAL/convex_hull_3.h>

#include <fstream>
#include <iostream>
#include <map>

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using Nef = CGAL::Nef_polyhedron_3<Exact>;
using Rounded = CGAL::Exact_predicates_inexact_constructions_kernel;

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: cgal_nef IN.off OUT.obj");
  CGAL::Polyhedron_3<Exact> surface;
  std::ifstream in(argv[1]);
  if (!(in >> surface) || surface.empty()) throw std::runtime_error("not a manifold surface");
  if (!surface.is_closed()) throw std::runtime_error("the surface is not closed");
  Nef solid(surface);
  CGAL::convex_decomposition_3(solid);

  std::ofstream out(argv[2]);
  out.precision(17);
  int parts = 0, vertices = 0;
  // The first volume is the outer one.
  for (auto volume = ++solid.volumes_begin(); volume != solid.volumes_end(); ++volume) {
    if (!volume->mark()) continue;
    CGAL::Polyhedron_3<Exact> part;
    solid.convert_inner_shell_to_polyhedron(volume->shells_begin(), part);
    std::vector<Rounded::Point_3> points;
    for (auto v = part.vertices_begin(); v != part.vertices_end(); ++v)
      points.emplace_back(CGAL::to_double(v->point().x()), CGAL::to_double(v->point().y()),
                          CGAL::to_double(v->point().z()));
    CGAL::Polyhedron_3<Rounded> hull;
    CGAL::convex_hull_3(points.begin(), points.end(), hull);
    if (hull.size_of_facets() < 4) continue;
    out << "g part_" << parts++ << "\n";
    std::map<Rounded::Point_3, int> row;
    for (auto v = hull.vertices_begin(); v != hull.vertices_end(); ++v) {
      row[v->point()] = ++vertices;
      out << "v " << v->point() << "\n";
    }
    for (auto f = hull.facets_begin(); f != hull.facets_end(); ++f) {
      out << "f";
      auto h = f->facet_begin();
      do out << " " << row.at(h->vertex()->point());
      while (++h != f->facet_begin());
      out << "\n";
    }
  }
} catch (const std::exception& error) {
  std::cerr << "cgal_nef: " << error.what() << "\n";
  return 1;
}
