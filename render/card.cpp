#include "render/card.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "render/detail/lettering.h"

namespace limber::render {

namespace {

constexpr double dimmed = 0.40;    // of the levels
constexpr double blur = 1 / 90.0;  // radius of each of three means, of the width

// Means over 2 radius + 1 pixels of a row of them, `stride` levels apart; beyond its ends goes on what is
// there.
void mean_along(std::uint8_t* levels, int count, std::size_t stride, int radius, std::vector<int>& copy) {
  copy.resize(std::size_t(count));
  for (int i = 0; i < count; ++i) copy[std::size_t(i)] = levels[std::size_t(i) * stride];
  const auto at = [&](int i) { return copy[std::size_t(std::clamp(i, 0, count - 1))]; };
  const int width = 2 * radius + 1;
  int sum = 0;
  for (int i = -radius; i <= radius; ++i) sum += at(i);
  for (int i = 0; i < count; ++i) {
    levels[std::size_t(i) * stride] = std::uint8_t((sum + radius) / width);
    sum += at(i + radius + 1) - at(i - radius);
  }
}

void blurred(Image8& image) {
  const int radius = std::max(1, int(std::lround(blur * image.width)));
  const std::size_t row = std::size_t(3) * image.width;
  std::vector<int> copy;
  for (int pass = 0; pass < 3; ++pass) {
    for (int y = 0; y < image.height; ++y)
      for (std::size_t c = 0; c < 3; ++c)
        mean_along(&image.rgb[std::size_t(y) * row + c], image.width, 3, radius, copy);
    for (std::size_t x = 0; x < row; ++x) mean_along(&image.rgb[x], image.height, row, radius, copy);
  }
}

void write_in_the_middle(Image8& image, const std::vector<std::string>& lines, bool on_dark) {
  using detail::text_width, detail::Weight;
  const double room = 0.84 * image.width, first = image.height / 18.0, other = image.height / 34.0;
  const auto weight = [](std::size_t i) { return i == 0 ? Weight::semibold : Weight::regular; };
  std::vector<double> heights;
  double total = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double wanted = i == 0 ? first : other;
    heights.push_back(wanted * std::min(1.0, room / std::max(1.0, text_width(lines[i], wanted, weight(i)))));
    total += heights[i] + (i == 0 ? 0 : i == 1 ? 1.5 * other : 1.1 * other);
  }
  double baseline = 0.5 * (image.height - total);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    baseline += heights[i] + (i == 0 ? 0 : i == 1 ? 1.5 * other : 1.1 * other);
    detail::draw_text(image, lines[i], 0.5 * (image.width - text_width(lines[i], heights[i], weight(i))),
                      baseline,
                      {.height_px = heights[i],
                       .color_srgb = on_dark ? Vec3(0.97, 0.97, 0.96) : Vec3(0.16, 0.17, 0.20),
                       .weight = weight(i)});
  }
}

}  // namespace

Image8 card(const Image8& picture, const std::vector<std::string>& lines) {
  Image8 image = picture;
  blurred(image);
  for (std::uint8_t& level : image.rgb) level = std::uint8_t(std::lround(dimmed * level));
  write_in_the_middle(image, lines, true);
  return image;
}

Image8 plain_card(int width, int height, const std::vector<std::string>& lines, const Vec3& ground_srgb) {
  Image8 image = filled(width, height, ground_srgb);
  write_in_the_middle(image, lines, ground_srgb.mean() < 0.5);
  return image;
}

Image8 mixed(const Image8& from, const Image8& to, double share) {
  LIMBER_CHECK(from.width == to.width && from.height == to.height, from.width, to.width);
  Image8 image = from;
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = std::uint8_t(std::lround((1 - share) * from.rgb[i] + share * to.rgb[i]));
  return image;
}

void paste(Image8& image, const Image8& inset, int left, int top, int rim_px, const Vec3& rim_srgb) {
  const Image8 dot = filled(1, 1, rim_srgb);
  for (int y = std::max(0, top - rim_px); y < std::min(image.height, top + inset.height + rim_px); ++y)
    for (int x = std::max(0, left - rim_px); x < std::min(image.width, left + inset.width + rim_px); ++x) {
      const bool in = left <= x && x < left + inset.width && top <= y && y < top + inset.height;
      const std::uint8_t* from =
          in ? &inset.rgb[3 * (std::size_t(y - top) * inset.width + std::size_t(x - left))] : dot.rgb.data();
      std::copy_n(from, 3, &image.rgb[3 * (std::size_t(y) * image.width + std::size_t(x))]);
    }
}

}  // namespace limber::render
