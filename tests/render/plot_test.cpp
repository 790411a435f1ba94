#include "render/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <regex>

#include "core/random.h"

namespace limber::render {
namespace {

TEST(Plot, TicksAreRoundAndCoverTheRange) {
  Rng rng(41, 0);
  for (int trial = 0; trial < 500; ++trial) {
    const double size = std::exp(rng.uniform(-20, 20)), low = rng.uniform(-3, 3) * size,
                 high = low + size * rng.uniform(0.01, 4);
    const std::vector<double> ticks = round_ticks(low, high, 6);
    ASSERT_GE(ticks.size(), 2u);
    ASSERT_LE(ticks.size(), 9u);
    const double step = ticks[1] - ticks[0];
    EXPECT_LE(ticks.front(), low + 1e-6 * step);
    EXPECT_GE(ticks.back(), high - 1e-6 * step);
    EXPECT_GT(ticks.front(), low - 1.000001 * step);
    const double mantissa = step / std::pow(10.0, std::floor(std::log10(step) + 1e-9));
    EXPECT_TRUE(std::abs(mantissa - 1) < 1e-6 || std::abs(mantissa - 2) < 1e-6 ||
                std::abs(mantissa - 5) < 1e-6)
        << step;
  }
  EXPECT_GE(round_ticks(3, 3, 6).size(), 2u);
  EXPECT_GE(round_ticks(0, 0, 6).size(), 2u);
}

// The path of a straight line is straight, starts and ends at its ticks' places, and rises up the page.
TEST(Plot, PointsLieWhereTheAxesSay) {
  const std::string svg =
      plot_svg({{"line", {1, 0, 0}, {0, 5, 10}, {-10, 0, 10}}}, {"", "time (s)", "volume change (%)"});
  std::smatch m;
  ASSERT_TRUE(std::regex_search(
      svg, m, std::regex("<path d=\"M([0-9.]+) ([0-9.]+)L([0-9.]+) ([0-9.]+)L([0-9.]+) ([0-9.]+)\"")));
  const auto number = [&](std::size_t i) { return std::stod(m[i]); };
  EXPECT_NEAR(number(1) + number(5), 2 * number(3), 0.03);
  EXPECT_NEAR(number(2) + number(6), 2 * number(4), 0.03);
  EXPECT_LT(number(1), number(5));
  EXPECT_GT(number(2), number(6));
  EXPECT_NE(svg.find("stroke=\"#ff0000\""), svg.npos);
  EXPECT_NE(svg.find(">−10<"), svg.npos);
  const auto data = [&](const char* name) {
    return std::stod(svg.substr(svg.find("data-" + std::string(name) + "=\"") + 7 + std::strlen(name)));
  };
  EXPECT_NEAR(
      number(3),
      data("left") + (5 - data("low")) / (data("high") - data("low")) * (data("right") - data("left")), 0.01);
}

// By its logarithm x is as far from 2 x everywhere, also where that is a line at the ends of all.
TEST(Plot, EqualRatiosAreEquallyFarApart) {
  Rng rng(43, 0);
  for (int trial = 0; trial < 200; ++trial) {
    const double x = std::exp(rng.uniform(-9, 9)), times = std::exp(rng.uniform(0.01, 4));
    const std::string svg = plot_svg({{"line", {1, 0, 0}, {x, x * times, x * times * times}, {0, 1, 2}}},
                                     {.x_label = "x", .y_label = "y", .log_x = true});
    std::smatch m;
    ASSERT_TRUE(std::regex_search(
        svg, m, std::regex("<path d=\"M([0-9.]+) [0-9.]+L([0-9.]+) [0-9.]+L([0-9.]+) [0-9.]+\"")));
    const auto number = [&](std::size_t i) { return std::stod(m[i]); };
    const auto data = [&](const char* name) {
      return std::stod(svg.substr(svg.find("data-" + std::string(name) + "=\"") + 7 + std::strlen(name)));
    };
    EXPECT_NEAR(number(2) - number(1), number(3) - number(2), 0.03) << x << " " << times;
    EXPECT_LE(data("low"), x);
    EXPECT_GE(data("high"), x * times * times);
    EXPECT_NEAR((number(2) - number(1)) / (data("right") - data("left")),
                std::log(times) / std::log(data("high") / data("low")), 1e-4);
  }
}

// The same curve, as pixels: each of its points is of its colour, where the SVG has it, and the rest of the
// page has none of it.
TEST(Plot, PixelsLieWhereTheSvgHasTheCurve) {
  const PlotLook look{"title", "time (s)", "volume change (%)", 900, 480, {-10, 10}};
  const std::vector<Curve> curves{{"a", {1, 0, 0}, {0, 2, 5, 10}, {-3, 8, 1, 9}}};
  const std::string svg = plot_svg(curves, look);
  const Image8 image = plot_image(curves, look);
  ASSERT_EQ(image.width, look.width_px);
  ASSERT_EQ(image.height, look.height_px);
  const auto is_red = [&](int x, int y) {
    const std::uint8_t* p = &image.rgb[3 * (std::size_t(y) * 900 + std::size_t(x))];
    return p[0] > 250 && p[1] < 10 && p[2] < 10;
  };
  const std::regex point("[ML]([0-9.]+) ([0-9.]+)");
  const std::string path = svg.substr(svg.find("<path d="), svg.find("fill=\"none\"") - svg.find("<path d="));
  int points = 0;
  double low_x = 1e9, high_x = 0;
  for (std::sregex_iterator m(path.begin(), path.end(), point), end; m != end; ++m, ++points) {
    const double x = std::stod((*m)[1]), y = std::stod((*m)[2]);
    low_x = std::min(low_x, x), high_x = std::max(high_x, x);
    bool red = false;  // a curve is two pixels wide and ends in the middle of its last
    for (int i = -2; i <= 2; ++i)
      for (int j = -2; j <= 2; ++j) red = red || is_red(int(x) + i, int(y) + j);
    EXPECT_TRUE(red) << x << " " << y;
  }
  EXPECT_EQ(points, 4);
  for (int y = 0; y < 480 - 60; ++y)  // below is the legend
    for (int x = 0; x < 900; ++x)
      ASSERT_FALSE((x < low_x - 3 || x > high_x + 3) && is_red(x, y)) << x << " " << y;
}

TEST(Plot, NamesAreEscapedAndTagsAreBalanced) {
  const std::string svg = plot_svg({{"a<b & \"c\"\x01", {0, 0, 1}, {0, 1, 2, 3}, {1, NAN, 2, 3}}},
                                   {"t & t", "<x>", "y", 600, 300, {-10, 2.5}});
  EXPECT_NE(svg.find("a&lt;b &amp; &quot;c&quot;<"), svg.npos);
  int open = 0, close = 0;
  for (std::size_t i = 0; i + 1 < svg.size(); ++i) {
    if (svg[i] == '<' && svg[i + 1] != '/' && svg[i + 1] != '?') ++open;
    if ((svg[i] == '<' && svg[i + 1] == '/') || (svg[i] == '/' && svg[i + 1] == '>')) ++close;
  }
  EXPECT_EQ(open, close);
  EXPECT_EQ(std::count(svg.begin(), svg.end(), '<'), std::count(svg.begin(), svg.end(), '>'));
  EXPECT_EQ(svg.find("nan"), svg.npos);
  const std::size_t path = svg.find("<path d=\"");
  EXPECT_EQ(std::count(svg.begin() + long(path), svg.begin() + long(svg.find('/', path)), 'M'),
            2);  // the gap
}

// As of thirty organs: all names are in the picture, which else keeps its size.
TEST(Plot, ALegendOfManyNamesHasRoom) {
  const PlotLook look{"title", "time (s)", "strain", 900, 480, {}};
  std::vector<Curve> curves;
  for (int i = 0; i < 31; ++i) curves.push_back({"lung_lower_lobe_left", {1, 0, 0}, {0, 1}, {0, double(i)}});
  const std::string svg = plot_svg(curves, look);
  const std::regex height("<svg [^>]*height=\"([0-9]+)\""), rect("<rect x=\"[0-9.]+\" y=\"([0-9.]+)\"");
  std::smatch all;
  ASSERT_TRUE(std::regex_search(svg, all, height));
  int names = 0;
  for (std::sregex_iterator m(svg.begin(), svg.end(), rect), end; m != end; ++m, ++names)
    EXPECT_LT(std::stod((*m)[1]) + 10, std::stod(all[1]));
  EXPECT_EQ(names, 31);
  const Image8 image = plot_image(curves, look);
  EXPECT_GT(image.height, 480 + 18);
  bool red = false;  // in the last row
  for (int x = 0; x < 900; ++x) {
    const std::uint8_t* p = &image.rgb[3 * (std::size_t(image.height - 14) * 900 + std::size_t(x))];
    red = red || (p[0] > 250 && p[1] < 10 && p[2] < 10);
  }
  EXPECT_TRUE(red);
  curves.resize(1);
  EXPECT_EQ(plot_image(curves, look).height, 480);
}

TEST(Plot, NothingToShowIsStillAPlot) {
  EXPECT_NE(plot_svg({}, {}).find("</svg>"), std::string::npos);
  EXPECT_NE(plot_svg({{"flat", {0, 0, 0}, {0, 1}, {0, 0}}}, {}).find("<path"), std::string::npos);
}

}  // namespace
}  // namespace limber::render
