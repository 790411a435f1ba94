// An image on the card with all its smaller sizes, for a surface that shows it.
#pragma once

#include "render/detail/targets.h"
#include "render/image.h"

namespace limber::render::detail {

// Beyond, only its smaller sizes are kept.
inline constexpr int max_texels_a_side = 4096;

struct ImageOnCard {
  Texture texture;
  Vec3 mean = Vec3::Ones();  // linear
};
// colors: sRGB, averaged and blended in linear light; else its levels are numbers. Row 0 of the image is at
// the top, of the texture at the bottom. Repeated beyond its edges.
ImageOnCard image_on_card(const Image8&, bool colors);

}  // namespace limber::render::detail
