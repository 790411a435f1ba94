#include "render/plot.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

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

std::string plot_svg(const std::vector<Curve>& curves, const PlotLook& look) {
  Range x, y;
  for (const Curve& curve : curves) {
    LIMBER_CHECK(curve.x.size() == curve.y.size(), curve.name, curve.x.size(), curve.y.size());
    for (const double v : curve.x) x.include(v);
    for (const double v : curve.y) y.include(v);
  }
  if (x.empty()) x = {0, 1};
  if (y.empty()) y = {0, 1};
  const double near = 0.6 * std::max(y.high - y.low, 1e-300);
  const Range data = y;
  for (const double limit : look.limits)
    if (limit > data.low - near && limit < data.high + near) y.include(limit);

  const std::vector<double> x_ticks = round_ticks(x.low, x.high, 8), y_ticks = round_ticks(y.low, y.high, 6);
  const double left = 74, right = look.width_px - 24.0, top = look.title.empty() ? 24 : 50,
               bottom = look.height_px - 92.0;
  const auto px = [&](double v) {
    return left + (v - x_ticks.front()) / (x_ticks.back() - x_ticks.front()) * (right - left);
  };
  const auto py = [&](double v) {
    return bottom - (v - y_ticks.front()) / (y_ticks.back() - y_ticks.front()) * (bottom - top);
  };

  std::string svg = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"13\" fill=\"#333\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
      look.width_px, look.height_px);
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
  const double x_step = x_ticks[1] - x_ticks[0], y_step = y_ticks[1] - y_ticks[0];
  for (const double tick : y_ticks) {
    line(left, py(tick), right, py(tick),
         std::abs(tick) < 1e-9 * y_step ? "stroke=\"#999\"" : "stroke=\"#e4e6e8\"");
    text(left - 8, py(tick) + 4.5, "end", "", tick_label(tick, y_step));
  }
  for (const double tick : x_ticks) {
    line(px(tick), bottom, px(tick), bottom + 5, "stroke=\"#999\"");
    text(px(tick), bottom + 20, "middle", "", tick_label(tick, x_step));
  }
  line(left, bottom, right, bottom, "stroke=\"#999\"");
  line(left, top, left, bottom, "stroke=\"#999\"");
  text(0.5 * (left + right), bottom + 42, "middle", "", look.x_label);
  text(0, 0, "middle", fmt::format(" transform=\"translate(20 {:.1f}) rotate(-90)\"", 0.5 * (top + bottom)),
       look.y_label);
  for (const double limit : look.limits)
    if (y_ticks.front() <= limit && limit <= y_ticks.back())
      line(left, py(limit), right, py(limit), "stroke=\"#b55\" stroke-dasharray=\"6 5\"");

  for (const Curve& curve : curves) {
    std::string path;
    bool pen_down = false;
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      const bool known = std::isfinite(curve.x[i]) && std::isfinite(curve.y[i]);
      if (known) path += fmt::format("{}{:.2f} {:.2f}", pen_down ? "L" : "M", px(curve.x[i]), py(curve.y[i]));
      pen_down = known;
    }
    if (!path.empty())
      svg += fmt::format(
          "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" stroke-linejoin=\"round\"/>\n", path,
          hex_color(curve.color_srgb));
  }

  // The legend, below, breaks into a second row where the first is full. Widths of letters are estimated.
  double at_x = left, at_y = look.height_px - 28.0;
  for (const Curve& curve : curves) {
    const double width = 44 + 7.5 * double(curve.name.size());
    if (at_x + width > right && at_x > left) at_x = left, at_y += 18;
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"20\" height=\"4\" fill=\"{}\"/>\n", at_x,
                       at_y - 6.5, hex_color(curve.color_srgb));
    text(at_x + 27, at_y, "start", "", curve.name);
    at_x += width;
  }
  return svg + "</svg>\n";
}

}  // namespace limber::render
