// A serpent on four feet out of ellipsoids: a body in waves that ends in a raised head.
#include <cmath>
#include <numbers>
#include <vector>

#include "scenes/detail/ellipsoids.h"
#include "scenes/shapes.h"

namespace limber::scenes {

SurfaceMesh make_dragon() {
  // z up, x to the front, metres; those with y > 0 stand for both sides.
  std::vector<Ellipsoid> parts;
  constexpr int links = 18;
  for (int i = 0; i <= links; ++i) {  // from the tip of the tail to the neck
    const double t = double(i) / links;
    const double thick = 0.04 + 0.10 * std::sin(std::numbers::pi * std::min(1.0, 0.1 + t)) + 0.05 * t;
    const double rise = t < 0.7 ? 0 : 5.0 * (t - 0.7) * (t - 0.7);
    const double height = 0.24 + 0.13 * std::sin(3.2 * std::numbers::pi * t) * (1 - t) + rise;
    parts.push_back({{-0.55 + 0.95 * t, 0, height}, {0.08, 0.85 * thick, 1.1 * thick}, 0, 0, 0.05});
  }
  parts.insert(parts.end(), {
                                {{0.50, 0, 0.79}, {0.14, 0.10, 0.09}, 10, 0, 0.06},         // head
                                {{0.62, 0, 0.76}, {0.10, 0.06, 0.055}, 10, 0, 0.04},        // snout
                                {{0.44, 0.05, 0.89}, {0.035, 0.03, 0.13}, -35, -12, 0.03},  // horn
                                {{0.22, 0.13, 0.24}, {0.07, 0.06, 0.16}, -10, 0, 0.05},     // foreleg
                                {{0.27, 0.14, 0.09}, {0.10, 0.06, 0.05}, 0, 0, 0.04},       // forefoot
                                {{-0.18, 0.14, 0.22}, {0.10, 0.07, 0.13}, 10, 0, 0.05},     // hind leg
                                {{-0.13, 0.15, 0.09}, {0.11, 0.06, 0.05}, 0, 0, 0.04},      // hind foot
                            });
  return join(parts, Sides::both, {{-0.75, -0.35, -0.1}, {0.85, 0.35, 1.15}}, 0.025);
}

}  // namespace limber::scenes
