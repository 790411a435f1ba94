// A rabbit out of ellipsoids.
#include <array>

#include "scenes/detail/ellipsoids.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

// z up, x to the front, metres; those with y > 0 stand for both sides.
constexpr double blend = 0.06;
const std::array parts = {
    Ellipsoid{{-0.08, 0, 0.33}, {0.36, 0.31, 0.31}, 20, 0, blend},         // trunk
    Ellipsoid{{-0.20, 0.20, 0.24}, {0.25, 0.165, 0.23}, 0, 0, blend},      // haunch
    Ellipsoid{{-0.02, 0.26, 0.06}, {0.21, 0.08, 0.06}, 0, 0, 0.04},        // hind foot
    Ellipsoid{{0.16, 0, 0.36}, {0.19, 0.19, 0.25}, -20, 0, blend},         // chest
    Ellipsoid{{0.26, 0.10, 0.17}, {0.07, 0.07, 0.18}, -8, 0, 0.05},        // foreleg
    Ellipsoid{{0.31, 0.105, 0.045}, {0.11, 0.065, 0.045}, 0, 0, 0.03},     // forefoot
    Ellipsoid{{0.28, 0, 0.64}, {0.20, 0.155, 0.16}, 12, 0, blend},         // head
    Ellipsoid{{0.40, 0.055, 0.585}, {0.095, 0.075, 0.075}, 0, 0, 0.04},    // cheek
    Ellipsoid{{0.17, 0.095, 0.87}, {0.068, 0.040, 0.20}, -22, -10, 0.03},  // ear
    Ellipsoid{{-0.46, 0, 0.24}, {0.09, 0.085, 0.085}, 0, 0, 0.03},         // tail
};

}  // namespace

SurfaceMesh make_bunny() {
  return join(parts, Sides::both, {{-0.65, -0.45, -0.05}, {0.6, 0.45, 1.2}}, 0.025);
}

}  // namespace limber::scenes
