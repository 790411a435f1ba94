#include "render/image_file.h"

#include <cstdio>
// after cstdio, which it needs
#include <jpeglib.h>

#include <csetjmp>
#include <cstring>

#include "core/error.h"
#include "render/png_file.h"

namespace limber::render {

namespace {

constexpr int max_scans = 200;  // of a progressive JPEG; more only cost time
constexpr long max_jpeg_memory = 1L << 30;

// An honest file has a thousandth of a row's bytes at least (PNG, by deflate), or a bit for each of its
// blocks (JPEG): what says that it is huge and is not takes no memory.
constexpr std::int64_t max_pixels_a_byte_of_png = 8 * 1100, max_pixels_a_byte_of_jpeg = 8 * 64;

void require_size(std::int64_t width, std::int64_t height, std::int64_t max_pixels_a_byte,
                  const std::string& bytes, const std::string& name) {
  if (width > max_image_side || height > max_image_side || width * height > max_image_pixels)
    throw InputError(fmt::format("\"{}\" has {} × {} pixels; at most {} a side and {} in all can be shown",
                                 name, width, height, max_image_side, max_image_pixels));
  if (width * height / max_pixels_a_byte > std::ssize(bytes))
    throw InputError(
        fmt::format("\"{}\": {} bytes cannot hold {} × {} pixels", name, bytes.size(), width, height));
}

// ── PNG

Image8 from_png(const std::string& bytes, const std::string& name) {
  const std::optional<PngInfo> whole = inspect_png_bytes(bytes);
  if (!whole) throw InputError(fmt::format("\"{}\" is a PNG that is cut short or damaged", name));
  require_size(whole->width, whole->height, max_pixels_a_byte_of_png, bytes, name);
  return rgb_of_png(bytes, name);
}

// ── JPEG

struct Errors {
  jpeg_error_mgr manager;  // the first, so that one pointer is the other
  std::jmp_buf back;
  char message[JMSG_LENGTH_MAX];
};
[[noreturn]] void leave(j_common_ptr jpeg) {
  auto* errors = reinterpret_cast<Errors*>(jpeg->err);
  errors->manager.format_message(jpeg, errors->message);
  std::longjmp(errors->back, 1);
}
// What libjpeg only warns of and fills with grey, as where a file is cut short, is damage.
void leave_at_warning(j_common_ptr jpeg, int level) {
  if (level < 0) leave(jpeg);
}
struct ScanCounter {
  jpeg_progress_mgr manager;
};
void count_scans(j_common_ptr jpeg) {
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > max_scans) {
    jpeg->err->msg_code = 0;
    leave(jpeg);
  }
}

enum class Step { header, pixels };

// libjpeg leaves an error by longjmp, so nothing with a destructor may live in here. The picture has its size
// after the header.
bool decode_jpeg(jpeg_decompress_struct* jpeg, Errors* errors, ScanCounter* progress,
                 const std::string* bytes, Step step, Image8* image) {
  if (setjmp(errors->back)) return false;
  if (step == Step::header) {
    jpeg_create_decompress(jpeg);
    jpeg->mem->max_memory_to_use = max_jpeg_memory;
    progress->manager.progress_monitor = count_scans;
    jpeg->progress = &progress->manager;
    jpeg_mem_src(jpeg, reinterpret_cast<const unsigned char*>(bytes->data()), bytes->size());
    jpeg_read_header(jpeg, TRUE);
    jpeg->out_color_space = JCS_RGB;
    return true;
  }
  jpeg_start_decompress(jpeg);
  const std::size_t stride = std::size_t(3) * std::size_t(image->width);
  while (jpeg->output_scanline < jpeg->output_height) {
    JSAMPROW row = &image->rgb[std::size_t(jpeg->output_scanline) * stride];
    jpeg_read_scanlines(jpeg, &row, 1);
  }
  jpeg_finish_decompress(jpeg);
  return true;
}

Image8 from_jpeg(const std::string& bytes, const std::string& name) {
  jpeg_decompress_struct jpeg{};
  Errors errors{};
  ScanCounter progress{};
  jpeg.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = leave;
  errors.manager.emit_message = leave_at_warning;
  struct Ending {
    jpeg_decompress_struct& jpeg;
    ~Ending() { jpeg_destroy_decompress(&jpeg); }
  } const ending{jpeg};
  Image8 image;
  const auto require = [&](bool done) {
    if (!done)
      throw InputError(fmt::format("\"{}\" is a JPEG that cannot be read ({})", name, errors.message));
  };
  require(decode_jpeg(&jpeg, &errors, &progress, &bytes, Step::header, &image));
  require_size(jpeg.image_width, jpeg.image_height, max_pixels_a_byte_of_jpeg, bytes, name);
  image = {int(jpeg.image_width), int(jpeg.image_height),
           std::vector<std::uint8_t>(3 * std::size_t(jpeg.image_width) * std::size_t(jpeg.image_height))};
  require(decode_jpeg(&jpeg, &errors, &progress, &bytes, Step::pixels, &image));
  return image;
}

}  // namespace

Image8 decoded_image(const std::string& bytes, const std::string& name) {
  if (bytes.starts_with("\x89PNG")) return from_png(bytes, name);
  if (bytes.starts_with("\xff\xd8")) return from_jpeg(bytes, name);
  throw InputError(fmt::format("\"{}\" is neither PNG nor JPEG", name));
}

}  // namespace limber::render
