// Colours for numbers, made in Oklab (Ottosson, A perceptual color space for image processing, 2020), where
// equal steps look equally large.
#pragma once

#include "core/types.h"

namespace limber::render {

struct Oklab {
  double lightness, a, b;  // 0 black … 1 white; a to red, b to yellow
};
Oklab oklab_from_srgb(const Vec3& srgb);
Vec3 srgb_from_oklab(const Oklab&);  // may lie outside 0 … 1 where no screen shows the colour

// 0 … 1 from pale grey over yellow and red to dark purple, darker in proportion; clamped outside. For
// quantities that begin at nothing: what has none is pale, so light, outlines and cages are seen on it.
Vec3 sequential_srgb(double share);

// 0 … 1 from blue over pale grey (0.5) to red, as light on both sides. For what grows and shrinks.
Vec3 diverging_srgb(double share);

}  // namespace limber::render
