#include "render/image.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace limber::render {
namespace {

TEST(Image, TransferCurvesAreInverse) {
  for (double x = 0; x <= 1; x += 1.0 / 1024) {
    EXPECT_NEAR(srgb_from_linear(linear_from_srgb(x)), x, 1e-6);
    EXPECT_NEAR(tone_mapped(tone_unmapped(std::min(x, 0.999))), std::min(x, 0.999), 1e-12);
  }
  EXPECT_NEAR(linear_from_srgb(0.5), 0.21404114, 1e-7);  // IEC 61966-2-1
}

TEST(Image, ToneMapRisesWithoutAKinkAndStaysBelowOne) {
  for (double x = 0.01; x < 8; x += 0.01) {
    EXPECT_GT(tone_mapped(x), tone_mapped(x - 0.01));
    EXPECT_LT(tone_mapped(x), 1);
    EXPECT_LE(tone_mapped(x) - tone_mapped(x - 0.01), 0.01 + 1e-12);  // never steeper than the identity
  }
}

TEST(Image, TheTableIsWithinOneLevelOfTheFormula) {
  Rng rng(1, 0);
  Image image{100, 50, {}};
  for (int i = 0; i < 100 * 50 * 4; ++i) image.rgba.push_back(float(std::exp(rng.uniform(-10, 3))));
  const Image8 shown = tone_mapped(image);
  for (int p = 0; p < 100 * 50; ++p)
    for (int c = 0; c < 3; ++c) {
      const double exact = 255 * srgb_from_linear(tone_mapped(double(image.rgba[4 * p + c])));
      EXPECT_NEAR(shown.rgb[3 * p + c], exact, 1.02);  // dithered
    }
}

// Over a tile the mean is the colour, no pixel is off by a level, and a colour that is a level stays one.
TEST(Image, DitherKeepsTheMeanOfATile) {
  for (double level = 0.57; level < 255; level += 2.71) {
    const float light = float(tone_unmapped(linear_from_srgb(level / 255)));
    Image tile{dither_columns, dither_rows, {}};
    tile.rgba.assign(std::size_t(4 * dither_columns * dither_rows), light);
    const double exact = 255 * srgb_from_linear(tone_mapped(double(light)));
    double sum = 0;
    for (const std::uint8_t shown : tone_mapped(tile).rgb) {
      ASSERT_NEAR(shown, exact, 1.02) << level;
      sum += shown;
    }
    EXPECT_NEAR(sum / (3 * dither_columns * dither_rows), exact, 0.02) << level;
  }
  for (const double level : {16.0, 60.0, 128.0, 236.0}) {
    const float light = float(tone_unmapped(linear_from_srgb(level / 255)));
    Image tile{dither_columns, dither_rows, {}};
    tile.rgba.assign(std::size_t(4 * dither_columns * dither_rows), light);
    EXPECT_EQ(tone_mapped(tile), filled(dither_columns, dither_rows, Vec3::Constant(level / 255))) << level;
  }
}

TEST(Image, SixteenBitsAreTheFormulaAndAlphaIsStraight) {
  Rng rng(2, 0);
  Image image{60, 40, {}}, premultiplied = image;
  for (int p = 0; p < 60 * 40; ++p) {
    const float cover = float(rng.uniform(0.05, 1));
    for (int c = 0; c < 3; ++c) {
      image.rgba.push_back(float(std::exp(rng.uniform(-8, 2))));
      premultiplied.rgba.push_back(image.rgba.back() * cover);
    }
    image.rgba.push_back(1);
    premultiplied.rgba.push_back(cover);
  }
  const Raster16 shown = tone_mapped_16(image), wide = tone_mapped_alpha_16(premultiplied);
  const Raster8 narrow = tone_mapped_alpha(premultiplied);
  for (std::size_t p = 0; p < 60 * 40; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double exact = srgb_from_linear(tone_mapped(double(image.rgba[4 * p + c])));
      EXPECT_NEAR(shown.levels[3 * p + c], 65535 * exact, 0.51);
      EXPECT_NEAR(wide.levels[4 * p + c], 65535 * exact, 1.01);
      EXPECT_NEAR(narrow.levels[4 * p + c], 255 * exact, 0.51);
    }
    EXPECT_NEAR(wide.levels[4 * p + 3], 65535 * premultiplied.rgba[4 * p + 3], 0.51);
  }
  const Image nothing{1, 1, {0, 0, 0, 0}};
  EXPECT_EQ(tone_mapped_alpha(nothing).levels, std::vector<std::uint8_t>(4, 0));
}

TEST(Image, WhatIsNoNumberComesOutBlack) {
  const Image image{1, 1, {std::nanf(""), -1.0f, INFINITY, 1.0f}};
  EXPECT_EQ(tone_mapped(image).rgb, (std::vector<std::uint8_t>{0, 0, 255}));
}

TEST(Image, ShrinkingAveragesLight) {
  Image8 board{4, 4, {}};  // black and white by turns: half the light, which is 188 in sRGB, not 128
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) board.rgb.insert(board.rgb.end(), 3, (x + y) % 2 ? 255 : 0);
  EXPECT_EQ(shrunk(board, 2, 2), filled(2, 2, Vec3::Constant(188.0 / 255)));
  EXPECT_EQ(shrunk(board, 4, 4), board);
  const Image8 plain = filled(37, 23, {0.2, 0.4, 0.9});
  EXPECT_EQ(shrunk(plain, 10, 7), filled(10, 7, {0.2, 0.4, 0.9}));
}

}  // namespace
}  // namespace limber::render
