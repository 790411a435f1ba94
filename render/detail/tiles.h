// Which triangles each sample of a picture shows. Samples lie in a grid, rows upward, a tile of them at a
// time; a triangle covers those in it, by the rules of OpenGL (a corner to 1/256 of a sample, top and left
// edges). Of opaque bodies the nearest is kept, of transparent surfaces each that lies before it. Shading
// comes after (shade_tile.h), once for all samples of a pixel that show the same triangle.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/camera.h"

namespace limber::render::detail {

inline constexpr int tile_samples = 64, tile_pixels = tile_samples / 2;  // a side

// A triangle in the grid: corners in 1/256 of a sample, depth 0 … 1 as z + x dz_dx + y dz_dy from sample (0,
// 0).
struct ScreenTriangle {
  std::array<std::int32_t, 3> x, y;
  float z, dz_dx, dz_dy;
  std::uint32_t number;  // of its mesh's triangles
  std::uint16_t mesh;    // the how manieth that was added
  bool front;
  bool clipped;               // a part of it, and x and y are not those of its corners
  std::uint8_t cuts;          // how many planes pass through it,
  std::uint32_t first_slope;  // and the first of them
};

// A triangle in a pixel.
struct Covered {
  std::int32_t triangle;  // in the list
  std::int16_t x, y;      // of the tile's pixels
  std::uint8_t samples;   // bits: lower left, lower right, upper left, upper right
};

// Triangles of bodies, put into the tiles that they meet.
class Tiles {
 public:
  enum class Of { opaque, transparent };
  Tiles(int columns, int rows, Of = Of::opaque);  // of samples

  // Vertices are placed by clip_from_world; with `fronts_alone` what is seen from behind is left out. Depths
  // stand back by `stand_back` times their steepness, and a little more. What is below a plane (n·p + d < 0)
  // is left out.
  void add(const std::vector<float>& positions, const std::vector<std::uint32_t>& corners,
           const Mat4& clip_from_world, bool fronts_alone, double stand_back,
           std::span<const Eigen::Vector4d> planes = {});

  // Two triangles a segment, as line_quads makes them, as one more mesh.
  void add_lines(std::span<const float> line_corners);
  // At a sample of the picture how far it is from the middle of the line.
  float across(const ScreenTriangle&, int x, int y) const;

  int columns() const { return (columns_ + tile_samples - 1) / tile_samples; }  // of tiles
  int rows() const { return (rows_ + tile_samples - 1) / tile_samples; }
  // Of the tile's samples, row by row: the nearest triangle's place in triangles(), −1: none; and its depth,
  // 1: none.
  struct Samples {
    alignas(64) std::array<std::int32_t, tile_samples * tile_samples> triangle;
    alignas(64) std::array<float, tile_samples * tile_samples> depth;
  };
  void sort();  // after all were added, before these
  bool empty(int column, int row) const;
  void resolve(int column, int row, Samples&) const;  // of opaque bodies
  // Every triangle in the tile before the depths that are given, in its order, pixel by pixel. Of a pixel a
  // transparent surface covers those samples whose places, turned a little, it covers.
  void cover(int column, int row, const Samples& opaque, std::vector<Covered>&) const;
  const std::vector<ScreenTriangle>& triangles() const { return triangles_; }

 private:
  template <bool turned, class Visit>
  void visit_blocks(int column, int row, const Visit&) const;

  int columns_, rows_, aside_;  // the last in parts of a sample
  std::uint16_t meshes_ = 0;
  std::vector<ScreenTriangle> triangles_;
  // f + x dx + y dy, x and y in samples: of a plane, below 0 where it cuts off; of a line how far one is from
  // its middle.
  struct Slope {
    float f, dx, dy;
  };
  std::vector<Slope> slopes_;
  struct Vertex {
    std::int32_t x, y;
    float z;
    const float* numbers;
    bool is_placed;
  };
  struct Part {  // of a triangle
    std::uint32_t number;
    bool clipped;
    std::size_t numbers;
    bool cut_below_zero, fronts_alone;
    double stand_back;
  };
  // Of vertices in clip space, each with some numbers, linear there, whose slopes in the picture are wanted.
  void add_clipped(std::span<const Eigen::Vector4f> clip, std::span<const std::uint32_t> corners,
                   std::span<const float> numbers, bool cut_below_zero, bool fronts_alone, double stand_back);
  void add_triangle(std::array<const Vertex*, 3>, const Part&);
  std::vector<std::uint32_t> first_, of_tiles_;  // [tile] in of_tiles_; triangles, in their order
};

}  // namespace limber::render::detail
