#include "meshing/cage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "core/error.h"
#include "core/progress.h"
#include "meshing/detail/coarsen.h"
#include "meshing/detail/conform.h"
#include "meshing/detail/gaps.h"
#include "meshing/detail/lattice_cage.h"
#include "meshing/detail/paper_cage.h"
#include "meshing/detail/shrink_fit.h"
#include "meshing/detail/tet_faces.h"
#include "meshing/quality.h"

namespace limber::meshing {
namespace {

using detail::CageModel;
using detail::Selection;

constexpr double warp_min_deg = 20;  // kept by the warp, and 180 − this

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
    double too_fine = 0, too_coarse = 0, spacing_before = 0, ratio_before = 0;
    bool too_large = false;  // a spacing was refused; then no other place of the lattice will help
    for (int i = 0; i < tries_a_phase; ++i) {
      Selection s = detail::select_tets(model, spacing, phase, warp_within);
      too_large = too_large || s.tets.empty();
      const double ratio = s.tets.empty() ? 4 : double(s.tets.size()) / budget;
      (ratio > 1 ? too_fine : too_coarse) = spacing;
      if (!s.tets.empty() && (best.tets.empty() || miss(s) < miss(best))) best = std::move(s);
      if (!best.tets.empty() && miss(best) < near_enough) return best;
      // The count of a solid goes with the third power of what divides the spacing, that of a surface with
      // the second, and that of a rod with the first: there the usual exponent would take many tries.
      constexpr double usual = 0.42, of_a_rod = 0.7;
      double exponent = usual;
      if (const double way = std::log(ratio / ratio_before); i > 0 && way != 0)
        if (const double seen = std::log(spacing_before / spacing) / way; seen > of_a_rod)
          exponent = std::min(seen, 1.0);
      spacing_before = spacing, ratio_before = ratio;
      spacing *= std::pow(ratio, exponent);
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

int component_count(const Tets& tets) {
  const std::vector<int> lowest = detail::components(tets);
  int count = 0;
  for (std::size_t t = 0; t < lowest.size(); ++t) count += lowest[t] == int(t);
  return count;
}

// A model, times a power of two: exact, so it changes no answer, and keeps products of coordinates far from
// under- and overflow.
struct ScaledModel {
  double unit;
  SurfaceMesh surface;
  CageModel cage_model;
  double gap;

  ScaledModel(const SurfaceMesh& given, const CageOptions& options)
      : unit(std::exp2(std::ilogb(bounding_box(given.positions).diagonal()))),
        surface(scaled(with_lone_vertices(given), 1 / unit)),
        cage_model(surface),
        gap(options.gap * bounding_box(given.positions).diagonal() / unit) {}

 private:
  static SurfaceMesh scaled(SurfaceMesh m, double by) {
    m.positions *= by;
    return m;
  }
};

struct Fitted {
  TetMesh mesh;
  int passes = 0;
  double glued_share = 0;
  double spacing = 0;
};

// Parts the lattice's tets at gaps, draws them in and coarsens them to the budget (docs/cage.md, steps 7 to
// 9). The dihedrals come down to their bounds by steps, for each step needs room to work with.
Fitted fit(const ScaledModel& model, const Selection& selection, const CageOptions& options,
           const std::function<void(int, const char*)>& tell) {
  constexpr double max_growth = 1.4;  // by splitting; more would leave too few tets for the rest
  // Heights of a tet, as shares of one of the lattice: the simulation's time step goes with the lowest tet.
  // 0.3 costs 1 to 4 % of volume, 0.1 gains under 1 %. Narrow gaps need lower ones.
  constexpr double lowest = 0.25, lowest_in_gap = 0.15;
  Fitted fitted{detail::build_mesh(selection).mesh, 0, 0, selection.lattice.spacing};
  const double lattice_height = fitted.spacing * std::sqrt(0.5);
  const int max_tets = int(max_growth * double(fitted.mesh.tets.rows()));
  const double first_margin_deg = std::clamp(warp_min_deg - options.min_dihedral_deg, 0.0, 3.0);
  const auto limits = [&](double share_of_margin) {
    const double margin_deg = share_of_margin * first_margin_deg;
    return TetLimits{{options.min_dihedral_deg + margin_deg, options.max_dihedral_deg - margin_deg},
                     lowest * lattice_height};
  };
  const auto part = [&](TetLimits bounds) {
    bounds.min_height_m = lowest_in_gap * lattice_height;
    detail::split_at_gaps(model.cage_model, {fitted.spacing, bounds, max_tets}, fitted.mesh);
    fitted.mesh = detail::open_gaps(model.cage_model, fitted.mesh);
  };
  const auto coarsen = [&](const TetLimits& bounds) {
    detail::coarsen(model.cage_model, bounds, options.tets, fitted.mesh);
  };
  const auto draw_in = [&](const TetLimits& bounds) {
    return detail::shrink_fit(model.cage_model.tree, {model.gap, bounds}, fitted.mesh);
  };
  tell(1, "gaps");
  part(limits(1));
  tell(2, "drawing in");
  fitted.passes = draw_in(limits(1));
  tell(3, "coarsening");
  coarsen(limits(1));
  tell(4, "gaps");
  part(limits(0.5));
  tell(5, "coarsening");
  coarsen(limits(0.5));
  tell(6, "drawing in");
  fitted.passes += draw_in(limits(0));
  tell(7, "what is glued");
  fitted.glued_share = detail::glued_tets(model.cage_model, fitted.mesh).share();
  return fitted;
}

// Fitting changes the number of tets: parting adds some, coarsening takes some. So the lattice's budget is
// guessed from what its tets glue, and corrected by what came out.
Fitted fit_lattice(const ScaledModel& model, const CageOptions& options, Progress& progress) {
  constexpr double coarsened = 0.8;        // share that coarsening leaves where there are no gaps
  constexpr double added_a_glued_tet = 7;  // both as measured, on average
  constexpr int attempts = 3;
  // A warp to the very limits would leave nothing to draw in with.
  const DihedralRange warp_within{std::max(warp_min_deg, options.min_dihedral_deg),
                                  std::min(180 - warp_min_deg, options.max_dihedral_deg)};
  const double tets = options.tets;
  Selection selection = fit_budget(model.cage_model, int(tets / coarsened), warp_within);
  if (selection.tets.empty()) return {};
  const std::vector<char> glued =
      detail::glued_tets(model.cage_model, detail::build_mesh(selection).mesh).glued;
  const double for_gaps = added_a_glued_tet * double(std::count(glued.begin(), glued.end(), 1));
  double lattice_tets = std::max((tets - for_gaps) / coarsened, tets / 1.2);
  Fitted best;
  const auto miss = [&](const Fitted& f) { return std::abs(double(f.mesh.tets.rows()) / tets - 1); };
  for (int i = 0; i < attempts; ++i) {
    if (i > 0 || lattice_tets < 0.95 * tets / coarsened)
      selection = fit_budget(model.cage_model, std::max(12, int(lattice_tets)), warp_within);
    if (selection.tets.empty()) break;
    Fitted fitted = fit(model, selection, options, [&](int step, const char* what) {
      progress.update(step, i == 0 ? what : fmt::format("{}, try {} of {}", what, i + 1, attempts));
    });
    lattice_tets *= tets / double(fitted.mesh.tets.rows());
    if (i == 0 || miss(fitted) < miss(best)) best = std::move(fitted);
    if (miss(best) < 0.09) break;
  }
  return best;
}

Fitted bare_lattice(const ScaledModel& model, const CageOptions& options) {
  const Selection selection = fit_budget(model.cage_model, options.tets, {});
  if (selection.tets.empty()) return {};
  Fitted fitted{detail::build_mesh(selection).mesh, 0, 0, selection.lattice.spacing};
  fitted.glued_share = detail::glued_tets(model.cage_model, fitted.mesh).share();
  return fitted;
}

Cage lattice_cage(const SurfaceMesh& surface, const CageOptions& options) {
  Progress progress("cage", 8);
  progress.update(0, "lattice");
  const ScaledModel model(surface, options);
  Fitted fitted = options.mode == CageMode::lattice ? fit_lattice(model, options, progress)
                                                    : bare_lattice(model, options);
  require(fitted.mesh.tets.rows() > 0, "the model is too thin for its length; give fewer tets");

  Cage cage;
  cage.mesh = std::move(fitted.mesh);
  cage.mesh.positions *= model.unit;
  cage.spacing_m = fitted.spacing * model.unit;
  cage.passes = fitted.passes;
  cage.glued_share = fitted.glued_share;
  if (model.cage_model.closed && volume(surface) > 0) cage.volume_ratio = volume(cage.mesh) / volume(surface);
  const double tets = double(cage.mesh.tets.rows());
  if (std::abs(tets / options.tets - 1) > 0.1)
    cage.notes.push_back(
        fmt::format("{} tets were asked for, {} is the nearest that the lattice gave", options.tets, tets));
  return cage;
}

Cage paper_cage(const std::vector<ConvexShell>& shells, double diagonal, int max_tets) {
  require(!shells.empty(), "mode paper needs convex shells; decompose the model first");
  detail::PaperCage paper = detail::paper_cage(shells, diagonal, max_tets);
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
void measure(const SurfaceMesh& surface, const CageOptions& options, Cage& cage) {
  const ScaledModel model(surface, options);
  const TetMesh scaled{cage.mesh.positions / model.unit, cage.mesh.tets};
  cage.glued_share = detail::glued_tets(model.cage_model, scaled).share();
  if (model.cage_model.closed && volume(surface) > 0) cage.volume_ratio = volume(cage.mesh) / volume(surface);
}

}  // namespace

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

Cage build_cage(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells,
                const CageOptions& options) {
  check(options);
  validate(surface, "cage");
  require(bounding_box(surface.positions).diagonal() > 0, "all vertices of the model are one point");
  Cage cage = options.mode == CageMode::paper
                  ? paper_cage(shells, bounding_box(surface.positions).diagonal(), options.tets)
              : options.mode == CageMode::conform ? conforming_cage(surface, options.tets)
                                                  : lattice_cage(surface, options);
  if (options.mode == CageMode::paper || options.mode == CageMode::conform) measure(surface, options, cage);
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
