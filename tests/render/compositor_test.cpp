// From samples to pixels, against what IEEE 754 and the geometry of a camera say.
#include "render/detail/compositor.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "render/camera.h"
#include "render/image.h"

namespace limber::render::detail {
namespace {

constexpr std::uint16_t half_one = 0x3c00, half_two = 0x4000, half_third = 0x3555;

// A half float as IEEE 754 defines it: sign, five bits of exponent, ten of mantissa.
double value_of_half(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
  const double size = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
  return bits & 0x8000 ? -size : size;
}

Camera above_the_ground() {
  Camera camera;
  camera.eye = {3, -4, 2}, camera.target = {0, 0, 0.4};
  return camera;
}

// Shade that is a linear function of the place, so that bilinear lookup gives it back.
ShadeMap leaning(double at_middle, const Eigen::Vector2d& slope) {
  ShadeMap map{.lower = {-20, -20}, .cell_m = 0.5, .columns = 80, .rows = 80, .blocked = {}};
  for (int r = 0; r < map.rows; ++r)
    for (int c = 0; c < map.columns; ++c)
      map.blocked.push_back(
          float(at_middle + slope.dot(map.lower + map.cell_m * Eigen::Vector2d(c + 0.5, r + 0.5))));
  return map;
}

class FinishTest : public testing::Test {
 protected:
  ShadeMap key = leaning(0.4, {0.02, -0.01}), sky = leaning(0.3, {-0.01, 0.015});
  Backdrop backdrop{.background_top = {0.2, 0.4, 0.8},
                    .background_bottom = {0.6, 0.5, 0.3},
                    .ground_seen = false,
                    .ground = ground_frame(Vec3::UnitZ(), 0.1),
                    .ground_color = {0.9, 0.7, 0.5},
                    .key_shade = &key,
                    .sky_shade = &sky,
                    .far_ground_color = {0.4, 0.35, 0.5},
                    .key_share = Vec3(0.6, 0.5, 0.7),
                    .fade_middle = Vec3(0.5, -0.2, 1),
                    .fade_begin_m = 3,
                    .fade_end_m = 9,
                    .haze_m = 30};
  Camera camera = above_the_ground();
  std::vector<float> row(const std::vector<std::uint16_t>& samples, int width, int height, int per_side,
                         int y) const {
    std::vector<float> rgba(4 * std::size_t(width));
    Compositor(backdrop, camera, width, height)
        .row(y, {samples.data(), per_side, 0, width, 0, height}, rgba.data());
    return rgba;
  }
};

TEST_F(FinishTest, EveryHalfFloatBecomesItsValue) {
  std::vector<std::uint16_t> samples;
  for (int bits = 0; bits < 1 << 16; ++bits)
    samples.insert(samples.end(), {std::uint16_t(bits), 0, 0, half_one});
  const std::vector<float> rgba = row(samples, 1 << 16, 1, 1, 0);
  for (int bits = 0; bits < 1 << 16; ++bits) {
    const int size = bits & 0x7fff;
    const double expected = size > 0x7c00 ? 0 : value_of_half(std::uint16_t(bits));  // 0x7c00: infinity
    ASSERT_EQ(double(rgba[4 * std::size_t(bits)]), expected) << bits;
  }
}

TEST_F(FinishTest, APixelIsTheMeanOfItsSamplesOverTheBackground) {
  // 3 × 2 pixels of 2 × 2 samples; only the upper left pixel and one sample of that at the lower right are
  // covered.
  std::vector<std::uint16_t> samples(4 * 6 * 4, 0);
  const auto sample = [&](int x, int y_upward) { return &samples[4 * std::size_t(y_upward * 6 + x)]; };
  int which = 0;
  for (const auto& [x, y] : {std::pair(0, 2), {1, 2}, {0, 3}, {1, 3}}) {
    const std::uint16_t values[] = {half_one, std::uint16_t(which++ == 0 ? half_two : 0), half_third,
                                    half_one};
    std::copy_n(values, 4, sample(x, y));
  }
  sample(5, 0)[0] = half_one, sample(5, 0)[3] = half_one;
  const std::vector<float> upper = row(samples, 3, 2, 2, 0), lower = row(samples, 3, 2, 2, 1);
  EXPECT_EQ(upper[0], 1);
  EXPECT_EQ(upper[1], 0.5f);
  EXPECT_EQ(upper[3], 1);
  EXPECT_EQ(double(upper[2]), value_of_half(half_third));
  for (std::size_t c = 0; c < 3; ++c) {
    const double background =
        0.75 * backdrop.background_bottom[int(c)] + 0.25 * backdrop.background_top[int(c)];
    EXPECT_NEAR(lower[c], background, 1e-6);
    EXPECT_NEAR(lower[8 + c], 0.75 * background + (c == 0 ? 0.25 : 0), 1e-6);
  }
  EXPECT_EQ(lower[11], 0.25f);
}

// Half a pixel of black before a background is shown half as bright in linear light, also before white, of
// which the tone map's inverse is huge; and a background that is a little brighter changes a pixel by no more
// than its own change.
TEST_F(FinishTest, WhatIsHalfCoveredIsMixedAsItIsShown) {
  const auto shown = [&](double background, std::uint16_t red, std::uint16_t alpha) {
    backdrop.background_top = backdrop.background_bottom = Vec3::Constant(tone_unmapped(background));
    return tone_mapped(double(row({red, 0, 0, alpha}, 1, 1, 1, 0)[0]));
  };
  constexpr std::uint16_t half_half = 0x3800, half_quarter = 0x3400;
  for (const double background : {0.3, 0.7, 0.9, 0.9999}) {
    EXPECT_NEAR(shown(background, 0, half_half), 0.5 * background, 1e-6) << background;
    EXPECT_NEAR(shown(background, 0, half_quarter), 0.75 * background, 1e-6) << background;
    EXPECT_NEAR(shown(background, 0, 0), background, 1e-6);
    EXPECT_EQ(shown(background, half_third, half_one), tone_mapped(value_of_half(half_third)));
  }
  for (const std::uint16_t red : {std::uint16_t(0), half_third, half_two})
    for (const std::uint16_t alpha : {half_quarter, half_half}) {
      constexpr double step = 1.0 / 512;
      for (double background = 0.5; background + step < 1; background += step) {
        const double more = shown(background + step, red, alpha) - shown(background, red, alpha);
        EXPECT_GE(more, -1e-6) << background;
        EXPECT_LE(more, 1.01 * step) << background;
      }
    }
}

TEST_F(FinishTest, TheGroundIsLitAndFadesByWhereARayMeetsIt) {
  backdrop.ground_seen = true;
  constexpr int width = 37, height = 20;
  const std::vector<std::uint16_t> nothing(4 * width * height, 0);
  const double half = 0.5 * height / std::tan(0.5 * camera.fov_deg * std::numbers::pi / 180);
  int on_ground = 0, fading = 0, beyond = 0, above = 0;
  for (const auto& [transparent, target_m] : {std::pair(false, 0.4), {true, 0.4}, {false, 2.5}}) {
    camera.target.z() = target_m;
    const Eigen::Matrix3d to_world = camera_from_world(camera).topLeftCorner<3, 3>().transpose();
    backdrop.transparent = transparent;
    for (int y = 0; y < height; ++y) {
      const std::vector<float> rgba = row(nothing, width, height, 1, y);
      for (int x = 0; x < width; ++x) {
        const Vec3 ray = to_world * Vec3(x + 0.5 - 0.5 * width, 0.5 * height - y - 0.5, -half);
        double shown = 0, key_hidden = 0, sky_hidden = 0, haze = 0;
        if (ray.z() < 0) {
          const Vec3 place = camera.eye - (camera.eye.z() - 0.1) / ray.z() * ray;
          const double away = (place - backdrop.fade_middle).head<2>().norm();
          const double t = std::clamp((away - 3) / (9 - 3), 0.0, 1.0);
          shown = 1 - t * t * (3 - 2 * t);
          const Eigen::Vector2d uv = backdrop.ground.plane_from_world * place;
          // Far away both maps end.
          const bool mapped = uv.cwiseAbs().maxCoeff() < 19.7;
          key_hidden = mapped ? 0.4 + 0.02 * uv.x() - 0.01 * uv.y() : 0;
          sky_hidden = mapped ? 0.85 * (0.3 - 0.01 * uv.x() + 0.015 * uv.y()) : 0;
          haze = away * away / (away * away + 30 * 30);
          on_ground += t == 0, fading += t > 0 && t < 1, beyond += t == 1;
        }
        const float* pixel = &rgba[4 * std::size_t(x)];
        const auto shade = [&](int c) {
          return backdrop.key_share[c] * key_hidden + (1 - backdrop.key_share[c]) * sky_hidden;
        };
        for (int c = 0; c < 3; ++c) {
          const double horizon = backdrop.background_bottom[c], far = backdrop.far_ground_color[c];
          const double floor = far + shown * (backdrop.ground_color[c] * (1 - shade(c)) - far);
          const double rise = std::min(1.0, 4 * std::pow(ray.normalized().z(), 2));
          const double expected = ray.z() < 0 ? floor + haze * (horizon - floor)
                                              : horizon + rise * (backdrop.background_top[c] - horizon);
          ASSERT_NEAR(pixel[c], transparent ? 0 : expected, 2e-5) << x << " " << y;
        }
        ASSERT_NEAR(pixel[3], transparent ? shown * shade(1) : 0, 2e-5) << x << " " << y;
        above += ray.z() > 0;
      }
    }
  }
  EXPECT_GT(on_ground, 100);
  EXPECT_GT(fading, 100);
  EXPECT_GT(beyond, 20);
  EXPECT_GT(above, 20);
}

}  // namespace
}  // namespace limber::render::detail
