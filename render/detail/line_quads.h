// Lines for the rasterizer: each segment a quad of constant width on the screen.
#pragma once

#include <span>
#include <vector>

#include "core/types.h"

namespace limber::render::detail {

// Five floats a corner: x y z w in clip space, and the distance from the middle of the line in samples. Quads
// reach half a sample farther on each side, for a soft edge.
constexpr int line_corner_floats = 5;

struct Screen {
  Eigen::Matrix4d clip_from_world;
  Eigen::Vector2d size;  // samples
};

// Fills corners with two triangles a segment; ends: row 2i to row 2i + 1. What lies behind the eye or
// far out of the picture, or has n·p + d < 0 for one of the planes (n, d), is cut off.
void line_quads(const Points& ends, const Screen&, double width_samples,
                std::span<const Eigen::Vector4d> planes, std::vector<float>& corners);

}  // namespace limber::render::detail
