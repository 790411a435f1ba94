#include "meshing/unite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <numbers>
#include <tuple>

#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "core/random.h"
#include "meshing/import.h"
#include "meshing/surface_tree.h"
#include "meshing/winding_number.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

SurfaceMesh moved(SurfaceMesh mesh, const Vec3& by) {
  mesh.positions.rowwise() += by.transpose();
  return mesh;
}
SurfaceMesh scaled(SurfaceMesh mesh, double by) {
  mesh.positions *= by;
  return mesh;
}
SurfaceMesh turned(SurfaceMesh mesh, const Vec3& axis, double angle) {
  mesh.positions = (mesh.positions * Eigen::AngleAxisd(angle, axis).toRotationMatrix().transpose()).eval();
  return mesh;
}
SurfaceMesh inside_out(SurfaceMesh mesh) {
  mesh.triangles.col(0).swap(mesh.triangles.col(1));
  return mesh;
}
SurfaceMesh side_by_side(const std::vector<SurfaceMesh>& elements) {
  SurfaceMesh all{Points(0, 3), Triangles(0, 3)};
  for (const SurfaceMesh& element : elements) append(all, element);
  return all;
}
SurfaceMesh cube(const Vec3& lower, double edge = 1) { return moved(made_box(Vec3::Constant(edge)), lower); }

// Two that overlap askew.
std::vector<SurfaceMesh> two_spheres(int rings) {
  return {made_sphere(rings),
          moved(turned(made_sphere(rings - 3), Vec3(1, 2, 3).normalized(), 0.7), {0.8, 0.3, -0.2})};
}

// By the project's own count: closed, a manifold, nowhere through itself; and an import finds nothing to
// mend.
void expect_solid(const SurfaceMesh& surface) {
  validate(surface, "united");
  const ImportedModel model = clean(surface);
  EXPECT_THAT(model.mended, ElementsAre());
  EXPECT_TRUE(model.left.closed());
  EXPECT_FALSE(model.left.non_manifold_vertices);
  EXPECT_FALSE(model.left.misoriented_edges);
  EXPECT_FALSE(model.left.degenerate_faces);
  EXPECT_TRUE(model.left.all_self_intersections_counted);
  EXPECT_EQ(model.left.self_intersecting_pairs.count, 0);
}

double winding(const SurfaceMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const auto t : mesh.triangles.rowwise())
    sum += solid_angle_share(mesh.positions.row(t[0]), mesh.positions.row(t[1]), mesh.positions.row(t[2]), p);
  return sum;
}

// What the half-spaces of b leave of a's faces, as Σ (area · height) / 3 about the origin (Sutherland and
// Hodgman 1974).
double share_of_intersection(const SurfaceMesh& a, const SurfaceMesh& b) {
  double volume = 0;
  for (const auto t : a.triangles.rowwise()) {
    std::vector<Vec3> polygon{a.positions.row(t[0]), a.positions.row(t[1]), a.positions.row(t[2])};
    for (const auto plane : b.triangles.rowwise()) {
      const Vec3 p = b.positions.row(plane[0]), q = b.positions.row(plane[1]), r = b.positions.row(plane[2]);
      const Vec3 n = (q - p).cross(r - p);
      std::vector<Vec3> kept;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3 &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
        const double h = n.dot(from - p), g = n.dot(to - p);
        if (h <= 0) kept.push_back(from);
        if (h * g < 0) kept.push_back(from + h / (h - g) * (to - from));
      }
      polygon = kept;
    }
    for (std::size_t i = 2; i < polygon.size(); ++i)
      volume += polygon[0].dot(polygon[i - 1].cross(polygon[i])) / 6;
  }
  return volume;
}

TEST(Unite, TwoBoxesByInclusionAndExclusion) {
  const United united = unite({made_box({1, 1, 1}), moved(made_box({1, 2, 1}), {0.3, 0.4, 0.7})});
  EXPECT_NEAR(volume(united.surface), 1 + 2 - 0.7 * 0.6 * 0.3, 1e-14);
  expect_solid(united.surface);
  EXPECT_THAT(united.together, ElementsAre(ElementsAre(0, 1)));
  EXPECT_TRUE(united.beside.empty());
}

// Both are convex, so what they share is what each one's faces keep within the other's half-spaces.
TEST(Unite, TwoSpheresAreTheirSumLessTheirLens) {
  const std::vector<SurfaceMesh> spheres = two_spheres(20);
  const SurfaceMesh &a = spheres[0], &b = spheres[1];
  const United united = unite(spheres);
  const double lens = share_of_intersection(a, b) + share_of_intersection(b, a);
  EXPECT_GT(lens, 1);
  EXPECT_NEAR(volume(united.surface), volume(a) + volume(b) - lens, 1e-12);
  expect_solid(united.surface);
}

TEST(Unite, HoldsWhatIsInEither) {
  std::vector<SurfaceMesh> elements = two_spheres(16);
  elements.push_back(moved(turned(made_torus(0.3, 32, 16), Vec3(3, 1, 2).normalized(), 1), {0.2, 1, 0.5}));
  const United united = unite(elements);
  expect_solid(united.surface);
  Rng rng(5, 0);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(rng.uniform(-1.5, 2.5), rng.uniform(-1.5, 2.5), rng.uniform(-2, 2));
    bool in_one = false;
    for (const SurfaceMesh& element : elements) in_one |= winding(element, p) > 0.5;
    inside += in_one;
    EXPECT_NEAR(winding(united.surface, p), in_one, 1e-9) << p.transpose();
  }
  EXPECT_GT(inside, 200);
}

TEST(Unite, WhatIsInsideAnotherVanishes) {
  const SurfaceMesh outer = made_sphere(12), inner = turned(scaled(made_sphere(9), 0.5), Vec3::UnitX(), 1);
  for (const auto& elements : {std::vector{outer, inner}, std::vector{inner, outer}}) {
    const United united = unite(elements);
    EXPECT_EQ(hash_of(united.surface), hash_of(outer));
    EXPECT_THAT(united.together, ElementsAre(ElementsAre(0, 1)));
  }
  // One shell of two is inside.
  const SurfaceMesh other = moved(inner, {3, 0, 0});
  EXPECT_EQ(hash_of(unite({outer, side_by_side({inner, other})}).surface),
            hash_of(side_by_side({outer, other})));
}

// The boxes round two links of a chain meet.
TEST(Unite, WhatMeetsNothingIsAsItWas) {
  const SurfaceMesh link = made_torus(0.3, 48, 24);
  const std::vector<SurfaceMesh> elements{
      link, moved(turned(link, Vec3::UnitX(), std::numbers::pi / 2), {1, 0, 0}), cube({5, 0, 0}),
      moved(made_hemisphere(8), {0, 7, 0}), cube({-9, 0, 0})};
  const United united = unite(elements);
  EXPECT_EQ(hash_of(united.surface), hash_of(side_by_side(elements)));
  EXPECT_TRUE(united.together.empty());
  EXPECT_TRUE(united.beside.empty());
}

TEST(Unite, ACavityStays) {
  const SurfaceMesh hollow = side_by_side({cube({0, 0, 0}, 3), inside_out(cube({1, 1, 1}))});
  const auto volume_with = [&](const SurfaceMesh& other) {
    const United united = unite({hollow, other}), in_the_other_order = unite({other, hollow});
    EXPECT_TRUE(united.beside.empty());
    expect_solid(united.surface);
    expect_solid(in_the_other_order.surface);
    EXPECT_NEAR(volume(in_the_other_order.surface), volume(united.surface), 1e-12);
    return volume(united.surface);
  };
  EXPECT_NEAR(volume_with(cube({2.5, 2.5, 2.5})), 26 + 1 - 0.125, 1e-13);   // at a corner of the wall
  EXPECT_NEAR(volume_with(cube({0.2, 0.2, 0.2}, 0.5)), 26, 1e-13);          // in the wall
  EXPECT_NEAR(volume_with(cube({1.2, 1.3, 1.4}, 0.5)), 26 + 0.125, 1e-13);  // in the cavity
  EXPECT_NEAR(volume_with(cube({1.5, 1.5, 1.5})), 26 + 0.125, 1e-13);       // from the wall into the cavity
  EXPECT_NEAR(volume_with(cube({1, 1, 1}, 0.5)), 26 + 0.125, 1e-13);        // in a corner of the cavity
  EXPECT_NEAR(volume_with(cube({-1, -1, -1}, 5)), 125, 1e-12);              // round it all
  // Fills it wholly; with other diagonals; and is hollow itself.
  const SurfaceMesh plug = cube({1, 1, 1});
  EXPECT_NEAR(volume_with(plug), 27, 1e-13);
  SurfaceMesh mirrored = inside_out(plug);
  mirrored.positions.col(0) = 3 - mirrored.positions.col(0).array();
  EXPECT_NEAR(volume_with(mirrored), 27, 1e-13);
  EXPECT_NEAR(volume_with(side_by_side({plug, inside_out(cube({1.2, 1.2, 1.2}, 0.5))})), 27 - 0.125, 1e-13);
}

TEST(Unite, BlocksThatShareAFaceAreOneWithoutAWall) {
  for (const SurfaceMesh& block : {cube({1, 0, 0}), moved(made_box({1, 0.5, 0.5}), {1, 0, 0.25}),
                                   moved(made_box({1, 0.5, 0.5}), {1, 0.25, 0.25}), cube({0.5, 0, 0}),
                                   cube({0, 0, 0}), cube({0, 0.5, 0}, 0.5)}) {
    const SurfaceMesh first = cube({0, 0, 0});
    const United united = unite({first, block});
    const double shared = share_of_intersection(first, block);
    EXPECT_THAT(united.together, ElementsAre(ElementsAre(0, 1)));
    expect_solid(united.surface);
    const double beyond = std::max(0., bounding_box(block.positions).upper.x() - 1);
    const Vec3 size = bounding_box(block.positions).size();
    EXPECT_NEAR(volume(united.surface), 1 + beyond * size.y() * size.z(), 1e-13) << shared;
  }
}

TEST(Unite, BlocksThatShareAnEdgeOrACornerAloneStayAsTheyAre) {
  for (const Vec3& at : {Vec3(1, 1, 0), Vec3(1, 1, 1), Vec3(1, 1, 0.5)}) {
    const std::vector<SurfaceMesh> blocks{cube({0, 0, 0}), cube(at)};
    const United united = unite(blocks);
    EXPECT_EQ(hash_of(united.surface), hash_of(side_by_side(blocks)));
    ASSERT_EQ(united.beside.size(), 1u);
    EXPECT_THAT(united.beside[0].elements, ElementsAre(0, 1));
    EXPECT_THAT(united.beside[0].why, HasSubstr("touch"));
  }
}

TEST(Unite, WhatIsNotFitStaysBesideAndIsNamed) {
  SurfaceMesh open = cube({0.5, 0.5, 0.5});
  open.triangles.conservativeResize(11, 3);
  SurfaceMesh flat = cube({0.5, 0.5, 0.5});
  flat.positions.conservativeResize(9, 3);
  flat.positions.row(8) = 0.5 * (flat.positions.row(0) + flat.positions.row(3));  // on the diagonal of a face
  flat.triangles.conservativeResize(14, 3);
  flat.triangles.row(1) << 0, 8, 1;
  flat.triangles.row(12) << 8, 3, 1;
  flat.triangles.row(13) << 0, 3, 8;
  const SurfaceMesh crossing = side_by_side({cube({0.5, 0.5, 0.5}), cube({0.7, 0.8, 0.9})}),
                    nested = side_by_side({cube({0.5, 0.5, 0.5}, 2), cube({1, 1, 1})}),
                    turned_about = inside_out(cube({0.5, 0.5, 0.5}));
  for (const auto& [unfit, why] : {std::pair{open, "it is open"},
                                   {flat, "it has a face without area"},
                                   {crossing, "it passes through itself"},
                                   {nested, "it has a shell within another that faces the same way"},
                                   {turned_about, "it is inside out"}}) {
    const SurfaceMesh first = cube({0, 0, 0}), last = cube({-0.5, -0.4, -0.3});
    const United united = unite({first, unfit, last});
    ASSERT_EQ(united.beside.size(), 1u) << why;
    EXPECT_THAT(united.beside[0].elements, ElementsAre(1));
    EXPECT_EQ(united.beside[0].why, why);
    EXPECT_THAT(united.together, ElementsAre(ElementsAre(0, 2)));
    EXPECT_EQ(hash_of(united.surface), hash_of(side_by_side({unite({first, last}).surface, unfit})));
    EXPECT_TRUE(unite({unfit, cube({9, 9, 9})}).beside.empty()) << "it meets nothing";
  }
  // One that is open and holds another.
  EXPECT_EQ(unite({made_hemisphere(8), cube({0, 0, 0.2}, 0.2)}).beside.size(), 1u);
}

// All vertices outside the other are there, and the new ones lie on both.
TEST(Unite, NoVertexMoves) {
  const std::vector<SurfaceMesh> spheres = two_spheres(24);
  const SurfaceMesh united = unite(spheres).surface;
  const auto place = [](const Points& p, Eigen::Index v) { return std::tuple(p(v, 0), p(v, 1), p(v, 2)); };
  std::map<std::tuple<double, double, double>, int> rows;
  for (int v = 0; v < united.positions.rows(); ++v) rows[place(united.positions, v)] = v;
  ASSERT_EQ(Eigen::Index(rows.size()), united.positions.rows());
  for (int i = 0; i < 2; ++i) {
    const SurfaceMesh& one = spheres[std::size_t(i)];
    for (int v = 0; v < one.positions.rows(); ++v)
      EXPECT_EQ(rows.erase(place(one.positions, v)),
                winding(spheres[std::size_t(1 - i)], one.positions.row(v)) < 0.5);
  }
  EXPECT_GT(rows.size(), 20u);
  for (const SurfaceMesh& one : spheres) {
    const SurfaceTree tree(one.positions, one.triangles);
    for (const auto& [_, v] : rows) {
      const Vec3 p = united.positions.row(v);
      EXPECT_LT((tree.closest_point(p) - p).norm(), 1e-14);
    }
  }
}

// The last one bridges two that were apart; what it does not meet keeps its place in the order.
TEST(Unite, AnElementJoinsWhatItMeets) {
  const SurfaceMesh ball = made_sphere(10);
  const std::vector<SurfaceMesh> elements{ball, cube({0, 5, 0}), moved(ball, {2.6, 0.1, 0.2}),
                                          moved(ball, {1.3, 0.3, 0.1})};
  const United united = unite(elements);
  EXPECT_THAT(united.together, ElementsAre(ElementsAre(0, 2, 3)));
  const auto lens = [&](std::size_t i, std::size_t j) {
    return share_of_intersection(elements[i], elements[j]) + share_of_intersection(elements[j], elements[i]);
  };
  EXPECT_NEAR(volume(united.surface), 1 + 3 * volume(ball) - lens(0, 3) - lens(2, 3), 1e-12);
  EXPECT_EQ(united.surface.positions.bottomRows(8), elements[1].positions);
  expect_solid(united.surface);
}

// Edges meet edges in the plane between the two.
TEST(Unite, MirrorImagesAreOne) {
  const SurfaceMesh one = moved(made_sphere(24), {-0.7, 0, 0});
  SurfaceMesh other = inside_out(one);
  other.positions.col(0) *= -1;
  const United united = unite({one, other});
  EXPECT_TRUE(united.beside.empty());
  expect_solid(united.surface);
  const double lens = share_of_intersection(one, other) + share_of_intersection(other, one);
  EXPECT_NEAR(volume(united.surface), 2 * volume(one) - lens, 1e-12);
}

// Rounding must not spoil what all but coincides: it is one, or stays as it was.
TEST(Unite, WhatAllButCoincidesIsOneOrStays) {
  const SurfaceMesh sphere = made_sphere(16);
  int were_united = 0;
  for (const double by : {1., 1e-5, 1e-7, 1e-8, 1e-9, 1e-12, 1e-15})
    for (const SurfaceMesh& other :
         {moved(sphere, {by, 0, 0}), turned(sphere, Vec3(1, 2, 3).normalized(), by)}) {
      SCOPED_TRACE(by);
      const United united = unite({sphere, other});
      if (united.beside.empty()) {
        expect_solid(united.surface);
        ++were_united;
      } else {
        EXPECT_EQ(hash_of(united.surface), hash_of(side_by_side({sphere, other})));
        EXPECT_THAT(united.beside[0].why, HasSubstr("by a hair"));
      }
    }
  EXPECT_GT(were_united, 5);
}

TEST(Unite, SameElementsSameBytes) {
  const std::vector<SurfaceMesh> spheres = two_spheres(30);
  const std::uint64_t hash = hash_of(unite(spheres).surface);
  std::vector<std::unique_ptr<char[]>> elsewhere;  // so that memory is another
  for (int i = 0; i < 100; ++i) elsewhere.push_back(std::make_unique<char[]>(std::size_t(1000 * i + 7)));
  EXPECT_EQ(hash_of(unite(spheres).surface), hash);
}

TEST(Unite, AStopEndsIt) {
  request_stop(SIGTERM);
  EXPECT_THROW(unite({cube({0, 0, 0}), cube({5, 0, 0})}), Interrupted);
  request_stop(0);
}

}  // namespace
}  // namespace limber::meshing
