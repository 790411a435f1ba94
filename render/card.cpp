#include "render/card.h"

#include <algorithm>
#include <cmath>
#include <sstream>

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

struct Row {
  std::string text;
  double height_px, above_px;  // of a capital; from the row before
  detail::Weight weight;
};

// At spaces, as soon as a word more would be wider.
std::vector<std::string> broken(const std::string& line, const Row& look, double room_px) {
  std::vector<std::string> rows;
  std::istringstream words(line);
  for (std::string word; words >> word;) {
    const std::string longer = rows.empty() ? word : rows.back() + " " + word;
    if (!rows.empty() && detail::text_width(longer, look.height_px, look.weight) <= room_px)
      rows.back() = longer;
    else
      rows.push_back(word);
  }
  return rows;
}

// In as few rows as fit, of much the same width.
std::vector<std::string> evenly_broken(const std::string& line, const Row& look, double room_px) {
  if (detail::text_width(line, look.height_px, look.weight) <= room_px) return {line};
  std::vector<std::string> rows = broken(line, look, room_px);
  for (double narrower = 0.98 * room_px; narrower > 0.4 * room_px; narrower -= 0.02 * room_px) {
    std::vector<std::string> closer = broken(line, look, narrower);
    if (closer.size() > rows.size()) break;
    rows = std::move(closer);
  }
  return rows;
}

// A long line becomes rows; a word that is wider than the room, and rows that are more than it is high, are
// written smaller.
void write_in_the_middle(Image8& image, const std::vector<std::string>& lines, bool on_dark) {
  using detail::text_width, detail::Weight;
  const double room = 0.84 * image.width, first = image.height / 18.0, other = image.height / 34.0;
  std::vector<Row> rows;
  double total = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    Row row{"", i == 0 ? first : other,
            (i == 0   ? 0
             : i == 1 ? 1.5
                      : 1.1) *
                other,
            i == 0 ? Weight::semibold : Weight::regular};
    for (std::string& text : evenly_broken(lines[i], row, room)) {
      row.text = std::move(text);
      const double width = text_width(row.text, row.height_px, row.weight);
      rows.push_back(row);
      rows.back().height_px *= std::min(1.0, room / std::max(1.0, width));
      total += rows.back().height_px + row.above_px;
      row.above_px = 0.7 * row.height_px;
    }
  }
  const double shrink = std::min(1.0, 0.84 * image.height / total);
  double baseline = 0.5 * (image.height - shrink * total);
  for (const Row& row : rows) {
    const double height = shrink * row.height_px;
    baseline += height + shrink * row.above_px;
    detail::draw_text(image, row.text, 0.5 * (image.width - text_width(row.text, height, row.weight)),
                      baseline,
                      {.height_px = height,
                       .color_srgb = on_dark ? Vec3(0.97, 0.97, 0.96) : Vec3(0.16, 0.17, 0.20),
                       .weight = row.weight});
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
