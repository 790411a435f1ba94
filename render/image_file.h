// Images that others made: PNG and JPEG of any kind, as eight-bit colors.
#pragma once

#include <string>

#include "render/image.h"

namespace limber::render {

inline constexpr int max_image_side = 16384;
inline constexpr std::int64_t max_image_pixels = 1 << 26;

// Levels as the file has them; what it says of transparency and of color spaces is left out. Throws
// InputError with `name` when the bytes are neither PNG nor JPEG, are cut short or damaged, hold other colors
// than grey or red, green and blue, or more pixels than the limits.
Image8 decoded_image(const std::string& bytes, const std::string& name);

}  // namespace limber::render
