// Captions: a small built-in alphabet of strokes, drawn soft-edged at any size.
#pragma once

#include <string_view>

#include "render/image.h"

namespace limber::render::detail {

// Printable ASCII; other letters come out as a box. The height is that of a capital; a letter takes as much
// width.
void draw_text(Image8&, std::string_view, double left_px, double baseline_px, double height_px,
               const Vec3& color_srgb);

}  // namespace limber::render::detail
