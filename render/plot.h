// Line plots as SVG text or pixels: the paper's volume change over time, a line a body.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/types.h"
#include "render/image.h"

namespace limber::render {

struct Curve {
  std::string name;  // for the legend, UTF-8
  Vec3 color_srgb;
  std::vector<double> x, y;  // of one length; a y that is not finite leaves a gap
};
struct PlotLook {
  std::string title = {}, x_label = {}, y_label = {};
  int width_px = 900, height_px = 480;
  std::vector<double> limits = {};  // dashed lines at these y, as −10 and 10 per cent; they widen the y axis
                                    // only when near the data
  bool log_x = false;                                       // x by its logarithm; all x > 0
  std::optional<std::pair<double, double>> y_from_to = {};  // the y axis shows these at least
};
// A whole SVG document; valid XML, no external fonts or styles. Same input, same bytes. Its data-left and
// data-right are the pixels where x is data-low and data-high.
std::string plot_svg(const std::vector<Curve>&, const PlotLook&);

// The same as pixels, in the letters of annotate.h, the y axis' words above it.
Image8 plot_image(const std::vector<Curve>&, const PlotLook&);

// Round numbers (1, 2 or 5 times a power of ten apart), about `count` of them, that cover low … high from
// outside.
std::vector<double> round_ticks(double low, double high, int count);

}  // namespace limber::render
