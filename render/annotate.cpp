#include "render/annotate.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "render/detail/lettering.h"
#include "render/label_places.h"
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

using detail::text_width, detail::Weight;

constexpr double readable_px = 9;  // of a capital

void write(Image8& image, const std::string& text, double left, double baseline, double height_px,
           Weight weight = Weight::regular) {
  detail::draw_text(image, text, left, baseline,
                    {.height_px = height_px, .color_srgb = ink, .weight = weight});
}

// A caption's two lines: heights of their capitals, and where they stand.
struct PlacedLines {
  double large_px = 0, small_px = 0, left = 0, baseline = 0, small_baseline = 0, width = 0;
};
PlacedLines lines_of(int width, int height, const std::string& line, const std::string& small_line,
                     Corner corner) {
  const double margin = width / 40.0, room = width - 2 * margin;
  const auto letter = [&](const std::string& text, double wanted, Weight weight) {
    return text.empty() ? 0 : wanted * std::min(1.0, room / std::max(1.0, text_width(text, wanted, weight)));
  };
  PlacedLines at;
  // On a small picture larger, as far as that leaves room for the picture.
  const double large = std::max(height / 42.0, std::min(readable_px, height / 26.0)),
               small = std::max(height / 60.0, std::min(0.8 * readable_px, height / 32.0));
  at.large_px = letter(line, large, Weight::semibold);
  at.small_px = letter(small_line, small, Weight::regular);
  at.width = std::max(text_width(line, std::max(1.0, at.large_px), Weight::semibold),
                      text_width(small_line, std::max(1.0, at.small_px)));
  const bool top = corner == Corner::top_left || corner == Corner::top_right;
  const double between = line.empty() || small_line.empty() ? 0 : 1.0 * at.small_px + 0.35 * at.large_px;
  if (top)
    at.baseline = margin + at.large_px, at.small_baseline = at.baseline + at.small_px + between;
  else
    at.small_baseline = height - margin, at.baseline = at.small_baseline - at.small_px - between;
  const bool right = corner == Corner::bottom_right || corner == Corner::top_right;
  at.left = right ? width - margin - at.width : margin;
  return at;
}

detail::TextLook on_picture(double height_px, Weight weight, bool on_dark) {
  return {.height_px = height_px,
          .color_srgb = on_dark ? white : ink,
          .weight = weight,
          .rim_px = 0.14 * height_px,
          .rim_srgb = on_dark ? ink : white};
}

}  // namespace

Image8 with_caption(const Image8& picture, const std::vector<std::string>& lines,
                    const std::vector<LegendKey>& keys) {
  const double margin = picture.width / 50.0, room = picture.width - 2 * margin;
  double letter = picture.width / 90.0;  // height of a capital
  constexpr double first_line = 1.3, key_gap = 3;
  const auto weight = [](std::size_t i) { return i == 0 ? Weight::semibold : Weight::regular; };
  const auto widest = [&] {
    double width = 0, row = 0;
    for (std::size_t i = 0; i < lines.size(); ++i)
      width = std::max(width, text_width(lines[i], (i == 0 ? first_line : 1) * letter, weight(i)));
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
    write(image, lines[i], margin, baseline, (i == 0 ? first_line : 1) * letter, weight(i));
  double left = margin;
  for (const LegendKey& key : keys) {
    fill(image, left, baseline - 1.1 * letter, left + 1.3 * letter, baseline + 0.2 * letter, key.color_srgb);
    write(image, key.text, left + 1.8 * letter, baseline, letter);
    left += text_width(key.text, letter) + key_gap * letter;
  }
  return image;
}

std::string letters_missing(const std::string& text) {
  std::string missing;
  for (std::size_t i = 0, length = 1; i < text.size(); i += length) {
    length = detail::letter_at(text, i).second;
    const std::string letter = text.substr(i, length);
    if (!detail::has_letter(detail::letter_at(text, i).first) && missing.find(letter) == std::string::npos)
      missing += letter;
  }
  return missing;
}

Eigen::Vector4d place_of_caption(int width, int height, const std::string& line,
                                 const std::string& small_line, Corner corner) {
  const PlacedLines at = lines_of(width, height, line, small_line, corner);
  const double top = line.empty() ? at.small_baseline - at.small_px : at.baseline - at.large_px,
               bottom = small_line.empty() ? at.baseline + 0.4 * at.large_px
                                           : at.small_baseline + 0.4 * at.small_px;
  return {at.left, top, at.left + at.width, bottom};
}

void draw_caption(Image8& image, const std::string& line, const std::string& small_line,
                  const CaptionLook& look) {
  const PlacedLines at = lines_of(image.width, image.height, line, small_line, look.corner);
  const bool right = look.corner == Corner::bottom_right || look.corner == Corner::top_right;
  const auto put = [&](const std::string& text, double baseline, double height_px, Weight weight) {
    if (text.empty()) return;
    const double left = right ? at.left + at.width - text_width(text, height_px, weight) : at.left;
    detail::draw_text(image, text, left, baseline, on_picture(height_px, weight, look.on_dark));
  };
  put(small_line, at.small_baseline, at.small_px, Weight::regular);
  put(line, at.baseline, at.large_px, Weight::semibold);
}

namespace {

void mix_in(Image8& image, int x, int y, const Vec3& color_srgb, double cover) {
  if (x < 0 || x >= image.width || y < 0 || y >= image.height || cover <= 0) return;
  std::uint8_t* p = &image.rgb[3 * (std::size_t(y) * image.width + std::size_t(x))];
  for (int c = 0; c < 3; ++c) p[c] = std::uint8_t(std::lround(p[c] + cover * (255 * color_srgb[c] - p[c])));
}

// With round ends; along the axis in which it is longer, a few pixels across at each.
void stroke(Image8& image, const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_px,
            const Vec3& color_srgb, double opacity) {
  const Eigen::Vector2d way = to - from;
  const int along = std::abs(way.x()) >= std::abs(way.y()) ? 0 : 1;
  const double radius = 0.5 * width_px, reach = radius + 1, length2 = std::max(way.squaredNorm(), 1e-12),
               slope = way[along] != 0 ? way[1 - along] / way[along] : 0;
  const int size = along == 0 ? image.width : image.height;
  const int first = int(std::max(0.0, std::floor(std::min(from[along], to[along]) - reach))),
            last = int(std::min(size - 1.0, std::ceil(std::max(from[along], to[along]) + reach)));
  for (int i = first; i <= last; ++i) {
    const double inside =
        std::clamp(i + 0.5, std::min(from[along], to[along]), std::max(from[along], to[along]));
    const double middle = from[1 - along] + slope * (inside - from[along]), half = 1.5 * reach;
    for (int k = int(std::floor(middle - half)); k <= int(std::ceil(middle + half)); ++k) {
      const Eigen::Vector2d p =
          along == 0 ? Eigen::Vector2d(i + 0.5, k + 0.5) : Eigen::Vector2d(k + 0.5, i + 0.5);
      const double share = std::clamp((p - from).dot(way) / length2, 0.0, 1.0);
      const double distance = (p - from - share * way).norm();
      mix_in(image, int(std::floor(p.x())), int(std::floor(p.y())), color_srgb,
             opacity * std::clamp(radius + 0.5 - distance, 0.0, 1.0));
    }
  }
}

constexpr Weight label_weight = Weight::semibold;

}  // namespace

double width_of_words(const std::string& words, double letter_px) {
  return text_width(words, letter_px, label_weight);
}

void draw_label(Image8& image, const std::string& words, const LabelPlace& place, const Eigen::Vector2d& end,
                double letter_px, bool on_dark, double share) {
  const Vec3 color = on_dark ? white : ink, rim = on_dark ? ink : white;
  const double line = std::max(1.0, 0.11 * letter_px), dot = 0.36 * letter_px,
               edge = std::max(1.0, 0.09 * letter_px);
  stroke(image, place.foot, end, line + 2 * edge, rim, 0.7 * share);
  stroke(image, end, end, dot + 2 * edge, rim, share);
  stroke(image, place.foot, end, line, color, share);
  stroke(image, end, end, dot, color, share);
  detail::TextLook look = on_picture(letter_px, label_weight, on_dark);
  look.opacity = share;
  detail::draw_text(image, words, place.left_px, place.baseline_px, look);
}

void draw_scale_bar(Image8& image, const std::string& words, double length_px, const CaptionLook& look) {
  const double margin = image.width / 40.0, letter = image.height / 60.0, thick = image.height / 360.0;
  const bool right = look.corner == Corner::bottom_right || look.corner == Corner::top_right;
  const double left = right ? image.width - margin - length_px : margin, bottom = image.height - margin;
  const Vec3 color = look.on_dark ? white : ink, rim = look.on_dark ? ink : white;
  const double edge = std::max(1.0, 0.5 * thick), foot = 3 * thick;
  const auto bar = [&](double wider, const Vec3& of) {
    fill(image, left - wider, bottom - thick - wider, left + length_px + wider, bottom + wider, of);
    for (const double x : {left, left + length_px - thick})
      fill(image, x - wider, bottom - foot - wider, x + thick + wider, bottom + wider, of);
  };
  bar(edge, rim);
  bar(0, color);
  detail::draw_text(image, words, left + 0.5 * (length_px - text_width(words, letter)),
                    bottom - foot - 0.6 * letter, on_picture(letter, Weight::regular, look.on_dark));
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
  const detail::TextLook words = on_picture(letter, Weight::regular, bar.on_dark);
  for (double y = top; y < bottom; ++y)
    fill(image, left, y, left + wide, y + 1, bar.color_srgb((bottom - y - 0.5) / (bottom - top)));
  for (const auto& [value, label] : ticks) {
    const double y = bottom - (value - bar.low) / (bar.high - bar.low) * (bottom - top);
    fill(image, left + wide, y - 0.06 * letter, left + wide + 0.5 * letter, y + 0.06 * letter + 1,
         bar.on_dark ? white : ink);
    detail::draw_text(image, label, left + wide + 1.0 * letter, y + 0.5 * letter, words);
  }
  const double width = text_width(bar.label, letter);
  detail::draw_text(image, bar.label, image.width - margin - width, top - 1.6 * letter, words);
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
    write(image, label, left - letter - text_width(label, letter), py(y) + 0.5 * letter, letter);
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
    write(image, label, px(x) - 0.5 * text_width(label, letter), bottom + 2.3 * letter, letter);
  }
  write(image, look.y_label, left - 6 * letter, top - 2.5 * letter, letter);
  write(image, look.x_label, 0.5 * (left + right - text_width(look.x_label, letter)), bottom + 4.6 * letter,
        letter);
  return image;
}

}  // namespace limber::render
