// The convex hull of points, by exact arithmetic: no point is outside, every corner is one of the points.
#pragma once

#include "core/mesh.h"

namespace limber::meshing {

// Only extreme points become vertices, in the order of their rows. Flat faces are triangulated.
// Throws InputError when the points lie in one plane, Interrupted once a stop signal has come.
ConvexShell convex_hull(const Points&);

}  // namespace limber::meshing
