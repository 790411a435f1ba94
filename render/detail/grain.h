// Fine reliefs of materials: one cube of slopes, repeated without a seam, looked up at the place at rest. A
// solid pattern needs neither a parametrization nor blending between planes, and goes wherever the mesh does.
#pragma once

#include <cstdint>
#include <vector>

namespace limber::render::detail {

constexpr int grain_cells = 64;  // along a side of the cube
constexpr int grain_waves = 8;   // wavelengths along a side

// Levels of slopes along x, y and z, and 255: (grain_cells³ × 4), x fastest; 128 is level, and the steepest
// is 127 off. Irregular: two octaves of gradient noise (Perlin 2002). Woven: a gyroid, whose cut by any plane
// looks like threads that cross.
std::vector<std::uint8_t> grain_slopes(bool woven);

}  // namespace limber::render::detail
