// What hides what from a far-off eye: for choosing where a camera stands.
#pragma once

#include <span>

#include "core/mesh.h"

namespace limber::detail {

// The share of the points from which nothing of `hiding` lies in the direction of the eye.
double share_in_sight(const Points&, const Vec3& toward_eye, std::span<const SurfaceMesh> hiding);

}  // namespace limber::detail
