#include "render/color_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace limber::render {
namespace {

TEST(ColorMap, OklabOfPrimariesIsAsPublished) {
  // Ottosson's page and the CSS Color 4 draft give these to three digits or more.
  const auto near = [](const Oklab& lab, double l, double a, double b) {
    return std::abs(lab.lightness - l) < 5e-4 && std::abs(lab.a - a) < 5e-4 && std::abs(lab.b - b) < 5e-4;
  };
  EXPECT_TRUE(near(oklab_from_srgb({1, 1, 1}), 1, 0, 0));
  EXPECT_TRUE(near(oklab_from_srgb({1, 0, 0}), 0.6280, 0.2249, 0.1258));
  EXPECT_TRUE(near(oklab_from_srgb({0, 0, 1}), 0.4520, -0.0324, -0.3115));
}

TEST(ColorMap, OklabAndBackIsTheSame) {
  for (double r = 0; r <= 1; r += 0.25)
    for (double g = 0; g <= 1; g += 0.25)
      for (double b = 0; b <= 1; b += 0.25)
        EXPECT_LT((srgb_from_oklab(oklab_from_srgb({r, g, b})) - Vec3(r, g, b)).norm(), 1e-6) << r << g << b;
}

// Also says that every colour can be shown: one that had to be clamped would be off the line.
TEST(ColorMap, LightnessOfTheSequentialMapIsALine) {
  for (int i = 0; i <= 100; ++i) {
    const double t = i / 100.0;
    EXPECT_NEAR(oklab_from_srgb(sequential_srgb(t)).lightness, 0.87 - 0.54 * t, 1e-3) << t;
  }
  EXPECT_EQ(sequential_srgb(-1), sequential_srgb(0));
  EXPECT_EQ(sequential_srgb(2), sequential_srgb(1));
}

TEST(ColorMap, BothSidesOfTheDivergingMapAreAsLight) {
  for (int i = 0; i <= 50; ++i) {
    const double t = i / 100.0;
    EXPECT_NEAR(oklab_from_srgb(diverging_srgb(t)).lightness,
                oklab_from_srgb(diverging_srgb(1 - t)).lightness, 1e-3);
  }
  EXPECT_LT(oklab_from_srgb(diverging_srgb(0)).b, -0.1);
  EXPECT_GT(oklab_from_srgb(diverging_srgb(1)).a, 0.1);
}

}  // namespace
}  // namespace limber::render
