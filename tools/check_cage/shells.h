// What is true of convex shells as a cover of a surface.
#pragma once

#include "tools/check_cage/solid.h"

namespace check {

struct ShellFacts {
  std::size_t shells = 0, max_vertices = 0;
  std::size_t shells_not_convex = 0;    // a corner in front of a face, or an edge without its twin; exact
  std::size_t vertices_uncovered = 0;   // of the surface, in no closed shell; exact
  std::size_t triangles_uncovered = 0;  // not within the union of the closed shells; exact
  // Distance from the boundary of the union of shells to the surface, over the surface's diagonal.
  std::size_t samples = 0;  // points of that boundary
  double mean_overshoot = 0, percentile_99_overshoot = 0, max_overshoot = 0;
  double sum_of_volumes = 0;

  bool holds() const { return shells_not_convex + vertices_uncovered + triangles_uncovered == 0; }
};
// About `samples` points are spread evenly over all faces of all shells; those deeper than 1e-9 of the
// diagonal in another shell are no points of the union's boundary and are dropped.
ShellFacts judge_shells(const Solid&, const std::vector<Surface>& shells, std::size_t samples = 40000);

}  // namespace check
