// Words on pictures, in an outline font that is compiled in: Open Sans (Debian's fonts-open-sans; Apache
// License 2.0), drawn by FreeType. Nothing is hinted, so the same words are the same pixels on every machine.
#pragma once

#include <string_view>
#include <utility>

#include "render/image.h"

namespace limber::render::detail {

enum class Weight { regular, semibold };

// UTF-8; places need not be whole pixels; what the font has no letter for comes out as its box. The height is
// that of a capital.
double text_width(std::string_view, double height_px, Weight = Weight::regular);
struct TextLook {
  double height_px;
  Vec3 color_srgb;
  Weight weight = Weight::regular;
  double rim_px = 0;  // of another colour round each letter, so that it reads on any ground
  Vec3 rim_srgb = Vec3::Ones();
  double opacity = 1;
};
void draw_text(Image8&, std::string_view, double left_px, double baseline_px, const TextLook&);
// The letter that begins at a byte, and how many bytes it takes; a byte that is no UTF-8 is U+FFFD.
std::pair<char32_t, std::size_t> letter_at(std::string_view, std::size_t);
bool has_letter(char32_t);

}  // namespace limber::render::detail
