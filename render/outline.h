// Dark lines along silhouettes and creases. Method: docs/rendering.md, "Outlines".
#pragma once

#include "render/image.h"
#include "render/renderer.h"

namespace limber::render {

// 0 … 1 a pixel: 1 on the nearer side of where the mesh changes or the depth jumps by more than step_m beyond
// what the surface's slant explains, and where the normal turns by more than some 45 degrees. What hangs
// together and reaches over less than a seventieth of the picture's height, or 6 pixels, is left out.
std::vector<float> outlines_of(const Passes&, double step_m);

// As lines of ink, some width_px wide, two pixels at least; what is to be thinner than one is paler instead.
void draw_outlines(Image8&, const Passes&, double step_m, double width_px, const Vec3& ink_srgb);

}  // namespace limber::render
