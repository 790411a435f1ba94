#include "meshing/detail/surface_spots.h"

#include <algorithm>

#include "core/random.h"

namespace limber::meshing::detail {

SurfaceSpots::SurfaceSpots(const SeenSurface& surface) : pieces_(surface.pieces) {
  double sum = 0;
  for (const SurfacePiece& p : pieces_) {
    areas_.push_back(sum += p.seen ? p.area_vector().norm() : 0);
    normals_.push_back(p.area_vector().normalized());
  }
}

SurfaceSpot SurfaceSpots::at(std::uint32_t i) const {
  const auto bits = philox4x32({i, 0, 0, 0}, {0, 0});
  const double wanted = 0x1p-32 * (bits[0] + 0.5) * areas_.back();
  const auto found = std::upper_bound(areas_.begin(), areas_.end() - 1, wanted) - areas_.begin();
  const SurfacePiece& piece = pieces_[std::size_t(found)];
  double u = 0x1p-32 * bits[1], v = 0x1p-32 * bits[2];
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const auto& [a, b, c] = piece.corners;
  return {a + u * (b - a) + v * (c - a), normals_[std::size_t(found)]};
}

}  // namespace limber::meshing::detail
