// Words on pictures: a caption with a legend below a picture, and a histogram. Printable ASCII only.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "render/image.h"

namespace limber::render {

struct LegendKey {
  std::string text;
  Vec3 color_srgb;
};

// The picture with a white band below it: the lines, the first one larger, then the keys in a row. Letters
// shrink until the longest line fits the width.
Image8 with_caption(const Image8& picture, const std::vector<std::string>& lines,
                    const std::vector<LegendKey>& keys = {});

// Words on the picture itself, in its lower left corner: a line, and a smaller one below it; either may be
// empty. Letters shrink until they fit.
void draw_caption(Image8&, const std::string& line, const std::string& small_line);

// What a colour means, at the picture's right edge: `color_srgb` of 0 at the lower end, of 1 at the upper.
struct ColorBar {
  std::string label;
  double low = 0, high = 1;
  std::function<Vec3(double)> color_srgb;
};
void draw_color_bar(Image8&, const ColorBar&);

struct HistogramLook {
  std::string x_label, y_label;
  double low = 0, high = 1;    // values outside count in the first and the last bar
  std::vector<Vec3> bar_srgb;  // a colour for each bar, ≥ 1; bars are equally wide
  int width_px = 1600, height_px = 900;
};
// How many of the values fall into each bar: [low, low + w), …, the last with its upper end.
std::vector<int> histogram_counts(const std::vector<double>& values, double low, double high, int bars);
Image8 histogram(const std::vector<double>& values, const HistogramLook&);

}  // namespace limber::render
