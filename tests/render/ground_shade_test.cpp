#include "render/detail/ground_shade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"

#include "tests/render/shapes.h"

namespace limber::render::detail {
namespace {

DrawnMesh drawn(const SurfaceMesh& mesh) {
  DrawnMesh d = order_for_drawing(mesh.triangles, mesh.positions, 180);
  deform(d, mesh.positions, Points());
  return d;
}

ShadeMap shade(const DrawnMesh& mesh, const Vec3& toward_light, std::vector<double> spreads, const Box& stage,
               int cells, float blocks = 1) {
  const GroundCaster casters[] = {{&mesh, blocks}};
  return shade_ground(casters, ground_frame({0, 0, 1}, 0), toward_light, spreads, stage, cells);
}

struct Moments {
  double area = 0;
  Eigen::Vector2d middle = {0, 0}, deviation = {0, 0};
};
Moments moments(const ShadeMap& map) {
  Moments m;
  Eigen::Vector2d square(0, 0);
  for (int r = 0; r < map.rows; ++r)
    for (int c = 0; c < map.columns; ++c) {
      const double blocked = map.blocked[std::size_t(r) * map.columns + c] * map.cell_m * map.cell_m;
      const Eigen::Vector2d p = map.lower + map.cell_m * Eigen::Vector2d(c + 0.5, r + 0.5);
      m.area += blocked, m.middle += blocked * p, square += blocked * p.cwiseAbs2();
    }
  m.middle /= m.area;
  m.deviation = (square / m.area - m.middle.cwiseAbs2()).cwiseSqrt();
  return m;
}

// A level plate's shadow has the plate's area and lies where the rays lead; blurring moves and loses none of
// it, and adds its own variance to that of the square.
TEST(GroundShade, APlatesShadowHasItsAreaPlaceAndSoftness) {
  const Vec3 toward_light = Vec3(-0.5, 0.3, 1).normalized();
  for (const double height : {0.5, 1.0, 2.0})
    for (const double spread : {0.03, 0.06, 0.2}) {
      SCOPED_TRACE(fmt::format("height {} spread {}", height, spread));
      const SurfaceMesh plate = quad_mesh({0, 0, height}, {1, 0, height}, {1, 1, height}, {0, 1, height});
      const ShadeMap map = shade(drawn(plate), toward_light, {spread}, bounding_box(plate.positions), 400);
      const Moments m = moments(map);
      EXPECT_NEAR(m.area, 1, 0.02);
      EXPECT_NEAR(m.middle.x(), 0.5 + 0.5 * height, 2 * map.cell_m);
      EXPECT_NEAR(m.middle.y(), 0.5 - 0.3 * height, 2 * map.cell_m);
      const double expected = std::sqrt(1.0 / 12 + std::pow(spread * height, 2));
      EXPECT_NEAR(m.deviation.x(), expected, 0.02 * expected + map.cell_m);
      EXPECT_NEAR(m.deviation.y(), expected, 0.02 * expected + map.cell_m);
    }
}

// The share of the sky that a large level plate hides from the ground below its middle, from the form factor
// of a disk.
TEST(GroundShade, TheSkyUnderAPlateIsHiddenByItsFormFactor) {
  const double radius = 1;
  for (const double height : {0.2, 0.5, 1.0}) {
    SurfaceMesh disk{Points(65, 3), Triangles(64, 3)};
    disk.positions.row(64) = Vec3(0, 0, height);
    for (int i = 0; i < 64; ++i) {
      const double a = i * std::numbers::pi / 32;
      disk.positions.row(i) = Vec3(radius * std::cos(a), radius * std::sin(a), height);
      disk.triangles.row(i) << 64, i, (i + 1) % 64;
    }
    const ShadeMap map = shade(drawn(disk), {0, 0, 1}, {0.5, 1.6}, bounding_box(disk.positions), 256);
    const Eigen::Vector2d cell = -map.lower / map.cell_m;
    const double hidden = map.blocked[std::size_t(cell.y()) * map.columns + std::size_t(cell.x())];
    EXPECT_NEAR(hidden, radius * radius / (radius * radius + height * height), 0.05) << height;
  }
}

TEST(GroundShade, ATiltedPlateHasNoGapsBetweenTheBands) {
  const SurfaceMesh plate = quad_mesh({0, 0, 0.01}, {3, 0, 3}, {3, 1, 3}, {0, 1, 0.01});
  const ShadeMap map = shade(drawn(plate), {0, 0, 1}, {0.05}, bounding_box(plate.positions), 400);
  for (double x = 0.1; x < 2; x += 0.02) {
    const Eigen::Vector2d cell = (Eigen::Vector2d(x, 0.5) - map.lower) / map.cell_m;
    EXPECT_GT(map.blocked[std::size_t(cell.y()) * map.columns + std::size_t(cell.x())], 0.93) << x;
  }
}

// What holds back a fraction of each ray has a shadow fainter by just that, everywhere. Bands that add up to
// more than all light are cut at that.
TEST(GroundShade, ASeeThroughPlatesShadowIsFainter) {
  const SurfaceMesh plate = quad_mesh({0, 0, 0.1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 0.1});
  const auto blocked = [&](float blocks) {
    return shade(drawn(plate), {0, 0, 1}, {0.1}, bounding_box(plate.positions), 128, blocks).blocked;
  };
  const std::vector<float> whole = blocked(1), part = blocked(0.3f);
  ASSERT_GT(*std::max_element(whole.begin(), whole.end()), 0.9f);
  for (std::size_t i = 0; i < whole.size(); ++i)
    if (whole[i] < 1)
      ASSERT_NEAR(part[i], 0.3f * whole[i], 1e-5f) << i;
    else
      ASSERT_GE(part[i], 0.3f - 1e-5f) << i;
}

TEST(GroundShade, WithoutCastersAllIsLit) {
  Box stage;
  stage.include(Vec3(0, 0, 0)), stage.include(Vec3(1, 1, 1));
  const ShadeMap map = shade_ground({}, ground_frame({0, 0, 1}, 0), {0, 0, 1}, std::vector{0.1}, stage, 64);
  EXPECT_EQ(std::accumulate(map.blocked.begin(), map.blocked.end(), 0.0f), 0.0f);
}

}  // namespace
}  // namespace limber::render::detail
