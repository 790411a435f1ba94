// Points spread evenly over what is seen of a surface.
#pragma once

#include "meshing/detail/seen_surface.h"

namespace limber::meshing::detail {

struct SurfaceSpot {
  Vec3 position, normal;
};

class SurfaceSpots {
 public:
  explicit SurfaceSpots(const SeenSurface&);  // must outlive it, and something must be seen
  // The i-th of a fixed sequence of random points.
  SurfaceSpot at(std::uint32_t i) const;

 private:
  const std::vector<SurfacePiece>& pieces_;
  std::vector<double> areas_;  // seen, of all pieces up to this
  std::vector<Vec3> normals_;
};

}  // namespace limber::meshing::detail
