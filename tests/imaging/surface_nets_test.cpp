// Surfaces of shapes that are known, and laws that hold for any voxels.
#include "imaging/surface_nets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/mass_properties.h"
#include "core/random.h"
#include "meshing/self_intersections.h"
#include "tests/imaging/made_maps.h"

namespace limber::imaging {
namespace {

const Eigen::Matrix3d millimetres = 0.001 * Eigen::Matrix3d::Identity();

// Each edge is of two triangles, once each way, and the triangles of each vertex are one fan.
void expect_manifold(const SurfaceMesh& mesh) {
  validate(mesh, "the surface");
  std::map<std::pair<int, int>, int> sides;
  std::map<int, std::map<int, int>> next;  // round each vertex
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles(t, k), b = mesh.triangles(t, (k + 1) % 3),
                c = mesh.triangles(t, (k + 2) % 3);
      EXPECT_EQ(++sides[std::pair(a, b)], 1) << "edge " << a << " " << b;
      next[a][b] = c;
    }
  for (const auto& [side, count] : sides) EXPECT_EQ(sides.count({side.second, side.first}), 1u);
  for (const auto& [vertex, turn] : next) {
    int at = turn.begin()->first;
    std::size_t steps = 0;
    do {
      ASSERT_TRUE(turn.contains(at)) << vertex;
      at = turn.at(at), ++steps;
    } while (at != turn.begin()->first && steps <= turn.size());
    EXPECT_EQ(steps, turn.size()) << "vertex " << vertex << " has more than one fan";
  }
}

SurfaceMesh both(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh all;
  all.positions.resize(a.positions.rows() + b.positions.rows(), 3);
  all.positions << a.positions, b.positions;
  all.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  all.triangles << a.triangles, (b.triangles.array() + int(a.positions.rows())).matrix();
  return all;
}

TEST(SurfaceNets, AnEllipsoidHasItsVolumeAndIsWithinHalfAVoxelButForAFewCorners) {
  const Vec3 radii(0.012, 0.016, 0.021), middle(0.1, -0.2, 0.3);
  const double volume_m3 = 4 * std::numbers::pi / 3 * radii.prod();
  Eigen::Matrix3d slanted;
  slanted << 0, -0.0008, 0.0001, 0.001, 0, 0, 0, 0.0002, 0.0015;
  for (const Eigen::Matrix3d& axes :
       {millimetres, Eigen::Matrix3d(Vec3(-0.0008, 0.001, 0.002).asDiagonal()), slanted}) {
    const std::array<int, 3> size{60, 60, 64};
    const Vec3 origin = middle - axes * Vec3(30.2, 29.7, 31.4);
    const LabelMap map = made_map(size, axes, origin, [&](const Vec3& p) {
      return int(((p - middle).array() / radii.array()).matrix().norm() < 1);
    });
    const LabelSurface found = surfaces_of(map, {1})[0];
    expect_manifold(found.surface);
    EXPECT_NEAR(volume(found.surface), volume_m3, 0.01 * volume_m3);
    // |x/r²| makes of the level the distance, to first order.
    const double half_voxel = 0.5 * axes.colwise().norm().maxCoeff();
    int beyond = 0;
    for (Eigen::Index v = 0; v < found.surface.positions.rows(); ++v) {
      const Vec3 d = found.surface.positions.row(v).transpose() - middle;
      const double level = (d.array() / radii.array()).matrix().norm();
      const double slope = (d.array() / radii.array().square()).matrix().norm() / level;
      EXPECT_LT(std::abs(level - 1) / slope, 1.2 * half_voxel);
      beyond += std::abs(level - 1) / slope > half_voxel;
    }
    EXPECT_LT(beyond, 2e-3 * double(found.surface.positions.rows()));
  }
}

// Nothing that voxels can do makes a surface that is none: not even noise, whose voxels meet at edges and
// points.
TEST(SurfaceNets, OfNoiseTooEachSurfaceIsAManifold) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Rng rng(seed, 0);
    const LabelMap map =
        made_map({9, 8, 7}, millimetres, Vec3::Zero(), [&](const Vec3&) { return rng.below(4); });
    for (const LabelSurface& one : surfaces_of(map, {1, 2, 3}, {.min_island = 0}))
      expect_manifold(one.surface);
  }
}

// Cells of Voronoi within a ball: flat boundaries at all angles, and edges and points at which many labels
// meet.
TEST(SurfaceNets, SurfacesMeetNeitherThemselvesNorOneAnother) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    Rng rng(seed, 0);
    std::vector<Vec3> seeds;
    for (int s = 0; s < 6; ++s)
      seeds.emplace_back(0.02 * rng.uniform(), 0.02 * rng.uniform(), 0.02 * rng.uniform());
    const Eigen::Matrix3d axes = Vec3(0.001, 0.0008, 0.0012).asDiagonal();
    const LabelMap map = made_map({24, 30, 20}, axes, Vec3::Zero(), [&](const Vec3& p) {
      if ((p - Vec3(0.011, 0.011, 0.011)).norm() > 0.009) return 0;
      const auto nearest = std::min_element(seeds.begin(), seeds.end(), [&](const Vec3& a, const Vec3& b) {
        return (p - a).norm() < (p - b).norm();
      });
      return int(nearest - seeds.begin()) + 1;
    });
    std::vector<int> rows;
    for (int row = 1; row < int(map.labels.size()); ++row)
      if (std::count(map.material.begin(), map.material.end(), row) > 20) rows.push_back(row);
    ASSERT_GE(rows.size(), 3u);
    const std::vector<LabelSurface> found = surfaces_of(map, rows, {.min_island = 0});
    for (std::size_t a = 0; a < rows.size(); ++a) {
      expect_manifold(found[a].surface);
      EXPECT_TRUE(meshing::self_intersections(found[a].surface).pairs.empty());
      for (std::size_t b = a + 1; b < rows.size(); ++b)
        EXPECT_TRUE(meshing::self_intersections(both(found[a].surface, found[b].surface)).pairs.empty())
            << seed << ": " << rows[a] << " and " << rows[b];
    }
  }
}

TEST(SurfaceNets, WithoutSmoothingAVoxelIsACubeAndFacesAddUp) {
  const LabelMap map = made_map({3, 3, 3}, millimetres, Vec3(1, 2, 3) * 0.001, [](const Vec3& p) {
    return int((p - Vec3(0.002, 0.003, 0.004)).norm() < 1e-6);
  });
  const LabelSurface cube = surfaces_of(map, {1}, {.gap = 0, .rounds = 0, .min_island = 0})[0];
  EXPECT_EQ(cube.surface.triangles.rows(), 12);
  EXPECT_NEAR(volume(cube.surface), 1e-9, 1e-18);
  const Box box = bounding_box(cube.surface.positions);
  EXPECT_LT((box.center() - Vec3(0.002, 0.003, 0.004)).norm(), 1e-12);
  // Voxels times their volume, whatever their shape.
  Rng rng(5, 0);
  const LabelMap noise =
      made_map({7, 7, 7}, millimetres, Vec3::Zero(), [&](const Vec3&) { return rng.below(2); });
  const LabelSurface all = surfaces_of(noise, {1}, {.gap = 0, .rounds = 0, .min_island = 0})[0];
  EXPECT_NEAR(volume(all.surface), 1e-9 * double(all.voxels), 1e-15);
}

TEST(SurfaceNets, NeighboursAreTheGapApartAndOthersAreNot) {
  // Two cubes that share a face in x, of voxels of 1 × 2 × 2 mm.
  const Eigen::Matrix3d axes = Vec3(0.001, 0.002, 0.002).asDiagonal();
  const LabelMap map = made_map({26, 14, 14}, axes, Vec3::Zero(), [](const Vec3& p) {
    if ((p.array() < 0.0025).any() || p.x() > 0.0225 || p.y() > 0.0225 || p.z() > 0.0225) return 0;
    return p.x() < 0.0125 ? 1 : 2;
  });
  for (const double gap : {0.0, 0.2, 0.6}) {
    const std::vector<LabelSurface> found = surfaces_of(map, {1, 2}, {.gap = gap});
    // In the middle of the shared face.
    const auto reach = [&](const SurfaceMesh& mesh, double sign) {
      double most = -1e300;
      for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
        if (std::abs(mesh.positions(v, 1) - 0.0125) < 0.004 &&
            std::abs(mesh.positions(v, 2) - 0.0125) < 0.004)
          most = std::max(most, sign * mesh.positions(v, 0));
      return sign * most;
    };
    EXPECT_NEAR(reach(found[1].surface, -1) - reach(found[0].surface, 1), gap * 0.001, 1e-9);
  }
  // The same boundary whichever are asked for.
  const LabelSurface alone = surfaces_of(map, {2})[0];
  EXPECT_EQ(alone.surface.positions, surfaces_of(map, {1, 2})[1].surface.positions);
  EXPECT_EQ(alone.surface.triangles, surfaces_of(map, {1, 2})[1].surface.triangles);
}

TEST(SurfaceNets, ShellsWithinShellsAndSheetsOfOneVoxelKeepApartAndWhole) {
  const Vec3 middle(0.015, 0.015, 0.015);
  const LabelMap map = made_map({31, 31, 31}, millimetres, Vec3::Zero(), [&](const Vec3& p) {
    const double r = (p - middle).norm();
    return r < 0.006 ? 1 : r < 0.010 ? 2 : r < 0.011 ? 3 : r < 0.014 ? 1 : 0;
  });
  const std::vector<LabelSurface> found = surfaces_of(map, {1, 2, 3}, {.min_island = 0});
  for (const LabelSurface& one : found) {
    expect_manifold(one.surface);
    EXPECT_TRUE(meshing::self_intersections(one.surface).pairs.empty());
  }
  EXPECT_TRUE(meshing::self_intersections(both(found[1].surface, found[2].surface)).pairs.empty());
  // A flat sheet: closed, of a tenth of its thickness at least.
  const LabelMap sheet = made_map({20, 20, 5}, millimetres, Vec3::Zero(), [](const Vec3& p) {
    return int(std::abs(p.z() - 0.002) < 1e-6 && p.x() > 0.0015 && p.x() < 0.0175 && p.y() > 0.0015 &&
               p.y() < 0.0175);
  });
  const SurfaceMesh thin = surfaces_of(sheet, {1})[0].surface;
  expect_manifold(thin);
  EXPECT_TRUE(meshing::self_intersections(thin).pairs.empty());
  EXPECT_GT(volume(thin), 0.1 * 256e-9);
}

TEST(SurfaceNets, IslandsAreLeftOutAndTold) {
  const LabelMap map = made_map({24, 12, 12}, millimetres, Vec3::Zero(), [](const Vec3& p) {
    if ((p - Vec3(0.006, 0.006, 0.006)).norm() < 0.004) return 1;
    return int(p.x() > 0.0195 && p.y() < 0.0015 && p.z() < 0.0005);  // 4 × 2 × 1 voxels
  });
  const LabelSurface all = surfaces_of(map, {1}, {.min_island = 8})[0];
  const LabelSurface large = surfaces_of(map, {1}, {.min_island = 9})[0];
  EXPECT_EQ(all.islands_dropped, 0);
  EXPECT_EQ(large.islands_dropped, 1);
  EXPECT_EQ(large.voxels_dropped, 8);
  EXPECT_EQ(large.voxels + 8, all.voxels);
  EXPECT_LT(bounding_box(large.surface.positions).upper.x(), 0.012);
  const LabelSurface none = surfaces_of(map, {1}, {.min_island = 1e6})[0];
  EXPECT_EQ(none.voxels, 0);
  EXPECT_EQ(none.voxels_dropped, all.voxels);
  EXPECT_EQ(none.surface.triangles.rows(), 0);
  EXPECT_THROW(surfaces_of(map, {2}), InputError);
  EXPECT_THROW(surfaces_of(map, {1}, {.gap = 0.7}), InputError);
  EXPECT_THROW(surfaces_of(map, {1}, {.rounds = -1}), InputError);
}

}  // namespace
}  // namespace limber::imaging
