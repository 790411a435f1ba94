// Laws of the steps that a cage is made by, each on its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "core/random.h"
#include "meshing/cage.h"
#include "meshing/certificate.h"
#include "meshing/detail/coarsen.h"
#include "meshing/detail/gaps.h"
#include "meshing/detail/manifold.h"
#include "meshing/detail/shrink_fit.h"
#include "tests/meshing/cage_models.h"

namespace limber::meshing {
namespace {

using detail::CageModel;

constexpr DihedralRange warp_range{20, 160};
constexpr TetLimits limits{{18, 162}, 0};

TetMesh lattice_mesh(const CageModel& model, double spacing,
                     const std::optional<DihedralRange>& warp_within = warp_range) {
  return detail::build_mesh(detail::select_tets(model, spacing, {0.137, 0.291, 0.413}, warp_within)).mesh;
}

TetMesh drawn_in(const CageModel& model, TetMesh mesh) {
  detail::shrink_fit(model.tree, {0.01, {{16.5, 163.5}, 0}}, mesh);
  return mesh;
}

std::array<Vec3, 4> corners(const TetMesh& mesh, int t) {
  std::array<Vec3, 4> p;
  for (int k = 0; k < 4; ++k) p[k] = mesh.positions.row(mesh.tets(t, k));
  return p;
}

// How many of `samples` points of a mesh lie outside another; on its boundary counts as inside.
int points_outside(const TetMesh& mesh, const TetMesh& other, int samples) {
  Rng rng(5, 0);
  int outside = 0;
  for (int i = 0; i < samples; ++i) {
    Vec3 p = Vec3::Zero();
    double sum = 0;
    for (const Vec3& corner : corners(mesh, rng.below(int(mesh.tets.rows())))) {
      const double weight = 1e-3 + rng.uniform();
      p += weight * corner, sum += weight;
    }
    p /= sum;
    bool held = false;
    for (int t = 0; t < other.tets.rows() && !held; ++t) {
      const auto [a, b, c, d] = corners(other, t);
      held = tet_holds(a, b, c, d, p);
    }
    outside += !held;
  }
  return outside;
}

void expect_limits_kept(const TetMesh& mesh, const TetLimits& kept) {
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    const auto [a, b, c, d] = corners(mesh, t);
    EXPECT_TRUE(keeps_limits(kept, a, b, c, d)) << "tet " << t;
  }
}

void expect_manifold(const TetMesh& mesh) {
  const detail::ManifoldFaults faults =
      detail::manifold_faults(boundary_triangles(mesh.tets), int(mesh.positions.rows()));
  EXPECT_TRUE(faults.edges.empty());
  EXPECT_TRUE(faults.vertices.empty());
}

std::ptrdiff_t glued_count(const CageModel& model, const TetMesh& mesh) {
  const std::vector<char> glued = detail::glued_tets(model, mesh).glued;
  return std::count(glued.begin(), glued.end(), 1);
}

// Two plates, `gap` apart along z; `joined_at_one_end` makes them a U.
SurfaceMesh two_plates(double gap, bool joined_at_one_end) {
  const SurfaceMesh plate = box_at_origin({2, 1, 0.2});
  const SurfaceMesh plates = joined(plate, moved(plate, {0, 0, 0.2 + gap}));
  return joined_at_one_end ? joined(plates, moved(box_at_origin({0.3, 1, 0.4 + gap}), {1.9, 0, 0})) : plates;
}

TEST(CageSteps, WarpKeepsItsRangeAndNeedsLessVolume) {
  for (const std::string name : {"sphere", "torus", "box"}) {
    SCOPED_TRACE(name);
    const CageModel model(models().at(name));
    const double spacing = name == "torus" ? 0.4 : 0.6;
    const TetMesh bare = lattice_mesh(model, spacing, {}), warped = lattice_mesh(model, spacing);
    expect_limits_kept(warped, {warp_range, 0});
    expect_limits_kept(lattice_mesh(model, spacing, DihedralRange{45, 120}), {{45, 120}, 0});
    EXPECT_LT(volume(warped), 0.97 * volume(bare));
  }
}

TEST(CageSteps, DrawingInMovesTheBoundaryOnlyInwards) {
  for (const std::string name : {"torus", "soup", "two spheres"}) {
    SCOPED_TRACE(name);
    const CageModel model(models().at(name));
    const TetMesh before = lattice_mesh(model, 0.5), after = drawn_in(model, before);
    EXPECT_LT(volume(after), volume(before));
    EXPECT_EQ(points_outside(after, before, 3000), 0);
    expect_limits_kept(after, {{16.5, 163.5}, 0});
  }
}

TEST(CageSteps, NoTetGetsLowerThanAskedByDrawingIn) {
  const CageModel model(models().at("torus"));
  TetMesh mesh = lattice_mesh(model, 0.4, {});
  const double floor = 0.35 * 0.4 * std::sqrt(0.5);
  detail::shrink_fit(model.tree, {0.01, {{15, 165}, floor}}, mesh);
  EXPECT_GE(measure_quality(mesh).min_height_m, floor);
}

TEST(CageSteps, SplittingAtGapsFillsTheSameSpaceWithGoodTetsThatShareWholeFaces) {
  const SurfaceMesh plates = two_plates(0.05, true);
  const CageModel model(plates);
  const TetMesh before = lattice_mesh(model, 0.5);
  TetMesh after = before;
  const TetLimits kept{{18, 162}, 0.02};
  detail::split_at_gaps(model, {0.5, kept, 100'000}, after);
  EXPECT_GT(after.tets.rows(), before.tets.rows() + 50);
  EXPECT_NEAR(volume(after), volume(before), 1e-12);
  EXPECT_EQ(points_outside(after, before, 2000), 0);
  expect_limits_kept(after, kept);
  // A face that hung on half a neighbour would be on the boundary, within the solid.
  expect_manifold(after);
  EXPECT_TRUE(certify(plates, after).holds());
  TetMesh capped = before;
  detail::split_at_gaps(model, {0.5, kept, int(before.tets.rows()) + 20}, capped);
  EXPECT_LE(capped.tets.rows(), before.tets.rows() + 40);  // one edge may go over it
}

TEST(CageSteps, OpeningGapsOnlyTakesAirAndKeepsTheBoundaryAManifold) {
  std::map<std::string, SurfaceMesh> surfaces{{"plates", two_plates(0.08, false)},
                                              {"U", two_plates(0.08, true)},
                                              {"soup", models().at("soup")},
                                              {"threads", made_soup(200)}};
  for (const auto& [name, surface] : surfaces) {
    const CageModel model(surface);
    for (double spacing : {0.6, 0.5, 0.4, 0.3}) {
      SCOPED_TRACE(name + " " + std::to_string(spacing));
      TetMesh split = lattice_mesh(model, spacing);
      detail::split_at_gaps(model, {spacing, limits, 100'000}, split);
      const TetMesh opened = detail::open_gaps(model, split);
      EXPECT_LE(volume(opened), volume(split));
      EXPECT_LE(opened.tets.rows(), split.tets.rows());
      expect_manifold(opened);
      EXPECT_TRUE(certify(surface, opened).holds());
    }
  }
}

TEST(CageSteps, PlatesThatTheLatticeGluesBecomeTwoPiecesAndStayOneWhereAnEndJoinsThem) {
  for (double spacing : {0.45, 0.3})
    for (const bool u_shaped : {false, true}) {
      SCOPED_TRACE(std::to_string(spacing) + (u_shaped ? " U" : ""));
      const SurfaceMesh plates = two_plates(0.2, u_shaped);
      const CageModel model(plates);
      TetMesh mesh = lattice_mesh(model, spacing);
      ASSERT_EQ(measure_quality(mesh).components, 1);
      for (int round = 0; round < 2; ++round) {
        detail::split_at_gaps(model, {spacing, {{16.5, 163.5}, 0}, 100'000}, mesh);
        mesh = drawn_in(model, detail::open_gaps(model, mesh));
      }
      EXPECT_EQ(measure_quality(mesh).components, u_shaped ? 1 : 2);
      EXPECT_LT(detail::glued_tets(model, mesh).share(), 0.02);
      EXPECT_TRUE(certify(plates, mesh).holds());
    }
}

TEST(CageSteps, CoarseningTakesTetsAndNothingElse) {
  for (const std::string name : {"torus", "sphere", "hemisphere"}) {
    SCOPED_TRACE(name);
    const SurfaceMesh surface = models().at(name);
    const CageModel model(surface);
    const TetMesh before = drawn_in(model, lattice_mesh(model, 0.3));
    TetMesh after = before;
    const int most = int(0.85 * double(before.tets.rows()));
    const TetLimits kept{{16.5, 163.5}, 0.5 * measure_quality(before).min_height_m};
    detail::coarsen(model, kept, most, after);
    EXPECT_LE(after.tets.rows(), most);
    EXPECT_GT(after.tets.rows(), most - 24);  // one collapse takes a ring of tets
    EXPECT_LE(volume(after), volume(before) * (1 + 1e-12));
    EXPECT_EQ(points_outside(after, before, 3000), 0);
    EXPECT_LE(glued_count(model, after), glued_count(model, before));
    expect_limits_kept(after, kept);
    expect_manifold(after);
    EXPECT_TRUE(certify(surface, after).holds());
  }
}

// Vertices − edges + triangles − tets: 1 for a ball, 0 for a ring, 2 for a hollow ball.
int euler_characteristic(const TetMesh& mesh) {
  std::set<std::array<int, 2>> edges;
  std::set<std::array<int, 3>> triangles;
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    std::array<int, 4> v{mesh.tets(t, 0), mesh.tets(t, 1), mesh.tets(t, 2), mesh.tets(t, 3)};
    std::sort(v.begin(), v.end());
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) {
        edges.insert({v[j], v[i]});
        for (int k = 0; k < j; ++k) triangles.insert({v[k], v[j], v[i]});
      }
  }
  return int(mesh.positions.rows()) - int(edges.size()) + int(triangles.size()) - int(mesh.tets.rows());
}

TEST(CageSteps, CoarseningKeepsHolesAndHollows) {
  // A speck in one place of the cages: elsewhere no surface is in the way.
  const SurfaceMesh speck = moved(box_at_origin({0.01, 0.01, 0.01}), {1, 0, 0});
  const CageModel model(speck);
  const SurfaceMesh ball = made_sphere(8);
  SurfaceMesh hollow = ball;
  hollow.positions *= 0.6;
  hollow.triangles.col(0).swap(hollow.triangles.col(1));
  for (const auto& [surface, expected] :
       {std::pair{models().at("torus"), 0}, std::pair{ball, 1}, std::pair{joined(ball, hollow), 2}})
    for (double spacing : {0.3, 0.2}) {
      TetMesh mesh = lattice_mesh(CageModel(surface), spacing, {});
      ASSERT_EQ(euler_characteristic(mesh), expected);
      detail::coarsen(model, {{0.5, 179.5}, 0}, 24, mesh);
      EXPECT_EQ(euler_characteristic(mesh), expected);
      expect_manifold(mesh);
    }
}

TEST(CageSteps, CoarseningGluesNothing) {
  const SurfaceMesh plates = two_plates(0.2, true);
  const CageModel model(plates);
  TetMesh mesh = drawn_in(model, detail::open_gaps(model, lattice_mesh(model, 0.12)));
  const auto before = glued_count(model, mesh);
  detail::coarsen(model, {{10, 170}, 0}, 24, mesh);
  EXPECT_LE(glued_count(model, mesh), before);
  expect_manifold(mesh);
}

TEST(CageSteps, CoarseningChangesNothingWhenTheBudgetIsMet) {
  const SurfaceMesh ball = made_sphere(8);
  const CageModel model(ball);
  const TetMesh before = lattice_mesh(model, 0.6);
  TetMesh after = before;
  detail::coarsen(model, limits, int(before.tets.rows()), after);
  EXPECT_EQ(after.tets, before.tets);
  EXPECT_EQ(after.positions, before.positions);
}

TEST(CageSteps, FreeShareIsWhereAWayMeetsTheSurface) {
  const SurfaceMesh box = box_at_origin({1, 2, 3});
  const SurfaceTree tree(box.positions, box.triangles);
  const Vec3 middle(0.5, 1, 1.5);
  Rng rng(8, 0);
  for (int i = 0; i < 500; ++i) {
    const Vec3 way = 4 * rng.direction();
    // To the nearest of the three planes that the way meets.
    const double expected = std::min(1.0, (middle.array() / way.array().abs()).minCoeff());
    EXPECT_NEAR(tree.free_share(middle, middle + way), expected, 1e-12);
    EXPECT_NEAR(tree.free_share(middle + 3 * way, middle + 2 * way), 1, 1e-12);
  }
}

TEST(CageSteps, SmallestHeightOfKnownTets) {
  // Edge √8: height √(2/3) of it.
  EXPECT_NEAR(smallest_height({1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}), std::sqrt(16 / 3.0), 1e-14);
  EXPECT_NEAR(smallest_height({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1 / std::sqrt(3.0), 1e-15);
  EXPECT_EQ(smallest_height({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}), 0);
}

}  // namespace
}  // namespace limber::meshing
