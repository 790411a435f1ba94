// Which mesh each pixel of a picture shows, found without a drawing context: the same on every machine, and
// in a fraction of the time of a picture. For what must be known of a film before its first frame is painted.
#pragma once

#include <span>
#include <vector>

#include "render/camera.h"

namespace limber::render {

// Row 0 is the top; of each pixel its middle counts.
struct Sight {
  Sight(int width_px, int height_px);
  int width, height;
  std::vector<int> object;     // −1: nothing
  std::vector<float> depth_m;  // along the view axis; infinity: nothing
  std::size_t at(int x, int y) const { return std::size_t(y) * std::size_t(width) + std::size_t(x); }
};

// Lays a mesh over what is there, where it is nearer and no plane (n, d) has n·p + d < 0. Triangles that
// reach behind the eye are left out.
void lay_over(Sight&, const Camera&, const Points&, const Triangles&, int number,
              std::span<const Eigen::Vector4d> planes = {});

// How many pixels it is from each pixel to one of another object or out of the picture, sideways and up or
// down.
std::vector<int> clearances(const Sight&);

}  // namespace limber::render
