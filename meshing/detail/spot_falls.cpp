#include "meshing/detail/spot_falls.h"

#include <algorithm>

namespace limber::meshing::detail {

SpotBlocks::SpotBlocks(const std::vector<SurfaceSpot>& spots) : blocks_(spots.size() / lanes + 1) {
  for (std::size_t n = 0; n < spots.size(); ++n)
    for (int axis = 0; axis < 3; ++axis) {
      blocks_[n / lanes].position[axis][n % lanes] = spots[n].position[axis];
      blocks_[n / lanes].normal[axis][n % lanes] = spots[n].normal[axis];
    }
}

[[gnu::target_clones("avx2", "default")]] Falls SpotBlocks::falls_from(const SurfaceSpot& at, int first,
                                                                       int end, const FallLimits& limits,
                                                                       Falls so_far) const {
  const Vec3 &p = at.position, &n = at.normal;
  Four squares = Four{} + so_far.min_squared_m2, bends = Four{} + so_far.bend_m;
  for (int b = first / lanes; b * lanes < end; ++b) {
    const auto& [position, normal] = blocks_[std::size_t(b)];
    const Four x = position[0] - p[0], y = position[1] - p[1], z = position[2] - p[2],
               squared = x * x + y * y + z * z, fall = -(x * n[0] + y * n[1] + z * n[2]),
               off = fall < 0 ? -fall : fall, spacing = squared * 2 * limits.missed_m / fall;
    const auto counts = (squared <= limits.farthest_m2) &
                        (normal[0] * n[0] + normal[1] * n[1] + normal[2] * n[2] > same_side);
    bends = (counts & (off > bends)) ? off : bends;
    squares = (counts & (fall > 0) & (squared >= limits.least_m2) & (spacing < squares)) ? spacing : squares;
  }
  for (int k = 0; k < lanes; ++k) {
    so_far.min_squared_m2 = std::min(so_far.min_squared_m2, squares[k]);
    so_far.bend_m = std::max(so_far.bend_m, bends[k]);
  }
  return so_far;
}

}  // namespace limber::meshing::detail
