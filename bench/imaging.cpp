// imaging_bench [SIZE…]: what docs/imaging.md tells of surfaces of labels. Ellipsoids at six places of two
// grids: their volume, and how far corners are from the true surface; cells of Voronoi and noise: how many
// pairs of triangles meet; CPU seconds and MB for six labels in cubes of SIZE voxels (64 128 256 unless
// said).
#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <string>

#include "core/progress.h"
#include "core/random.h"
#include "imaging/surface_nets.h"
#include "meshing/self_intersections.h"
#include "tests/imaging/made_maps.h"

using namespace limber;
using namespace limber::imaging;

namespace {

const Eigen::Matrix3d millimetres = 0.001 * Eigen::Matrix3d::Identity();

void ellipsoids(const char* name, const Eigen::Matrix3d& axes) {
  const Vec3 radii(0.012, 0.016, 0.021), middle(0.1, -0.2, 0.3);
  const double true_m3 = 4 * std::numbers::pi / 3 * radii.prod(), voxel_m = axes.colwise().norm().maxCoeff();
  int corners = 0, beyond = 0;
  double farthest_m = 0, volume_error = 0;
  for (int place = 0; place < 6; ++place) {
    const Vec3 origin = middle - axes * Vec3(30.2 + 0.13 * place, 29.7 + 0.29 * place, 31.4 + 0.17 * place);
    const LabelMap map = made_map({62, 62, 64}, axes, origin, [&](const Vec3& p) {
      return int(((p - middle).array() / radii.array()).matrix().norm() < 1);
    });
    const SurfaceMesh mesh = surfaces_of(map, {1})[0].surface;
    volume_error = std::max(volume_error, std::abs(volume(mesh) / true_m3 - 1));
    for (const auto& row : mesh.positions.rowwise()) {
      const Vec3 d = row.transpose() - middle;
      const double level = (d.array() / radii.array()).matrix().norm();
      const double slope = (d.array() / radii.array().square()).matrix().norm() / level;
      const double away_m = std::abs(level - 1) / slope;
      farthest_m = std::max(farthest_m, away_m);
      beyond += away_m > 0.5 * voxel_m, ++corners;
    }
  }
  fmt::print(
      "ellipsoid {:14} {:5} corners, {} farther than half a voxel, farthest {:.3f} of one, volume {:.2f} %\n",
      name, corners, beyond, farthest_m / voxel_m, 100 * volume_error);
}

std::size_t meetings(const LabelMap& map) {
  std::vector<int> rows;
  for (int row = 1; row < int(map.labels.size()); ++row)
    if (std::count(map.material.begin(), map.material.end(), row) > 0) rows.push_back(row);
  SurfaceMesh all;
  all.positions.resize(0, 3), all.triangles.resize(0, 3);
  for (const LabelSurface& one : surfaces_of(map, rows, {.min_island = 0})) {
    const Eigen::Index points = all.positions.rows(), triangles = all.triangles.rows();
    all.positions.conservativeResize(points + one.surface.positions.rows(), 3);
    all.positions.bottomRows(one.surface.positions.rows()) = one.surface.positions;
    all.triangles.conservativeResize(triangles + one.surface.triangles.rows(), 3);
    all.triangles.bottomRows(one.surface.triangles.rows()) = one.surface.triangles.array() + int(points);
  }
  return meshing::self_intersections(all).pairs.size();
}

LabelMap voronoi(std::uint64_t seed) {
  Rng rng(seed, 0);
  std::vector<Vec3> seeds;
  for (int s = 0; s < 6; ++s)
    seeds.emplace_back(0.02 * rng.uniform(), 0.02 * rng.uniform(), 0.02 * rng.uniform());
  return made_map({24, 30, 20}, Vec3(0.001, 0.0008, 0.0012).asDiagonal(), Vec3::Zero(), [&](const Vec3& p) {
    if ((p - Vec3(0.011, 0.011, 0.011)).norm() > 0.009) return 0;
    const auto nearest = std::min_element(seeds.begin(), seeds.end(), [&](const Vec3& a, const Vec3& b) {
      return (p - a).norm() < (p - b).norm();
    });
    return int(nearest - seeds.begin()) + 1;
  });
}

LabelMap noise(std::uint64_t seed) {
  Rng rng(seed, 0);
  return made_map({9, 8, 7}, millimetres, Vec3::Zero(), [&](const Vec3&) { return rng.below(4); });
}

template <class Make>
void count_meetings(const char* name, int maps, const Make& make) {
  int with = 0;
  for (int seed = 1; seed <= maps; ++seed) with += meetings(make(std::uint64_t(seed))) > 0;
  fmt::print("{}: surfaces meet in {} of {} maps\n", name, with, maps);
}

void cost(int size) {
  const LabelMap map = made_map({size, size, size}, millimetres, Vec3::Zero(), [&](const Vec3& p) {
    const Vec3 q = 1000 * p / size;
    const double r = (q - Vec3(0.5, 0.5, 0.5)).norm();
    return r < 0.2 ? 1 : r < 0.3 ? 2 : r < 0.45 ? 3 + (q.x() > 0.5) + 2 * (q.y() > 0.5) : 0;
  });
  const double start = cpu_seconds();
  std::int64_t triangles = 0;
  for (const LabelSurface& one : surfaces_of(map, {1, 2, 3, 4, 5, 6}))
    triangles += one.surface.triangles.rows();
  fmt::print("{0}x{0}x{0} voxels, six labels: {1:.2f} CPU s, {2} triangles, {3:.0f} MB at most so far\n",
             size, cpu_seconds() - start, triangles, peak_memory_mb());
}

}  // namespace

int main(int argc, char** argv) {
  ellipsoids("1 x 1 x 1 mm", millimetres);
  ellipsoids("0.8 x 1 x 2 mm", Vec3(-0.0008, 0.001, 0.002).asDiagonal());
  count_meetings("cells of Voronoi", 60, voronoi);
  count_meetings("noise", 20, noise);
  std::vector<int> sizes{64, 128, 256};
  if (argc > 1) sizes.clear();
  for (int i = 1; i < argc; ++i) sizes.push_back(std::stoi(argv[i]));
  for (const int size : sizes) cost(size);
}
