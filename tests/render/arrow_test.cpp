#include "render/arrow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

namespace limber::render {
namespace {

// A prism and a pyramid over regular polygons of as many sides as a ring has corners.
TEST(Arrow, VolumeIsThatOfShaftAndHead) {
  const Vec3 from(1, 2, 3), to(2, 0, 5);  // 3 long
  const double radius = 0.05, head_radius = 2.4 * radius, head = 6 * radius;
  const int sides = 20;
  const double polygon = sides / 2.0 * std::sin(2 * std::numbers::pi / sides);  // of radius 1
  const double expected = polygon * (radius * radius * (3 - head) + head_radius * head_radius * head / 3);
  EXPECT_NEAR(volume(SurfaceMesh{arrow(from, to, radius), arrow_triangles()}), expected, 1e-12);
}

TEST(Arrow, IsClosed) {
  std::map<std::pair<int, int>, int> balance;
  const Triangles triangles = arrow_triangles();
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      const int a = triangles(t, i), b = triangles(t, (i + 1) % 3);
      balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  for (const auto& [edge, sum] : balance) EXPECT_EQ(sum, 0) << edge.first << ' ' << edge.second;
  EXPECT_EQ(Eigen::Index(balance.size()), triangles.rows() * 3 / 2);
}

TEST(Arrow, EndsAtItsTip) {
  const Vec3 from(0, 0, 0), to(0.1, 0.2, -0.3);
  for (const double radius : {0.001, 0.5}) {  // slender, and shrunk as a whole
    const Points points = arrow(from, to, radius);
    const Vec3 along = (to - from).normalized();
    EXPECT_NEAR((points * along).maxCoeff(), (to - from).norm(), 1e-12);
    EXPECT_NEAR((points * along).minCoeff(), 0, 1e-12);
  }
  EXPECT_EQ(arrow(to, to, 0.1),
            Points(Points::Zero(arrow(from, to, 1).rows(), 3).rowwise() + to.transpose()));
}

}  // namespace
}  // namespace limber::render
