// Organs out of ellipsoids, with the proportions of BodyParts3D's (a heart of 104 × 111 × 102 mm, lungs of
// 183 × 118 × 229, a liver of 160 × 209 × 155, a spine of 123 × 118 × 699); x to the front, y to the body's
// left, 1 m high.
#include <array>
#include <cmath>
#include <vector>

#include "scenes/detail/ellipsoids.h"
#include "scenes/shapes.h"

namespace limber::scenes {

SurfaceMesh make_heart() {
  const std::array parts = {
      Ellipsoid{{0.02, 0.02, -0.05}, {0.40, 0.44, 0.42}, 0, 25, 0.1},    // ventricles, the tip to the left
      Ellipsoid{{0.12, 0.26, -0.22}, {0.26, 0.26, 0.22}, 0, 25, 0.12},   // the tip
      Ellipsoid{{-0.16, 0.14, 0.24}, {0.26, 0.28, 0.20}, 0, 0, 0.1},     // left atrium
      Ellipsoid{{-0.02, -0.26, 0.14}, {0.26, 0.24, 0.26}, 0, 0, 0.1},    // right atrium
      Ellipsoid{{0.04, -0.04, 0.42}, {0.13, 0.13, 0.16}, -10, 0, 0.08},  // aorta
      Ellipsoid{{-0.10, -0.28, 0.40}, {0.10, 0.10, 0.16}, 0, 0, 0.06},   // vena cava
  };
  return join(parts, Sides::one, {{-0.7, -0.75, -0.75}, {0.7, 0.75, 0.75}}, 0.03);
}

SurfaceMesh make_lung(double side) {  // 1: the left one
  // A tall half-ellipsoid with its flat side to the heart, and a narrow top.
  const std::array parts = {
      Ellipsoid{{-0.05, side * 0.02, -0.18}, {0.36, 0.22, 0.32}, 0, 0, 0.05},
      Ellipsoid{{0.10, side * 0.04, -0.28}, {0.28, 0.18, 0.20}, 0, 0, 0.12},
      Ellipsoid{{-0.06, side * 0.01, 0.18}, {0.27, 0.19, 0.32}, 0, 0, 0.15},
      Ellipsoid{
          {0.17, -side * 0.10, -0.05}, {0.19, 0.15, 0.28}, 0, 0, 0.1},  // the front edge, before the heart
  };
  return join(parts, Sides::one, {{-0.7, -0.5, -0.75}, {0.7, 0.5, 0.75}}, 0.025);
}

SurfaceMesh make_liver() {
  const std::array parts = {
      Ellipsoid{{-0.06, -0.28, -0.02}, {0.46, 0.40, 0.46}, 0, 0, 0.1},  // right lobe
      Ellipsoid{{0.12, 0.12, 0.14}, {0.36, 0.38, 0.30}, 0, -15, 0.2},   // left lobe
      Ellipsoid{{0.18, 0.42, 0.26}, {0.26, 0.30, 0.18}, 0, -15, 0.15},  // and its end
  };
  return join(parts, Sides::one, {{-0.8, -0.9, -0.75}, {0.8, 1.0, 0.75}}, 0.035);
}

SurfaceMesh make_spine() {
  std::vector<Ellipsoid> parts;
  constexpr int vertebrae = 22;
  for (int i = 0; i < vertebrae; ++i) {  // from below
    const double t = double(i) / (vertebrae - 1), height = t - 0.5;
    const double bend = 0.035 * std::sin(6.6 * t + 0.4);
    const double width = 0.040 - 0.008 * t;
    parts.push_back({{bend, 0, height}, {width, 1.1 * width, 0.03}, 0, 0, 0.02});
    parts.push_back(
        {{bend - 0.055, 0, height - 0.006}, {0.035, 0.016, 0.018}, -25, 0, 0.02});  // spinous process
  }
  return join(parts, Sides::one, {{-0.2, -0.12, -0.6}, {0.15, 0.12, 0.6}}, 0.018);
}

}  // namespace limber::scenes
