// The sides of the bounds.
#pragma once

#include <compare>

#include "core/mesh.h"

namespace limber::detail {

// A side of a box.
struct Wall {
  int axis = 0;
  bool upper = false;
  auto operator<=>(const Wall&) const = default;
};
// The side that a place is farthest beyond, or nearest to.
Wall wall_at(const Box& bounds, const Vec3& place);

}  // namespace limber::detail
