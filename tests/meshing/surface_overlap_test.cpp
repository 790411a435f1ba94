#include "meshing/surface_overlap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "core/random.h"
#include "meshing/surface_tree.h"
#include "meshing/winding_number.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {
namespace {

using Map = std::function<Vec3(const Vec3&)>;

Points mapped(const Points& points, const Map& map) {
  Points result(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) result.row(i) = map(points.row(i));
  return result;
}
SurfaceMesh mapped(const SurfaceMesh& mesh, const Map& map) {
  return {mapped(mesh.positions, map), mesh.triangles};
}

// A surface at rest where it is.
struct Still {
  explicit Still(const SurfaceMesh& mesh)
      : shape(mesh.positions, mesh.triangles), placed(shape, mesh.positions) {}
  SurfaceShape shape;
  PlacedSurface placed;
};
SurfaceOverlap overlap(const SurfaceMesh& a, const SurfaceMesh& b) {
  return meshing::overlap(Still(a).placed, Still(b).placed);
}
SurfaceGap gap(const SurfaceMesh& a, const SurfaceMesh& b, double farthest = 100) {
  return meshing::gap(Still(a).placed, Still(b).placed, farthest);
}
SurfaceOverlap self_overlap(const SurfaceMesh& rest, const Map& map) {
  const SurfaceShape shape(rest.positions, rest.triangles);
  return meshing::self_overlap(PlacedSurface(shape, mapped(rest.positions, map)),
                               PlacedSurface(shape, rest.positions));
}

Eigen::Isometry3d some_motion() {
  return Eigen::Translation3d(0.3, -1.2, 2.1) * Eigen::AngleAxisd(1.1, Vec3(0.2, -0.5, 0.8).normalized());
}

// The faces of a box [0 … size] in cells, with one vertex a place.
SurfaceMesh made_bar(const Vec3& size, const Eigen::Vector3i& cells) {
  SurfaceMesh mesh;
  std::map<std::array<int, 3>, int> vertex_at;
  std::vector<Vec3> places;
  std::vector<Eigen::Vector3i> triangles;
  const auto vertex = [&](const Eigen::Vector3i& at) {
    const auto [found, fresh] = vertex_at.try_emplace({at[0], at[1], at[2]}, int(places.size()));
    if (fresh) places.push_back(size.cwiseProduct(at.cast<double>()).cwiseQuotient(cells.cast<double>()));
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, 1}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int i = 0; i < cells[u]; ++i)
        for (int k = 0; k < cells[v]; ++k) {
          const auto corner = [&](int a, int b) {
            Eigen::Vector3i at;
            at[axis] = side * cells[axis], at[u] = i + a, at[v] = k + b;
            return vertex(at);
          };
          const int p = corner(0, 0), q = corner(1, 0), r = corner(1, 1), s = corner(0, 1);
          for (const Eigen::Vector3i& t : {Eigen::Vector3i(p, q, r), Eigen::Vector3i(p, r, s)})
            triangles.push_back(side ? t : Eigen::Vector3i(t[0], t[2], t[1]));
        }
    }
  mesh.positions.resize(Eigen::Index(places.size()), 3);
  for (std::size_t i = 0; i < places.size(); ++i) mesh.positions.row(Eigen::Index(i)) = places[i];
  mesh.triangles.resize(Eigen::Index(triangles.size()), 3);
  for (std::size_t i = 0; i < triangles.size(); ++i) mesh.triangles.row(Eigen::Index(i)) = triangles[i];
  return mesh;
}

SurfaceMesh both(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh mesh;
  mesh.positions.resize(a.positions.rows() + b.positions.rows(), 3);
  mesh.positions << a.positions, b.positions;
  mesh.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  mesh.triangles << a.triangles, (b.triangles.array() + int(a.positions.rows())).matrix();
  return mesh;
}

TEST(PlacedSurface, WindingAndDistanceAreThoseOfTheWholeSumAndOfTheExactTree) {
  const SurfaceMesh rest = made_torus(0.3, 60, 24);
  const SurfaceShape shape(rest.positions, rest.triangles);
  const auto wring = [](const Vec3& p) {
    return Vec3(p.x() + 0.3 * p.y() * p.z(), 1.4 * p.y(), p.z() - 0.2 * p.x() * p.x());
  };
  const Points now = mapped(rest.positions, wring);
  const PlacedSurface placed(shape, now);
  const SurfaceTree tree(now, rest.triangles);
  Rng rng(3, 0);
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = 1.6 * rng.uniform() * rng.direction();
    double sum = 0;
    for (const auto& t : rest.triangles.rowwise())
      sum += solid_angle_share(now.row(t[0]), now.row(t[1]), now.row(t[2]), p);
    EXPECT_NEAR(placed.winding(p), sum, 0.05);
    const double distance = (tree.closest_point(p) - p).norm();
    EXPECT_NEAR(placed.distance(p), distance, 1e-12);
    EXPECT_LE(placed.distance(p, 2 * distance), 2 * distance);
    EXPECT_NEAR(placed.distance(p, 0.5 * distance), distance, 1e-12);
  }
}

// Unit balls whose poles are turned to one another: depth and gap are the centres' distance against 2.
// Boxes in single precision hold every corner, however far from zero they are, and hardly more.
TEST(PlacedSurface, BoxesHoldTheirTriangles) {
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  const SurfaceShape shape(torus.positions, torus.triangles);
  for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(0.7, -31.3, 1234.567), Vec3(1e-9, -1e6, 1e-30)}) {
    const PlacedSurface placed(shape,
                               mapped(torus.positions, [&](const Vec3& p) { return Vec3(p + shift); }));
    const double most = 1e-6 * (1 + shift.cwiseAbs().maxCoeff());
    for (std::size_t n = 0; n < placed.boxes().size(); ++n) {
      const Box box = placed.boxes()[n];
      Box exact;
      for (int t = shape.tree.nodes[n].begin; t < shape.tree.nodes[n].end; ++t)
        for (const Vec3& corner : placed.corners(t)) exact.include(corner);
      ASSERT_TRUE((box.lower.array() <= exact.lower.array()).all() &&
                  (box.upper.array() >= exact.upper.array()).all());
      ASSERT_LT((exact.lower - box.lower).maxCoeff(), most);
      ASSERT_LT((box.upper - exact.upper).maxCoeff(), most);
      if (n > 0) continue;
      EXPECT_EQ(placed.box().lower, exact.lower);
      EXPECT_EQ(placed.box().upper, exact.upper);
    }
  }
}

TEST(SurfaceOverlap, OfTwoBallsIsWhatTheirCentresTell) {
  const SurfaceMesh ball = made_sphere(60);
  for (const double centres : {1.5, 1.9, 1.99, 2.01, 2.3}) {
    SCOPED_TRACE(centres);
    const Eigen::Isometry3d motion = some_motion();
    const SurfaceMesh one = mapped(ball, [&](const Vec3&p) { return motion * p; }),
                      two =
                          mapped(ball, [&](const Vec3&p) { return motion * Vec3(p + Vec3(0, 0, centres)); });
    const double depth = std::max(0.0, 2 - centres), distance = std::max(0.0, centres - 2);
    const SurfaceOverlap deepest = overlap(one, two);
    const SurfaceGap nearest = gap(one, two);
    EXPECT_NEAR(deepest.depth_m, depth, 2e-3 * depth + 1e-12);
    EXPECT_NEAR(nearest.distance_m, distance, 1e-12);
    const Vec3 middle = motion * Vec3(0, 0, centres / 2);
    if (depth > 0) {
      EXPECT_LT((deepest.place_m - middle).norm(), 0.51 * depth);
    } else {
      EXPECT_LT((nearest.place_m - middle).norm(), 1e-12);
    }
    EXPECT_NEAR(gap(one, two, 0.1).distance_m, std::min(distance, 0.1), 1e-12);
  }
}

TEST(SurfaceOverlap, OfABallInsideAnotherReachesToItsDeepestPoint) {
  const SurfaceMesh ball = made_sphere(60);
  const SurfaceMesh small = mapped(ball, [](const Vec3& p) { return Vec3(0.2 * p + Vec3(0, 0, 0.5)); });
  EXPECT_NEAR(overlap(ball, small).depth_m, 0.7,
              2e-3);  // its lowest point is 0.3 from the large one's centre
  EXPECT_EQ(gap(ball, small).distance_m, 0);
  EXPECT_EQ(gap(small, ball, 0.01).distance_m, 0);
}

// All points of either's surface are near the other's. The largest ball in both is the smaller body's own,
// and no ball that lies in both is larger.
TEST(SurfaceOverlap, OfBodiesThatFillTheSamePlaceIsNotHowFarTheirSurfacesAreApart) {
  const Eigen::Isometry3d motion = some_motion();
  const auto placed = [&](const SurfaceMesh& mesh, double scale, const Vec3& by) {
    return mapped(mesh, [&](const Vec3& p) { return Vec3(motion * Vec3(scale * p + by)); });
  };
  const SurfaceMesh ball = made_sphere(40), coarse = made_sphere(17), bar = made_bar({1, 1, 1}, {3, 3, 3});
  struct Case {
    SurfaceMesh one, other;
    double most, least;
  };
  const Case cases[] = {
      {placed(ball, 1, {0, 0, 0}), placed(ball, 1, {0, 0, 0}), 2, 1.9},
      {placed(ball, 1, {0, 0, 0}), placed(ball, 1, {0.002, 0, 0}), 2, 1.9},
      {placed(ball, 1, {0, 0, 0}), placed(coarse, 1, {0, 0.003, 0}), 2, 1.9},
      {placed(ball, 1, {0, 0, 0}), placed(ball, 0.99, {0, 0, 0}), 1.98, 1.9},
      {placed(bar, 1, {0, 0, 0}), placed(bar, 1, {0, 0, 0}), 1, 0.6},  // places are not in the very middle
      {placed(bar, 1, {0, 0, 0}), placed(bar, 1, {0.001, 0.001, 0}), 1, 0.6},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(&c - cases);
    const double depth = overlap(c.one, c.other).depth_m;
    EXPECT_GE(depth, c.least);
    EXPECT_LE(depth, c.most + 1e-9);
    EXPECT_EQ(overlap(c.other, c.one).depth_m, depth);
  }
  // Two of many pieces, of which one pair fills the same place.
  SurfaceMesh many = placed(ball, 0.1, {0, 0, 0});
  for (int k = 1; k < 20; ++k) many = both(many, placed(ball, 0.1, {0.3 * k, 0, 0}));
  EXPECT_NEAR(overlap(many, placed(ball, 0.1, {0.3 * 13, 0.0001, 0})).depth_m, 0.2, 0.01);
  EXPECT_EQ(overlap(many, placed(ball, 0.04, {0.3 * 13.5, 0, 0})).depth_m, 0);
}

// A bar's ridge, along x, reaches d into the ridge, along y, of another one that is turned by `turn` about y:
// the stretch of it that is inside is longer on one side, and its deepest point, on the other ridge's
// bisector, is d / (√2 cos turn) from both faces. No vertex is inside anything, and the stretch's middle is
// less deep.
TEST(SurfaceOverlap, OfRidgesThatCrossIsFoundWithNoVertexInside) {
  const double quarter = std::numbers::pi / 4, d = 0.1;
  for (const double turn : {0.0, 0.2, -0.4})
    for (const int cells : {1, 3}) {
      SCOPED_TRACE(testing::Message() << "turned by " << turn << ", cells " << cells);
      const SurfaceMesh along_x = mapped(made_bar({8, 1, 1}, {cells, 1, 1}), [&](const Vec3& p) {
        return Vec3(Eigen::AngleAxisd(quarter, Vec3::UnitX()) * (p - Vec3(4, 1, 1)));
      });
      const SurfaceMesh along_y = mapped(made_bar({1, 8, 1}, {1, cells, 1}), [&](const Vec3& p) {
        return Vec3(Eigen::AngleAxisd(turn - quarter, Vec3::UnitY()) * (p - Vec3(0, 4, 0)) - Vec3(0, 0, d));
      });
      const double depth = d / (std::sqrt(2.0) * std::cos(turn));
      EXPECT_NEAR(overlap(along_x, along_y).depth_m, depth, 0.02 * depth);
      EXPECT_EQ(gap(along_x, along_y).distance_m, 0);
      const SurfaceMesh above = mapped(along_y, [&](const Vec3& p) { return Vec3(p + Vec3(0, 0, 0.25)); });
      EXPECT_EQ(overlap(along_x, above).depth_m, 0);
      EXPECT_NEAR(gap(along_x, above).distance_m, 0.25 - d, 1e-12);
    }
}

TEST(SurfaceOverlap, DoesNotDependOnTheOrderOfTheTwoNorOnWhereTheyAre) {
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  const SurfaceMesh ball =
      mapped(made_sphere(16), [](const Vec3& p) { return Vec3(0.5 * p + Vec3(1.2, 0.3, 0.4)); });
  const double depth = overlap(torus, ball).depth_m;
  EXPECT_GT(depth, 0.1);
  EXPECT_NEAR(overlap(ball, torus).depth_m, depth, 0.01 * depth);
  const Eigen::Isometry3d motion = some_motion();
  const auto moved = [&](const SurfaceMesh& mesh) {
    return mapped(mesh, [&](const Vec3& p) { return motion * p; });
  };
  EXPECT_NEAR(overlap(moved(torus), moved(ball)).depth_m, depth, 1e-9);
  const SurfaceMesh apart = mapped(ball, [](const Vec3& p) { return Vec3(p + Vec3(0.3, 0.2, 0.5)); });
  const double distance = gap(torus, apart).distance_m;
  EXPECT_GT(distance, 0.1);
  EXPECT_NEAR(gap(apart, torus).distance_m, distance, 1e-12);
  EXPECT_NEAR(gap(moved(torus), moved(apart)).distance_m, distance, 1e-9);
}

// By a second way: every triangle of one against every triangle of the other, no tree.
TEST(SurfaceOverlap, TheGapIsTheLeastOverAllPairsOfTriangles) {
  const SurfaceMesh torus = made_torus(0.3, 24, 10);
  Rng rng(5, 0);
  for (int i = 0; i < 5; ++i) {
    const Vec3 place = 2.5 * rng.direction();
    const SurfaceMesh other = mapped(torus, [&](const Vec3& p) {
      return Vec3(Eigen::AngleAxisd(i, Vec3(1, 2, 3).normalized()) * p + place);
    });
    // Places of a fine grid of either on the exact tree of the other: never nearer, and nearly as near.
    double least = 1e300;
    for (const auto& [from, to] : {std::pair(&torus, &other), std::pair(&other, &torus)}) {
      const SurfaceTree tree(to->positions, to->triangles);
      for (const auto& t : from->triangles.rowwise())
        for (int a = 0; a <= 8; ++a)
          for (int b = 0; a + b <= 8; ++b) {
            const Vec3 p = (a * from->positions.row(t[0]) + b * from->positions.row(t[1]) +
                            (8 - a - b) * from->positions.row(t[2])) /
                           8;
            least = std::min(least, (tree.closest_point(p) - p).norm());
          }
    }
    const double found = gap(torus, other).distance_m;
    EXPECT_LE(found, least + 1e-12);
    EXPECT_GE(found, least - 1e-3);
  }
}

// A bar of length 14, wound about an axis at the radius 2, so that its ends pass one another: of its width 1,
// all but the pitch is in itself. Points midway between its inner and outer face are that deep.
Map wound(double pitch) {
  return [pitch](const Vec3& p) {
    const double angle = p.x() / 2, radius = 2.25 - p.y();
    return Vec3(radius * std::cos(angle), radius * std::sin(angle),
                p.z() + pitch * angle / (2 * std::numbers::pi));
  };
}

TEST(SelfOverlap, OfAWoundBarIsWhatItsPitchLeavesOfItsWidth) {
  const SurfaceMesh bar = made_bar({14, 0.5, 1}, {140, 6, 10});
  const auto straight = [](const Vec3& p) { return p; };
  EXPECT_EQ(self_overlap(bar, straight).depth_m, 0);
  EXPECT_EQ(self_overlap(bar, wound(1.02)).depth_m, 0);
  for (const double depth : {0.02, 0.1, 0.2}) {
    // Square to its faces, which climb by the pitch a turn.
    const double climb = (1 - depth) / (2 * std::numbers::pi * 2);
    EXPECT_NEAR(self_overlap(bar, wound(1 - depth)).depth_m, depth / std::hypot(1, climb), 0.03 * depth)
        << depth;
  }
  const Eigen::Isometry3d motion = some_motion();
  EXPECT_NEAR(self_overlap(bar, [&](const Vec3& p) { return motion * wound(0.9)(p); }).depth_m,
              self_overlap(bar, wound(0.9)).depth_m, 1e-6);
}

// Two arms that stand a little or much farther apart than what counts as one place, each pushed by a little
// more or less than half of it: hardly out of shape, and through one another or not.
class SelfOverlapOfAHairpin : public testing::TestWithParam<double> {};
TEST_P(SelfOverlapOfAHairpin, IsSeenHoweverNearlyItKeepsItsShape) {
  const SurfaceMesh bar = made_bar({4, 0.5, 0.5}, {80, 6, 6});
  const double between = GetParam() * own_neighbourhood * 1.75;  // of the length of the hairpin
  const auto folded = [&](const Vec3& p) {                       // a hairpin
    const double radius = 0.5 * between + 0.5 - p.y();
    const double bend = std::numbers::pi * 0.25, s = p.x() - 2;
    if (std::abs(s) < bend) {
      const double angle = s / 0.5;
      return Vec3(radius * std::cos(angle), radius * std::sin(angle), p.z());
    }
    return Vec3(-(std::abs(s) - bend), s < 0 ? -radius : radius, p.z());
  };
  const SurfaceMesh hairpin = mapped(bar, folded);
  for (const double closed : {0.9, 0.995, 1.02, 1.2}) {
    const auto close = [&](const Vec3& p) {
      const double part = std::clamp(-p.x() / 0.6, 0.0, 1.0);
      return Vec3(p.x(), p.y() - (p.y() < 0 ? -1 : 1) * part * 0.5 * closed * between, p.z());
    };
    const double depth = self_overlap(hairpin, close).depth_m;
    if (closed < 1)
      EXPECT_EQ(depth, 0) << closed;
    else
      EXPECT_NEAR(depth, (closed - 1) * between, 0.1 * (closed - 1) * between) << closed;
  }
}
INSTANTIATE_TEST_SUITE_P(Gaps, SelfOverlapOfAHairpin, testing::Values(1.05, 2.0, 4.0, 8.0));

// Coarse cells: where the bar passes through itself no vertex need be inside.
TEST(SelfOverlap, IsFoundOnEdgesToo) {
  const SurfaceMesh bar = made_bar({14, 0.5, 1}, {35, 1, 1});
  EXPECT_NEAR(self_overlap(bar, wound(0.9)).depth_m, 0.1, 0.02);
  EXPECT_EQ(self_overlap(bar, wound(1.05)).depth_m, 0);
}

// What is in itself at rest is not counted, wherever the body goes and however it is stretched as a whole;
// what comes to it is, as if the rest were clean.
TEST(SelfOverlap, IsBeyondThatAtRest) {
  const SurfaceMesh bar = made_bar({14, 0.5, 1}, {140, 6, 10});
  const SurfaceMesh knot = mapped(bar, wound(0.9));
  const Eigen::Isometry3d motion = some_motion();
  EXPECT_EQ(self_overlap(knot, [&](const Vec3& p) { return motion * p; }).depth_m, 0);
  EXPECT_EQ(
      self_overlap(knot, [](const Vec3& p) { return Vec3(1.2 * p.x() + 0.1 * p.y(), p.y(), 0.8 * p.z()); })
          .depth_m,
      0);

  // A cross-piece through the bar's middle, at rest already.
  const SurfaceMesh piece = mapped(made_bar({0.3, 1.5, 0.3}, {4, 20, 4}),
                                   [](const Vec3& p) { return Vec3(p + Vec3(7, -0.5, 0.35)); });
  const SurfaceMesh crossed = both(bar, piece);
  EXPECT_EQ(self_overlap(crossed, [](const Vec3& p) { return p; }).depth_m, 0);
  EXPECT_EQ(self_overlap(crossed, wound(1.05)).depth_m, 0);
  EXPECT_NEAR(self_overlap(crossed, wound(0.9)).depth_m, self_overlap(bar, wound(0.9)).depth_m, 1e-3);

  // Through the end that comes to lie in the other: of what the bar holds at rest, only what the other end
  // holds too is counted.
  const SurfaceMesh at_end = both(bar, mapped(made_bar({0.3, 1.5, 0.25}, {4, 20, 4}),
                                              [](const Vec3& p) { return Vec3(p + Vec3(0.2, -0.5, 0.7)); }));
  EXPECT_NEAR(self_overlap(at_end, wound(0.9)).depth_m, self_overlap(bar, wound(0.9)).depth_m, 1e-3);
}

// Half a ball has no lid: what pierces it is found, and as deep as in a whole one.
TEST(SurfaceOverlap, OpenSurfacesCountByTheirWindingNumber) {
  const SurfaceMesh bowl = made_hemisphere(40);
  const SurfaceMesh needle = mapped(made_bar({0.1, 0.1, 1}, {1, 1, 4}),
                                    [](const Vec3& p) { return Vec3(p + Vec3(-0.05, -0.05, 0.8)); });
  EXPECT_NEAR(overlap(bowl, needle).depth_m, 0.2, 5e-3);
}

TEST(SurfaceOverlap, NothingIsInNothing) {
  const SurfaceMesh none{Points(0, 3), Triangles(0, 3)}, ball = made_sphere(6);
  EXPECT_EQ(overlap(none, ball).depth_m, 0);
  EXPECT_EQ(gap(ball, none, 3).distance_m, 3);
  EXPECT_EQ(self_overlap(none, [](const Vec3& p) { return p; }).depth_m, 0);
}

}  // namespace
}  // namespace limber::meshing
