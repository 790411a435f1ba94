// Where panes stand.
#include "limber/detail/film/pane.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace limber::detail {
namespace {

const Box bounds{Vec3(0, 0, 0), Vec3(4, 2, 3)};

double area_of(const Triangles& triangles, const Points& positions, const Vec3& towards) {
  double area = 0;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Vec3 a = positions.row(triangles(t, 0)), b = positions.row(triangles(t, 1)),
               c = positions.row(triangles(t, 2));
    area += 0.5 * (b - a).cross(c - a).dot(towards);
  }
  return area;
}

TEST(Pane, AWallIsTheOneThatAPlaceIsNearestToOrFarthestBeyond) {
  EXPECT_EQ(wall_at(bounds, {3.9, 1, 1}), (Wall{0, true}));
  EXPECT_EQ(wall_at(bounds, {4.1, 1, 1}), (Wall{0, true}));
  EXPECT_EQ(wall_at(bounds, {1, 0.01, 1}), (Wall{1, false}));
  EXPECT_EQ(wall_at(bounds, {1, -0.2, -0.1}), (Wall{1, false}));
  EXPECT_EQ(wall_at(bounds, {1, 1, -0.1}), (Wall{2, false}));
  EXPECT_EQ(wall_at(bounds, {1, 1, 3.05}), (Wall{2, true}));
}

TEST(Pane, FadesLinearlyBeforeAndAfterATouch) {
  std::vector<bool> touching(20, false);
  touching[8] = touching[9] = true;
  const std::vector<double> shares = faded(touching, 3);
  for (int f = 0; f < 20; ++f) {
    const int away = std::max({0, 8 - f, f - 9});
    EXPECT_NEAR(shares[std::size_t(f)], std::max(0.0, 1 - away / 4.0), 1e-12) << f;
  }
  EXPECT_EQ(faded({false, true, false}, 0), (std::vector<double>{0, 1, 0}));
}

// Round corners, of seven chords each, take (4 − 14 sin(π/14)) r² of a rectangle.
TEST(Pane, IsARoundedRectangleInItsWallBehindTheBody) {
  const Box body{Vec3(1, 0.5, 1), Vec3(1.8, 1.1, 2)};
  constexpr double margin = 0.2, rim = 0.03;
  for (int axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true}) {
      SCOPED_TRACE(2 * axis + upper);
      const Pane pane = pane_behind(body, bounds, {axis, upper}, margin, rim);
      const Box glass = bounding_box(pane.glass);
      const double place = upper ? bounds.upper[axis] : bounds.lower[axis];
      EXPECT_EQ(glass.lower[axis], place);
      EXPECT_EQ(glass.upper[axis], place);
      const int x = (axis + 1) % 3, y = (axis + 2) % 3;
      for (const int side : {x, y}) {
        EXPECT_NEAR(glass.lower[side], body.lower[side] - margin, 1e-12);
        EXPECT_NEAR(glass.upper[side], body.upper[side] + margin, 1e-12);
      }
      const auto area = [&](double less) {
        const double r = margin - less;
        return (glass.size()[x] - 2 * less) * (glass.size()[y] - 2 * less) -
               (4 - 14 * std::sin(EIGEN_PI / 14)) * r * r;
      };
      const Vec3 along = Vec3::Unit(axis);
      EXPECT_NEAR(area_of(pane_triangles(), pane.glass, along), area(0), 1e-12);
      EXPECT_NEAR(area_of(rim_triangles(), pane.rim, along), area(0) - area(rim), 1e-12);
      EXPECT_EQ(bounding_box(pane.rim).lower, glass.lower);
      EXPECT_EQ(bounding_box(pane.rim).upper, glass.upper);
    }
}

TEST(Pane, EndsWithTheWall) {
  const Pane pane = pane_behind({Vec3(3.2, 1.5, 2.8), Vec3(4.1, 2.1, 3.3)}, bounds, {0, true}, 0.3, 0.05);
  EXPECT_EQ(bounding_box(pane.glass).upper, bounds.upper);
  EXPECT_NEAR(bounding_box(pane.glass).lower[1], 1.2, 1e-12);
  // Of a body that has left through another wall, no more than an edge is left.
  const Pane gone = pane_behind({Vec3(1, 5, 1), Vec3(2, 6, 2)}, bounds, {0, true}, 0.3, 0.05);
  EXPECT_TRUE(gone.glass.allFinite() && gone.rim.allFinite());
  EXPECT_EQ(bounding_box(gone.glass).size()[1], 0);
}

}  // namespace
}  // namespace limber::detail
