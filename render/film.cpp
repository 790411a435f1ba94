#include "render/film.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"
#include "core/process.h"
#include "core/progress.h"
#include "render/detail/lettering.h"
#include "render/detail/process.h"
#include "render/png_file.h"

namespace limber::render {

namespace {

void require_all_good(const std::vector<fs::path>& frames) {
  if (frames.empty()) throw InputError("there is no frame to make a film of; render first");
  int width = 0, height = 0;
  for (const fs::path& frame : frames) {
    const auto info = inspect_png(frame);
    if (!info)
      throw InputError(
          fmt::format("{}: is missing, cut short or damaged, so no film was made; render this frame again",
                      frame.string()));
    if (width == 0) width = info->width, height = info->height;
    if (info->width != width || info->height != height)
      throw InputError(fmt::format("{}: has {}×{} pixels, but {} has {}×{}; render them alike",
                                   frame.string(), info->width, info->height, frames[0].string(), width,
                                   height));
  }
}

// H.264 with yuv420p wants even sides.
Image8 with_even_sides(Image8 image) {
  const int width = image.width + image.width % 2, height = image.height + image.height % 2;
  if (width == image.width && height == image.height) return image;
  Image8 even{width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 3)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        even.rgb[3 * (std::size_t(y) * width + x) + c] =
            image.rgb[3 * (std::size_t(std::min(y, image.height - 1)) * image.width +
                           std::min(x, image.width - 1)) +
                      c];
  return even;
}

std::string last_lines(std::string text, int count) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::size_t begin = text.size();
  while (begin > 0 && count > 0)
    if (text[--begin] == '\n' && --count == 0) ++begin;
  return text.empty() ? "it said nothing" : text.substr(begin);
}

std::uint64_t big_endian(const std::string& file, std::size_t at, int bytes) {
  std::uint64_t n = 0;
  for (int i = 0; i < bytes; ++i) n = n << 8 | static_cast<unsigned char>(file[at + std::size_t(i)]);
  return n;
}

// An mp4 is a row of boxes: 4 bytes of size, 4 of kind; size 1 puts the real one in the next 8. ffmpeg has
// been seen to end with 0 on a file it could not finish.
bool is_whole_mp4(const std::string& file) {
  bool has_index = false, has_pictures = false;
  std::size_t at = 0;
  while (file.size() - at >= 16) {
    const std::uint64_t size =
        big_endian(file, at, 4) == 1 ? big_endian(file, at + 8, 8) : big_endian(file, at, 4);
    if (size < 8 || size > file.size() - at) return false;
    has_index |= file.compare(at + 4, 4, "moov") == 0;
    has_pictures |= file.compare(at + 4, 4, "mdat") == 0;
    at += std::size_t(size);
  }
  return has_index && has_pictures;
}

// WebM is EBML (RFC 8794): a head, then one segment that says how long it is. The number of leading zero bits
// of a length's first byte says how many bytes follow.
bool is_whole_webm(const std::string& file) {
  std::size_t at = 0;
  for (const std::uint64_t id : {0x1A45DFA3u, 0x18538067u}) {
    if (file.size() < at + 12 || big_endian(file, at, 4) != id) return false;
    const int bytes = 1 + std::countl_zero(static_cast<unsigned char>(file[at + 4]));
    if (bytes > 8) return false;
    const std::uint64_t size =
        big_endian(file, at + 4, bytes) & ((std::uint64_t(1) << (7 * bytes)) - 1);  // without the marker
    at += 4 + std::size_t(bytes) + std::size_t(size);
    if (size > file.size() || at > file.size()) return false;
  }
  return at == file.size();
}

bool is_whole_gif(const std::string& file) { return file.starts_with("GIF89a") && file.back() == ';'; }

struct Format {
  const char* ending;
  std::vector<std::string> words;  // of ffmpeg's output
  bool (*is_whole)(const std::string&);
};

// A fixed number of threads: x264's and VP9's output depends on it.
const std::vector<Format>& formats() {
  static const std::vector<std::string> bt709{"-vf",
                                              "scale=out_color_matrix=bt709:out_range=tv",
                                              "-pix_fmt",
                                              "yuv420p",
                                              "-color_primaries",
                                              "bt709",
                                              "-color_trc",
                                              "bt709",
                                              "-colorspace",
                                              "bt709",
                                              "-color_range",
                                              "tv"};
  const auto with_bt709 = [](std::vector<std::string> words) {
    words.insert(words.begin(), bt709.begin(), bt709.end());
    return words;
  };
  static const std::vector<Format> all{
      {".mp4",
       with_bt709({"-c:v", "libx264", "-preset", "medium", "-crf", "18", "-threads", "2", "-movflags",
                   "+faststart", "-f", "mp4"}),
       is_whole_mp4},
      {".webm",
       with_bt709({"-c:v", "libvpx-vp9", "-crf", "30", "-b:v", "0", "-deadline", "good", "-cpu-used", "4",
                   "-threads", "2", "-f", "webm"}),
       is_whole_webm},
      {".gif",
       {"-filter_complex", "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=sierra2_4a",
        "-f", "gif"},
       is_whole_gif}};
  return all;
}

const Format& format_of(const fs::path& film) {
  for (const Format& format : formats())
    if (film.extension() == format.ending) return format;
  throw InputError(fmt::format("{}: a film's name ends in .mp4, .webm or .gif", film.string()));
}

}  // namespace

void require_film_possible(double frames_per_second, const fs::path& film) {
  if (!(frames_per_second >= 0.1 && frames_per_second <= 240))
    throw InputError(fmt::format("{} frames a second: must lie between 0.1 and 240", frames_per_second));
  format_of(film);
  if (film.extension() == ".gif" && frames_per_second > 50)
    throw InputError(fmt::format("{}: a GIF shows at most 50 frames a second, not {}; choose .mp4 or .webm",
                                 film.string(), frames_per_second));
  if (const fs::path folder = film.parent_path(); !folder.empty() && !fs::is_directory(folder))
    throw InputError(fmt::format("{}: there is no folder {}; make it first", film.string(), folder.string()));
  if (!is_in_path("ffmpeg"))
    throw InputError(
        fmt::format("{}: films are made by ffmpeg, and there is none in PATH; install it, or add it to PATH",
                    film.string()));
}

void make_film(const std::vector<fs::path>& frames, double frames_per_second, const fs::path& film) {
  require_film_possible(frames_per_second, film);
  const Format& format = format_of(film);
  require_all_good(frames);
  Image8 image = with_even_sides(read_png(frames[0]));
  const int width = image.width, height = image.height;

  PendingFile pending(film);
  write_file(pending.temporary(), "");  // our own complaint if the folder is missing or not writable
  // Decoded pixels go in, so no damaged PNG and no odd file name can reach ffmpeg.
  std::vector<std::string> command{"ffmpeg",
                                   "-hide_banner",
                                   "-loglevel",
                                   "error",
                                   "-nostats",
                                   "-xerror",
                                   "-y",
                                   "-f",
                                   "rawvideo",
                                   "-pix_fmt",
                                   "rgb24",
                                   "-video_size",
                                   fmt::format("{}x{}", width, height),
                                   "-framerate",
                                   fmt::format("{}", frames_per_second),
                                   "-i",
                                   "pipe:0"};
  command.insert(command.end(), format.words.begin(), format.words.end());
  command.insert(command.end(), {"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1",
                                 pending.temporary().string()});
  detail::Process ffmpeg(command);
  Progress progress("film", std::int64_t(frames.size()));
  bool taken = true;
  for (std::size_t f = 0; f < frames.size() && taken; ++f) {
    throw_if_stopped();
    if (f > 0) image = with_even_sides(read_png(frames[f]));
    taken = ffmpeg.write(image.rgb.data(), image.rgb.size());
    progress.update(std::int64_t(f) + 1);
  }
  const int code = ffmpeg.finish();
  throw_if_stopped();
  const std::string words = ffmpeg.said();
  const bool disk_full = words.find("No space left") != words.npos;
  const std::string what =
      fmt::format("{}: ffmpeg failed (exit code {}): {}", film.string(), code, last_lines(words, 4));
  if (disk_full) throw DiskError(what);
  if (code != 0 || !taken) throw InputError(what);
  if (!format.is_whole(read_file(pending.temporary())))
    throw DiskError(
        fmt::format("{}: ffmpeg ended well but its file is not whole; is the disk full?", film.string()));
  pending.commit();
}

namespace {

// `frame_at` gives a frame, `name_of` says which one is meant.
template <class FrameAt, class NameOf>
Image8 sheet_of(int count, const FrameAt& frame_at, const NameOf& name_of,
                const std::vector<std::string>& captions, const SheetLook& look) {
  if (count == 0) throw InputError("there is no frame to put on a contact sheet; render first");
  LIMBER_CHECK(captions.empty() || int(captions.size()) == count, captions.size(), count);
  LIMBER_CHECK(look.tile_width_px > 0 && look.margin_px >= 0 && look.columns >= 0, look.tile_width_px,
               look.margin_px, look.columns);
  const int columns = look.columns > 0 ? std::min(look.columns, count) : int(std::ceil(std::sqrt(count)));
  const int rows = (count + columns - 1) / columns;
  double longest = 1;  // as wide as so many capitals are high
  for (const std::string& caption : captions)
    longest = std::max(longest, detail::text_width(caption, 20) / 20);

  Image8 sheet;
  int tile_width = 0, tile_height = 0, caption_band = 0;
  double caption_px = 0;  // height of a capital
  const auto place = [&](const Image8& part, int left, int top) {
    for (int y = 0; y < part.height; ++y)
      std::copy_n(&part.rgb[std::size_t(3) * y * part.width], 3 * part.width,
                  &sheet.rgb[3 * (std::size_t(top + y) * sheet.width + left)]);
  };
  for (int f = 0; f < count; ++f) {
    Image8 frame = frame_at(f);
    if (f == 0) {
      tile_width = std::min(look.tile_width_px, frame.width);
      tile_height = std::max(1, int(std::lround(double(frame.height) * tile_width / frame.width)));
      if (!captions.empty()) {  // as large as reads well, and smaller where the longest would not fit
        caption_px = std::clamp(tile_width / 40.0, 6.0, 24.0);
        caption_px = std::clamp(tile_width / longest, 4.0, caption_px);
        caption_band = int(std::ceil(3 * caption_px));
      }
      sheet =
          filled(columns * (tile_width + look.margin_px) + look.margin_px,
                 rows * (tile_height + caption_band + look.margin_px) + look.margin_px, look.background_srgb);
    }
    if (frame.width < tile_width || frame.height < tile_height)
      throw InputError(fmt::format("{}: is smaller than {}; render them alike", name_of(f), name_of(0)));
    frame = shrunk(frame, tile_width, tile_height);
    const int left = look.margin_px + f % columns * (tile_width + look.margin_px);
    const int top = look.margin_px + f / columns * (tile_height + caption_band + look.margin_px);
    place(frame, left, top);
    if (captions.empty()) continue;
    Image8 band = filled(tile_width, caption_band, look.background_srgb);
    detail::draw_text(band, captions[f], 0, 1.9 * caption_px,
                      {.height_px = caption_px, .color_srgb = look.caption_srgb});
    place(band, left, top + tile_height);
  }
  return sheet;
}

}  // namespace

Image8 contact_sheet(const std::vector<fs::path>& frames, const std::vector<std::string>& captions,
                     const SheetLook& look) {
  const auto file = [&](int f) -> const fs::path& { return frames[std::size_t(f)]; };
  return sheet_of(
      int(frames.size()), [&](int f) { return read_png(file(f)); }, [&](int f) { return file(f).string(); },
      captions, look);
}

Image8 contact_sheet_of(const std::vector<Image8>& frames, const std::vector<std::string>& captions,
                        const SheetLook& look) {
  return sheet_of(
      int(frames.size()), [&](int f) { return frames[std::size_t(f)]; },
      [](int f) { return fmt::format("picture {}", f + 1); }, captions, look);
}

std::vector<int> spread_over(int frames, int count) {
  std::vector<int> picked;
  const int n = std::min(frames, count);
  for (int i = 0; i < n; ++i)
    picked.push_back(n == 1 ? 0 : int(std::lround(double(i) * (frames - 1) / (n - 1))));
  return picked;
}

}  // namespace limber::render
