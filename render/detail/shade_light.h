// The light that surfaces send to the eye, sixteen places side by side: the mesh shader of shaders.cpp
// on the CPU. Plain data and pointers only: this header is compiled for three instruction sets, as
// fem/detail/kernels.h is.
#pragma once

namespace limber::render::detail {

// A square of depths with one row and column of 1 (lit) before it, and two behind it.
struct DepthMap {
  int side;
  const float* depths;  // (side + 3)²
  static constexpr int rim = 3;
};

// Relief (grain.h), each level half as wide as the one before: slopes − 1 … 1 as 0 … 255 in the lowest three
// bytes.
struct Relief {
  static constexpr int levels = 7;
  const unsigned* texels;
  int first[levels], cells[levels];
};

// What all bodies have in common. Lengths in the shadow map are in units of its side and depth.
struct Stage {
  float eye[3], up[3], toward_key[3], toward_box[3], key_light[3], sky_light[3];
  float bounced[3];  // what open ground sends upward
  float ground_height, faced_m;
  float ground_x[3], ground_y[3], ground_lower[2], ground_scale[2];
  const float* ground_sky;  // (ground_rows × ground_columns)
  int ground_columns, ground_rows;
  float shadow_from_normal[9];  // row by row
  float shadow_softness, min_shadow, max_shadow;
  DepthMap shadow, entry;
  float searching[12], taps[16];  // reaches of looks, shares of their disc's radius
};

struct Finish {
  bool transparent, sheet, flat_inside;
  float opacity, log2_clear;  // of transparent surfaces; the second is log2(1 − opacity)
  bool tinted;
  float roughness, metallic, sheen;
  float open_power;         // 2^(−16 roughness − 1)
  float translucency;       // 0: none
  float scatter_powers[3];  // − 1.4427 over the depth by which each colour falls to 1/e
  float scatter_radius;
  float grain;  // 0: none
  bool fine;    // the relief: each of a pixel's samples shows another part of it
  const Relief* relief;
};

// Of a vertex, and of a place: where it is, normal, colour and the share of the sky that is open, where it is
// at rest in waves of the relief, and in the shadow map.
inline constexpr int vertex_numbers = 16, places_at_once = 16;
inline constexpr int at_place = 0, at_normal = 3, at_color = 6, at_open = 9, at_rest = 10, at_shadow = 13;

// `along`: by how much the numbers change from a sample to the next, to the right and upward.
struct alignas(64) LitPlaces {
  float value[vertex_numbers][places_at_once], along_x[vertex_numbers][places_at_once],
      along_y[vertex_numbers][places_at_once];
  float side[places_at_once];                                // −1: seen from behind
  float pixel_x[places_at_once], pixel_y[places_at_once];    // whole
  float middle_x[places_at_once], middle_y[places_at_once];  // of the pixel, in samples from the place
  float weight[4][places_at_once];  // of the pixel's samples, 0 where it does not show; their sum is 1
  // Out. Of a transparent surface the share of the light behind it that it holds back, and its own light
  // times that share; else 1.
  float light[3][places_at_once], held_back[places_at_once];
};

using Shade = void (*)(const Stage&, const Finish&, LitPlaces&);
Shade shade_sse2();
Shade shade_avx2();
Shade shade_avx512();

}  // namespace limber::render::detail
