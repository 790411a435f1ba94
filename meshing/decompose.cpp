#include "meshing/decompose.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"
#include "meshing/detail/cut_search.h"
#include "meshing/detail/enclosing_shell.h"
#include "meshing/detail/exact_parts.h"
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
    throw InputError(
        fmt::format("concavity is a share of the diagonal from 0 to 1, not {}", options.max_concavity));
  if (!(options.inflation >= 0) || options.inflation > 1)
    throw InputError(
        fmt::format("shells are inflated by a share of the diagonal from 0 to 1, not {}", options.inflation));
}

// The solid cut into parts, each with its shell in the user's coordinates.
class Shells {
 public:
  Shells(const SurfaceMesh& mesh, const DecomposeOptions& options)
      : mesh_(mesh),
        options_(options),
        solid_(solid_of(mesh, progress_)),
        inside_(solid_.mesh.positions, solid_.boundary),
        distance_(solid_.filled.positions, solid_.filled.triangles),
        model_(make_model(solid_.mesh.positions, solid_.mesh.triangles)) {
    if (options.exact) {
      exact_parts_ = exact_convex_parts(mesh);
      for (const std::vector<Vec3>& corners : exact_parts_) {
        throw_if_stopped();
        std::vector<Vec3> work;
        for (const Vec3& p : corners) work.push_back(solid_.frame.work_from_user(p));
        result_.shells.push_back(shell_of(work, corners));
      }
    } else {
      parts_ = find_parts(model_, whole(model_, solid_.mesh.triangles), inside_, distance_,
                          {options.max_shells, options.max_concavity * solid_.diagonal}, progress_);
      progress_.update(std::int64_t(parts_.size()), "shells", 0.85);
      result_.shells.resize(parts_.size());
      parallel_for(int(parts_.size()),
                   [&](int p) { result_.shells[std::size_t(p)] = shell_of(parts_[std::size_t(p)]); });
    }
    measure_overshoot();
  }

  Decomposition result();

 private:
  static Solid solid_of(const SurfaceMesh& mesh, Progress& progress) {
    progress.update(0, "the solid", 0);
    return make_solid(mesh);
  }
  Vec3 user_point(int p) const {
    return std::size_t(p) < solid_.user_vertex.size()
               ? Vec3(mesh_.positions.row(solid_.user_vertex[std::size_t(p)]))
               : solid_.frame.user_from_work(model_.points[std::size_t(p)]);
  }
  ConvexShell shell_of(const Part&) const;
  // Of few corners round the hull of `work`, which holds the user's points.
  ConvexShell shell_of(const std::vector<Vec3>& work, const std::vector<Vec3>& user) const;
  void measure_overshoot();
  bool bound_is_met() const { return result_.max_overshoot <= options_.max_concavity; }
  void cut_the_worst_until_the_bound_is_met();
  void find_neighbours();
  void inflate();
  void count_uncovered();
  std::int64_t triangles_uncovered_by_exact_parts() const;

  const SurfaceMesh& mesh_;
  const DecomposeOptions& options_;
  Progress progress_{"decompose", parts_to_cut(options_.max_shells)};
  Solid solid_;
  InsideTest inside_;
  SurfaceDistance distance_;
  Model model_;
  // Part p is in shell p; one of the two is empty.
  std::vector<Part> parts_;
  std::vector<std::vector<Vec3>> exact_parts_;
  Decomposition result_;
};

ConvexShell Shells::shell_of(const Part& part) const {
  std::vector<Vec3> points;
  for (int p : points_of(part)) points.push_back(user_point(p));
  return shell_of(hull_candidates(model_, part), points);
}

ConvexShell Shells::shell_of(const std::vector<Vec3>& work, const std::vector<Vec3>& user) const {
  GrowingHull hull;
  hull.add(work);
  std::vector<Vec3> corners = hull.vertices();
  if (hull.flat()) {
    hull.clear();
    hull.add(thickened(corners, solid_.flat_half_thickness));
    corners = hull.vertices();
  }
  corners = fewer_corners(corners, options_.max_vertices);
  for (Vec3& p : corners) p = solid_.frame.user_from_work(p);
  const double rounding = 16 * 2.3e-16 * mesh_.positions.cwiseAbs().maxCoeff();
  return enclosing_shell(corners, user, std::max(1e-12 * solid_.diagonal / solid_.frame.scale, rounding));
}

void Shells::inflate() {
  for (ConvexShell& shell : result_.shells) {
    std::vector<Vec3> user, work;
    for (Eigen::Index v = 0; v < shell.vertices.rows(); ++v) {
      user.push_back(shell.vertices.row(v));
      work.push_back(solid_.frame.work_from_user(user.back()));
    }
    shell = shell_of(bevelled(work, options_.inflation * solid_.diagonal), user);
  }
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
  const std::vector<BoundarySample> samples = boundary_samples(shells, boundary_sample_count / total_area);
  overshoots.resize(samples.size());
  parallel_for_many(int(samples.size()), [&](int i) {
    overshoots[std::size_t(i)] = distance_.at(samples[std::size_t(i)].point) / solid_.diagonal;
  });
  for (std::size_t i = 0; i < samples.size(); ++i) {
    double& largest = result_.overshoot_of_shell[std::size_t(samples[i].shell)];
    largest = std::max(largest, overshoots[i]);
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

// Shells that share a point of a cut, or a corner of exact parts.
void Shells::find_neighbours() {
  std::vector<std::pair<int, int>> shell_of_point;
  for (std::size_t s = 0; s < parts_.size(); ++s)
    for (int p : points_of(parts_[s])) shell_of_point.push_back({p, int(s)});
  std::map<std::array<double, 3>, int> number;
  for (std::size_t s = 0; s < exact_parts_.size(); ++s)
    for (const Vec3& p : exact_parts_[s])
      shell_of_point.push_back(
          {number.try_emplace({p.x(), p.y(), p.z()}, int(number.size())).first->second, int(s)});
  std::sort(shell_of_point.begin(), shell_of_point.end());
  shell_of_point.erase(std::unique(shell_of_point.begin(), shell_of_point.end()), shell_of_point.end());
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
  const std::vector<int> vertices = vertices_of(mesh_.triangles);
  std::vector<char> covered(vertices.size(), 0);
  parallel_for_many(int(vertices.size()), [&](int i) {
    throw_if_stopped();
    const Vec3 p = mesh_.positions.row(vertices[std::size_t(i)]);
    char& is = covered[std::size_t(i)];
    for (std::size_t s = 0; s < shells.size() && !is; ++s)
      is = (p.array() >= boxes[s].lower.array()).all() && (p.array() <= boxes[s].upper.array()).all() &&
           encloses(shells[s], p);
  });
  result_.vertices_uncovered += std::count(covered.begin(), covered.end(), 0);
  if (options_.exact) {
    result_.triangles_uncovered = triangles_uncovered_by_exact_parts();
    return;
  }
  const int triangles = int(mesh_.triangles.rows());
  std::vector<char> uncovered(std::size_t(triangles), 0), seen(std::size_t(triangles), 0);
  std::vector<std::vector<int>> outside(parts_.size());  // of a part its rows that are not in its shell
  parallel_for(int(parts_.size()), [&](int s) {
    for (const int p : points_of(parts_[std::size_t(s)]))
      if (!encloses(shells[std::size_t(s)], user_point(p))) outside[std::size_t(s)].push_back(p);
  });
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Polygons& surface = parts_[s].surface;
    for (int i = 0; i < surface.count(); ++i) {
      if (surface.triangle[std::size_t(i)] >= solid_.sheets * triangles) continue;
      const std::size_t t = std::size_t(surface.triangle[std::size_t(i)] % triangles);
      seen[t] = 1;
      for (int k = surface.first[std::size_t(i)]; k < surface.first[std::size_t(i) + 1]; ++k)
        uncovered[t] |=
            std::binary_search(outside[s].begin(), outside[s].end(), surface.corners[std::size_t(k)]);
    }
  }
  for (std::size_t t = 0; t < uncovered.size(); ++t) result_.triangles_uncovered += uncovered[t] || !seen[t];
}

// Cuts away from each triangle what lies in a shell. The shells overlap by far more than the rounding of
// this.
std::int64_t Shells::triangles_uncovered_by_exact_parts() const {
  using Polygon = std::vector<Vec3>;
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 4>> planes;
  for (const ConvexShell& shell : result_.shells) planes.push_back(planes_of(shell));
  const auto clipped = [](const Polygon& polygon, const auto& plane, double sign) {
    Polygon kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double da = sign * (plane.template head<3>().dot(a) + plane[3]);
      const double db = sign * (plane.template head<3>().dot(b) + plane[3]);
      if (da <= 0) kept.push_back(a);
      if ((da < 0 && db > 0) || (da > 0 && db < 0)) kept.push_back(a + da / (da - db) * (b - a));
    }
    return kept.size() < 3 ? Polygon{} : kept;
  };
  std::int64_t uncovered = 0;
  for (Eigen::Index t = 0; t < mesh_.triangles.rows(); ++t) {
    throw_if_stopped();
    std::vector<Polygon> left = {{mesh_.positions.row(mesh_.triangles(t, 0)),
                                  mesh_.positions.row(mesh_.triangles(t, 1)),
                                  mesh_.positions.row(mesh_.triangles(t, 2))}};
    for (std::size_t s = 0; s < planes.size() && !left.empty(); ++s) {
      std::vector<Polygon> outside;
      for (Polygon& inner : left)
        for (Eigen::Index f = 0; f < planes[s].rows() && !inner.empty(); ++f) {
          const Eigen::Vector4d plane = planes[s].row(f);
          if (Polygon beyond = clipped(inner, plane, -1); !beyond.empty())
            outside.push_back(std::move(beyond));
          inner = clipped(inner, plane, 1);
        }
      left = std::move(outside);
    }
    uncovered += !left.empty();
  }
  return uncovered;
}

Decomposition Shells::result() {
  const bool nothing_to_gain = int(parts_.size()) < options_.max_shells;
  if (options_.max_concavity > 0 && !options_.exact) cut_the_worst_until_the_bound_is_met();
  result_.stopped_by = options_.exact                                 ? "exact"
                       : options_.max_concavity > 0 && bound_is_met() ? "concavity"
                       : nothing_to_gain                              ? "gain"
                                                                      : "count";
  find_neighbours();
  if (options_.inflation > 0) inflate();
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
