// One shell of few corners round many points.
#pragma once

#include <span>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

// `corners` are those of the points' convex hull; the result has at most `most` points, and its hull holds
// all of them up to rounding, with little added volume.
std::vector<Vec3> fewer_corners(const std::vector<Vec3>& corners, int most);

// Points whose hull takes in all that is within `distance` of the hull of `corners`, and nothing farther
// than 1.13 times that: its sum with the polytope of 26 planes (to the faces, edges and corners of a cube)
// round a ball. That bevels every edge and corner, where planes moved outwards alone would meet in spikes.
std::vector<Vec3> bevelled(const std::vector<Vec3>& corners, double distance);

// Points in a plane, on a line or all in one place get a twin `distance` away to either side, so that they
// span a volume.
std::vector<Vec3> thickened(const std::vector<Vec3>& points, double distance);

// The exact hull of `corners`, grown about its middle by 2e-6 of its size or as little more as it takes until
// it holds every point exactly, and at least `margin` inside each face. Its corners are numbers of float32
// where a thousandth of its size is enough for that, so that it is convex in files of floats, too. Throws
// InternalError when it never holds them.
ConvexShell enclosing_shell(std::span<const Vec3> corners, std::span<const Vec3> points, double margin);

// No face has the point on its outer side: exact.
bool encloses(const ConvexShell&, const Vec3& point);

}  // namespace limber::meshing::detail
