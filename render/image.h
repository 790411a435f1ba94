// Pictures in memory, and the road from linear light to what a screen shows. Method: docs/rendering.md.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace limber::render {

// Linear light, as the renderer leaves it. Row 0 is the top. Alpha is the share of the pixel that meshes and
// lines cover; colours are those of the whole pixel. With a transparent background they are what meshes and
// lines add (premultiplied), and alpha counts the shadows on the ground too, which are black.
struct Image {
  int width = 0, height = 0;
  std::vector<float> rgba;  // (height × width × 4)
};

// What a PNG holds: sRGB, 8 bit. Row 0 is the top.
struct Image8 {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // (height × width × 3)
  bool operator==(const Image8&) const = default;
};

// The other pictures a PNG can hold: 1 channel (grey), 2 (grey, alpha), 3 (red, green, blue) or 4 (and alpha,
// which is straight: not multiplied into the colours). Row 0 is the top.
template <class Level>
struct Raster {
  int width = 0, height = 0, channels = 0;
  std::vector<Level> levels;  // (height × width × channels)
  bool operator==(const Raster&) const = default;
};
using Raster8 = Raster<std::uint8_t>;
using Raster16 = Raster<std::uint16_t>;

Image8 filled(int width, int height, const Vec3& color_srgb);

// The sRGB transfer curve (IEC 61966-2-1), a channel at a time, 0 … 1.
double srgb_from_linear(double);
double linear_from_srgb(double);
Vec3 linear_from_srgb(const Vec3&);

// Identity up to 0.7, so that a body under full light keeps its colour; above, an exponential shoulder to 1.
constexpr double tone_knee = 0.7;  // up to here it is the identity
double tone_mapped(double linear);
double tone_unmapped(double shown);  // inverse, for colours that must come out as they were asked for; < 1

// Tone map, then sRGB, dithered: over a tile of dither_rows × dither_columns pixels of one colour the mean is
// that colour's within a fiftieth of a level, and no pixel is off by more than some 1.02 levels. Slow
// gradients show no bands. Rows keep long runs of one level, so that PNG files stay small: docs/rendering.md.
constexpr int dither_rows = 8, dither_columns = 256;
Image8 tone_mapped(const Image&);
// Row y of that: four floats a pixel to three levels a pixel.
void tone_mapped(std::span<const float> rgba, int y, std::uint8_t* rgb);
// The same to 16 bit; and with alpha, for images with a transparent background.
Raster16 tone_mapped_16(const Image&);
Raster8 tone_mapped_alpha(const Image&);
Raster16 tone_mapped_alpha_16(const Image&);

// Average of the covered area, in linear light. The new size is at most the old one.
Image8 shrunk(const Image8&, int width, int height);

}  // namespace limber::render
