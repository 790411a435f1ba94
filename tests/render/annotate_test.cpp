#include "render/annotate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace limber::render {
namespace {

Vec3 pixel(const Image8& image, int x, int y) {
  const std::uint8_t* p = &image.rgb[3 * (std::size_t(y) * image.width + x)];
  return Vec3(p[0], p[1], p[2]) / 255;
}

bool holds_color(const Image8& image, const Vec3& color, int first_row) {
  for (int y = first_row; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if ((pixel(image, x, y) - color).cwiseAbs().maxCoeff() < 0.01) return true;
  return false;
}

TEST(Caption, LeavesThePictureAndWritesBelowIt) {
  const Image8 picture = filled(400, 100, {0.2, 0.4, 0.6});
  const Image8 image = with_caption(picture, {"one", "two"}, {{"key", {1, 0, 0}}});
  EXPECT_EQ(image.width, 400);
  EXPECT_GT(image.height, 100);
  EXPECT_TRUE(std::equal(picture.rgb.begin(), picture.rgb.end(), image.rgb.begin()));
  EXPECT_TRUE(holds_color(image, {1, 0, 0}, 100)) << "the square of the key";
  EXPECT_GT(with_caption(picture, {"one", "two", "three"}).height,
            with_caption(picture, {"one", "two"}).height);
}

TEST(Caption, ALineOfAnyLengthFits) {
  const Image8 picture = filled(400, 20, {0, 0, 0});
  const Vec3 white(1, 1, 1);
  for (const std::size_t length : {3, 30, 300}) {
    const Image8 image = with_caption(picture, {std::string(length, 'M')}, {});
    int last = 0;
    for (int y = 20; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        if (pixel(image, x, y) != white) last = std::max(last, x);
    EXPECT_LT(last, 395) << length;
    EXPECT_GT(last, length == 300 ? 300 : 10) << "and no smaller than need be";
  }
}

TEST(Histogram, EveryValueIsCountedOnce) {
  EXPECT_EQ(histogram_counts({0, 0.5, 1, 1.999, 2, 3.5}, 0, 4, 4), (std::vector{2, 2, 1, 1}));
  EXPECT_EQ(histogram_counts({-7, 4, 9}, 0, 4, 4), (std::vector{1, 0, 0, 2})) << "outside: in the outer bars";
  std::vector<double> values(1000);
  std::iota(values.begin(), values.end(), 0.0);
  const std::vector<int> counts = histogram_counts(values, 0, 1000, 8);
  EXPECT_EQ(counts, std::vector<int>(8, 125));
}

// Bars are measured in the picture: as high, in pixels of their own colour, as their counts say.
TEST(Histogram, BarsAreAsHighAsTheirCounts) {
  const Vec3 red(1, 0, 0), green(0, 1, 0), blue(0, 0, 1);
  const Image8 image = histogram({0.1, 0.2, 0.5, 0.5, 0.5, 0.5, 0.9}, {.x_label = "x",
                                                                       .y_label = "y",
                                                                       .low = 0,
                                                                       .high = 1,
                                                                       .bar_srgb = {red, green, blue},
                                                                       .width_px = 900,
                                                                       .height_px = 600});
  ASSERT_EQ(image.width, 900);
  ASSERT_EQ(image.height, 600);
  const auto height = [&](const Vec3& color) {
    int most = 0;
    for (int x = 0; x < image.width; ++x) {
      int rows = 0;
      for (int y = 0; y < image.height; ++y) rows += pixel(image, x, y) == color;
      most = std::max(most, rows);
    }
    return most;
  };
  EXPECT_GT(height(green), 300);
  EXPECT_NEAR(height(red), height(green) / 2.0, 1);
  EXPECT_NEAR(height(blue), height(green) / 4.0, 1);
}

}  // namespace
}  // namespace limber::render
