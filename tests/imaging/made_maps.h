// Label maps of shapes whose surfaces are known.
#pragma once

#include <functional>

#include "imaging/label_map.h"

namespace limber::imaging {

// Labels 0 … of the middles of the voxels, in metres.
inline LabelMap made_map(std::array<int, 3> size, const Eigen::Matrix3d& axes_m, const Vec3& origin_m,
                         const std::function<int(const Vec3&)>& label) {
  LabelMap map;
  map.size = size, map.axes_m = axes_m, map.origin_m = origin_m;
  int most = 0;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const int row = label(origin_m + axes_m * Vec3(i, j, k));
        map.material.push_back(std::uint16_t(row));
        most = std::max(most, row);
      }
  for (int row = 1; row <= most; ++row) map.labels.push_back(row), map.names.push_back("");
  return map;
}

}  // namespace limber::imaging
