// How far spots of a surface fall away below the tangent plane of a place.
#pragma once

#include <vector>

#include "meshing/detail/surface_spots.h"

namespace limber::meshing::detail {

// Cosine of two normals, below which they are not of one side of a sheet.
constexpr double same_side = 0.2;

// Of the spots that were looked at: the least square of a spacing at which none of them is missed by more
// than is allowed, and how far one of them is off the tangent plane.
struct Falls {
  double min_squared_m2, bend_m;
};
struct FallLimits {
  double farthest_m2,
      least_m2;  // squared distances: what is farther does not count, nor the fall of nearer ones
  double missed_m;
};

// Spots, four side by side. Those that fill the last block have no normal, and so are of no side.
class SpotBlocks {
 public:
  SpotBlocks() = default;
  explicit SpotBlocks(const std::vector<SurfaceSpot>&);
  // With those of all blocks that hold first … end − 1, on this side of `at`.
  Falls falls_from(const SurfaceSpot& at, int first, int end, const FallLimits&, Falls so_far) const;

 private:
  static constexpr int lanes = 4;
  typedef double Four __attribute__((vector_size(lanes * sizeof(double)), aligned(lanes * sizeof(double))));
  struct Block {
    Four position[3], normal[3];
  };
  std::vector<Block> blocks_;
};

}  // namespace limber::meshing::detail
