#include "core/contact_shape.h"

#include <algorithm>

namespace limber {

double DistanceField::at(const Vec3& point_m) const {
  std::array<std::size_t, 3> corner{};
  Vec3 share;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = nodes[std::size_t(axis)] - 1;
    const double place = std::clamp((point_m[axis] - lower_m[axis]) / cell_m, 0.0, last);
    corner[std::size_t(axis)] = std::size_t(std::min(place, last - 1));
    share[axis] = place - double(corner[std::size_t(axis)]);
  }
  const std::size_t row = std::size_t(nodes[0]), slice = row * std::size_t(nodes[1]);
  const std::int16_t* at = values.data() + corner[2] * slice + corner[1] * row + corner[0];
  const auto along_x = [&](const std::int16_t* v) { return v[0] + share[0] * (v[1] - v[0]); };
  const auto along_xy = [&](const std::int16_t* v) {
    const double near = along_x(v), far = along_x(v + row);
    return near + share[1] * (far - near);
  };
  const double near = along_xy(at), far = along_xy(at + slice);
  return unit_m * (near + share[2] * (far - near));
}

}  // namespace limber
