// What hides what from a far-off eye.
#include "limber/detail/authoring/line_of_sight.h"

#include <gtest/gtest.h>

namespace limber::detail {
namespace {

// A square of side 2 round the middle at height z, and 20 × 20 points over the same square at height 0.
SurfaceMesh square(const Vec3& middle) {
  SurfaceMesh mesh{Points(4, 3), Triangles(2, 3)};
  mesh.positions << -1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0;
  mesh.positions.rowwise() += middle.transpose();
  mesh.triangles << 0, 1, 2, 0, 2, 3;
  return mesh;
}

Points grid() {
  Points points(400, 3);
  for (int i = 0; i < 400; ++i) points.row(i) << (i % 20 + 0.5) / 10 - 1, (i / 20 + 0.5) / 10 - 1, 0;
  return points;
}

TEST(LineOfSight, WhatIsHiddenIsTheShadowOfWhatHides) {
  const std::vector<SurfaceMesh> above{square({0, 0, 3})};
  EXPECT_EQ(share_in_sight(grid(), {0, 0, 1}, above), 0);
  EXPECT_EQ(share_in_sight(grid(), {0, 0, -1}, above), 1);
  EXPECT_EQ(share_in_sight(grid(), {1, 0, 3}, above), 0.5);  // the shadow is moved by half the square
  EXPECT_EQ(share_in_sight(grid(), {1, 1, 3}, above), 0.75);
  EXPECT_EQ(share_in_sight(grid(), {-1, -1, 3}, above), 0.75);
  EXPECT_EQ(share_in_sight(grid(), {1, 0, 0}, above), 1);
  EXPECT_EQ(share_in_sight(grid(), {0, 0, 1}, {}), 1);
}

TEST(LineOfSight, WhatTwoHideCountsOnce) {
  const std::vector<SurfaceMesh> two{square({1, 0, 3}), square({1, 1, 5})};
  EXPECT_EQ(share_in_sight(grid(), {0, 0, 1}, two), 0.5);
  const std::vector<SurfaceMesh> crossed{square({1, 0, 3}), square({0, 1, 5})};
  EXPECT_EQ(share_in_sight(grid(), {0, 0, 1}, crossed), 0.25);
}

}  // namespace
}  // namespace limber::detail
