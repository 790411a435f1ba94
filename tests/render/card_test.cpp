// Cards, and one picture in another.
#include "render/card.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace limber::render {
namespace {

Image8 grain(int width, int height) {
  Rng rng(3, 0);
  Image8 image{width, height, {}};
  for (int i = 0; i < 3 * width * height; ++i) image.rgb.push_back(std::uint8_t(rng.uniform(0, 256)));
  return image;
}

double mean_of(const Image8& image) {
  double sum = 0;
  for (const std::uint8_t level : image.rgb) sum += level;
  return sum / double(image.rgb.size());
}

// The box of what differs: left, top, right, bottom; right < left where nothing does.
Eigen::Vector4i box_of_changes(const Image8& a, const Image8& b) {
  Eigen::Vector4i box(a.width, a.height, 0, 0);
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const std::size_t at = 3 * (std::size_t(y) * std::size_t(a.width) + std::size_t(x));
      if (std::equal(&a.rgb[at], &a.rgb[at] + 3, &b.rgb[at])) continue;
      box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x + 1), std::max(box[3], y + 1)};
    }
  return box;
}

// Means keep the mean; three of them over w pixels, one after the other, leave 11/(20 w) of the variance of
// noise along each axis.
TEST(Card, ThePictureIsDimmedAndBlurred) {
  const Image8 picture = grain(450, 300), dim = card(picture, {""});
  EXPECT_NEAR(mean_of(dim), 0.4 * mean_of(picture), 1);
  const auto spread = [&](const Image8& image) {
    const double mean = mean_of(image);
    double sum = 0;
    for (const std::uint8_t level : image.rgb) sum += (level - mean) * (level - mean);
    return std::sqrt(sum / double(image.rgb.size()));
  };
  const double width = 2 * std::round(450 / 90.0) + 1;
  EXPECT_NEAR(spread(dim), 0.4 * spread(picture) * 11 / (20 * width), 0.3);
  const Image8 grey = filled(200, 100, Vec3(0.5, 0.25, 1));
  const Image8 darker = card(grey, {""});
  for (std::size_t i = 0; i < grey.rgb.size(); ++i) EXPECT_EQ(darker.rgb[i], std::lround(0.4 * grey.rgb[i]));
}

TEST(Card, TheWordsStandInTheMiddleAndFitTheWidth) {
  const Vec3 ground(0.9, 0.9, 0.9);
  const Image8 empty = plain_card(640, 360, {""}, ground);
  double last_height = 0;
  for (const auto& lines :
       {std::vector<std::string>{"Hourglass"}, std::vector<std::string>{"Hourglass", "and a line below it"},
        std::vector<std::string>{"Hourglass", "and a line below it", "and one more"}}) {
    const Eigen::Vector4i box = box_of_changes(empty, plain_card(640, 360, lines, ground));
    ASSERT_LT(box[0], box[2]);
    EXPECT_NEAR(0.5 * (box[0] + box[2]), 320, 4);
    EXPECT_NEAR(0.5 * (box[1] + box[3]), 180, 12);  // some letters have tails
    EXPECT_GT(box[3] - box[1], last_height);
    last_height = box[3] - box[1];
  }
  const Eigen::Vector4i wide = box_of_changes(empty, plain_card(640, 360, {std::string(300, 'm')}, ground));
  EXPECT_NEAR(wide[2] - wide[0], 0.84 * 640, 16);
}

// As large as a short one's letters, in rows that are in the picture and much as wide as one another.
TEST(Card, ALongLineIsBrokenAtItsSpaces) {
  const Vec3 ground(0.9, 0.9, 0.9);
  const Image8 empty = plain_card(640, 360, {""}, ground);
  const auto rows_of = [&](const std::string& line) {
    const Image8 image = plain_card(640, 360, {line}, ground);
    std::vector<Eigen::Vector4i> rows;  // boxes, parted by rows of pixels without ink
    for (int y = 0; y < 360; ++y) {
      Eigen::Vector4i row(640, y, 0, y + 1);
      for (int x = 0; x < 640; ++x)
        if (const std::size_t at = 3 * std::size_t(640 * y + x); image.rgb[at] != empty.rgb[at])
          row[0] = std::min(row[0], x), row[2] = std::max(row[2], x + 1);
      if (row[2] == 0) continue;
      if (rows.empty() || rows.back()[3] < y)
        rows.push_back(row);
      else
        rows.back() = {std::min(rows.back()[0], row[0]), rows.back()[1], std::max(rows.back()[2], row[2]),
                       y + 1};
    }
    return rows;
  };
  const auto one = rows_of("nmnm xnxn");
  ASSERT_EQ(one.size(), 1u);
  std::string line = "nmnm";
  for (int words = 1; words < 12; ++words) line += " xnxn";
  const auto several = rows_of(line);
  ASSERT_GE(several.size(), 2u);
  for (const Eigen::Vector4i& row : several) {
    EXPECT_EQ(row[3] - row[1], one[0][3] - one[0][1]) << "letters of another size";
    EXPECT_LE(row[2] - row[0], 0.84 * 640 + 2);
    EXPECT_GE(row[2] - row[0], 0.6 * (several[0][2] - several[0][0])) << "a lonely word";
  }
  // However long it is, it stays in the picture.
  for (int words = 0; words < 200; ++words) line += " xnxn";
  const auto many = rows_of(line);
  EXPECT_GT(many.front()[1], 0.05 * 360);
  EXPECT_LT(many.back()[3], 0.95 * 360);
}

TEST(Card, WordsAreDarkOnPaleAndPaleOnDark) {
  for (const double value : {0.1, 0.9}) {
    const Image8 image = plain_card(320, 180, {"Words"}, Vec3::Constant(value)),
                 empty = plain_card(320, 180, {""}, Vec3::Constant(value));
    EXPECT_EQ(mean_of(image) > mean_of(empty), value < 0.5);
  }
}

TEST(Card, MixedIsTheOneTheOtherAndTheMeanOfBoth) {
  const Image8 a = grain(40, 30), b = filled(40, 30, Vec3(1, 0, 0.5));
  EXPECT_EQ(mixed(a, b, 0), a);
  EXPECT_EQ(mixed(a, b, 1), b);
  const Image8 half = mixed(a, b, 0.5);
  for (std::size_t i = 0; i < a.rgb.size(); ++i) EXPECT_NEAR(half.rgb[i], 0.5 * (a.rgb[i] + b.rgb[i]), 0.5);
}

TEST(Card, APastedPictureIsThereWithinItsRimAndNothingElseChanges) {
  const Image8 ground = filled(60, 40, Vec3(0, 0, 0)), small = grain(20, 10);
  for (const auto& [left, top] : {std::pair(7, 9), std::pair(-5, -3), std::pair(50, 35)}) {
    Image8 image = ground;
    paste(image, small, left, top, 2, Vec3(1, 1, 1));
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 60; ++x) {
        const int u = x - left, v = y - top;
        const bool in = 0 <= u && u < 20 && 0 <= v && v < 10, rim = -2 <= u && u < 22 && -2 <= v && v < 12;
        const int expected = in ? small.rgb[3 * std::size_t(20 * v + u)] : rim ? 255 : 0;
        ASSERT_EQ(image.rgb[3 * std::size_t(60 * y + x)], expected) << x << " " << y;
      }
  }
}

}  // namespace
}  // namespace limber::render
