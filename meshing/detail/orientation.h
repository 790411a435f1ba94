// On which side of a plane a point lies: exact.
#pragma once

#include "core/types.h"

namespace limber::meshing::detail {

// The sign of signed_volume(a, b, c, d): +1 when d sees a b c counter-clockwise, −1 when clockwise, 0 in one
// plane.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace limber::meshing::detail
