// Pictures with words in their middle, and one picture in another.
#pragma once

#include <string>
#include <vector>

#include "render/image.h"

namespace limber::render {

// The picture, blurred and dimmed, with the lines in its middle, the first one larger.
Image8 card(const Image8& picture, const std::vector<std::string>& lines);
// The same on a plain ground.
Image8 plain_card(int width, int height, const std::vector<std::string>& lines, const Vec3& ground_srgb);

// From one picture (share 0) to another (1) of the same size.
Image8 mixed(const Image8& from, const Image8& to, double share);

// Puts a picture into a larger one, within a rim; the rim lies round it. Throws nothing: what is outside is
// cut off.
void paste(Image8&, const Image8& inset, int left, int top, int rim_px, const Vec3& rim_srgb);

}  // namespace limber::render
