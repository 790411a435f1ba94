#include "render/plot.h"

#include <gtest/gtest.h>

#include <cmath>
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

TEST(Plot, NothingToShowIsStillAPlot) {
  EXPECT_NE(plot_svg({}, {}).find("</svg>"), std::string::npos);
  EXPECT_NE(plot_svg({{"flat", {0, 0, 0}, {0, 1}, {0, 0}}}, {}).find("<path"), std::string::npos);
}

}  // namespace
}  // namespace limber::render
