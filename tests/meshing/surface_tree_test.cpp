#include "meshing/surface_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <vector>

#include "core/error.h"
#include "core/progress.h"
#include "core/random.h"
#include "tests/meshing/cage_models.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {
namespace {

__extension__ typedef __int128 Int128;

Int128 exact_six_volumes(const std::array<std::array<std::int64_t, 3>, 4>& p) {
  std::array<std::array<Int128, 3>, 3> e;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) e[i][k] = p[i + 1][k] - p[0][k];
  return e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
         e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
         e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
}

TEST(Orientation, AgreesWithIntegersWhereRoundingWouldErr) {
  Rng rng(1, 0);
  int zeros = 0, tiny = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    // Four points of nearly one plane, far from the origin: the fourth is a sum of the edges, moved by at
    // most one.
    std::array<std::array<std::int64_t, 3>, 4> p;
    for (int i = 0; i < 3; ++i)
      for (auto& x : p[i]) x = (std::int64_t(1) << 38) + std::int64_t(rng.bits() % (1u << 30));
    for (int k = 0; k < 3; ++k) p[3][k] = p[1][k] + p[2][k] - p[0][k] + rng.below(3) - 1;
    const Int128 expected = exact_six_volumes(p);
    const auto vec = [&](int i) { return Vec3(double(p[i][0]), double(p[i][1]), double(p[i][2])); };
    zeros += expected == 0;
    tiny += expected != 0;
    ASSERT_EQ(orientation(vec(0), vec(1), vec(2), vec(3)), (expected > 0) - (expected < 0))
        << "trial " << trial;
  }
  EXPECT_GT(zeros, 100);
  EXPECT_GT(tiny, 10'000);
}

Vec3 random_point(Rng& rng, double size) {
  const double x = rng.uniform(-size, size), y = rng.uniform(-size, size);
  return {x, y, rng.uniform(-size, size)};
}

// Is anything left of the triangle when all that lies beyond one of the tet's faces is cut off?
bool clipped_triangle_is_left(const std::array<Vec3, 4>& tet, std::vector<Vec3> polygon) {
  for (int i = 0; i < 4; ++i) {
    const Vec3 &a = tet[(i + 1) % 4], &b = tet[(i + 2) % 4], &c = tet[(i + 3) % 4];
    Vec3 inwards = (b - a).cross(c - a);
    if (inwards.dot(tet[i] - a) < 0) inwards = -inwards;
    std::vector<Vec3> left;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vec3 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
      const double dp = inwards.dot(p - a), dq = inwards.dot(q - a);
      if (dp >= 0) left.push_back(p);
      if ((dp < 0) != (dq < 0)) left.push_back(p + (q - p) * (dp / (dp - dq)));
    }
    polygon = left;
  }
  return !polygon.empty();
}

SurfaceMesh one_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  SurfaceMesh m{Points(3, 3), Triangles(1, 3)};
  m.positions << a.transpose(), b.transpose(), c.transpose();
  m.triangles << 0, 1, 2;
  return m;
}

TEST(SurfaceTree, TetMeetsTriangleExactlyWhenClippingLeavesSomething) {
  Rng rng(2, 0);
  int meeting = 0;
  constexpr int trials = 20'000;
  for (int trial = 0; trial < trials; ++trial) {
    std::array<Vec3, 3> tri;
    std::array<Vec3, 4> tet;
    for (Vec3& p : tri) p = random_point(rng, 1);
    for (Vec3& p : tet) p = random_point(rng, 1);  // either orientation
    const SurfaceMesh m = one_triangle(tri[0], tri[1], tri[2]);
    const bool expected = clipped_triangle_is_left(tet, {tri.begin(), tri.end()});
    meeting += expected;
    const SurfaceTree tree(m.positions, m.triangles);
    ASSERT_EQ(tree.meets_tet(tet[0], tet[1], tet[2], tet[3]), expected) << "trial " << trial;
    ASSERT_EQ(tree.triangles_meeting_tet(tet[0], tet[1], tet[2], tet[3]).size(), std::size_t(expected));
  }
  EXPECT_GT(meeting, trials / 10);
  EXPECT_LT(meeting, trials * 9 / 10);
}

TEST(SurfaceTree, TouchingIsMeeting) {
  const SurfaceMesh m = one_triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const SurfaceTree tree(m.positions, m.triangles);
  const double above = 5e-324;  // the least number above 0
  const Vec3 up(0, 0, 1);
  // A tet that stands on its tip in the triangle, on its edge, on its corner; then lifted by the least
  // number.
  for (const Vec3& tip : {Vec3(0.25, 0.25, 0), Vec3(0.5, 0.5, 0), Vec3(1, 0, 0)}) {
    const Vec3 a = tip + up, b = a + Vec3(0.1, 0, 0), c = a + Vec3(0, 0.1, 0);
    EXPECT_TRUE(tree.meets_tet(tip, a, b, c));
    EXPECT_FALSE(tree.meets_tet(tip + Vec3(0, 0, above), a, b, c));
    EXPECT_TRUE(tree.meets_triangle(tip, a, b));
    EXPECT_FALSE(tree.meets_triangle(tip + Vec3(0, 0, above), a, b));
  }
}

TEST(SurfaceTree, TriangleInsideATetMeetsIt) {
  const SurfaceMesh m = one_triangle({0.1, 0.1, 0.1}, {0.2, 0.1, 0.1}, {0.1, 0.2, 0.1});
  const SurfaceTree tree(m.positions, m.triangles);
  EXPECT_TRUE(tree.meets_tet({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}));
  EXPECT_TRUE(tree.meets_tet({1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {0, 0, 1}));
}

TEST(SurfaceTree, FlatTrianglesAreSegmentsAndPoints) {
  const SurfaceMesh segment = one_triangle({0, 0, 0}, {1, 1, 1}, {0.5, 0.5, 0.5});
  const SurfaceTree tree(segment.positions, segment.triangles);
  EXPECT_TRUE(tree.meets_triangle({0.75, 0, 0}, {0.75, 2, 0}, {0.75, 0, 2}));
  EXPECT_FALSE(tree.meets_triangle({0.75, 0.76, 0}, {0.75, 2, 0}, {0.75, 0.76, 2}));
  EXPECT_EQ(tree.closest_point({2, 2, 2}), Vec3(1, 1, 1));
  const SurfaceMesh point = one_triangle({1, 2, 3}, {1, 2, 3}, {1, 2, 3});
  const SurfaceTree point_tree(point.positions, point.triangles);
  EXPECT_TRUE(point_tree.meets_triangle({1, 0, 0}, {1, 9, 0}, {1, 0, 9}));
  EXPECT_FALSE(point_tree.meets_triangle({1, 2.5, 0}, {1, 9, 0}, {1, 2.5, 9}));
  EXPECT_EQ(point_tree.closest_point({0, 0, 0}), Vec3(1, 2, 3));
}

TEST(SurfaceTree, ClosestPointIsOnTheSurfaceAndNoSampleIsNearer) {
  const SurfaceMesh m = made_sphere(8);
  const SurfaceTree tree(m.positions, m.triangles);
  Rng rng(3, 0);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 p = random_point(rng, 2);
    const Vec3 q = tree.closest_point(p);
    double nearest_sample = 1e300, off_surface = 1e300;
    for (int f = 0; f < m.triangles.rows(); ++f) {
      const Vec3 a = m.positions.row(m.triangles(f, 0)), b = m.positions.row(m.triangles(f, 1)),
                 c = m.positions.row(m.triangles(f, 2));
      constexpr int n = 12;
      for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j)
          nearest_sample = std::min(nearest_sample, (a + (b - a) * i / n + (c - a) * j / n - p).norm());
      // q is in the triangle when the three parts that it makes add up to the whole.
      const double parts =
          (a - q).cross(b - q).norm() + (b - q).cross(c - q).norm() + (c - q).cross(a - q).norm();
      off_surface = std::min(off_surface, parts - (b - a).cross(c - a).norm());
    }
    ASSERT_LE((q - p).norm(), nearest_sample + 1e-12) << "trial " << trial;
    ASSERT_LT(off_surface, 1e-10) << "trial " << trial;
  }
}

TEST(SurfaceTree, AnswersDoNotDependOnTheOrderOfTheTriangles) {
  const SurfaceMesh m = made_sphere(10);
  SurfaceMesh reversed = m;
  reversed.triangles = m.triangles.colwise().reverse().eval();
  const SurfaceTree tree(m.positions, m.triangles), other(reversed.positions, reversed.triangles);
  Rng rng(4, 0);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 p = random_point(rng, 1.5);
    ASSERT_EQ(tree.closest_point(p), other.closest_point(p));
  }
  ASSERT_EQ(tree.closest_point(Vec3::Zero()), other.closest_point(Vec3::Zero()));  // many are equally near
}

TEST(TrianglePieces, CoverTheirTrianglesAndAreCloseToThem) {
  const SurfaceMesh rod = rod_of_needles(200, 1e-3);
  const auto pieces = detail::pieces_of(rod.positions, rod.triangles);
  EXPECT_GT(pieces.size(), 20u * std::size_t(rod.triangles.rows()));
  EXPECT_TRUE(std::is_sorted(pieces.begin(), pieces.end(),
                             [](const auto& a, const auto& b) { return a.triangle < b.triangle; }));
  Rng rng(5, 0);
  for (std::size_t first = 0; first < pieces.size();) {
    std::size_t last = first;
    const int f = pieces[first].triangle;
    while (last < pieces.size() && pieces[last].triangle == f) ++last;
    for (int trial = 0; trial < 20; ++trial) {
      const double a = rng.uniform(0, 1), b = rng.uniform(0, 1 - a);
      const Vec3 p = a * rod.positions.row(rod.triangles(f, 0)).transpose() +
                     b * rod.positions.row(rod.triangles(f, 1)).transpose() +
                     (1 - a - b) * rod.positions.row(rod.triangles(f, 2)).transpose();
      EXPECT_TRUE(std::any_of(pieces.begin() + std::ptrdiff_t(first), pieces.begin() + std::ptrdiff_t(last),
                              [&](const auto& piece) {
                                return ((p - piece.box.lower).array() >= -1e-15).all() &&
                                       ((piece.box.upper - p).array() >= -1e-15).all();
                              }))
          << f;
    }
    first = last;
  }
  for (const auto& piece : pieces) EXPECT_LT(piece.box.diagonal(), 1.2 / 64) << piece.triangle;
  // What lies along the axes is close already, and fat triangles are not helped.
  const SurfaceMesh sliver = one_triangle({0, 0, 0}, {1, 0, 0}, {0, 1e-6, 0}),
                    fat = one_triangle({0, 0, 0}, {1, 1, 0}, {0, 1, 1});
  EXPECT_EQ(detail::pieces_of(sliver.positions, sliver.triangles).size(), 1u);
  EXPECT_EQ(detail::pieces_of(fat.positions, fat.triangles).size(), 1u);
}

SurfaceMesh two(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh both{Points(a.positions.rows() + b.positions.rows(), 3),
                   Triangles(a.triangles.rows() + b.triangles.rows(), 3)};
  both.positions << a.positions, b.positions;
  both.triangles << a.triangles, Triangles(b.triangles.array() + int(a.positions.rows()));
  return both;
}

TEST(Axes, LieAlongARodOfNeedlesWhichThenHaveOneBoxEach) {
  for (const Vec3& at : {Vec3(0, 0, 0), Vec3(-2e4, 1.4e4, 6e3)}) {
    SurfaceMesh rod = rod_of_needles(50, 1e-3);
    rod.positions.rowwise() += at.transpose();
    const detail::Axes axes(rod.positions, rod.triangles);
    ASSERT_TRUE(axes.turned());
    EXPECT_EQ(detail::pieces_of(axes.along(rod.positions), rod.triangles).size(),
              std::size_t(rod.triangles.rows()));
    EXPECT_GT(detail::pieces_of(rod.positions, rod.triangles).size(),
              10u * std::size_t(rod.triangles.rows()));
    // A turn: distances stay.
    const Vec3 p(0.3, -1, 2), q(1, 1, -0.5);
    EXPECT_NEAR((axes.along(p) - axes.along(q)).norm(), (p - q).norm(), 1e-14);
  }
}

TEST(Axes, AreTheWorldsWhereNoOthersAreMuchBetter) {
  for (const auto& [name, m] : models())
    EXPECT_FALSE(detail::Axes(m.positions, m.triangles).turned()) << name;
  // Two rods askew, across one another: whichever has its way, the other has needles athwart.
  const SurfaceMesh rod = rod_of_needles(50, 1e-3);
  SurfaceMesh other = rod;
  other.positions.col(1) *= -1, other.positions.col(2) *= 5;
  const SurfaceMesh both = two(rod, other);
  EXPECT_FALSE(detail::Axes(both.positions, both.triangles).turned());
}

// Of each triangle alone: where its plane is passed, if its edges are passed on one side (as signs of
// volumes).
double first_met(const SurfaceMesh& m, const Vec3& p, const Vec3& q) {
  double first = 1;
  for (const auto row : m.triangles.rowwise()) {
    const Vec3 a = m.positions.row(row[0]), b = m.positions.row(row[1]), c = m.positions.row(row[2]);
    const int ab = orientation(p, q, a, b), bc = orientation(p, q, b, c), ca = orientation(p, q, c, a);
    if (ab != bc || bc != ca || ab == 0) continue;
    const double before = signed_volume(a, b, c, p), after = signed_volume(a, b, c, q);
    if ((before > 0) != (after > 0)) first = std::min(first, before / (before - after));
  }
  return first;
}

// Meetings as clipping finds them, nearest points as of each triangle alone.
void expect_answers_as_of_each_alone(const SurfaceMesh& rod, int trials) {
  const SurfaceTree tree(rod.positions, rod.triangles);
  Rng rng(6, 0);
  int met = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Vec3 on_rod = Vec3(-2.9, 1, 0.6) + rng.uniform(-0.1, 1.1) * Vec3(0.5, 1, 0.1);
    std::array<Vec3, 4> t;
    for (Vec3& corner : t) corner = on_rod + random_point(rng, 0.05);
    std::vector<int> alone;
    double nearest = 1e300;
    for (int f = 0; f < rod.triangles.rows(); ++f) {
      const auto corner = [&](int k) { return Vec3(rod.positions.row(rod.triangles(f, k)).transpose()); };
      const SurfaceMesh one = one_triangle(corner(0), corner(1), corner(2));
      const SurfaceTree judge(one.positions, one.triangles);
      if (clipped_triangle_is_left(t, {corner(0), corner(1), corner(2)})) alone.push_back(f);
      nearest = std::min(nearest, (judge.closest_point(t[0]) - t[0]).norm());
    }
    EXPECT_EQ(tree.triangles_meeting_tet(t[0], t[1], t[2], t[3]), alone);
    EXPECT_EQ(tree.meets_tet(t[0], t[1], t[2], t[3]), !alone.empty());
    EXPECT_EQ((tree.closest_point(t[0]) - t[0]).norm(), nearest);
    EXPECT_EQ(tree.free_share(t[0], t[1]) < 1, first_met(rod, t[0], t[1]) < 1);
    EXPECT_NEAR(tree.free_share(t[0], t[1]), first_met(rod, t[0], t[1]), 1e-12);
    met += !alone.empty();
  }
  EXPECT_GT(met, trials / 5);
  EXPECT_LT(met, trials * 9 / 10);
}

TEST(SurfaceTree_slow, OfNeedlesAnswersAsOfEachNeedleAlone) {
  expect_answers_as_of_each_alone(rod_of_needles(12, 1e-3), 100);
}

TEST(SurfaceTree_slow, OfNeedlesAlongTheirAxesAnswersAsOfEachNeedleAlone) {
  const SurfaceMesh rod = rod_of_needles(50, 1e-3);
  ASSERT_TRUE(detail::Axes(rod.positions, rod.triangles).turned());
  expect_answers_as_of_each_alone(rod, 40);
}

// Whoever waits for an answer may be told to stop.
TEST(SurfaceTree, StopsForASignal) {
  const SurfaceMesh m = one_triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const SurfaceTree tree(m.positions, m.triangles);
  request_stop(SIGTERM);
  EXPECT_THROW(tree.meets_tet({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), Interrupted);
  EXPECT_THROW(tree.closest_point({0, 0, 0}), Interrupted);
  request_stop(0);
}

}  // namespace
}  // namespace limber::meshing
