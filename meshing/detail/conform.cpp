#include "meshing/detail/conform.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/alpha_wrap_3.h>
#include <CGAL/exude_mesh_3.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include "core/error.h"
#include "meshing/detail/own_process.h"
#include "meshing/self_intersections.h"

namespace limber::meshing::detail {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
namespace parameters = CGAL::parameters;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex =
    CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

constexpr int cpu_seconds_allowed = 300;

struct Soup {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

Soup soup_of(const SurfaceMesh& surface) {
  Soup soup;
  for (const auto p : surface.positions.rowwise()) soup.points.emplace_back(p[0], p[1], p[2]);
  for (const auto t : surface.triangles.rowwise())
    soup.triangles.push_back({std::size_t(t[0]), std::size_t(t[1]), std::size_t(t[2])});
  return soup;
}

// The surface as Mesh_3 needs it, closed and outward, or why it is not fit; `polyhedron` is filled where it
// is.
std::string why_not_fit(const SurfaceMesh& surface, Soup soup, Polyhedron& polyhedron) {
  if (!self_intersections(surface, 1).pairs.empty()) return "passes through itself";
  if (!PMP::is_polygon_soup_a_polygon_mesh(soup.triangles)) return "is not a manifold";
  PMP::polygon_soup_to_polygon_mesh(soup.points, soup.triangles, polyhedron);
  if (!CGAL::is_closed(polyhedron)) return "is not closed";
  PMP::orient_to_bound_a_volume(polyhedron);
  return {};
}

Polyhedron wrap_of(const Soup& soup, double alpha, double offset) {
  Polyhedron wrap;
  CGAL::alpha_wrap_3(soup.points, soup.triangles, alpha, offset, wrap);
  if (wrap.empty()) throw InputError("the alpha wrap came out empty");
  return wrap;
}

// How the boundary is meshed: along the model's sharp edges, as a manifold.
struct Kind {
  bool sharp, manifold;
};

// Nothing when that takes far more tets than asked: a wall thinner than the size, sharp edges close together.
std::optional<Complex> refined(const Domain& domain, bool manifold, double size, int tets) {
  // Off the surface by at most 0.15 of the size. Refinement is proved to end up to facet angles of 30
  // degrees.
  const Criteria criteria(parameters::edge_size = size, parameters::facet_angle = 25,
                          parameters::facet_size = size, parameters::facet_distance = 0.15 * size,
                          parameters::cell_radius_edge_ratio = 2, parameters::cell_size = size);
  CGAL::Mesh_error_code error = CGAL::CGAL_MESH_3_NO_ERROR;
  parameters::internal::Mesh_3_options options;
  options.maximal_number_of_vertices = std::size_t(tets) + 1000;  // a vertex has about five tets
  options.pointer_to_error_code = &error;
  CGAL::get_default_random() = CGAL::Random(1);
  Complex complex =
      CGAL::make_mesh_3<Complex>(domain, criteria, parameters::no_perturb(), parameters::no_exude(), options,
                                 manifold ? parameters::manifold() : parameters::non_manifold());
  if (error != CGAL::CGAL_MESH_3_NO_ERROR) return {};
  return complex;
}

double share_of(const Complex& complex, int tets) {
  return double(complex.number_of_cells_in_complex()) / tets;
}
double miss(double share) { return std::abs(std::log(std::max(share, 1e-6))); }

// The size whose count comes nearest to `tets`; the count falls about with the size's 2.5th power, by small
// jumps. It begins at `size` and leaves there the one it took. Nothing when no size up to `largest` stays
// below the limit.
std::optional<Complex> refined_to_budget(const Domain& domain, bool manifold, int tets, double largest,
                                         double& size) {
  constexpr double near_enough = 0.03;
  constexpr int tries = 10;
  std::optional<Complex> best;
  double best_size = size, too_fine = 0, too_coarse = 0;
  for (int i = 0; i < tries && size < largest; ++i) {
    std::optional<Complex> complex = refined(domain, manifold, size, tets);
    const double share = complex ? std::clamp(share_of(*complex, tets), 0.02, 50.0) : 6;
    (share > 1 ? too_fine : too_coarse) = size;
    if (complex && (!best || miss(share) < miss(share_of(*best, tets))))
      best = std::move(complex), best_size = size;
    if (best && miss(share_of(*best, tets)) < near_enough) break;
    size *= std::pow(share, 0.4);
    if (too_fine > 0 && too_coarse > 0) {
      if (too_coarse / too_fine < 1.01) break;
      const double inner = std::pow(too_coarse / too_fine, 0.1);
      size = std::clamp(size, too_fine * inner, too_coarse / inner);
    }
  }
  size = best_size;
  return best;
}

// Slivers go. The limit of time is none, or the bytes would depend on the clock.
void improve(Complex& complex, const Domain& domain) {
  constexpr double good_enough_deg = 12;
  CGAL::perturb_mesh_3(complex, domain, parameters::time_limit = 0,
                       parameters::sliver_bound = good_enough_deg);
  CGAL::exude_mesh_3(complex, parameters::time_limit = 0, parameters::sliver_bound = good_enough_deg);
}

TetMesh mesh_of(const Complex& complex) {
  std::vector<std::array<std::array<double, 3>, 4>> cells;
  std::map<std::array<double, 3>, int> row;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    auto& corners = cells.emplace_back();
    for (int k = 0; k < 4; ++k) {
      const auto& p = cell->vertex(k)->point();
      corners[std::size_t(k)] = {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
      row.emplace(corners[std::size_t(k)], 0);
    }
  }
  // In the order of coordinates, for CGAL's own order is that of its memory.
  TetMesh mesh{Points(Eigen::Index(row.size()), 3), Tets(Eigen::Index(cells.size()), 4)};
  Eigen::Index next = 0;
  for (auto& [p, index] : row) {
    mesh.positions.row(next) << p[0], p[1], p[2];
    index = int(next++);
  }
  std::vector<std::array<int, 4>> tets;
  for (const auto& corners : cells) {
    std::array<int, 4>& tet = tets.emplace_back();
    for (std::size_t k = 0; k < 4; ++k) tet[k] = row[corners[k]];
    std::sort(tet.begin(), tet.end());
    const auto p = [&](int k) { return Vec3(mesh.positions.row(tet[std::size_t(k)])); };
    if (signed_volume(p(0), p(1), p(2), p(3)) < 0) std::swap(tet[2], tet[3]);
  }
  std::sort(tets.begin(), tets.end());
  for (std::size_t t = 0; t < tets.size(); ++t)
    mesh.tets.row(Eigen::Index(t)) << tets[t][0], tets[t][1], tets[t][2], tets[t][3];
  return mesh;
}

Conformed conform_here(const SurfaceMesh& surface, int tets) {
  Conformed result;
  const double diagonal = bounding_box(surface.positions).diagonal();
  const Soup soup = soup_of(surface);
  Polyhedron polyhedron;
  result.wrapped = why_not_fit(surface, soup, polyhedron);
  if (!result.wrapped.empty()) {
    const double alpha = diagonal / 80;
    result.wrap_offset_m = alpha / 20;
    polyhedron = wrap_of(soup, alpha, result.wrap_offset_m);
  }
  CGAL::Random random(1);
  constexpr double sharp_deg = 60;
  Domain sharp(polyhedron, &random), smooth(polyhedron, &random);
  sharp.detect_features(sharp_deg);
  int sharp_edges = 0;
  sharp.get_curves(boost::make_function_output_iterator([&](const auto&) { ++sharp_edges; }));

  std::optional<Complex> best;
  for (const Kind kind : {Kind{true, true}, Kind{false, true}, Kind{false, false}}) {
    if (kind.sharp && sharp_edges == 0) continue;
    const Domain& domain = kind.sharp ? sharp : smooth;
    double wanted = tets;  // fewer or more than asked, for what the removal of slivers adds or takes
    double size = std::cbrt(std::abs(CGAL::to_double(PMP::volume(polyhedron))) / (0.1 * tets));
    for (int round = 0; round < 2; ++round) {
      std::optional<Complex> complex = refined_to_budget(domain, kind.manifold, int(wanted), diagonal, size);
      if (!complex) break;
      improve(*complex, domain);
      const double share = share_of(*complex, tets);
      if (!best || miss(share) < miss(share_of(*best, tets))) {
        best = std::move(complex);
        result.sharp_edges = kind.sharp ? sharp_edges : 0;
      }
      if (miss(share) < 0.08) break;
      wanted = std::clamp(wanted / share, 0.5 * tets, 2.0 * tets);
    }
    if (best && miss(share_of(*best, tets)) < 0.1) break;
  }
  if (!best) throw InputError("needs far more tets than asked");
  result.mesh = mesh_of(*best);
  if (result.mesh.tets.rows() == 0) throw InputError("has no inside that is as wide as the tets asked for");
  return result;
}

// From one process to the other.
template <class T>
void put(std::string& bytes, const T* values, Eigen::Index count) {
  bytes.append(reinterpret_cast<const char*>(values), sizeof(T) * std::size_t(count));
}
template <class T>
void take(std::string_view& bytes, T* values, Eigen::Index count) {
  const std::size_t size = sizeof(T) * std::size_t(count);
  LIMBER_CHECK(bytes.size() >= size, bytes.size(), size);
  if (size > 0) std::memcpy(values, bytes.data(), size);
  bytes.remove_prefix(size);
}

struct Header {
  std::int64_t nodes, tets, wrapped_letters, sharp_edges;
  double wrap_offset_m;
};

std::string packed(const Conformed& c) {
  const Header header{c.mesh.positions.rows(), c.mesh.tets.rows(), std::int64_t(c.wrapped.size()),
                      c.sharp_edges, c.wrap_offset_m};
  std::string bytes;
  put(bytes, &header, 1);
  put(bytes, c.wrapped.data(), header.wrapped_letters);
  put(bytes, c.mesh.positions.data(), c.mesh.positions.size());
  put(bytes, c.mesh.tets.data(), c.mesh.tets.size());
  return bytes;
}

Conformed unpacked(std::string_view bytes) {
  Header header;
  take(bytes, &header, 1);
  Conformed c;
  c.wrapped.resize(std::size_t(header.wrapped_letters));
  c.mesh.positions.resize(header.nodes, 3);
  c.mesh.tets.resize(header.tets, 4);
  take(bytes, c.wrapped.data(), header.wrapped_letters);
  take(bytes, c.mesh.positions.data(), c.mesh.positions.size());
  take(bytes, c.mesh.tets.data(), c.mesh.tets.size());
  c.sharp_edges = int(header.sharp_edges);
  c.wrap_offset_m = header.wrap_offset_m;
  return c;
}

}  // namespace

Conformed conform(const SurfaceMesh& surface, int tets) {
  const OwnProcessResult result =
      run_in_own_process([&] { return packed(conform_here(surface, tets)); }, cpu_seconds_allowed);
  if (!result.finished)
    throw InputError(
        fmt::format("cage: mode conform: CGAL's mesher gave up on this model: it {}; mode lattice takes any "
                    "model",
                    result.bytes));
  return unpacked(result.bytes);
}

}  // namespace limber::meshing::detail
