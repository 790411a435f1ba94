// What shells must be whoever made them: convex, and over all of a surface.
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing {

struct ShellCheck {
  int not_convex = 0;  // shells that are not closed, or of whose faces one has a corner beyond it; exact
  std::int64_t vertices_uncovered = 0;   // of the surface, in no shell; exact
  std::int64_t triangles_uncovered = 0;  // with a corner, or the middle of an edge or of all, that is farther
                                         // than rounding from every shell
  double mean_overshoot = 0, max_overshoot = 0;  // as in Decomposition, of these shells
};

// The surface must pass validate(), and so must the shells.
ShellCheck check_shells(const std::vector<ConvexShell>&, const SurfaceMesh&);

// Whether it is the same, and so convex, in a file of float32 numbers.
bool holds_in_float32(const ConvexShell&);

}  // namespace limber::meshing
