// What the renderer draws into, and the textures it reads back from. Those that only passes need are made
// when they are first asked for.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace limber::render::detail {

struct Texture {
  unsigned id = 0;
  bool multisampled = false, solid = false;
  void bind(int unit) const;
};

// How an axis of samples is laid out: either a larger picture, or several samples a pixel.
struct SampleGrid {
  int width = 0, height = 0;  // of the textures
  int per_pixel = 0;          // 0: one a texel
};

// Where a rasterizer of four samples a pixel takes them, in pixels from the middle of the pixel.
using SamplePlaces = std::array<Eigen::Vector2d, 4>;
// None where they do not lie each in another quarter of the pixel.
std::optional<SamplePlaces> four_samples();

class Targets {
 public:
  Targets(int width, int height, SampleGrid);

  static constexpr int shadow_size = 2048;
  Texture shadow_map;
  unsigned shadow_frame;
  unsigned not_compared;  // a sampler that reads the depths of the shadow map
  // Where light first meets what casts, of coarse stand-ins too: for thickness. Blended between texels.
  static constexpr int entry_size = 1024;
  Texture entry_map;
  unsigned entry_frame;
  unsigned blended;  // a sampler

  // The reliefs of grain.h, with smaller ones for what is far.
  const Texture& grain(bool woven);

  // Colour (premultiplied, linear), and the depth of the opaque.
  Texture samples, samples_depth;
  unsigned samples_frame;
  Texture ground_sky_map;

  // Beside the colours of the opaque: normal and scalar, number of the mesh; and the same once a pixel.
  struct Passes {
    Texture normal_scalar, object;
    unsigned frame;  // samples, samples_depth and these
    Texture pixel_normal_scalar, pixel_object, pixel_depth;
    unsigned pixel_frame;
  };
  const Passes& passes();

  // Where several samples a texel are averaged.
  unsigned resolved_frame();

  // Nothing but a rasterizer of four samples a pixel, for what goes into lists (layer_lists.h).
  unsigned four_samples_frame();

 private:
  int width_, height_;
  SampleGrid grid_;
  Passes passes_{};
  Texture grains_[2];
  unsigned resolved_frame_ = 0, four_samples_frame_ = 0;
};

// A channel a texel, replaced as a whole.
void fill(const Texture&, int columns, int rows, const float* values);

}  // namespace limber::render::detail
