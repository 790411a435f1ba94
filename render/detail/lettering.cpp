#include "render/detail/lettering.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace limber::render::detail {

namespace {

// Each letter: strokes parted by ',', points parted by ' ', a point is x (0 … 4) and y (0 … 8). Baseline 2,
// lower case up to 6, capitals up to 8, tails down to 0. From ' ' to '~'.
constexpr const char* alphabet[] = {
    "",                                                 // space
    "28 24,22 22",                                      // !
    "18 16,38 36",                                      // "
    "17 13,37 33,06 46,04 44",                          // #
    "47 18 07 06 44 43 32 03,29 21",                    // $
    "02 48,08 18 17 07 08,32 42 43 33 32",              // %
    "42 06 07 18 28 37 36 03 12 22 44",                 // &
    "28 26",                                            // '
    "38 26 24 32",                                      // (
    "18 26 24 12",                                      // )
    "27 23,06 44,04 46",                                // *
    "26 22,04 44",                                      // +
    "22 11",                                            // ,
    "04 44",                                            // -
    "22 22",                                            // .
    "02 48",                                            // /
    "12 03 07 18 38 47 43 32 12",                       // 0
    "06 28 22,02 42",                                   // 1
    "07 18 38 47 46 02 42",                             // 2
    "07 18 38 47 46 35 15,35 44 43 32 12 03",           // 3
    "32 38 04 44",                                      // 4
    "48 08 05 35 44 43 32 12 03",                       // 5
    "47 38 18 07 03 12 32 43 44 35 15 04",              // 6
    "08 48 12",                                         // 7
    "15 06 07 18 38 47 46 35 15 04 03 12 32 43 44 35",  // 8
    "03 12 32 43 47 38 18 07 06 15 35 46",              // 9
    "25 25,22 22",                                      // :
    "25 25,22 11",                                      // ;
    "46 04 42",                                         // <
    "05 45,03 43",                                      // =
    "06 44 02",                                         // >
    "07 18 38 47 46 25 24,22 22",                       // ?
    "33 36 16 13 43 47 38 18 07 03 12 42",              // @
    "02 28 42,14 34",                                   // A
    "02 08 38 47 46 35 05,35 44 43 32 02",              // B
    "47 38 18 07 03 12 32 43",                          // C
    "02 08 28 46 44 22 02",                             // D
    "48 08 02 42,05 35",                                // E
    "48 08 02,05 35",                                   // F
    "47 38 18 07 03 12 32 43 45 25",                    // G
    "08 02,48 42,05 45",                                // H
    "18 38,12 32,28 22",                                // I
    "48 43 32 12 03",                                   // J
    "08 02,48 05 42",                                   // K
    "08 02 42",                                         // L
    "02 08 25 48 42",                                   // M
    "02 08 42 48",                                      // N
    "22 03 07 28 47 43 22",                             // O
    "02 08 38 47 46 35 05",                             // P
    "12 03 07 18 38 47 43 32 12,24 41",                 // Q
    "02 08 38 47 46 35 05,25 42",                       // R
    "47 38 18 07 06 15 35 44 43 32 12 03",              // S
    "08 48,28 22",                                      // T
    "08 03 12 32 43 48",                                // U
    "08 22 48",                                         // V
    "08 12 26 32 48",                                   // W
    "02 48,08 42",                                      // X
    "08 25 48,25 22",                                   // Y
    "08 48 02 42",                                      // Z
    "38 28 22 32",                                      // [
    "08 42",                                            // backslash
    "18 28 22 12",                                      // ]
    "06 28 46",                                         // ^
    "01 41",                                            // _
    "18 26",                                            // `
    "05 16 36 45 42,44 14 03 12 32 43",                 // a
    "08 02,04 16 36 45 43 32 12 04",                    // b
    "45 36 16 05 03 12 32 43",                          // c
    "48 42,44 36 16 05 03 12 32 44",                    // d
    "04 44 45 36 16 05 03 12 32",                       // e
    "48 38 27 22,16 46",                                // f
    "46 41 30 10 01,44 36 16 05 03 12 32 44",           // g
    "08 02,04 16 36 45 42",                             // h
    "26 22,28 28",                                      // i
    "26 21 10,28 28",                                   // j
    "08 02,46 04 42",                                   // k
    "18 28 22",                                         // l
    "06 02,05 16 25 22,25 36 45 42",                    // m
    "06 02,04 16 36 45 42",                             // n
    "16 05 03 12 32 43 45 36 16",                       // o
    "06 00,04 16 36 45 43 32 12 04",                    // p
    "46 40,44 36 16 05 03 12 32 44",                    // q
    "06 02,04 16 36 45",                                // r
    "45 36 16 05 14 34 43 32 12 03",                    // s
    "28 23 32 42,16 46",                                // t
    "06 03 12 32 44,46 42",                             // u
    "06 22 46",                                         // v
    "06 12 25 32 46",                                   // w
    "06 42,02 46",                                      // x
    "06 23,46 10",                                      // y
    "06 46 02 42",                                      // z
    "38 27 26 15 24 23 32",                             // {
    "28 20",                                            // |
    "18 27 26 35 24 23 12",                             // }
    "04 15 34 45",                                      // ~
};
constexpr const char* unknown = "02 08 48 42 02";
constexpr double advance = 6, cap_height = 6, baseline = 2, stroke_width = 0.85;

struct Stroke {
  Eigen::Vector2d from, to;  // pixels
};

double distance(const Eigen::Vector2d& p, const Stroke& s) {
  const Eigen::Vector2d d = s.to - s.from;
  const double t = d.squaredNorm() > 0 ? std::clamp((p - s.from).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
  return (p - s.from - t * d).norm();
}

}  // namespace

void draw_text(Image8& image, std::string_view text, double left_px, double baseline_px, double height_px,
               const Vec3& color_srgb) {
  const double unit = height_px / cap_height, half = std::max(0.5, 0.5 * stroke_width * unit);
  std::vector<Stroke> strokes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool known = text[i] >= ' ' && text[i] <= '~';
    const std::string_view letter = known ? alphabet[text[i] - ' '] : unknown;
    const double x0 = left_px + (double(i) * advance + 0.5) * unit;
    strokes.clear();
    for (std::size_t k = 0; k + 4 < letter.size(); k += 3) {
      if (letter[k + 2] == ',') continue;
      const auto point = [&](std::size_t at) {
        return Eigen::Vector2d(x0 + (letter[at] - '0') * unit,
                               baseline_px - (letter[at + 1] - '0' - baseline) * unit);
      };
      strokes.push_back({point(k), point(k + 3)});
    }
    const int left = std::max(0, int(x0 - unit)), right = std::min(image.width, int(x0 + 5 * unit) + 1);
    const int top = std::max(0, int(baseline_px - 8 * unit)),
              bottom = std::min(image.height, int(baseline_px + 3 * unit) + 1);
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) {
        double cover = 0;
        for (const Stroke& s : strokes)
          cover = std::max(cover, std::clamp(half + 0.5 - distance({x + 0.5, y + 0.5}, s), 0.0, 1.0));
        std::uint8_t* p = &image.rgb[3 * (std::size_t(y) * image.width + x)];
        for (int c = 0; c < 3; ++c)
          p[c] = std::uint8_t(std::lround(p[c] + cover * (255 * color_srgb[c] - p[c])));
      }
  }
}

}  // namespace limber::render::detail
