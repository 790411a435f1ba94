#include "render/image.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/appearance.h"
#include "core/error.h"

namespace limber::render {

namespace {

std::uint8_t level(double srgb) { return std::uint8_t(std::lround(255 * std::clamp(srgb, 0.0, 1.0))); }

// Sign, exponent and the upper 13 bits of the mantissa pick the entry, so its value is right to 1/16384.
constexpr int dropped_bits = 10;
constexpr std::uint32_t first_key = std::bit_cast<std::uint32_t>(0x1p-13f) >> dropped_bits;
constexpr std::uint32_t last_key = std::bit_cast<std::uint32_t>(16.0f) >> dropped_bits;

// In 256ths of a level.
const std::vector<std::uint16_t>& level_table() {
  static const auto table = [] {
    std::vector<std::uint16_t> t(last_key - first_key + 1);
    for (std::uint32_t k = 0; k < t.size(); ++k) {
      const std::uint32_t middle = ((first_key + k) << dropped_bits) | (1u << (dropped_bits - 1));
      t[k] = std::uint16_t(
          std::lround(256 * 255 * srgb_from_linear(tone_mapped(double(std::bit_cast<float>(middle))))));
    }
    return t;
  }();
  return table;
}

// Formulas, not the table: pictures with alpha or 16 bit are made now and then.
template <class Level>
Raster<Level> shown_as(const Image& image, int channels) {
  constexpr double top = std::numeric_limits<Level>::max();
  const auto level_of = [](double share) { return Level(std::lround(top * std::clamp(share, 0.0, 1.0))); };
  Raster<Level> shown{image.width, image.height, channels, {}};
  const std::size_t pixels = std::size_t(image.width) * image.height;
  shown.levels.reserve(pixels * std::size_t(channels));
  for (std::size_t p = 0; p < pixels; ++p) {
    const float* rgba = &image.rgba[4 * p];
    const double alpha = channels == 4 ? rgba[3] : 1;
    for (int c = 0; c < 3; ++c) {
      const double light = alpha > 0 ? rgba[c] / alpha : 0;
      shown.levels.push_back(light > 0 ? level_of(srgb_from_linear(tone_mapped(light))) : Level(0));
    }
    if (channels == 4) shown.levels.push_back(level_of(alpha));
  }
  return shown;
}

}  // namespace

Image8 filled(int width, int height, const Vec3& color_srgb) {
  Image8 image{width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 3)};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = level(color_srgb[int(i % 3)]);
  return image;
}

double srgb_from_linear(double x) {
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}
double linear_from_srgb(double x) { return limber::linear_from_srgb(x); }
Vec3 linear_from_srgb(const Vec3& color) {
  return color.unaryExpr([](double x) { return linear_from_srgb(x); });
}

double tone_mapped(double linear) {
  return linear <= tone_knee ? linear
                             : 1 - (1 - tone_knee) * std::exp((tone_knee - linear) / (1 - tone_knee));
}
double tone_unmapped(double shown) {
  return shown <= tone_knee
             ? shown
             : tone_knee - (1 - tone_knee) * std::log((1 - std::min(shown, 0.9999)) / (1 - tone_knee));
}

namespace {

constexpr int dither_run = dither_columns / 8;

constexpr int reversed(int three_bits) {
  return (three_bits & 1) << 2 | (three_bits & 2) | (three_bits & 4) >> 2;
}

// Ordered dither (Bayer 1973) whose tile is drawn out along the row: what is added to a value in 256ths of a
// level before it is cut off. Of the 64 thresholds of a tile one holds for a whole run of pixels; those of
// rows below one another differ by half a level, then by a quarter, and begin elsewhere from run to run.
constexpr int threshold(int y, int run) {
  return 2 + 32 * reversed((y + 3 * run) & 7) + 4 * reversed(run & 7);
}

}  // namespace

void tone_mapped(std::span<const float> rgba, int y, std::uint8_t* rgb) {
  const std::vector<std::uint16_t>& table = level_table();
  const std::size_t pixels = rgba.size() / 4;
  for (std::size_t begin = 0; begin < pixels; begin += dither_run) {
    const int added = threshold(y, int(begin / dither_run));
    const auto level_of = [&](float x) {
      // Not (x > first) also catches NaN, which a shader may leave but must not spread.
      if (!(x > 0x1p-13f)) return std::uint8_t(0);
      const std::uint32_t key = std::min(std::bit_cast<std::uint32_t>(x) >> dropped_bits, last_key);
      return std::uint8_t((table[key - first_key] + added) >> 8);
    };
    for (std::size_t p = begin; p < std::min(begin + dither_run, pixels); ++p)
      for (std::size_t c = 0; c < 3; ++c) rgb[3 * p + c] = level_of(rgba[4 * p + c]);
  }
}

Image8 tone_mapped(const Image& image) {
  Image8 shown{image.width, image.height,
               std::vector<std::uint8_t>(std::size_t(image.width) * image.height * 3)};
  const std::size_t width = std::size_t(image.width);
  for (int y = 0; y < image.height; ++y)
    tone_mapped(std::span(image.rgba).subspan(4 * width * std::size_t(y), 4 * width), y,
                &shown.rgb[3 * width * std::size_t(y)]);
  return shown;
}

Raster16 tone_mapped_16(const Image& image) { return shown_as<std::uint16_t>(image, 3); }
Raster8 tone_mapped_alpha(const Image& image) { return shown_as<std::uint8_t>(image, 4); }
Raster16 tone_mapped_alpha_16(const Image& image) { return shown_as<std::uint16_t>(image, 4); }

Image8 shrunk(const Image8& image, int width, int height) {
  LIMBER_CHECK(0 < width && width <= image.width && 0 < height && height <= image.height, width, height,
               image.width, image.height);
  std::array<double, 256> linear;
  for (int i = 0; i < 256; ++i) linear[i] = linear_from_srgb(i / 255.0);

  Image8 small{width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 3)};
  const double step_x = double(image.width) / width, step_y = double(image.height) / height;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double left = x * step_x, right = (x + 1) * step_x, top = y * step_y, bottom = (y + 1) * step_y;
      Vec3 sum = Vec3::Zero();
      double area = 0;
      for (int v = int(top); v < std::min(image.height, int(std::ceil(bottom))); ++v)
        for (int u = int(left); u < std::min(image.width, int(std::ceil(right))); ++u) {
          const double part = (std::min(right, u + 1.0) - std::max(left, double(u))) *
                              (std::min(bottom, v + 1.0) - std::max(top, double(v)));
          const std::uint8_t* p = &image.rgb[3 * (std::size_t(v) * image.width + u)];
          sum += part * Vec3(linear[p[0]], linear[p[1]], linear[p[2]]);
          area += part;
        }
      for (int c = 0; c < 3; ++c)
        small.rgb[3 * (std::size_t(y) * width + x) + c] = level(srgb_from_linear(sum[c] / area));
    }
  return small;
}

}  // namespace limber::render
