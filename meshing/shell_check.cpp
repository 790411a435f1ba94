#include "meshing/shell_check.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "core/threads.h"
#include "meshing/detail/overshoot.h"
#include "meshing/detail/solid.h"
#include "meshing/surface_tree.h"

namespace limber::meshing {

namespace {

constexpr double rounding = 1e-9;      // of the diagonal; of middles, which are computed
constexpr double min_altitude = 1e-9;  // of a face, over its shell's diagonal: lower ones are slivers

Vec3 corner_of(const ConvexShell& shell, Eigen::Index face, int k) {
  return shell.vertices.row(shell.triangles(face, k));
}

// Whether p is beyond the face; exact.
bool beyond(const ConvexShell& shell, Eigen::Index face, const Vec3& p) {
  return orientation(corner_of(shell, face, 0), corner_of(shell, face, 1), corner_of(shell, face, 2), p) > 0;
}

bool is_convex(const ConvexShell& shell) {
  std::set<std::pair<int, int>> sides;
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      if (!sides.insert({shell.triangles(f, k), shell.triangles(f, (k + 1) % 3)}).second) return false;
  for (const auto& [from, to] : sides)
    if (!sides.contains({to, from})) return false;
  for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f)
    for (Eigen::Index v = 0; v < shell.vertices.rows(); ++v)
      if (beyond(shell, f, shell.vertices.row(v))) return false;
  return true;
}

// A shell with the planes of its faces, to be quick where a point is clearly on one side of them.
class Region {
 public:
  Region(const ConvexShell& shell, double tolerance)
      : shell_(shell), box_(bounding_box(shell.vertices)), tolerance_(tolerance) {
    const double min_height = min_altitude * box_.diagonal();
    for (Eigen::Index f = 0; f < shell.triangles.rows(); ++f) {
      const Vec3 a = corner_of(shell, f, 0), b = corner_of(shell, f, 1), c = corner_of(shell, f, 2);
      const Vec3 n = (b - a).cross(c - a);
      const double length = n.norm();
      normals_.push_back(length > 0 ? Vec3(n / length) : Vec3(Vec3::Zero()));
      offsets_.push_back(normals_.back().dot(a));
      slivers_.push_back(length <= min_height * std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}));
    }
  }
  // `exact`: not by a hair outside.
  bool holds(const Vec3& p, bool exact) const {
    if ((p.array() < box_.lower.array() - tolerance_).any() ||
        (p.array() > box_.upper.array() + tolerance_).any())
      return false;
    for (std::size_t f = 0; f < normals_.size(); ++f) {
      const double height = normals_[f].dot(p) - offsets_[f];
      if (height < -tolerance_) continue;
      // A sliver's plane is noise: what is beyond it is beyond a neighbour, too, or nearly in the sliver.
      if (slivers_[f] && !exact) continue;
      if (exact ? beyond(shell_, Eigen::Index(f), p) : height > tolerance_) return false;
    }
    return true;
  }

 private:
  const ConvexShell& shell_;
  Box box_;
  double tolerance_;
  std::vector<Vec3> normals_;
  std::vector<double> offsets_;
  std::vector<char> slivers_;
};

void measure_overshoot(const std::vector<ConvexShell>& shells, const SurfaceMesh& surface,
                       ShellCheck& result) {
  constexpr double boundary_sample_count = 20'000;  // as decompose() has it
  const detail::Solid solid = detail::make_solid(surface);
  const detail::SurfaceDistance distance(solid.filled.positions, solid.filled.triangles);
  std::vector<ConvexShell> work = shells;
  double total_area = 0;
  for (ConvexShell& shell : work) {
    for (Eigen::Index v = 0; v < shell.vertices.rows(); ++v)
      shell.vertices.row(v) = solid.frame.work_from_user(shell.vertices.row(v)).transpose();
    total_area += area(SurfaceMesh{shell.vertices, shell.triangles});
  }
  std::vector<double> overshoots;
  for (const detail::BoundarySample& sample :
       detail::boundary_samples(work, boundary_sample_count / total_area))
    overshoots.push_back(distance.at(sample.point) / solid.diagonal);
  if (overshoots.empty()) return;
  std::sort(overshoots.begin(), overshoots.end());
  result.mean_overshoot =
      std::accumulate(overshoots.begin(), overshoots.end(), 0.0) / double(overshoots.size());
  result.max_overshoot = overshoots.back();
}

}  // namespace

ShellCheck check_shells(const std::vector<ConvexShell>& shells, const SurfaceMesh& surface) {
  ShellCheck result;
  const double tolerance = rounding * bounding_box(surface.positions).diagonal();
  std::vector<Region> regions;
  for (const ConvexShell& shell : shells) {
    result.not_convex += !is_convex(shell);
    regions.emplace_back(shell, tolerance);
  }
  const auto covered = [&](const Vec3& p, bool exact) {
    return std::any_of(regions.begin(), regions.end(),
                       [&](const Region& region) { return region.holds(p, exact); });
  };
  std::vector<char> bad_vertex(std::size_t(surface.positions.rows()), 0),
      bad_triangle(std::size_t(surface.triangles.rows()), 0);
  const std::vector<int> used = vertices_of(surface.triangles);
  parallel_for(int(used.size()), [&](int i) {
    const int v = used[std::size_t(i)];
    bad_vertex[std::size_t(v)] = !covered(surface.positions.row(v), true);
  });
  parallel_for(int(surface.triangles.rows()), [&](int t) {
    const auto corner = [&](int k) { return Vec3(surface.positions.row(surface.triangles(t, k))); };
    bool good = covered((corner(0) + corner(1) + corner(2)) / 3, false);
    for (int k = 0; k < 3; ++k)
      good = good && !bad_vertex[std::size_t(surface.triangles(t, k))] &&
             covered(0.5 * (corner(k) + corner((k + 1) % 3)), false);
    bad_triangle[std::size_t(t)] = !good;
  });
  result.vertices_uncovered = std::count(bad_vertex.begin(), bad_vertex.end(), 1);
  result.triangles_uncovered = std::count(bad_triangle.begin(), bad_triangle.end(), 1);
  measure_overshoot(shells, surface, result);
  return result;
}

bool holds_in_float32(const ConvexShell& shell) {
  return (shell.vertices.cast<float>().cast<double>().array() == shell.vertices.array()).all();
}

}  // namespace limber::meshing
