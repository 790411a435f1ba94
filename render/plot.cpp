#include "render/plot.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "render/detail/lettering.h"

namespace limber::render {

namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20) out += c;  // XML has no way to write control characters
    }
  return out;
}

std::string hex_color(const Vec3& srgb) {
  const auto level = [&](int c) { return int(std::lround(255 * std::clamp(srgb[c], 0.0, 1.0))); };
  return fmt::format("#{:02x}{:02x}{:02x}", level(0), level(1), level(2));
}

// Enough digits to tell ticks apart that are `step` away from each other.
std::string tick_label(double value, double step) {
  const int digits = std::clamp(int(std::ceil(-std::log10(step) - 1e-9)), 0, 12);
  std::string text = fmt::format("{:.{}f}", std::abs(value) < 1e-9 * step ? 0.0 : value, digits);
  if (text[0] == '-') text.replace(0, 1, "−");
  return text;
}

struct Range {
  double low = 1e300, high = -1e300;
  void include(double v) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  bool empty() const { return low > high; }
};

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  LIMBER_CHECK(std::isfinite(low) && std::isfinite(high) && low <= high && count >= 2, low, high, count);
  if (!(high - low > 1e-12 * std::max(std::abs(low), std::abs(high)))) {  // one value: room on both sides
    const double room = low == 0 ? 1 : 0.1 * std::abs(low);
    low -= room, high += room;
  }
  const double raw = (high - low) / count, power = std::pow(10.0, std::floor(std::log10(raw)));
  const double step = power * (raw <= power ? 1 : raw <= 2 * power ? 2 : raw <= 5 * power ? 5 : 10);
  std::vector<double> ticks;
  const double first = std::floor(low / step + 1e-9), last = std::ceil(high / step - 1e-9);
  for (double k = first; k <= last; ++k) ticks.push_back(k * step);
  return ticks;
}

namespace {

// Powers of ten, and with few of them 2 and 5 times these, that cover low … high from outside.
std::vector<double> log_ticks(double low, double high) {
  LIMBER_CHECK(0 < low && low <= high && std::isfinite(high), low, high);
  const double first = std::floor(std::log10(low)), last = std::floor(std::log10(high)) + 1;
  const bool few = last - first <= 3;
  std::vector<double> ticks;
  for (double k = first; k <= last; ++k)
    for (const double times : {1, 2, 5}) {
      if (times != 1 && !few) continue;
      const double tick = times * std::pow(10.0, k);
      if (tick <= low) ticks.clear();
      ticks.push_back(tick);
      if (tick >= high && ticks.size() > 1) return ticks;
    }
  return ticks;
}

// Where things lie in a plot, in pixels.
struct Layout {
  std::vector<double> x_ticks, y_ticks;
  double left, right, top, bottom;
  bool log_x;
  double y_step() const { return y_ticks[1] - y_ticks[0]; }
  std::string x_label(double tick) const {
    return log_x ? fmt::format("{:g}", tick) : tick_label(tick, x_ticks[1] - x_ticks[0]);
  }
  double px(double v) const {
    const auto along = [&](double x) { return log_x ? std::log10(x) : x; };
    const double low = along(x_ticks.front()), high = along(x_ticks.back());
    return left + (along(v) - low) / (high - low) * (right - left);
  }
  double py(double v) const {
    return bottom - (v - y_ticks.front()) / (y_ticks.back() - y_ticks.front()) * (bottom - top);
  }
  bool is_zero(double y_tick) const { return std::abs(y_tick) < 1e-9 * y_step(); }
  bool shows(double limit) const { return y_ticks.front() <= limit && limit <= y_ticks.back(); }
};

Layout layout_of(const std::vector<Curve>& curves, const PlotLook& look) {
  Range x, y;
  for (const Curve& curve : curves) {
    LIMBER_CHECK(curve.x.size() == curve.y.size(), curve.name, curve.x.size(), curve.y.size());
    for (const double v : curve.x) x.include(v);
    for (const double v : curve.y) y.include(v);
  }
  if (look.y_from_to) y.include(look.y_from_to->first), y.include(look.y_from_to->second);
  if (x.empty()) x = {0, 1};
  if (y.empty()) y = {0, 1};
  const double near = 0.6 * std::max(y.high - y.low, 1e-300);
  const Range data = y;
  for (const double limit : look.limits)
    if (limit > data.low - near && limit < data.high + near) y.include(limit);
  return {.x_ticks = look.log_x ? log_ticks(x.low, x.high) : round_ticks(x.low, x.high, 8),
          .y_ticks = round_ticks(y.low, y.high, 6),
          .left = 74,
          .right = look.width_px - 24.0,
          .top = look.title.empty() ? 24.0 : 50.0,
          .bottom = look.height_px - 92.0,
          .log_x = look.log_x};
}

// Soft-edged, over what is there.
void draw_line(Image8& image, double x1, double y1, double x2, double y2, double width_px,
               const Vec3& color) {
  const double reach = 0.5 * width_px + 1, dx = x2 - x1, dy = y2 - y1, length2 = dx * dx + dy * dy;
  const auto first = [](double v) { return std::max(0, int(std::floor(v))); };
  const int right = std::min(image.width - 1, int(std::max(x1, x2) + reach)),
            bottom = std::min(image.height - 1, int(std::max(y1, y2) + reach));
  for (int y = first(std::min(y1, y2) - reach); y <= bottom; ++y)
    for (int x = first(std::min(x1, x2) - reach); x <= right; ++x) {
      const double u = x + 0.5 - x1, v = y + 0.5 - y1;
      const double t = length2 > 0 ? std::clamp((u * dx + v * dy) / length2, 0.0, 1.0) : 0;
      const double distance = std::hypot(u - t * dx, v - t * dy);
      const double share = std::clamp(0.5 * width_px + 0.5 - distance, 0.0, 1.0);
      std::uint8_t* pixel = &image.rgb[3 * (std::size_t(y) * std::size_t(image.width) + std::size_t(x))];
      for (int c = 0; c < 3; ++c)
        pixel[c] =
            std::uint8_t(std::lround(pixel[c] + share * (255 * std::clamp(color[c], 0.0, 1.0) - pixel[c])));
    }
}

// Names below the plot, one after the other; where a row is full the next begins. The picture has room for
// two rows, and grows by those that are more.
constexpr double legend_row_px = 18;
struct LegendPlace {
  double x, y;
};
std::vector<LegendPlace> legend_places(const std::vector<double>& widths, const Layout& at,
                                       const PlotLook& look) {
  std::vector<LegendPlace> places;
  double x = at.left, y = look.height_px - 28.0;
  for (const double width : widths) {
    if (x + width > at.right && x > at.left) x = at.left, y += legend_row_px;
    places.push_back({x, y});
    x += width;
  }
  return places;
}
int height_with(const std::vector<LegendPlace>& legend, const PlotLook& look) {
  const double second_row = look.height_px - 28.0 + legend_row_px;
  return look.height_px + (legend.empty() ? 0 : int(std::max(0.0, legend.back().y - second_row)));
}

}  // namespace

std::string plot_svg(const std::vector<Curve>& curves, const PlotLook& look) {
  const Layout at = layout_of(curves, look);
  const double left = at.left, right = at.right, top = at.top, bottom = at.bottom;
  std::vector<double> widths;  // of letters they are estimated
  for (const Curve& curve : curves) widths.push_back(44 + 7.5 * double(curve.name.size()));
  const std::vector<LegendPlace> legend = legend_places(widths, at, look);

  std::string svg = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "data-left=\"{2}\" data-right=\"{3}\" data-low=\"{4}\" data-high=\"{5}\" font-family=\"sans-serif\" "
      "font-size=\"13\" fill=\"#333\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
      look.width_px, height_with(legend, look), left, right, at.x_ticks.front(), at.x_ticks.back());
  const auto text = [&](double at_x, double at_y, const char* anchor, const std::string& more,
                        const std::string& words) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", at_x, at_y, anchor,
                       more, escaped(words));
  };
  const auto line = [&](double x1, double y1, double x2, double y2, const char* style) {
    svg += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1, x2, y2,
                       style);
  };

  if (!look.title.empty()) text(left, 30, "start", " font-size=\"17\" font-weight=\"bold\"", look.title);
  for (const double tick : at.y_ticks) {
    line(left, at.py(tick), right, at.py(tick), at.is_zero(tick) ? "stroke=\"#999\"" : "stroke=\"#e4e6e8\"");
    text(left - 8, at.py(tick) + 4.5, "end", "", tick_label(tick, at.y_step()));
  }
  for (const double tick : at.x_ticks) {
    line(at.px(tick), bottom, at.px(tick), bottom + 5, "stroke=\"#999\"");
    text(at.px(tick), bottom + 20, "middle", "", at.x_label(tick));
  }
  line(left, bottom, right, bottom, "stroke=\"#999\"");
  line(left, top, left, bottom, "stroke=\"#999\"");
  text(0.5 * (left + right), bottom + 42, "middle", "", look.x_label);
  text(0, 0, "middle", fmt::format(" transform=\"translate(20 {:.1f}) rotate(-90)\"", 0.5 * (top + bottom)),
       look.y_label);
  for (const double limit : look.limits)
    if (at.shows(limit))
      line(left, at.py(limit), right, at.py(limit), "stroke=\"#b55\" stroke-dasharray=\"6 5\"");

  for (const Curve& curve : curves) {
    std::string path;
    bool pen_down = false;
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      const bool known = std::isfinite(curve.x[i]) && std::isfinite(curve.y[i]);
      if (known)
        path += fmt::format("{}{:.2f} {:.2f}", pen_down ? "L" : "M", at.px(curve.x[i]), at.py(curve.y[i]));
      pen_down = known;
    }
    if (!path.empty())
      svg += fmt::format(
          "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" stroke-linejoin=\"round\"/>\n", path,
          hex_color(curve.color_srgb));
  }

  for (std::size_t c = 0; c < curves.size(); ++c) {
    const auto [x, y] = legend[c];
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"20\" height=\"4\" fill=\"{}\"/>\n", x,
                       y - 6.5, hex_color(curves[c].color_srgb));
    text(x + 27, y, "start", "", curves[c].name);
  }
  return svg + "</svg>\n";
}

Image8 plot_image(const std::vector<Curve>& curves, const PlotLook& look) {
  const Layout at = layout_of(curves, look);
  const Vec3 ink = Vec3::Constant(0.2), axis = Vec3::Constant(0.6), grid = Vec3::Constant(0.9),
             red(0.7, 0.33, 0.33);
  constexpr double letter = 8;  // height of a capital
  std::vector<double> widths;
  for (const Curve& curve : curves) widths.push_back(44 + detail::text_width(curve.name, letter));
  const std::vector<LegendPlace> legend = legend_places(widths, at, look);
  Image8 image = filled(look.width_px, height_with(legend, look), Vec3::Ones());
  const auto text = [&](double x, double y, double share_left, const std::string& words, double size) {
    detail::draw_text(image, words, x - share_left * detail::text_width(words, size), y,
                      {.height_px = size, .color_srgb = ink});
  };
  text(at.left, 22, 0, look.title, 1.4 * letter);
  for (const double tick : at.y_ticks) {
    draw_line(image, at.left, at.py(tick), at.right, at.py(tick), 1, at.is_zero(tick) ? axis : grid);
    text(at.left - 8, at.py(tick) + 4, 1, tick_label(tick, at.y_step()), letter);
  }
  for (const double tick : at.x_ticks) {
    draw_line(image, at.px(tick), at.bottom, at.px(tick), at.bottom + 5, 1, axis);
    text(at.px(tick), at.bottom + 20, 0.5, at.x_label(tick), letter);
  }
  draw_line(image, at.left, at.bottom, at.right, at.bottom, 1, axis);
  draw_line(image, at.left, at.top, at.left, at.bottom, 1, axis);
  text(0.5 * (at.left + at.right), at.bottom + 42, 0.5, look.x_label, letter);
  text(4, at.top - 13, 0, look.y_label, letter);
  for (const double limit : look.limits)
    for (double x = at.left; at.shows(limit) && x < at.right; x += 11)
      draw_line(image, x, at.py(limit), std::min(x + 6, at.right), at.py(limit), 1, red);
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const Curve& curve = curves[c];
    for (std::size_t i = 1; i < curve.x.size(); ++i) {
      const double y1 = curve.y[i - 1], y2 = curve.y[i];
      if (std::isfinite(y1) && std::isfinite(y2))
        draw_line(image, at.px(curve.x[i - 1]), at.py(y1), at.px(curve.x[i]), at.py(y2), 2, curve.color_srgb);
    }
    const auto [x, y] = legend[c];
    draw_line(image, x, y - 4, x + 20, y - 4, 4, curve.color_srgb);
    text(x + 27, y, 0, curve.name, letter);
  }
  return image;
}

}  // namespace limber::render
