#include "render/png_file.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstring>

#include "core/content_hash.h"
#include "core/error.h"

namespace limber::render {

namespace {

void append(png_structp png, png_bytep bytes, png_size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), size);
}
void nothing(png_structp) {}

// What libpng is handed.
struct Rows {
  int width, height, channels, bits;
  const std::uint8_t* bytes;  // 16 bit: as this machine has them
};

// libpng leaves an error by longjmp, so nothing with a destructor may live in here.
bool encode(png_structp png, png_infop info, const Rows& rows, png_text* texts, int text_count,
            std::string* out) {
  constexpr int kinds[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                           PNG_COLOR_TYPE_RGB_ALPHA};
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, out, append, nothing);
  png_set_IHDR(png, info, png_uint_32(rows.width), png_uint_32(rows.height), rows.bits,
               kinds[rows.channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
  png_set_compression_level(png, 1);
  png_set_compression_strategy(png, Z_RLE);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  if (rows.channels > 2) png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_text(png, info, texts, text_count);
  png_write_info(png, info);
  if (rows.bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
  const std::size_t stride = std::size_t(rows.width) * std::size_t(rows.channels * rows.bits / 8);
  for (int y = 0; y < rows.height; ++y) png_write_row(png, rows.bytes + std::size_t(y) * stride);
  png_write_end(png, info);
  return true;
}

std::string encoded(const Rows& rows, std::size_t levels, const Texts& texts) {
  LIMBER_CHECK(rows.width > 0 && rows.height > 0 && 1 <= rows.channels && rows.channels <= 4, rows.width,
               rows.height, rows.channels);
  LIMBER_CHECK(levels == std::size_t(rows.width) * std::size_t(rows.height) * std::size_t(rows.channels),
               levels, rows.width, rows.height, rows.channels);
  std::vector<png_text> chunks;
  for (const auto& [key, text] : texts) {
    LIMBER_CHECK(!key.empty() && key.size() < 80 && text.find('\0') == text.npos, key, text);
    png_text chunk{};
    chunk.compression = PNG_TEXT_COMPRESSION_NONE;
    chunk.key = const_cast<char*>(key.c_str());
    chunk.text = const_cast<char*>(text.c_str());
    chunk.text_length = text.size();
    chunks.push_back(chunk);
  }
  std::string out;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  const bool done = info && encode(png, info, rows, chunks.data(), int(chunks.size()), &out);
  png_destroy_write_struct(&png, &info);
  LIMBER_CHECK(done, rows.width, rows.height);
  return out;
}

struct Source {
  const std::string& file;
  std::size_t at = 0;
};
void take(png_structp png, png_bytep bytes, png_size_t size) {
  auto& source = *static_cast<Source*>(png_get_io_ptr(png));
  if (size > source.file.size() - source.at) png_error(png, "is cut short");
  std::memcpy(bytes, source.file.data() + source.at, size);
  source.at += size;
}
// The whole of a message is told in the InputError.
[[noreturn]] void keep_message(png_structp png, png_const_charp message) {
  std::strncpy(static_cast<char*>(png_get_error_ptr(png)), message, 199);
  png_longjmp(png, 1);
}
void no_warning(png_structp, png_const_charp) {}

// The levels that an image holds, and room for them; its first row.
void ask_for_levels(png_structp png, const Raster16&) {
  png_set_expand_16(png);
  if (std::endian::native == std::endian::little) png_set_swap(png);
}
void ask_for_levels(png_structp png, const Image8&) {
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_strip_alpha(png);
  png_set_gray_to_rgb(png);
}
png_bytep first_row(Raster16& image, int channels) {
  image.channels = channels;
  image.levels.assign(std::size_t(image.width) * std::size_t(image.height) * std::size_t(channels), 0);
  return reinterpret_cast<png_bytep>(image.levels.data());
}
png_bytep first_row(Image8& image, int channels) {
  image.rgb.assign(std::size_t(image.width) * std::size_t(image.height) * std::size_t(channels), 0);
  return image.rgb.data();
}

// As encode.
template <class Image>
bool decode(png_structp png, png_infop info, Source* source, Image* image) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_read_fn(png, source, take);
  png_read_info(png, info);
  ask_for_levels(png, *image);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  image->width = int(png_get_image_width(png, info)), image->height = int(png_get_image_height(png, info));
  const png_bytep rows = first_row(*image, png_get_channels(png, info));
  const std::size_t stride = png_get_rowbytes(png, info);
  for (int pass = 0; pass < passes; ++pass)
    for (int y = 0; y < image->height; ++y) png_read_row(png, rows + std::size_t(y) * stride, nullptr);
  png_read_end(png, nullptr);
  return true;
}

// "", or what libpng says is wrong.
template <class Image>
std::string decoded(const std::string& file, Image* image) {
  char message[200] = "";
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, message, keep_message, no_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  Source source{file};
  const bool done = info && decode(png, info, &source, image);
  png_destroy_read_struct(&png, &info, nullptr);
  return done ? "" : *message ? message : "no memory";
}

std::uint32_t big_endian(const char* p) {
  const auto* b = reinterpret_cast<const unsigned char*>(p);
  return std::uint32_t(b[0]) << 24 | std::uint32_t(b[1]) << 16 | std::uint32_t(b[2]) << 8 | b[3];
}

std::optional<PngInfo> inspect(std::string_view file) {
  constexpr std::string_view signature = "\x89PNG\r\n\x1a\n";
  if (!file.starts_with(signature)) return std::nullopt;
  PngInfo info{0, 0, {}};
  bool has_pixels = false;
  for (std::size_t at = signature.size(); file.size() - at >= 12;) {
    const std::size_t length = big_endian(&file[at]);
    if (length > file.size() - at - 12) return std::nullopt;
    const std::string_view type = file.substr(at + 4, 4), data = file.substr(at + 8, length);
    const auto checksum = crc32(0, reinterpret_cast<const Bytef*>(type.data()), uInt(length + 4));
    if (checksum != big_endian(&file[at + 8 + length])) return std::nullopt;
    if (type == "IHDR") {
      if (length != 13 || at != signature.size()) return std::nullopt;  // one, and it comes first
      info.width = int(big_endian(data.data())), info.height = int(big_endian(data.data() + 4));
    } else if (type == "tEXt") {
      if (const std::size_t end = data.find('\0'); end != data.npos)
        info.texts[std::string(data.substr(0, end))] = std::string(data.substr(end + 1));
    } else if (type == "IDAT") {
      has_pixels = true;
    } else if (type == "IEND") {
      if (!has_pixels || info.width <= 0 || info.height <= 0) return std::nullopt;
      return info;
    }
    at += 12 + length;
  }
  return std::nullopt;
}

struct WholeFile {
  std::string bytes;
  PngInfo info;
};
WholeFile read_whole(const fs::path& path) {
  std::string file = read_file(path);
  auto info = inspect(file);
  if (!info)
    throw InputError(fmt::format("{}: is not a PNG, is cut short or damaged; make it again", path.string()));
  // Deflate makes at most a thousandth of a row of nothing.
  const std::int64_t pixels = std::int64_t(info->width) * info->height;
  if (pixels / 8 > 1100 * std::int64_t(file.size()))
    throw InputError(fmt::format("{}: {} bytes cannot hold {} × {} pixels; make it again", path.string(),
                                 file.size(), info->width, info->height));
  if (pixels > (1 << 27))
    throw InputError(
        fmt::format("{}: {} × {} pixels are too many", path.string(), info->width, info->height));
  return {std::move(file), std::move(*info)};
}

}  // namespace

std::string png_bytes(const Image8& image, const Texts& texts) {
  return encoded({image.width, image.height, 3, 8, image.rgb.data()}, image.rgb.size(), texts);
}
std::string png_bytes(const Raster8& image, const Texts& texts) {
  return encoded({image.width, image.height, image.channels, 8, image.levels.data()}, image.levels.size(),
                 texts);
}
std::string png_bytes(const Raster16& image, const Texts& texts) {
  return encoded({image.width, image.height, image.channels, 16,
                  reinterpret_cast<const std::uint8_t*>(image.levels.data())},
                 image.levels.size(), texts);
}

void write_png(const fs::path& path, const Image8& image, const Texts& texts) {
  write_file(path, png_bytes(image, texts));
}
void write_png(const fs::path& path, const Raster8& image, const Texts& texts) {
  write_file(path, png_bytes(image, texts));
}
void write_png(const fs::path& path, const Raster16& image, const Texts& texts) {
  write_file(path, png_bytes(image, texts));
}

Image8 read_png(const fs::path& path, Texts* texts) {
  const auto [file, info] = read_whole(path);
  png_image reader{};
  reader.version = PNG_IMAGE_VERSION;
  Image8 image;
  const png_color white{255, 255, 255};
  bool done = png_image_begin_read_from_memory(&reader, file.data(), file.size()) != 0;
  if (done) {
    reader.format = PNG_FORMAT_RGB;
    image = {int(reader.width), int(reader.height), std::vector<std::uint8_t>(PNG_IMAGE_SIZE(reader))};
    done = png_image_finish_read(&reader, &white, image.rgb.data(), 0, nullptr) != 0;
  }
  const std::string message = reader.message;
  png_image_free(&reader);
  if (!done) throw InputError(fmt::format("{}: {}; make it again", path.string(), message));
  if (texts) *texts = info.texts;
  return image;
}

Raster16 read_png_16(const fs::path& path, Texts* texts) {
  const auto [file, info] = read_whole(path);
  Raster16 image;
  if (const std::string wrong = decoded(file, &image); !wrong.empty())
    throw InputError(fmt::format("{}: {}; make it again", path.string(), wrong));
  if (texts) *texts = info.texts;
  return image;
}

namespace {

std::string pixel_hash_of(int width, int height, int channels, const auto& levels) {
  return fmt::format(
      "{}x{}x{} {}", width, height, channels,
      content_hash({reinterpret_cast<const char*>(levels.data()), sizeof levels[0] * levels.size()}));
}

}  // namespace

std::string pixel_hash(const Image8& image) { return pixel_hash_of(image.width, image.height, 3, image.rgb); }
std::string pixel_hash(const Raster8& image) {
  return pixel_hash_of(image.width, image.height, image.channels, image.levels);
}
std::string pixel_hash(const Raster16& image) {
  return pixel_hash_of(image.width, image.height, image.channels, image.levels);
}
namespace {

// `use` gets the image with as many bits a channel as the file has.
auto with_image_of(const fs::path& path, const auto& use) {
  Texts texts;
  const Raster16 image = read_png_16(path, &texts);
  constexpr int bits_at = 24;  // in the file: of a channel
  if (read_file(path)[bits_at] == 16) return use(image, texts);
  Raster8 bytes{image.width, image.height, image.channels, std::vector<std::uint8_t>(image.levels.size())};
  std::transform(image.levels.begin(), image.levels.end(), bytes.levels.begin(),
                 [](std::uint16_t level) { return std::uint8_t(level / 257); });
  return use(bytes, texts);
}

}  // namespace

std::string pixel_hash(const fs::path& path) {
  return with_image_of(path, [](const auto& image, const Texts&) { return pixel_hash(image); });
}
bool is_as_written(const fs::path& path) {
  return with_image_of(path, [&](const auto& image, const Texts& texts) {
    return png_bytes(image, texts) == read_file(path);
  });
}

Image8 rgb_of_png(const std::string& file, const std::string& name) {
  Image8 image;
  if (const std::string wrong = decoded(file, &image); !wrong.empty())
    throw InputError(fmt::format("\"{}\" is a PNG that cannot be read ({})", name, wrong));
  return image;
}

std::optional<PngInfo> inspect_png(const fs::path& path) {
  try {
    return inspect(read_file(path));
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::optional<PngInfo> inspect_png_bytes(std::string_view bytes) { return inspect(bytes); }

std::optional<std::string> frame_hash(const fs::path& path) {
  const auto info = inspect_png(path);
  if (!info || !info->texts.contains("limber-hash")) return std::nullopt;
  return info->texts.at("limber-hash");
}

}  // namespace limber::render
