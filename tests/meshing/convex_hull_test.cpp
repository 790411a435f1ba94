#include "meshing/convex_hull.h"

#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <set>

#include "core/error.h"
#include "core/progress.h"
#include "core/random.h"
#include "meshing/detail/growing_hull.h"
#include "meshing/detail/orientation.h"
#include "tests/meshing/shell_laws.h"

namespace limber::meshing {
namespace {

Points ball_of_points(int count, std::uint64_t seed) {
  Rng rng(seed, 0);
  Points points(count, 3);
  for (int i = 0; i < count; ++i) points.row(i) = (std::cbrt(rng.uniform()) * rng.direction()).transpose();
  return points;
}

double hull_volume(const ConvexShell& shell) { return volume(SurfaceMesh{shell.vertices, shell.triangles}); }

// The triangles of a hull are those that have no point on their outer side: looked for among all triples.
TEST(ConvexHull, OfRandomPointsIsAllTrianglesWithNothingBeyond) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Points points = ball_of_points(40, seed);
    std::set<std::array<Vec3::Scalar, 9>> expected, found;
    const auto key = [](const Vec3& a, const Vec3& b, const Vec3& c) {
      std::array<std::array<double, 3>, 3> rows = {
          {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}}};
      std::rotate(rows.begin(), std::min_element(rows.begin(), rows.end()), rows.end());
      return std::array<double, 9>{rows[0][0], rows[0][1], rows[0][2], rows[1][0], rows[1][1],
                                   rows[1][2], rows[2][0], rows[2][1], rows[2][2]};
    };
    for (int a = 0; a < 40; ++a)
      for (int b = 0; b < 40; ++b)
        for (int c = 0; c < 40; ++c) {
          if (a == b || b == c || a == c) continue;
          const Vec3 pa = points.row(a), pb = points.row(b), pc = points.row(c);
          bool beyond = false;
          for (int d = 0; d < 40 && !beyond; ++d)
            beyond = d != a && d != b && d != c && signed_volume(pa, pb, pc, points.row(d)) > 0;
          if (!beyond) expected.insert(key(pa, pb, pc));
        }
    const ConvexShell hull = convex_hull(points);
    for (Eigen::Index f = 0; f < hull.triangles.rows(); ++f)
      found.insert(key(hull.vertices.row(hull.triangles(f, 0)), hull.vertices.row(hull.triangles(f, 1)),
                       hull.vertices.row(hull.triangles(f, 2))));
    EXPECT_EQ(found, expected);
  }
}

TEST(ConvexHull, OfAGridOnACubeHasItsEightCornersOnly) {
  Points grid(125, 3);
  for (int i = 0; i < 125; ++i) grid.row(i) << 0.1 * (i % 5), 0.1 * (i / 5 % 5), 0.1 * (i / 25);
  const ConvexShell hull = convex_hull(grid);
  EXPECT_EQ(hull.vertices.rows(), 8);
  EXPECT_EQ(hull.triangles.rows(), 12);
  EXPECT_NEAR(hull_volume(hull), 0.064, 1e-15);
  expect_convex(hull);
}

TEST(ConvexHull, GrowsOverAlmostFlatAndRepeatedPoints) {
  Points points = ball_of_points(300, 9);
  points.col(2) *= 1e-15;
  points.bottomRows(100) = points.topRows(100);
  expect_convex(convex_hull(points));
}

TEST(ConvexHull, RefusesPointsInOnePlane) {
  Points points = ball_of_points(20, 3);
  points.col(2).setConstant(0.1);
  EXPECT_THROW(convex_hull(points), InputError);
  EXPECT_THROW(convex_hull(points.topRows(3)), InputError);
}

TEST(ConvexHull, GrowingHullHasTheVolumeOfTheExactOneAfterEveryPoint) {
  const Points points = ball_of_points(200, 4);
  detail::GrowingHull growing;
  for (int n = 1; n < 4; ++n) growing.add(Vec3(points.row(n - 1)));
  for (int n = 4; n <= 200; ++n) {
    growing.add(Vec3(points.row(n - 1)));
    EXPECT_NEAR(growing.volume(), hull_volume(convex_hull(points.topRows(n))), 1e-12) << n << " points";
  }
}

// Planes that are rounded to float, which are asked first, are off by more than the tolerance.
TEST(ConvexHull, AGrowingHullHoldsWhatNoPlaneOfItIsBelow) {
  const Points points = ball_of_points(300, 11);
  detail::GrowingHull hull;
  for (Eigen::Index i = 0; i < points.rows(); ++i) hull.add(Vec3(points.row(i)) + Vec3(0.3, -0.2, 0.7));
  const auto planes = hull.planes();
  ASSERT_GT(planes.rows(), 50);
  int held = 0, out = 0;
  for (const Vec3& corner : hull.vertices())
    for (Eigen::Index f = 0; f < planes.rows(); ++f)
      for (const double off : {-2.0, 0.5, 0.999, 1.001, 2.0}) {
        // The corner's shadow on the plane, pulled towards the hull's middle, and then so far off the plane.
        const Vec3 n = planes.row(f).head<3>(), pulled = 0.99 * corner + 0.01 * Vec3(0.3, -0.2, 0.7);
        const Vec3 p = pulled - (n.dot(pulled) + planes(f, 3) - off * hull.tolerance()) * n;
        const bool is_held = (planes.leftCols<3>() * p + planes.col(3)).maxCoeff() <= hull.tolerance();
        ASSERT_EQ(hull.holds(p), is_held) << "plane " << f << ", " << off << " tolerances off it";
        ++(is_held ? held : out);
      }
  EXPECT_GT(held, 50);
  EXPECT_GT(out, 50);
}

// Every rounding of these products is wrong by more than the answer: the sign follows the last bit.
TEST(ConvexHull, OrientationSeesOneBit) {
  const Vec3 a(12, 12, 0), b(24, 24, 1), c(24, 24, 0);
  Vec3 d(0.5, 0.5, 0.3);
  EXPECT_EQ(detail::orientation(a, b, c, d), 0);
  d.y() = std::nextafter(0.5, 1.0);
  const int up = detail::orientation(a, b, c, d);
  d.y() = std::nextafter(0.5, 0.0);
  EXPECT_EQ(detail::orientation(a, b, c, d), -up);
  EXPECT_NE(up, 0);
  EXPECT_EQ(detail::orientation(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()), 1);
}

// A rough hull moves each point a little as it takes it in; among the slivers of thin plates whose points lie
// in rows, the face that showed the point may not see it any more.
TEST(ConvexHull, RoughHullsOfRowsInThinPlatesStayWhole) {
  for (double thickness : {1e-3, 1e-4, 1e-5})
    for (std::uint64_t seed = 0; seed < 3000; ++seed) {
      Rng rng(seed, 7);
      const Vec3 across = rng.direction(), along = across.cross(rng.direction()).normalized(),
                 up = across.cross(along);
      std::vector<Vec3> points;
      for (int i = 0; i < 60; ++i)
        points.push_back(0.2 * (i / 4) / 15.0 * across + (i / 2 % 2) * 0.1 * along +
                         thickness * (i % 2) * up);
      for (std::size_t i = points.size() - 1; i > 0; --i)
        std::swap(points[i], points[std::size_t(rng.uniform() * double(i + 1))]);
      detail::GrowingHull hull(3e-8);
      hull.add(points);
      EXPECT_NEAR(hull.volume(), 0.2 * 14 / 15 * 0.1 * thickness, 1e-8) << seed;
    }
}

// Of a surface of 30,000 vertices a hull takes seconds.
TEST(ConvexHull, StopsForASignal) {
  const Points corners = Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  request_stop(SIGTERM);
  EXPECT_THROW(convex_hull(corners), Interrupted);
  request_stop(0);
}

}  // namespace
}  // namespace limber::meshing
