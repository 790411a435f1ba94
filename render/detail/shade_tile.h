// The colours of a tile's samples: places to be lit (shade_light.h) are found, once for all samples of a
// pixel that show the same triangle, lit sixteen at a time, and written to the samples.
#pragma once

#include <cstdint>
#include <vector>

#include "render/detail/shade_light.h"
#include "render/detail/tiles.h"

namespace limber::render::detail {

struct ShadedMesh {
  const std::uint32_t* corners;  // three a triangle
  std::vector<float> vertices;   // (vertex_numbers each)
  std::vector<float> per_w;      // of each vertex, 1/w of its place in clip space
  Finish finish;
};

// Of one thread.
class TileShader {
 public:
  // Light and alpha of each sample of a tile, half floats, 0 where no triangle is; the tile's lower left
  // sample is (x0, y0).
  void shade(const Stage&, const std::vector<ShadedMesh>&, const std::vector<ScreenTriangle>&,
             const Tiles::Samples&, int x0, int y0, std::uint16_t* halves);

 private:
  struct Item {
    std::int32_t triangle;  // in the list
    std::int16_t x, y;      // of the tile's pixels
    std::uint8_t samples;   // bits
  };
  void collect(const std::vector<ScreenTriangle>&, const Tiles::Samples&);
  void place(const ShadedMesh&, const std::vector<ScreenTriangle>&, const Item*, int count, int x0, int y0);

  std::vector<std::vector<Item>> items_;  // body by body
  LitPlaces places_;
};

}  // namespace limber::render::detail
