#include "render/annotate.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "render/detail/lettering.h"
#include "render/plot.h"

namespace limber::render {

namespace {

const Vec3 white = Vec3::Ones(), ink = {0.2, 0.22, 0.25}, grid = {0.9, 0.905, 0.91};

void fill(Image8& image, double left, double top, double right, double bottom, const Vec3& color_srgb) {
  const Image8 dot = filled(1, 1, color_srgb);
  const auto within = [](double v, int size) { return int(std::clamp(std::lround(v), 0L, long(size))); };
  for (int y = within(top, image.height); y < within(bottom, image.height); ++y)
    for (int x = within(left, image.width); x < within(right, image.width); ++x)
      std::copy_n(dot.rgb.data(), 3, &image.rgb[3 * (std::size_t(y) * image.width + x)]);
}

// A letter is as wide as a capital is high.
double text_width(const std::string& text, double height_px) { return double(text.size()) * height_px; }

}  // namespace

Image8 with_caption(const Image8& picture, const std::vector<std::string>& lines,
                    const std::vector<LegendKey>& keys) {
  const double margin = picture.width / 50.0, room = picture.width - 2 * margin;
  double letter = picture.width / 90.0;  // height of a capital
  constexpr double first_line = 1.3, key_gap = 3;
  const auto widest = [&] {
    double width = 0, row = 0;
    for (std::size_t i = 0; i < lines.size(); ++i)
      width = std::max(width, text_width(lines[i], (i == 0 ? first_line : 1) * letter));
    for (const LegendKey& key : keys) row += text_width(key.text, letter) + key_gap * letter;
    return std::max(width, row);
  };
  if (const double width = widest(); width > room) letter *= room / width;

  const double step = 2.1 * letter;
  const int band = int(std::ceil(margin + step * double(lines.size() + !keys.empty()) + 0.5 * letter));
  Image8 image = filled(picture.width, picture.height + band, white);
  std::copy(picture.rgb.begin(), picture.rgb.end(), image.rgb.begin());
  double baseline = picture.height + margin + letter;
  for (std::size_t i = 0; i < lines.size(); ++i, baseline += step)
    detail::draw_text(image, lines[i], margin, baseline, (i == 0 ? first_line : 1) * letter, ink);
  double left = margin;
  for (const LegendKey& key : keys) {
    fill(image, left, baseline - 1.1 * letter, left + 1.3 * letter, baseline + 0.2 * letter, key.color_srgb);
    detail::draw_text(image, key.text, left + 1.8 * letter, baseline, letter, ink);
    left += text_width(key.text, letter) + key_gap * letter;
  }
  return image;
}

void draw_caption(Image8& image, const std::string& line, const std::string& small_line) {
  const double margin = image.width / 40.0, room = image.width - 2 * margin;
  const auto letter = [&](const std::string& text, double wanted) {
    return text.empty() ? 0 : std::min(wanted, room / double(text.size()));
  };
  const double large = letter(line, image.height / 40.0), small = letter(small_line, image.height / 60.0);
  const double baseline = image.height - margin;
  const auto write = [&](const std::string& text, double y, double height) {
    const double rim = 0.14 * height;  // pale, so that it reads on dark bodies too
    for (const auto& [dx, dy] : {std::pair(-1.0, 0.0),
                                 {1.0, 0.0},
                                 {0.0, -1.0},
                                 {0.0, 1.0},
                                 {-0.7, -0.7},
                                 {-0.7, 0.7},
                                 {0.7, -0.7},
                                 {0.7, 0.7}})
      detail::draw_text(image, text, margin + rim * dx, y + rim * dy, height, white);
    detail::draw_text(image, text, margin, y, height, ink);
  };
  write(small_line, baseline, small);
  write(line, baseline - 1.9 * small, large);
}

void draw_color_bar(Image8& image, const ColorBar& bar) {
  LIMBER_CHECK(bar.low < bar.high, bar.low, bar.high);
  const double letter = image.height / 72.0, margin = image.width / 40.0;
  const double top = 0.25 * image.height, bottom = 0.75 * image.height, wide = 1.6 * letter;
  std::vector<std::pair<double, std::string>> ticks;
  double room = 0;
  for (const double value : round_ticks(bar.low, bar.high, 5)) {
    const double slack = 1e-9 * (bar.high - bar.low);
    if (value < bar.low - slack || value > bar.high + slack) continue;
    ticks.emplace_back(value, fmt::format("{:.6g}", value));
    room = std::max(room, text_width(ticks.back().second, letter));
  }
  const double left = image.width - margin - room - 1.2 * letter - wide;
  for (double y = top; y < bottom; ++y)
    fill(image, left, y, left + wide, y + 1, bar.color_srgb((bottom - y - 0.5) / (bottom - top)));
  for (const auto& [value, label] : ticks) {
    const double y = bottom - (value - bar.low) / (bar.high - bar.low) * (bottom - top);
    fill(image, left + wide, y - 0.06 * letter, left + wide + 0.5 * letter, y + 0.06 * letter + 1, ink);
    detail::draw_text(image, label, left + wide + 1.0 * letter, y + 0.5 * letter, letter, ink);
  }
  const double width = text_width(bar.label, letter);
  detail::draw_text(image, bar.label, image.width - margin - width, top - 1.6 * letter, letter, ink);
}

std::vector<int> histogram_counts(const std::vector<double>& values, double low, double high, int bars) {
  LIMBER_CHECK(low < high && bars > 0, low, high, bars);
  std::vector<int> counts(std::size_t(bars), 0);
  for (const double v : values)
    ++counts[std::size_t(std::clamp(std::floor((v - low) / (high - low) * bars), 0.0, bars - 1.0))];
  return counts;
}

Image8 histogram(const std::vector<double>& values, const HistogramLook& look) {
  const int bars = int(look.bar_srgb.size());
  const std::vector<int> counts = histogram_counts(values, look.low, look.high, bars);
  const double letter = look.width_px / 90.0;
  const double left = 8 * letter, right = look.width_px - 3 * letter;
  const double top = 5 * letter, bottom = look.height_px - 6 * letter;
  const std::vector<double> x_ticks = round_ticks(look.low, look.high, 9);
  const double highest = std::max(1, *std::max_element(counts.begin(), counts.end()));
  const auto px = [&](double x) { return left + (x - look.low) / (look.high - look.low) * (right - left); };
  const auto py = [&](double y) { return bottom - y / highest * (bottom - top); };

  Image8 image = filled(look.width_px, look.height_px, white);
  const double hair = std::max(1.0, look.width_px / 1000.0);
  for (const double y : round_ticks(0, highest, 5)) {
    if (y > highest) continue;
    fill(image, left, py(y) - hair, right, py(y), grid);
    const std::string label = fmt::format("{:g}", y);
    detail::draw_text(image, label, left - letter - text_width(label, letter), py(y) + 0.5 * letter, letter,
                      ink);
  }
  const double bar_width = (look.high - look.low) / bars;
  for (int b = 0; b < bars; ++b)
    fill(image, px(look.low + b * bar_width) + hair, py(counts[std::size_t(b)]),
         px(look.low + (b + 1) * bar_width) - hair, bottom, look.bar_srgb[std::size_t(b)]);
  fill(image, left, bottom, right, bottom + 2 * hair, ink);
  for (const double x : x_ticks) {
    if (x < look.low || x > look.high) continue;
    fill(image, px(x) - hair, bottom, px(x) + hair, bottom + 0.6 * letter, ink);
    const std::string label = fmt::format("{:g}", x);
    detail::draw_text(image, label, px(x) - 0.5 * text_width(label, letter), bottom + 2.3 * letter, letter,
                      ink);
  }
  detail::draw_text(image, look.y_label, left - 6 * letter, top - 2.5 * letter, letter, ink);
  detail::draw_text(image, look.x_label, 0.5 * (left + right - text_width(look.x_label, letter)),
                    bottom + 4.6 * letter, letter, ink);
  return image;
}

}  // namespace limber::render
