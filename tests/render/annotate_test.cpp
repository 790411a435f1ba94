#include "render/annotate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "render/detail/lettering.h"

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

// Left, top, right and bottom of what is not white.
Eigen::Vector4i ink_of(const Image8& image) {
  Eigen::Vector4i box(image.width, image.height, -1, -1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (pixel(image, x, y) != Vec3::Ones())
        box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
  return box;
}

TEST(Lettering, IsAsHighAndAsWideAsItSays) {
  using detail::text_width;
  for (const double height : {9.0, 20.0, 41.0}) {
    const double width = text_width("HEIGHT", height);
    EXPECT_NEAR(width, text_width("HEIG", height) + text_width("HT", height), 1e-9);
    EXPECT_NEAR(text_width("HEIGHT", 2 * height), 2 * width, 0.02 * width);
    Image8 image = filled(400, 100, {1, 1, 1});
    detail::draw_text(image, "HH", 10, 80, {.height_px = height, .color_srgb = {0, 0, 0}});
    const Eigen::Vector4i ink = ink_of(image);
    EXPECT_NEAR(80 - ink[1], height, 1.5);
    EXPECT_EQ(ink[3], 79);
    EXPECT_GE(ink[0], 10);
    EXPECT_LE(ink[2], 10 + text_width("HH", height));
  }
}

// On a picture that is too small for it, what is there is what the same words are on a larger one.
TEST(Lettering, DrawsAsMuchAsThePictureHas) {
  const detail::TextLook look{.height_px = 20, .color_srgb = {0, 0, 0}, .rim_px = 3, .rim_srgb = {1, 0, 0}};
  constexpr int size = 50, margin = 60;
  int with_ink = 0;
  for (const auto& [x, y] :
       {std::pair(-20.3, 10.0), {35.0, 30.7}, {5.0, -3.0}, {5.0, 60.0}, {-50.0, 100.0}}) {
    Image8 part = filled(size, size, {1, 1, 1}),
           whole = filled(size + 2 * margin, size + 2 * margin, {1, 1, 1});
    detail::draw_text(part, "Wg", x, y, look);
    detail::draw_text(whole, "Wg", x + margin, y + margin, look);
    for (int row = 0; row < size; ++row)
      for (int column = 0; column < size; ++column)
        ASSERT_EQ(pixel(part, column, row), pixel(whole, column + margin, row + margin)) << x << ' ' << y;
    with_ink += part != filled(size, size, {1, 1, 1});
  }
  EXPECT_EQ(with_ink, 4);
}

TEST(Lettering, SaysWhichLettersItLacks) {
  EXPECT_EQ(letters_missing("Größe 5× – λ, Ж: 3 µm"), "");
  EXPECT_EQ(letters_missing("a 心 b 心 肺"), "心肺");
  EXPECT_EQ(detail::letter_at("a\xff", 1), std::pair(char32_t(0xfffd), std::size_t(1)));
  EXPECT_EQ(detail::letter_at("\xe5\xbf", 0).first, char32_t(0xfffd)) << "cut short";
  EXPECT_EQ(detail::letter_at("x心", 1), std::pair(char32_t(0x5fc3), std::size_t(3)));
}

TEST(ScaleBar, IsAsLongAsItShouldBe) {
  for (const Corner corner : {Corner::bottom_left, Corner::bottom_right}) {
    Image8 image = filled(640, 360, {0.5, 0.5, 0.5});
    draw_scale_bar(image, "5 cm", 123, {.corner = corner});
    int longest = 0;
    for (int y = 0; y < image.height; ++y) {
      int run = 0;
      for (int x = 0; x < image.width; ++x)
        longest = std::max(longest, run = pixel(image, x, y).maxCoeff() < 0.3 ? run + 1 : 0);
    }
    EXPECT_EQ(longest, 123);
  }
}

// A tick is of the brightness of words; that of 0.4 is right of the bar, at two fifths of its height.
TEST(ColorBar, IsLightOnDarkAndDarkOnLight) {
  for (const bool dark : {false, true}) {
    Image8 image = filled(1920, 1080, Vec3::Constant(dark ? 0.1 : 0.95));
    const Vec3 ground = pixel(image, 0, 0), gray(0.5, 0.5, 0.5);
    draw_color_bar(
        image,
        {.label = "", .low = 0, .high = 1, .color_srgb = [&](double) { return gray; }, .on_dark = dark});
    const int y = int(1080 * (0.75 - 0.4 * 0.5));
    int right = image.width - 1;
    while (right > 0 && (pixel(image, right, y + 8) - gray).norm() > 0.01) --right;
    const Vec3 tick = pixel(image, right + 4, y);
    EXPECT_GT(right, 1600);
    EXPECT_GT((tick - ground).norm(), 1) << tick.transpose();
    EXPECT_EQ(tick.mean() > ground.mean(), dark);
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
