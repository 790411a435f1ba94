#include "render/outline.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace limber::render {

namespace {

constexpr double opacity = 0.8;
constexpr double speck = 0.014;  // of the picture's height, and
constexpr int min_speck_px = 6;
// Cosines of the turn between neighbours of two pixels' distance: no line, and a full one.
constexpr float smooth_turn = 0.80F, sharp_turn = 0.55F;

// Means over 2 reach + 1 pixels along rows, then columns.
std::vector<float> widened(const std::vector<float>& values, int width, int height, double reach) {
  const auto pass = [&](const std::vector<float>& from, bool across) {
    std::vector<float> to(from.size());
    const int whole = int(reach);
    const float part = float(reach - whole);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        float sum = 0;
        for (int k = -whole - 1; k <= whole + 1; ++k) {
          const int i = std::clamp((across ? x : y) + k, 0, (across ? width : height) - 1);
          sum += (std::abs(k) > whole ? part : 1) *
                 from[std::size_t(across ? y : i) * std::size_t(width) + std::size_t(across ? i : x)];
        }
        to[std::size_t(y) * std::size_t(width) + std::size_t(x)] = sum;
      }
    return to;
  };
  return pass(pass(values, true), false);
}

// Lines that hang together and reach less far than this are no edge of anything: in a crease that is finer
// than the pixels the normals of neighbors differ here and there.
void remove_specks(std::vector<float>& lines, int width, int height, int min_px) {
  std::vector<bool> known(lines.size(), false);
  std::vector<std::size_t> one;
  for (std::size_t first = 0; first < lines.size(); ++first) {
    if (known[first] || lines[first] == 0) continue;
    known[first] = true;
    one.assign(1, first);
    int left = width, top = height, right = -1, bottom = -1;
    for (std::size_t i = 0; i < one.size(); ++i) {
      const int x = int(one[i] % std::size_t(width)), y = int(one[i] / std::size_t(width));
      left = std::min(left, x), right = std::max(right, x), top = std::min(top, y),
      bottom = std::max(bottom, y);
      for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) {
          const std::size_t next = std::size_t(v) * std::size_t(width) + std::size_t(u);
          if (known[next] || lines[next] == 0) continue;
          known[next] = true;
          one.push_back(next);
        }
    }
    if (std::max(right - left, bottom - top) + 1 >= min_px) continue;
    for (const std::size_t i : one) lines[i] = 0;
  }
}

}  // namespace

std::vector<float> outlines_of(const Passes& passes, double step_m) {
  const int width = passes.width, height = passes.height;
  std::vector<float> lines(std::size_t(width) * std::size_t(height), 0);
  const auto at = [&](int x, int y) { return std::size_t(y) * std::size_t(width) + std::size_t(x); };
  // Between the pixels before and after one.
  const auto look = [&](std::size_t before, std::size_t here, std::size_t after) {
    if (passes.object[here] < 0) return;
    float& line = lines[here];
    for (const std::size_t other : {before, after})
      if (passes.object[other] != passes.object[here] && passes.depth_m[other] > passes.depth_m[here])
        line = 1;
    if (passes.object[before] != passes.object[here] || passes.object[after] != passes.object[here]) return;
    // On a plane 1 / depth is linear in the picture.
    const double z = double(passes.depth_m[here]);
    const double bend =
        z * z * (2 / z - 1 / double(passes.depth_m[before]) - 1 / double(passes.depth_m[after]));
    line = std::max(line, float(std::clamp(2 * bend / step_m - 1, 0.0, 1.0)));
    float turn = 0;
    for (std::size_t c = 0; c < 3; ++c) turn += passes.normal[3 * before + c] * passes.normal[3 * after + c];
    line = std::max(line, std::clamp((smooth_turn - turn) / (smooth_turn - sharp_turn), 0.0F, 1.0F));
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      look(at(std::max(0, x - 1), y), at(x, y), at(std::min(width - 1, x + 1), y));
      look(at(x, std::max(0, y - 1)), at(x, y), at(x, std::min(height - 1, y + 1)));
    }
  remove_specks(lines, width, height, std::max(min_speck_px, int(std::lround(speck * height))));
  return lines;
}

void draw_outlines(Image8& image, const Passes& passes, double step_m, double width_px,
                   const Vec3& ink_srgb) {
  LIMBER_CHECK(image.width == passes.width && image.height == passes.height, image.width, passes.width);
  // A soft edge of a pixel, whatever the width; what is to be thinner than a pixel is paler instead.
  const double ink_share = opacity * std::sqrt(std::min(1.0, width_px));
  const std::vector<float> lines =
      widened(outlines_of(passes, step_m), image.width, image.height, std::max(0.5, 0.5 * (width_px - 1)));
  const Image8 ink = filled(1, 1, ink_srgb);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double share = ink_share * std::min(1.0, 0.5 * double(lines[i]));
    for (std::size_t c = 0; c < 3 && share > 0; ++c) {
      std::uint8_t& level = image.rgb[3 * i + c];
      level = std::uint8_t(std::lround((1 - share) * level + share * ink.rgb[c]));
    }
  }
}

}  // namespace limber::render
