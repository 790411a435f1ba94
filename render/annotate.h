// Words on pictures: a caption with a legend below a picture, captions, bars of colours and of length on it,
// and a histogram. UTF-8; letters of Latin, Greek and Cyrillic alphabets (`letters_missing`).
#pragma once

#include <array>
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

// The letters of a text that there is no picture of, each once.
std::string letters_missing(const std::string& text);

// Words on the picture itself, in a corner: a line, and a smaller one below it; either may be empty. Letters
// shrink until they fit. Pale on dark ground, with a rim of the ground's value.
enum class Corner { bottom_left, top_left, bottom_right, top_right };
inline constexpr std::array corners{Corner::bottom_left, Corner::top_left, Corner::bottom_right,
                                    Corner::top_right};
struct CaptionLook {
  Corner corner = Corner::bottom_left;
  bool on_dark = false;
};
void draw_caption(Image8&, const std::string& line, const std::string& small_line, const CaptionLook& = {});
// What that takes up of a picture of this size, pixels: left, top, right, bottom.
Eigen::Vector4d place_of_caption(int width, int height, const std::string& line,
                                 const std::string& small_line, Corner);

// A name beside what it names, and a line from it to there; `share` 0 … 1 is how much of both is seen.
struct LabelPlace;
void draw_label(Image8&, const std::string& words, const LabelPlace&, const Eigen::Vector2d& end,
                double letter_px, bool on_dark, double share = 1);
double width_of_words(const std::string&, double letter_px);  // of labels

// How long a length is on the picture: a bar of `length_px` and words over it, in a lower corner.
void draw_scale_bar(Image8&, const std::string& words, double length_px, const CaptionLook&);

// What a colour means, at the picture's right edge: `color_srgb` of 0 at the lower end, of 1 at the upper.
struct ColorBar {
  std::string label;
  double low = 0, high = 1;
  std::function<Vec3(double)> color_srgb;
  bool on_dark = false;  // the picture, so that words are light
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
