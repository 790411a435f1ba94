#include "limber/detail/world/wall.h"

namespace limber::detail {

Wall wall_at(const Box& bounds, const Vec3& place) {
  const Vec3 below = bounds.lower - place, above = place - bounds.upper;
  Wall wall;
  wall.upper = above.maxCoeff() > below.maxCoeff();
  (wall.upper ? above : below).maxCoeff(&wall.axis);
  return wall;
}

}  // namespace limber::detail
