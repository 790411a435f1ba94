#include "meshing/unite.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/progress.h"
#include "meshing/defects.h"
#include "meshing/detail/edges.h"
#include "meshing/detail/own_process.h"
#include "meshing/import.h"
#include "meshing/repair.h"
#include "meshing/self_intersections.h"
#include "meshing/surface_tree.h"
#include "meshing/winding_number.h"

namespace limber::meshing {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

constexpr int cpu_seconds_allowed = 600;  // for two pieces; two spheres of 100,000 triangles take one

Mesh::Point point_of(const SurfaceMesh& surface, int v) {
  return {surface.positions(v, 0), surface.positions(v, 1), surface.positions(v, 2)};
}

// Of a manifold. Rows of `surface` and indices of the mesh are the same.
Mesh mesh_of(const SurfaceMesh& surface) {
  Mesh mesh;
  for (int v = 0; v < surface.positions.rows(); ++v) mesh.add_vertex(point_of(surface, v));
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const auto corner = [&](int k) { return Mesh::Vertex_index(std::uint32_t(surface.triangles(t, k))); };
    if (mesh.add_face(corner(0), corner(1), corner(2)) == Mesh::null_face())
      throw InputError(fmt::format("is no manifold at triangle {}", t));
  }
  return mesh;
}

// ---- what is fit ----

// Closed, without a face that lies in a line, and nowhere through itself; or why not.
std::string why_no_solid(const SurfaceMesh& surface) {
  const Defects defects = find_defects(surface, 0);
  if (defects.boundary_edges) return "is open";
  if (defects.non_manifold_edges || defects.non_manifold_vertices) return "is no manifold";
  if (defects.misoriented_edges) return "does not know its inside: neighbors face opposite ways";
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    if (CGAL::collinear(point_of(surface, surface.triangles(t, 0)),
                        point_of(surface, surface.triangles(t, 1)),
                        point_of(surface, surface.triangles(t, 2))))
      return "has a face without area";
  const SelfIntersections own = self_intersections(surface, 1);
  if (!own.pairs.empty() || !own.complete) return "passes through itself";
  return {};
}

std::string why_not_fit(const SurfaceMesh& surface) {
  if (const std::string why = why_no_solid(surface); !why.empty()) return why;
  if (!PMP::does_bound_a_volume(mesh_of(surface)))
    return "has a shell within another that faces the same way";
  if (volume(surface) <= 0) return "is inside out";
  return {};
}

// Elements that are one by now.
class Piece {
 public:
  Piece(SurfaceMesh element, int number)
      : surface_(std::move(element)), elements_{number}, box_(bounding_box(surface_.positions)) {}
  // Of two, which are fit.
  Piece(SurfaceMesh surface, const Piece& a, const Piece& b)
      : surface_(std::move(surface)),
        elements_(elements_of(a, b)),
        box_(bounding_box(surface_.positions)),
        why_not_fit_("") {}
  static std::vector<int> elements_of(const Piece& a, const Piece& b) {
    std::vector<int> all;
    std::merge(a.elements_.begin(), a.elements_.end(), b.elements_.begin(), b.elements_.end(),
               std::back_inserter(all));
    return all;
  }
  const SurfaceMesh& surface() const { return surface_; }
  const std::vector<int>& elements() const { return elements_; }
  const Box& box() const { return box_; }
  const std::string& why_not_fit() {
    if (!why_not_fit_) why_not_fit_ = meshing::why_not_fit(surface_);
    return *why_not_fit_;
  }
  const SurfaceTree& tree() {
    if (!tree_) tree_ = std::make_unique<SurfaceTree>(surface_.positions, surface_.triangles);
    return *tree_;
  }

 private:
  SurfaceMesh surface_;
  std::vector<int> elements_;  // ascending
  Box box_;
  std::optional<std::string> why_not_fit_;
  std::unique_ptr<SurfaceTree> tree_;
};

// ---- two pieces ----

bool apart(const Box& a, const Box& b) {
  return (a.lower.array() > b.upper.array()).any() || (b.lower.array() > a.upper.array()).any();
}

// Exact; touching is meeting.
bool surfaces_meet(Piece& a, Piece& b) {
  const bool a_is_larger = a.surface().triangles.rows() >= b.surface().triangles.rows();
  Piece& large = a_is_larger ? a : b;
  const SurfaceMesh& small = (a_is_larger ? b : a).surface();
  for (Eigen::Index t = 0; t < small.triangles.rows(); ++t) {
    std::array<Vec3, 3> corners;
    Box box;
    for (int k = 0; k < 3; ++k)
      box.include(corners[std::size_t(k)] = small.positions.row(small.triangles(t, k)));
    if (!apart(box, large.box()) && large.tree().meets_triangle(corners[0], corners[1], corners[2]))
      return true;
  }
  return false;
}

// Of surfaces that do not meet, whatever they are like.
bool within(const SurfaceMesh& inner, const SurfaceMesh& outer) {
  return WindingNumber(outer.positions, outer.triangles).inside(inner.positions.row(inner.triangles(0, 0)));
}

// Without the shells that are inside the other, which they do not meet; exact.
SurfaceMesh outside_of(const SurfaceMesh& other, const SurfaceMesh& surface) {
  const Mesh mesh = mesh_of(other);
  const CGAL::Side_of_triangle_mesh<Mesh, Kernel> side(mesh);
  const std::vector<int> shell = detail::components(surface.triangles, detail::edge_uses(surface.triangles));
  std::vector<char> inside(shell.size());
  SurfaceMesh kept = surface;
  Eigen::Index next = 0;
  for (std::size_t t = 0; t < shell.size(); ++t) {
    const int first = shell[t];
    if (first == int(t))
      inside[t] = side(point_of(surface, surface.triangles(first, 0))) == CGAL::ON_BOUNDED_SIDE;
    if (!inside[std::size_t(first)]) kept.triangles.row(next++) = surface.triangles.row(Eigen::Index(t));
  }
  kept.triangles.conservativeResize(next, 3);
  if (next < surface.triangles.rows()) drop_unused(kept);
  return kept;
}

template <class Rows>
void put(std::string& bytes, const Rows& rows) {
  const Eigen::Index count = rows.rows();
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  bytes.append(reinterpret_cast<const char*>(rows.data()), sizeof *rows.data() * std::size_t(rows.size()));
}
template <class Rows>
void get(const std::string& bytes, std::size_t& at, Rows& rows) {
  Eigen::Index count = 0;
  std::memcpy(&count, bytes.data() + at, sizeof count);
  at += sizeof count;
  rows.resize(count, 3);
  std::memcpy(rows.data(), bytes.data() + at, sizeof *rows.data() * std::size_t(rows.size()));
  at += sizeof *rows.data() * std::size_t(rows.size());
}

// Without removed ones, in the order of their indices.
SurfaceMesh surface_of(const Mesh& mesh) {
  SurfaceMesh surface{Points(Eigen::Index(mesh.number_of_vertices()), 3),
                      Triangles(Eigen::Index(mesh.number_of_faces()), 3)};
  std::vector<int> row(mesh.num_vertices());
  int next = 0;
  for (const auto v : mesh.vertices()) {
    for (int c = 0; c < 3; ++c) surface.positions(next, c) = mesh.point(v)[c];
    row[v.idx()] = next++;
  }
  Eigen::Index t = 0;
  for (const auto f : mesh.faces()) {
    int corner = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f)))
      surface.triangles(t, corner++) = row[v.idx()];
    ++t;
  }
  return surface;
}

void collapse_short_edges(Mesh& mesh, double least_m) {
  for (bool again = true; again;) {
    again = false;
    const std::vector<Mesh::Edge_index> edges(mesh.edges().begin(), mesh.edges().end());
    for (const auto e : edges) {
      if (mesh.is_removed(e)) continue;
      const auto v = mesh.source(mesh.halfedge(e)), w = mesh.target(mesh.halfedge(e));
      if (CGAL::squared_distance(mesh.point(v), mesh.point(w)) > least_m * least_m) continue;
      if (!CGAL::Euler::does_satisfy_link_condition(e, mesh)) continue;
      const Mesh::Point place = mesh.point(std::min(v, w));  // the older: what is new goes for what was there
      mesh.point(CGAL::Euler::collapse_edge(e, mesh)) = place;
      again = true;
    }
  }
}

double length(const Mesh& mesh, Mesh::Vertex_index v, Mesh::Vertex_index w) {
  return std::sqrt(CGAL::squared_distance(mesh.point(v), mesh.point(w)));
}

// Height over the longest side.
double thinness(const Mesh& mesh, Mesh::Vertex_index u, Mesh::Vertex_index v, Mesh::Vertex_index w) {
  const double longest = std::max({length(mesh, u, v), length(mesh, v, w), length(mesh, w, u)});
  return 2 * std::sqrt(CGAL::squared_area(mesh.point(u), mesh.point(v), mesh.point(w))) / longest;
}

// A flat triangle and its neighbor on its longest side get the other diagonal, where that makes no flat one
// or is the shorter: of some side by side, all come to where one has an area. Returns whether any did.
bool flip_flat_triangles(Mesh& mesh, double least_m) {
  bool any = false;
  const std::vector<Mesh::Face_index> faces(mesh.faces().begin(), mesh.faces().end());
  for (const auto f : faces) {
    auto longest = mesh.halfedge(f);
    for (const auto h : mesh.halfedges_around_face(longest))
      if (length(mesh, mesh.source(h), mesh.target(h)) >
          length(mesh, mesh.source(longest), mesh.target(longest)))
        longest = h;
    const auto a = mesh.source(longest), c = mesh.target(longest), b = mesh.target(mesh.next(longest)),
               d = mesh.target(mesh.next(mesh.opposite(longest)));
    if (thinness(mesh, a, b, c) > least_m || b == d || mesh.halfedge(b, d) != Mesh::null_halfedge()) continue;
    const bool all_full = thinness(mesh, a, b, d) > least_m && thinness(mesh, b, c, d) > least_m;
    if (!all_full && length(mesh, b, d) >= length(mesh, a, c)) continue;
    CGAL::Euler::flip_edge(longest, mesh);
    any = true;
  }
  return any;
}

// Where surfaces all but touch, the cut leaves needles and flat triangles: rounding lays them over their
// neighbors, and an import, which drops them, would leave slits.
void remove_slivers(Mesh& mesh, double least_m) {
  constexpr int rounds = 50;
  for (int round = 0; round < rounds; ++round) {
    collapse_short_edges(mesh, least_m);
    if (!flip_flat_triangles(mesh, least_m)) return;
  }
}

// CGAL 5.5 keeps a shell of one that wholly fills a cavity of the other: both its sides are inside.
void drop_filled_cavities(SurfaceMesh& united, const Mesh& a, const Mesh& b) {
  const std::vector<int> shell = detail::components(united.triangles, detail::edge_uses(united.triangles));
  std::map<int, int> largest;       // of each shell
  const auto normal = [&](int t) {  // as long as twice the area
    const auto corner = [&](int k) { return Vec3(united.positions.row(united.triangles(t, k))); };
    return Vec3((corner(1) - corner(0)).cross(corner(2) - corner(0)));
  };
  for (int t = 0; t < int(shell.size()); ++t) {
    int& best = largest.try_emplace(shell[std::size_t(t)], t).first->second;
    if (normal(t).norm() > normal(best).norm()) best = t;
  }
  if (largest.size() == 1) return;
  using Side = CGAL::Side_of_triangle_mesh<Mesh, Kernel>;
  const Side side_of_a(a), side_of_b(b);
  const auto inside = [&](const Vec3& p) {
    const Mesh::Point point(p.x(), p.y(), p.z());
    return side_of_a(point) == CGAL::ON_BOUNDED_SIDE || side_of_b(point) == CGAL::ON_BOUNDED_SIDE;
  };
  std::set<int> filled;
  for (const auto& [one, t] : largest) {
    const Vec3 middle =
        (united.positions.row(united.triangles(t, 0)) + united.positions.row(united.triangles(t, 1)) +
         united.positions.row(united.triangles(t, 2))) /
        3;
    constexpr double step = 1e-6;  // of the triangle's size
    const Vec3 out = step * normal(t) / std::sqrt(normal(t).norm());
    if (inside(middle + out) && inside(middle - out)) filled.insert(one);
  }
  Eigen::Index next = 0;
  for (int t = 0; t < int(shell.size()); ++t)
    if (!filled.contains(shell[std::size_t(t)]))
      united.triangles.row(next++) = united.triangles.row(t).eval();
  united.triangles.conservativeResize(next, 3);
}

std::string corefined(const SurfaceMesh& a, const SurfaceMesh& b, double least_m) {
  CGAL::get_default_random() = CGAL::Random(1);
  std::array<Mesh, 2> meshes{mesh_of(a), mesh_of(b)};
  if (!PMP::corefine_and_compute_union(meshes[0], meshes[1], meshes[0]))
    throw InputError("would make no manifold: they touch along an edge alone");
  remove_slivers(meshes[0], least_m);
  SurfaceMesh surface = surface_of(meshes[0]);
  drop_filled_cavities(surface, mesh_of(a), mesh_of(b));
  drop_unused(surface);
  std::string bytes;
  put(bytes, surface.positions), put(bytes, surface.triangles);
  return bytes;
}

struct Outcome {
  std::optional<SurfaceMesh> surface;  // of both in one
  std::string why_not;                 // empty without a surface: they have nothing to do with one another
};

// Sides shorter than `least_m` are none.
Outcome united_where_they_meet(const SurfaceMesh& a, const SurfaceMesh& b, double least_m) {
  // CGAL may crash on what it was not made for.
  const detail::OwnProcessResult result =
      detail::run_in_own_process([&] { return corefined(a, b, least_m); }, cpu_seconds_allowed);
  if (!result.finished) return {{}, "uniting them " + result.bytes};
  SurfaceMesh surface;
  std::size_t at = 0;
  get(result.bytes, at, surface.positions), get(result.bytes, at, surface.triangles);
  if (surface.triangles.rows() == 0) return {{}, "nothing comes out"};
  std::string why = why_no_solid(surface);
  for (int t = 0; why.empty() && t < surface.triangles.rows(); ++t)
    if (meshing::thinness(surface, t) <= least_m) why = "has faces without area";
  if (!why.empty()) return {{}, fmt::format("what comes out {}: they touch alone, or by a hair", why)};
  constexpr double rounding = 1e-6;
  const double of_a = volume(a), of_b = volume(b), of_both = volume(surface);
  if (of_both < std::max(of_a, of_b) * (1 - rounding) || of_both > (of_a + of_b) * (1 + rounding))
    return {{},
            fmt::format("what comes out has a volume of {:.6g}, not between {:.6g} and {:.6g}", of_both,
                        std::max(of_a, of_b), of_a + of_b)};
  return {std::move(surface), {}};
}

Outcome united(Piece& a, Piece& b, bool meet, double least_m) {
  if (meet) return united_where_they_meet(a.surface(), b.surface(), least_m);
  SurfaceMesh both = outside_of(b.surface(), a.surface());
  const SurfaceMesh of_b = outside_of(a.surface(), b.surface());
  if (both.triangles.rows() == a.surface().triangles.rows() &&
      of_b.triangles.rows() == b.surface().triangles.rows())
    return {};
  append(both, of_b);
  return {std::move(both), {}};
}

}  // namespace

void append(SurfaceMesh& mesh, const SurfaceMesh& more) {
  const Eigen::Index points = mesh.positions.rows(), triangles = mesh.triangles.rows();
  mesh.positions.conservativeResize(points + more.positions.rows(), 3);
  mesh.positions.bottomRows(more.positions.rows()) = more.positions;
  mesh.triangles.conservativeResize(triangles + more.triangles.rows(), 3);
  mesh.triangles.bottomRows(more.triangles.rows()) = more.triangles.array() + int(points);
}

// Pieces have nothing to do with one another, or could not be united. A new element is united with one after
// the other: what it grows by had nothing to do with those before.
United unite(const std::vector<SurfaceMesh>& elements) {
  Progress progress("uniting", std::int64_t(elements.size()));
  United result;
  SurfaceMesh all{Points(0, 3), Triangles(0, 3)};
  for (const SurfaceMesh& element : elements) append(all, element);
  const double least_m = weld_tolerance_m(all, ImportOptions().weld_tolerance);
  std::vector<Piece> pieces;
  std::vector<char> unfit_and_met(elements.size(), false);
  for (int e = 0; e < int(elements.size()); ++e) {
    Piece piece(elements[std::size_t(e)], e);
    for (std::size_t i = 0; i < pieces.size();) {
      throw_if_stopped();
      Piece& other = pieces[i++];
      if (apart(piece.box(), other.box())) continue;
      const bool meet = surfaces_meet(piece, other);
      if (!piece.why_not_fit().empty() || !other.why_not_fit().empty()) {
        if (!meet && !within(piece.surface(), other.surface()) && !within(other.surface(), piece.surface()))
          continue;
        for (Piece* one : {&piece, &other})
          if (!one->why_not_fit().empty()) unfit_and_met[std::size_t(one->elements().front())] = true;
        continue;
      }
      Outcome outcome = united(other, piece, meet, least_m);
      if (outcome.surface) {
        piece = Piece(std::move(*outcome.surface), other, piece);
        pieces.erase(pieces.begin() + std::ptrdiff_t(--i));
      } else if (!outcome.why_not.empty()) {
        result.beside.push_back({Piece::elements_of(other, piece), outcome.why_not});
      }
    }
    pieces.push_back(std::move(piece));
    progress.update(e + 1);
  }
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& a, const Piece& b) { return a.elements().front() < b.elements().front(); });
  result.surface = {Points(0, 3), Triangles(0, 3)};
  for (Piece& piece : pieces) {
    append(result.surface, piece.surface());
    // What could not be united at first, and was with a third, is no longer beside.
    std::erase_if(result.beside, [&](const United::Beside& beside) {
      return std::includes(piece.elements().begin(), piece.elements().end(), beside.elements.begin(),
                           beside.elements.end());
    });
    if (piece.elements().size() > 1) result.together.push_back(piece.elements());
    if (const int e = piece.elements().front(); unfit_and_met[std::size_t(e)])
      result.beside.push_back({{e}, "it " + piece.why_not_fit()});
  }
  return result;
}

}  // namespace limber::meshing
