#include "meshing/detail/delaunay.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <algorithm>

#include "core/mesh.h"

namespace limber::meshing::detail {

std::vector<std::array<int, 4>> delaunay_tets(const Points& points) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Vertex = CGAL::Triangulation_vertex_base_with_info_3<int, Kernel>;
  using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<Vertex>>;
  Delaunay delaunay;
  for (int i = 0; i < points.rows(); ++i)
    delaunay.insert(Kernel::Point_3(points(i, 0), points(i, 1), points(i, 2)))->info() = i;
  std::vector<std::array<int, 4>> tets;
  for (const auto& cell : delaunay.finite_cell_handles()) {
    std::array<int, 4> tet;
    for (int k = 0; k < 4; ++k) tet[k] = cell->vertex(k)->info();
    std::sort(tet.begin(), tet.end());
    const auto p = [&](int k) { return Vec3(points.row(tet[k])); };
    if (signed_volume(p(0), p(1), p(2), p(3)) < 0) std::swap(tet[2], tet[3]);
    if (signed_volume(p(0), p(1), p(2), p(3)) > 0) tets.push_back(tet);
  }
  std::sort(tets.begin(), tets.end());
  return tets;
}

}  // namespace limber::meshing::detail
