// Which opaque triangle each sample of a picture shows. Samples lie in a grid, rows upward, a tile of them at
// a time; a triangle covers those in it, by the rules of OpenGL (a corner to 1/256 of a sample, top and left
// edges), and the nearest is kept. Shading comes after (shade_tile.h), once for all samples of a pixel that
// show the same triangle.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "render/camera.h"

namespace limber::render::detail {

inline constexpr int tile_samples = 64;  // a side

// A triangle in the grid: corners in 1/256 of a sample, depth 0 … 1 as z + x dz_dx + y dz_dy from sample (0,
// 0).
struct ScreenTriangle {
  std::array<std::int32_t, 3> x, y;
  float z, dz_dx, dz_dy;
  std::uint32_t number;  // of its mesh's triangles
  std::uint16_t mesh;    // the how manieth that was added
  bool front;
  std::int32_t cut;  // −1, or which of the cuts passes through it
};

// Triangles of bodies, put into the tiles that they meet.
class Tiles {
 public:
  Tiles(int columns, int rows);  // of samples

  // Vertices are placed by clip_from_world; with `fronts_alone` what is seen from behind is left out. Depths
  // stand back by `stand_back` times their steepness, and a little more. Of `cut`, a plane, what is
  // below it (n·p + d < 0) is left out. False, and nothing is added, where a
  // vertex lies before the near plane or far out of the picture.
  bool add(const std::vector<float>& positions, const std::vector<std::uint32_t>& corners,
           const Mat4& clip_from_world, bool fronts_alone, double stand_back,
           const Eigen::Vector4d* cut = nullptr);

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
  void resolve(int column, int row, Samples&) const;
  const std::vector<ScreenTriangle>& triangles() const { return triangles_; }

 private:
  int columns_, rows_;
  std::uint16_t meshes_ = 0;
  std::vector<ScreenTriangle> triangles_;
  struct Cut {  // f + x dx + y dy < 0 where it is cut off, x and y in samples
    float f, dx, dy;
  };
  std::vector<Cut> cuts_;
  std::vector<std::uint32_t> first_, of_tiles_;  // [tile] in of_tiles_; triangles, in their order
};

}  // namespace limber::render::detail
