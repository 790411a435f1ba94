// PNG files, quick to write (zlib level 1, run lengths, SUB filter), never half written.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "core/file.h"
#include "render/image.h"

namespace limber::render {

using Texts = std::map<std::string, std::string>;  // tEXt chunks: keyword (1 … 79 Latin-1 letters) → text

// 3 channels or 4 are said to be sRGB; grey ones are plain numbers (depth, scalars).
std::string png_bytes(const Image8&, const Texts& = {});
std::string png_bytes(const Raster8&, const Texts& = {});
std::string png_bytes(const Raster16&, const Texts& = {});
void write_png(const fs::path&, const Image8&, const Texts& = {});  // throws DiskError
void write_png(const fs::path&, const Raster8&, const Texts& = {});
void write_png(const fs::path&, const Raster16&, const Texts& = {});

// Any PNG, brought to 8-bit sRGB; transparency over white. Throws InputError when the file is missing, is not
// a PNG or is cut short.
Image8 read_png(const fs::path&, Texts* texts = nullptr);

// Any PNG with the channels it has (a palette becomes colours), 8-bit levels times 257. Throws as read_png.
Raster16 read_png_16(const fs::path&, Texts* texts = nullptr);

// The same of what a file holds, as eight-bit colors without transparency. Asks for as much memory as the
// file says that it has pixels: inspect_png_bytes tells. Throws InputError with `name`.
Image8 rgb_of_png(const std::string& file, const std::string& name);

struct PngInfo {
  int width, height;
  Texts texts;
};
// Walks all chunks and their checksums without decoding. nullopt: missing, not a PNG, cut short, or damaged.
std::optional<PngInfo> inspect_png(const fs::path&);
std::optional<PngInfo> inspect_png_bytes(std::string_view);  // the same of what a file holds

// Of all levels, and of width, height and channels: the same of a picture and of the file that it was written
// to. Throws as read_png.
std::string pixel_hash(const Image8&);
std::string pixel_hash(const Raster8&);
std::string pixel_hash(const Raster16&);
std::string pixel_hash(const fs::path&);
// The file is, byte for byte, what write_png makes of its pixels and texts (another zlib may make others).
// Throws as read_png.
bool is_as_written(const fs::path&);

// What the frame shows, as text "limber-hash" says: how a resumed run knows a good frame. nullopt also when
// it does not say.
std::optional<std::string> frame_hash(const fs::path&);

}  // namespace limber::render
