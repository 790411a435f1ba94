#include "meshing/decompose.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/progress.h"
#include "meshing/detail/cut_search.h"
#include "meshing/detail/enclosing_shell.h"
#include "meshing/detail/overshoot.h"
#include "meshing/detail/part_search.h"
#include "meshing/detail/solid.h"

namespace limber::meshing {

namespace {

using namespace detail;

constexpr double boundary_sample_count = 20000;

void check(const SurfaceMesh& mesh, const DecomposeOptions& options) {
  validate(mesh, "the model to decompose");
  if (options.max_shells < 1)
    throw InputError(fmt::format("at least 1 shell is needed, not {}", options.max_shells));
  if (options.max_vertices < 8)
    throw InputError(fmt::format("a shell needs at least 8 vertices, not {}", options.max_vertices));
  if (!(options.max_concavity >= 0) || options.max_concavity > 1)
    throw InputError(fmt::format("the concavity bound is a share of the diagonal from 0 to 1, not {}",
                                 options.max_concavity));
}

// The solid cut into parts, each with its shell in the user's coordinates.
class Shells {
 public:
  Shells(const SurfaceMesh& mesh, const DecomposeOptions& options)
      : mesh_(mesh),
        options_(options),
        solid_(make_solid(mesh)),
        inside_(solid_.mesh.positions, solid_.boundary),
        distance_(solid_.filled.positions, solid_.filled.triangles),
        model_(make_model(solid_.mesh.positions, solid_.mesh.triangles)) {
    parts_ = find_parts(model_, whole(model_, solid_.mesh.triangles), inside_, distance_,
                        {options.max_shells, options.max_concavity * solid_.diagonal});
    for (const Part& part : parts_) result_.shells.push_back(shell_of(part));
    measure_overshoot();
  }

  Decomposition result();

 private:
  Vec3 user_point(int p) const {
    return std::size_t(p) < solid_.user_vertex.size()
               ? Vec3(mesh_.positions.row(solid_.user_vertex[std::size_t(p)]))
               : solid_.frame.user_from_work(model_.points[std::size_t(p)]);
  }
  ConvexShell shell_of(const Part&) const;
  void measure_overshoot();
  bool bound_is_met() const { return result_.max_overshoot <= options_.max_concavity; }
  void cut_the_worst_until_the_bound_is_met();
  void find_neighbours();
  void count_uncovered();

  const SurfaceMesh& mesh_;
  const DecomposeOptions& options_;
  Solid solid_;
  InsideTest inside_;
  SurfaceDistance distance_;
  Model model_;
  std::vector<Part> parts_;  // part p in shell p
  Decomposition result_;
};

ConvexShell Shells::shell_of(const Part& part) const {
  GrowingHull hull;
  hull.add(hull_candidates(model_, part));
  std::vector<Vec3> corners = hull.vertices(), points;
  if (hull.flat()) {
    hull.clear();
    hull.add(thickened(corners, solid_.flat_half_thickness));
    corners = hull.vertices();
  }
  corners = fewer_corners(corners, options_.max_vertices);
  for (Vec3& p : corners) p = solid_.frame.user_from_work(p);
  for (int p : points_of(part)) points.push_back(user_point(p));
  const double rounding = 16 * 2.3e-16 * mesh_.positions.cwiseAbs().maxCoeff();
  return enclosing_shell(corners, points, std::max(1e-12 * solid_.diagonal / solid_.frame.scale, rounding));
}

void Shells::measure_overshoot() {
  std::vector<ConvexShell> shells = result_.shells;
  double total_area = 0;
  for (ConvexShell& shell : shells) {
    for (Eigen::Index v = 0; v < shell.vertices.rows(); ++v)
      shell.vertices.row(v) = solid_.frame.work_from_user(shell.vertices.row(v)).transpose();
    total_area += area(SurfaceMesh{shell.vertices, shell.triangles});
  }
  std::vector<double> overshoots;
  result_.overshoot_of_shell.assign(shells.size(), 0.0);
  for (const BoundarySample& sample : boundary_samples(shells, boundary_sample_count / total_area)) {
    overshoots.push_back(distance_.at(sample.point) / solid_.diagonal);
    double& largest = result_.overshoot_of_shell[std::size_t(sample.shell)];
    largest = std::max(largest, overshoots.back());
  }
  std::sort(overshoots.begin(), overshoots.end());
  result_.mean_overshoot =
      std::accumulate(overshoots.begin(), overshoots.end(), 0.0) / double(overshoots.size());
  result_.percentile_99_overshoot = overshoots[(overshoots.size() - 1) * 99 / 100];
  result_.max_overshoot = overshoots.back();
}

// The search looks at fewer places than the measure does.
void Shells::cut_the_worst_until_the_bound_is_met() {
  while (!bound_is_met() && int(parts_.size()) < options_.max_shells) {
    throw_if_stopped();
    const auto& overshoots = result_.overshoot_of_shell;
    const std::size_t worst =
        std::size_t(std::max_element(overshoots.begin(), overshoots.end()) - overshoots.begin());
    const Cut best = best_cut_ahead(model_, parts_[worst], inside_);
    if (best.gain <= 0) return;
    auto [below, above] = cut(model_, parts_[worst], best.plane, inside_);
    parts_[worst] = std::move(below);
    parts_.push_back(std::move(above));
    result_.shells[worst] = shell_of(parts_[worst]);
    result_.shells.push_back(shell_of(parts_.back()));
    measure_overshoot();
  }
}

// Shells that share a point of a cut.
void Shells::find_neighbours() {
  std::vector<std::pair<int, int>> shell_of_point;
  for (std::size_t s = 0; s < parts_.size(); ++s)
    for (int p : points_of(parts_[s])) shell_of_point.push_back({p, int(s)});
  std::sort(shell_of_point.begin(), shell_of_point.end());
  auto& neighbours = result_.neighbours;
  for (std::size_t i = 0; i < shell_of_point.size(); ++i)
    for (std::size_t j = i; j-- > 0 && shell_of_point[j].first == shell_of_point[i].first;)
      neighbours.push_back({shell_of_point[j].second, shell_of_point[i].second});
  std::sort(neighbours.begin(), neighbours.end());
  neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
}

// From the shells alone.
void Shells::count_uncovered() {
  const std::vector<ConvexShell>& shells = result_.shells;
  std::vector<Box> boxes;
  for (const ConvexShell& shell : shells) boxes.push_back(bounding_box(shell.vertices));
  for (int v : vertices_of(mesh_.triangles)) {
    const Vec3 p = mesh_.positions.row(v);
    bool covered = false;
    for (std::size_t s = 0; s < shells.size() && !covered; ++s)
      covered = (p.array() >= boxes[s].lower.array()).all() && (p.array() <= boxes[s].upper.array()).all() &&
                encloses(shells[s], p);
    result_.vertices_uncovered += !covered;
  }
  const int triangles = int(mesh_.triangles.rows());
  std::vector<char> uncovered(std::size_t(triangles), 0), seen(std::size_t(triangles), 0);
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Polygons& surface = parts_[s].surface;
    for (int i = 0; i < surface.count(); ++i) {
      if (surface.triangle[std::size_t(i)] >= solid_.sheets * triangles) continue;
      const std::size_t t = std::size_t(surface.triangle[std::size_t(i)] % triangles);
      seen[t] = 1;
      for (int k = surface.first[std::size_t(i)]; k < surface.first[std::size_t(i) + 1]; ++k)
        if (!encloses(shells[s], user_point(surface.corners[std::size_t(k)]))) uncovered[t] = 1;
    }
  }
  for (std::size_t t = 0; t < uncovered.size(); ++t) result_.triangles_uncovered += uncovered[t] || !seen[t];
}

Decomposition Shells::result() {
  const bool nothing_to_gain = int(parts_.size()) < options_.max_shells;
  if (options_.max_concavity > 0) cut_the_worst_until_the_bound_is_met();
  result_.stopped_by = options_.max_concavity > 0 && bound_is_met() ? "concavity"
                       : nothing_to_gain                            ? "gain"
                                                                    : "count";
  find_neighbours();
  for (const ConvexShell& shell : result_.shells)
    result_.sum_of_hull_volumes += volume(SurfaceMesh{shell.vertices, shell.triangles});
  result_.model_volume = std::abs(volume(solid_.filled)) / std::pow(solid_.frame.scale, 3);
  count_uncovered();
  return result_;
}

}  // namespace

Decomposition decompose(const SurfaceMesh& mesh, const DecomposeOptions& options) {
  check(mesh, options);
  return Shells(mesh, options).result();
}

}  // namespace limber::meshing
