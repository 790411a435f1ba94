// Panes: where a body touches a wall of the bounds that nobody sees. Method: docs/rendering.md, "Panes".
#pragma once

#include <vector>

#include "limber/detail/world/wall.h"

namespace limber::detail {

// 0 … 1 a frame: 1 where something touches, over `frames` rising before and falling after.
std::vector<double> faded(const std::vector<bool>& touching, int frames);

// A rectangle with round corners in the plane of a wall, behind a body's box and larger by a margin; its rim
// is a band within it. Always the same numbers of vertices.
struct Pane {
  Points glass, rim;
};
Pane pane_behind(const Box& body, const Box& bounds, const Wall&, double margin_m, double rim_m);
Triangles pane_triangles();
Triangles rim_triangles();

}  // namespace limber::detail
