#include "meshing/cage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "meshing/detail/conform.h"
#include "meshing/detail/glued.h"
#include "meshing/detail/lattice_cage.h"
#include "meshing/detail/paper_cage.h"
#include "meshing/detail/shrink_fit.h"
#include "meshing/detail/tet_faces.h"
#include "meshing/quality.h"

namespace limber::meshing {
namespace {

using detail::CageModel;
using detail::Selection;

void require(bool holds, const std::string& text) {
  if (!holds) throw InputError("cage: " + text);
}

void check(const CageOptions& o) {
  require(o.tets >= 24 && o.tets <= 200'000, fmt::format("tets is {}, but must lie in 24 … 200000", o.tets));
  require(o.min_dihedral_deg >= 1 && o.min_dihedral_deg <= 45,
          fmt::format("min_dihedral_deg is {}, but must lie in 1 … 45", o.min_dihedral_deg));
  require(o.max_dihedral_deg >= 100 && o.max_dihedral_deg <= 179,
          fmt::format("max_dihedral_deg is {}, but must lie in 100 … 179", o.max_dihedral_deg));
  require(o.gap >= 1e-6 && o.gap <= 0.1, fmt::format("gap is {}, but must lie in 1e-6 … 0.1", o.gap));
}

// A vertex of no triangle must be enclosed too, for it will be bound: it becomes a triangle of one point.
SurfaceMesh with_lone_vertices(const SurfaceMesh& surface) {
  std::vector<bool> used(std::size_t(surface.positions.rows()), false);
  for (Eigen::Index i = 0; i < surface.triangles.size(); ++i) used[surface.triangles.data()[i]] = true;
  SurfaceMesh all = surface;
  const Eigen::Index lone = std::count(used.begin(), used.end(), false);
  all.triangles.conservativeResize(surface.triangles.rows() + lone, 3);
  Eigen::Index row = surface.triangles.rows();
  for (std::size_t v = 0; v < used.size(); ++v)
    if (!used[v]) all.triangles.row(row++).setConstant(int(v));
  return all;
}

// The spacing whose count comes nearest to the budget. The count falls with the spacing, but by jumps, and on
// a model that is aligned with the axes by large ones; then other places of the lattice help.
Selection fit_budget(const CageModel& model, int budget, const std::optional<DihedralRange>& warp_within) {
  // The first place is none where a node, an edge or a face would lie on a plane that users like.
  static const std::array<Vec3, 6> phases{Vec3(0.137, 0.291, 0.413), Vec3(0.613, 0.171, 0.829),
                                          Vec3(0.371, 0.743, 0.059), Vec3(0.887, 0.537, 0.271),
                                          Vec3(0.211, 0.947, 0.671), Vec3(0.463, 0.389, 0.983)};
  constexpr double near_enough = 0.05;
  constexpr int tries_a_phase = 12;
  Selection best;
  const auto miss = [&](const Selection& s) { return std::abs(double(s.tets.size()) / budget - 1); };
  double spacing = model.box.diagonal() / std::cbrt(double(budget));
  for (const Vec3& phase : phases) {
    double too_fine = 0, too_coarse = 0;
    bool too_large = false;  // a spacing was refused; then no other place of the lattice will help
    for (int i = 0; i < tries_a_phase; ++i) {
      Selection s = detail::select_tets(model, spacing, phase, warp_within);
      too_large = too_large || s.tets.empty();
      const double ratio = s.tets.empty() ? 4 : double(s.tets.size()) / budget;
      (ratio > 1 ? too_fine : too_coarse) = spacing;
      if (!s.tets.empty() && (best.tets.empty() || miss(s) < miss(best))) best = std::move(s);
      if (!best.tets.empty() && miss(best) < near_enough) return best;
      spacing *= std::pow(ratio, 0.42);
      if (too_fine > 0 && too_coarse > 0) {
        if (too_coarse / too_fine < (too_large ? 1.1 : 1.0005)) break;
        const double low = too_fine * std::pow(too_coarse / too_fine, 0.1),
                     high = too_coarse * too_fine / low;
        spacing = std::clamp(spacing, low, high);
      }
    }
    if (best.tets.empty() || too_large || miss(best) < 0.1) return best;
    spacing = best.lattice.spacing;
  }
  return best;
}

// Planes n·x = d of a shell's triangles, n outwards and of length 1.
struct HalfSpaces {
  Points normals;
  Eigen::VectorXd offsets;
};

HalfSpaces half_spaces(const ConvexShell& shell) {
  HalfSpaces h{Points(shell.triangles.rows(), 3), Eigen::VectorXd(shell.triangles.rows())};
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f) {
    const Vec3 a = shell.vertices.row(shell.triangles(f, 0)), b = shell.vertices.row(shell.triangles(f, 1)),
               c = shell.vertices.row(shell.triangles(f, 2));
    const Vec3 n = (b - a).cross(c - a).normalized();
    h.normals.row(f) = n;
    h.offsets[f] = n.dot(a);
  }
  return h;
}

std::vector<int> label_tets(const TetMesh& mesh, const std::vector<ConvexShell>& shells) {
  std::vector<HalfSpaces> bounds;
  for (const ConvexShell& shell : shells) bounds.push_back(half_spaces(shell));
  std::vector<int> label(std::size_t(mesh.tets.rows()), 0);
  for (std::size_t t = 0; t < label.size(); ++t) {
    Vec3 middle = Vec3::Zero();
    for (int k = 0; k < 4; ++k)
      middle += 0.25 * mesh.positions.row(mesh.tets(Eigen::Index(t), k)).transpose();
    double deepest = -1e300;
    for (std::size_t s = 0; s < bounds.size(); ++s) {
      const double depth = (bounds[s].offsets - bounds[s].normals * middle).minCoeff();
      if (depth > deepest) deepest = depth, label[t] = int(s);
    }
  }
  return label;
}

int component_count(const Tets& tets) {
  const std::vector<int> lowest = detail::components(tets);
  int count = 0;
  for (std::size_t t = 0; t < lowest.size(); ++t) count += lowest[t] == int(t);
  return count;
}

Cage lattice_cage(const SurfaceMesh& surface, const CageOptions& options) {
  // Times a power of two: exact, so it changes no answer, and keeps products of coordinates far from under-
  // and overflow.
  const double diagonal = bounding_box(surface.positions).diagonal();
  const double unit = std::exp2(std::ilogb(diagonal));
  SurfaceMesh scaled = with_lone_vertices(surface);
  scaled.positions /= unit;
  const CageModel model(scaled);
  std::optional<DihedralRange> warp_within;
  // A warp to the very limits would leave nothing to draw in with.
  if (options.mode == CageMode::lattice)
    warp_within = {std::max(20.0, options.min_dihedral_deg), std::min(160.0, options.max_dihedral_deg)};
  const Selection selection = fit_budget(model, options.tets, warp_within);
  require(!selection.tets.empty(), "the model is too thin for its length; give fewer tets");

  Cage cage;
  cage.mesh = detail::build_mesh(selection).mesh;
  if (options.mode == CageMode::lattice)
    cage.passes = detail::shrink_fit(
        model.tree, {options.gap * diagonal / unit, options.min_dihedral_deg, options.max_dihedral_deg},
        cage.mesh);
  cage.glued_share = detail::glued_share(model, scaled, cage.mesh);
  cage.mesh.positions *= unit;
  cage.spacing_m = selection.lattice.spacing * unit;
  if (model.closed && volume(surface) > 0) cage.volume_ratio = volume(cage.mesh) / volume(surface);
  const double tets = double(cage.mesh.tets.rows());
  if (std::abs(tets / options.tets - 1) > 0.1)
    cage.notes.push_back(
        fmt::format("{} tets were asked for, {} is the nearest that the lattice gave", options.tets, tets));
  return cage;
}

Cage paper_cage(const std::vector<ConvexShell>& shells, double diagonal) {
  require(!shells.empty(), "mode paper needs convex shells; decompose the model first");
  detail::PaperCage paper = detail::paper_cage(shells, diagonal);
  require(paper.mesh.tets.rows() > 0, "no shell has a volume; decompose the model anew");
  Cage cage;
  cage.mesh = std::move(paper.mesh);
  cage.shell_from_tet = std::move(paper.shell_from_tet);
  cage.notes = std::move(paper.notes);
  return cage;
}

Cage conforming_cage(const SurfaceMesh& surface, int tets) {
  detail::Conformed conformed = detail::conform(surface, tets);
  Cage cage;
  cage.mesh = std::move(conformed.mesh);
  cage.notes.push_back("mode conform: the tets follow the surface, whose vertices lie inside and outside");
  if (!conformed.wrapped.empty())
    cage.notes.push_back(fmt::format(
        "mode conform: the model {}, so the tets fill CGAL's alpha wrap of it, {:.2g} m off the surface",
        conformed.wrapped, conformed.wrap_offset_m));
  if (conformed.sharp_edges > 0)
    cage.notes.push_back(fmt::format("mode conform: {} sharp edge lines are kept", conformed.sharp_edges));
  const double share = double(cage.mesh.tets.rows()) / tets;
  if (std::abs(share - 1) > 0.1)
    cage.notes.push_back(fmt::format("{} tets were asked for, {} is the nearest that CGAL's mesher gave",
                                     tets, cage.mesh.tets.rows()));
  return cage;
}

// What lattice_cage measures on its way.
void measure(const SurfaceMesh& surface, Cage& cage) {
  const double unit = std::exp2(std::ilogb(bounding_box(surface.positions).diagonal()));
  SurfaceMesh scaled = with_lone_vertices(surface);
  scaled.positions /= unit;
  const CageModel model(scaled);
  cage.glued_share = detail::glued_share(model, scaled, {cage.mesh.positions / unit, cage.mesh.tets});
  if (model.closed && volume(surface) > 0) cage.volume_ratio = volume(cage.mesh) / volume(surface);
}

}  // namespace

Cage build_cage(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells,
                const CageOptions& options) {
  check(options);
  validate(surface, "cage");
  require(bounding_box(surface.positions).diagonal() > 0, "all vertices of the model are one point");
  Cage cage = options.mode == CageMode::paper ? paper_cage(shells, bounding_box(surface.positions).diagonal())
              : options.mode == CageMode::conform ? conforming_cage(surface, options.tets)
                                                  : lattice_cage(surface, options);
  if (options.mode == CageMode::paper || options.mode == CageMode::conform) measure(surface, cage);
  if (options.mode != CageMode::paper) cage.shell_from_tet = label_tets(cage.mesh, shells);
  cage.components = component_count(cage.mesh.tets);
  if (cage.components > 1)
    cage.notes.push_back(fmt::format("the cage has {} pieces, because {}", cage.components,
                                     options.mode == CageMode::paper
                                         ? "not all neighbouring shells have a face in common"
                                         : "the model has parts that lie apart"));
  return cage;
}

}  // namespace limber::meshing
