#include "render/detail/lettering.h"

#include <ft2build.h>
#include FT_FREETYPE_H
#include FT_GLYPH_H
#include FT_OUTLINE_H
#include FT_STROKER_H
#include FT_TRUETYPE_TABLES_H

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "core/error.h"

// The font's files, as they are, between two names each.
#define LIMBER_INCLUDE_BYTES(name, file)                                                 \
  asm(".pushsection .rodata\n.global " #name "\n.balign 16\n" #name ":\n.incbin \"" file \
      "\"\n.global " #name "_end\n" #name "_end:\n.byte 0\n.popsection\n");              \
  extern "C" const unsigned char name[], name##_end[]
LIMBER_INCLUDE_BYTES(limber_font_regular, LIMBER_FONTS "/OpenSans-Regular.ttf");
LIMBER_INCLUDE_BYTES(limber_font_semibold, LIMBER_FONTS "/OpenSans-Semibold.ttf");

namespace limber::render::detail {

namespace {

void check(FT_Error error) { LIMBER_CHECK(error == 0, error); }

struct Destroy {
  void operator()(FT_Library library) const { FT_Done_FreeType(library); }
  void operator()(FT_Face face) const { FT_Done_Face(face); }
  void operator()(FT_Stroker stroker) const { FT_Stroker_Done(stroker); }
  void operator()(FT_Glyph glyph) const { FT_Done_Glyph(glyph); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Destroy>;

Owned<FT_Glyph> glyph_of(FT_Face face) {
  FT_Glyph glyph = nullptr;
  check(FT_Get_Glyph(face->glyph, &glyph));
  return Owned<FT_Glyph>(glyph);
}

// FreeType's library and faces belong to one thread.
class Fonts {
 public:
  static Fonts& of_this_thread() {
    thread_local Fonts fonts;
    return fonts;
  }
  // With capitals of that height.
  FT_Face face(Weight weight, double height_px) {
    const FT_Face font = faces_[std::size_t(weight)].get();
    const auto* sizes = static_cast<const TT_OS2*>(FT_Get_Sfnt_Table(font, FT_SFNT_OS2));
    LIMBER_CHECK(sizes && sizes->sCapHeight > 0);
    const double em_px = height_px * font->units_per_EM / sizes->sCapHeight;
    check(FT_Set_Char_Size(font, 0, std::max(FT_F26Dot6(1), FT_F26Dot6(std::lround(64 * em_px))), 72, 72));
    return font;
  }
  FT_Stroker stroker() { return stroker_.get(); }

 private:
  Fonts() {
    FT_Library library = nullptr;
    check(FT_Init_FreeType(&library));
    library_.reset(library);
    const std::array<std::pair<const unsigned char*, const unsigned char*>, 2> files{
        {{limber_font_regular, limber_font_regular_end}, {limber_font_semibold, limber_font_semibold_end}}};
    for (std::size_t i = 0; i < files.size(); ++i) {
      FT_Face face = nullptr;
      check(FT_New_Memory_Face(library, files[i].first, files[i].second - files[i].first, 0, &face));
      faces_[i].reset(face);
    }
    FT_Stroker stroker = nullptr;
    check(FT_Stroker_New(library, &stroker));
    stroker_.reset(stroker);
  }
  Owned<FT_Library> library_;
  std::array<Owned<FT_Face>, 2> faces_;
  Owned<FT_Stroker> stroker_;
};

// Calls `visit(x_px)` with each letter loaded into the face, x_px its pen's place; returns the pen's last
// place.
template <class Visit>
double for_each_letter(FT_Face face, std::string_view text, Visit visit) {
  double x_px = 0;
  while (!text.empty()) {
    const auto [letter, length] = letter_at(text, 0);
    text.remove_prefix(length);
    check(FT_Load_Glyph(face, FT_Get_Char_Index(face, letter), FT_LOAD_NO_HINTING | FT_LOAD_NO_BITMAP));
    visit(x_px);
    x_px += double(face->glyph->linearHoriAdvance) / 65536;
  }
  return x_px;
}

void blend(Image8& image, Owned<FT_Glyph> glyph, double x_px, double y_px, const Vec3& color_srgb,
           double opacity) {
  FT_Vector shift{std::lround(64 * (x_px - std::floor(x_px))), std::lround(64 * (std::ceil(y_px) - y_px))};
  FT_Glyph drawn = glyph.release();
  const FT_Error error = FT_Glyph_To_Bitmap(&drawn, FT_RENDER_MODE_NORMAL, &shift, 1);
  glyph.reset(drawn);
  check(error);
  const auto* map = reinterpret_cast<const FT_BitmapGlyphRec*>(drawn);
  const int left = int(std::floor(x_px)) + map->left, top = int(std::ceil(y_px)) - map->top;
  const FT_Bitmap& bits = map->bitmap;
  for (int row = std::max(0, -top); row < int(bits.rows) && top + row < image.height; ++row)
    for (int column = std::max(0, -left); column < int(bits.width) && left + column < image.width; ++column) {
      const double cover = opacity * bits.buffer[row * bits.pitch + column] / 255.0;
      std::uint8_t* p = &image.rgb[3 * (std::size_t(top + row) * image.width + std::size_t(left + column))];
      for (int c = 0; c < 3; ++c)
        p[c] = std::uint8_t(std::lround(p[c] + cover * (255 * color_srgb[c] - p[c])));
    }
}

}  // namespace

std::pair<char32_t, std::size_t> letter_at(std::string_view text, std::size_t at) {
  text.remove_prefix(at);
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t length = byte(0) < 0x80   ? 1
                             : byte(0) < 0xc0 ? 0
                             : byte(0) < 0xe0 ? 2
                             : byte(0) < 0xf0 ? 3
                                              : 4;
  if (length == 1) return {byte(0), 1};
  if (length == 0 || length > text.size()) return {0xfffd, 1};
  char32_t letter = byte(0) & (0xffu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if (byte(i) >> 6 != 2) return {0xfffd, 1};
    letter = letter << 6 | (byte(i) & 0x3fu);
  }
  return {letter, length};
}

double text_width(std::string_view text, double height_px, Weight weight) {
  return for_each_letter(Fonts::of_this_thread().face(weight, height_px), text, [](double) {});
}

void draw_text(Image8& image, std::string_view text, double left_px, double baseline_px,
               const TextLook& look) {
  Fonts& fonts = Fonts::of_this_thread();
  const FT_Face face = fonts.face(look.weight, look.height_px);
  if (look.rim_px > 0) {
    FT_Stroker_Set(fonts.stroker(), std::lround(64 * look.rim_px), FT_STROKER_LINECAP_ROUND,
                   FT_STROKER_LINEJOIN_ROUND, 0);
    for_each_letter(face, text, [&](double x_px) {
      Owned<FT_Glyph> glyph = glyph_of(face);
      FT_Glyph wide = glyph.release();
      const FT_Error error = FT_Glyph_StrokeBorder(&wide, fonts.stroker(), 0, 1);
      glyph.reset(wide);
      check(error);
      blend(image, std::move(glyph), left_px + x_px, baseline_px, look.rim_srgb, look.opacity);
    });
  }
  for_each_letter(face, text, [&](double x_px) {
    blend(image, glyph_of(face), left_px + x_px, baseline_px, look.color_srgb, look.opacity);
  });
}

bool has_letter(char32_t letter) {
  return FT_Get_Char_Index(Fonts::of_this_thread().face(Weight::regular, 10), letter) != 0;
}

}  // namespace limber::render::detail
