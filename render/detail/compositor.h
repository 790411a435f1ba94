// From samples to pixels: the average of a pixel's samples, over background and ground. On the CPU, row by
// row, for half of what it cost llvmpipe.
#pragma once

#include <cstdint>
#include <vector>

#include "render/camera.h"
#include "render/detail/ground_shade.h"

namespace limber::render::detail {

// What is seen behind meshes and lines. Colours are linear, as the tone map takes them.
struct Backdrop {
  // Where the ground is seen overhead and at the horizon; else at the top and the bottom of the picture.
  Vec3 background_top, background_bottom;
  bool ground_seen = false;
  GroundFrame ground;
  Vec3 ground_color;
  const ShadeMap *key_shade, *sky_shade;
  Vec3 far_ground_color = Vec3::Zero();
  Vec3 key_share = Vec3::Ones();            // of the light on open ground, colour by colour
  Vec3 fade_middle;                         // round it the ground becomes the far ground,
  double fade_begin_m = 0, fade_end_m = 1;  // between these,
  double haze_m = 1;                        // and the horizon: half so at this distance
  // Pixels hold what meshes and lines add, and the ground's shadows as alpha; see RenderSettings.
  bool transparent = false;
};

class Compositor {
 public:
  // Shade maps must outlive it.
  Compositor(const Backdrop&, const Camera&, int width, int height);

  // What is drawn, in a rectangle of pixels of `per_side`² samples each, its lower left corner `left` and
  // `above` pixels from the picture's. `samples` begins in that corner: rows upward, four half floats a
  // sample, premultiplied.
  struct Samples {
    const std::uint16_t* first;
    int per_side, left, columns, above, rows;
  };
  // Row y, 0 at the top: width × 4 floats.
  void row(int y, const Samples&, float* rgba) const;

 private:
  void put_over_ground(int y, float* rgba) const;

  Backdrop backdrop_;
  Camera camera_;
  int width_, height_;
};

}  // namespace limber::render::detail
