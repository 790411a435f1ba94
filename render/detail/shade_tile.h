// The colours of a tile's samples: places to be lit (shade_light.h) are found, once for all samples of a
// pixel that show the same triangle, and lit sixteen at a time. Of opaque bodies they are written to the
// samples; transparent surfaces are laid over these, front to back (Carpenter's A-buffer, 1984).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "render/detail/shade_light.h"
#include "render/detail/tiles.h"

namespace limber::render::detail {

struct ShadedMesh {
  const std::uint32_t* corners;           // three a triangle
  std::vector<float> vertices;            // (vertex_numbers each)
  std::vector<float> per_w;               // of each vertex, 1/w of its place in clip space
  Eigen::Matrix<float, 3, 4> in_picture;  // of a place in the world: x and y in samples, times w, and w
  Finish finish;
};

// Of a line, as a mesh of its own.
struct Stroke {
  float color[3], opacity;  // linear
  float half_width;         // samples; its edge is soft by half a sample to either side
};

// Of one thread.
class TileShader {
 public:
  // Light and alpha of each sample of a tile, half floats, 0 where no triangle is; the tile's lower left
  // sample is (x0, y0).
  void shade(const Stage&, const std::vector<ShadedMesh>&, const std::vector<ScreenTriangle>&,
             const Tiles::Samples&, int x0, int y0, std::uint16_t* halves);
  // Transparent surfaces, body after body, and lines, in any order; then all that was put is laid over.
  void put_surfaces(const Stage&, const std::vector<ShadedMesh>&, const std::vector<ScreenTriangle>&,
                    const std::vector<Covered>&, int x0, int y0);
  void put_lines(const Tiles&, const std::vector<Stroke>&, const std::vector<Covered>&, int x0, int y0);
  void lay_over(std::uint16_t* halves);

 private:
  void collect(const std::vector<ScreenTriangle>&, const Tiles::Samples&);
  void place(const ShadedMesh&, const std::vector<ScreenTriangle>&, const Covered*, int count, int x0,
             int y0);

  std::vector<std::vector<Covered>> items_;  // body by body
  struct Layer {
    float depth;
    std::array<float, 4> light;  // and the share that it holds back
    std::uint16_t pixel;
    std::uint8_t samples;
  };
  std::vector<Layer> layers_;
  std::vector<std::uint32_t> first_, of_pixels_;  // [pixel] in of_pixels_; layers
  LitPlaces places_;
};

}  // namespace limber::render::detail
