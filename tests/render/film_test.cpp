#include "render/film.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>

#include "core/error.h"
#include "render/detail/lettering.h"
#include "render/png_file.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

std::vector<fs::path> write_frames(const Folder& folder, int count, int width, int height) {
  std::vector<fs::path> frames;
  for (int f = 0; f < count; ++f) {
    frames.push_back(folder /
                     fmt::format("it's {:02}%d.png", f));  // a name that would trouble a shell or a pattern
    write_png(frames.back(), filled(width, height, Vec3(0.1 * f, 0.5, 1 - 0.1 * f)));
  }
  return frames;
}

int files_in(const Folder& folder) {
  return int(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()));
}

// PATH with only `programs` in it, until the end of the scope.
struct OnlyPrograms {
  explicit OnlyPrograms(const fs::path& programs) : before(::getenv("PATH")) {
    ::setenv("PATH", programs.c_str(), 1);
  }
  ~OnlyPrograms() { ::setenv("PATH", before.c_str(), 1); }
  std::string before;
};

void write_program(const fs::path& path, const std::string& script) {
  write_file(path, "#!/bin/sh\n" + script);
  fs::permissions(path, fs::perms::owner_all);
}

std::string message_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

// The picture size in an mp4's track header: 16.16 fixed point, the last 8 bytes of the box `tkhd`.
std::pair<int, int> size_in_mp4(const std::string& file) {
  const std::size_t tag = file.find("tkhd");
  if (tag == file.npos) return {0, 0};
  const auto number = [&](std::size_t at) {
    return int(static_cast<unsigned char>(file[at])) << 8 | static_cast<unsigned char>(file[at + 1]);
  };
  const std::size_t end = tag - 4 + std::size_t(number(tag - 2));
  return {number(end - 8), number(end - 4)};
}

TEST(Film, HasTheFramesAndIsTheSameEachTime) {
  const Folder folder;
  const auto frames = write_frames(folder, 8, 33, 17);
  make_film(frames, 24, folder / "a.mp4");
  make_film(frames, 24, folder / "b.mp4");
  const std::string film = read_file(folder / "a.mp4");
  EXPECT_EQ(film, read_file(folder / "b.mp4"));
  EXPECT_EQ(size_in_mp4(film), std::pair(34, 18));  // odd sides are padded
  EXPECT_EQ(files_in(folder), 10);
}

// The pixels of a film, as ffmpeg reads them.
std::string decoded(const fs::path& film) {
  const std::string command =
      "ffmpeg -loglevel error -i '" + film.string() + "' -f rawvideo -pix_fmt rgb24 - 2>&1";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  std::string pixels;
  for (int c; (c = std::fgetc(pipe)) != EOF;) pixels.push_back(char(c));
  EXPECT_EQ(::pclose(pipe), 0) << pixels;
  return pixels;
}

TEST(Film, EveryFormatShowsTheFramesInTheirColours) {
  const Folder folder;
  const auto frames = write_frames(folder, 8, 64, 32);
  for (const char* name : {"a.mp4", "a.webm", "a.gif"}) {
    make_film(frames, 25, folder / name);
    const std::string pixels = decoded(folder / name);
    ASSERT_EQ(pixels.size(), 8u * 64 * 32 * 3) << name;
    for (std::size_t f = 0; f < 8; ++f)
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(static_cast<unsigned char>(pixels[(f * 64 * 32 + 700) * 3 + c]),
                    read_png(frames[f]).rgb[700 * 3 + c], 6)
            << name << " frame " << f;
  }
  const std::string again = read_file(folder / "a.webm");
  make_film(frames, 25, folder / "a.webm");
  EXPECT_EQ(read_file(folder / "a.webm"), again);
  EXPECT_NE(message_of([&] { make_film(frames, 25, folder / "a.avi"); }).find(".webm"), std::string::npos);
  EXPECT_NE(message_of([&] { make_film(frames, 60, folder / "a.gif"); }).find("50 frames"),
            std::string::npos);
}

TEST(Film, IsNotMadeWhenAFrameIsMissingDamagedOrOfAnotherSize) {
  const Folder folder;
  auto frames = write_frames(folder, 3, 32, 16);
  const auto complaint = [&] { return message_of([&] { make_film(frames, 24, folder / "a.mp4"); }); };
  const std::string good = read_file(frames[1]);
  write_file(frames[1], good.substr(0, good.size() - 20));
  EXPECT_NE(complaint().find(frames[1].string()), std::string::npos);
  fs::remove(frames[1]);
  EXPECT_THROW(make_film(frames, 24, folder / "a.mp4"), InputError);
  EXPECT_NE(complaint().find(frames[1].string()), std::string::npos);
  write_png(frames[1], filled(30, 16, {0, 0, 0}));
  EXPECT_NE(complaint().find("30×16"), std::string::npos);
  EXPECT_THROW(make_film({}, 24, folder / "a.mp4"), InputError);
  EXPECT_THROW(make_film({frames[0]}, 0, folder / "a.mp4"), InputError);
  EXPECT_EQ(files_in(folder), 3);
}

TEST(Film, SaysWhatFfmpegSaid) {
  const Folder folder, programs;
  const auto frames = write_frames(folder, 3, 320, 160);
  const auto film = [&] { make_film(frames, 24, folder / "a.mp4"); };
  const OnlyPrograms only(programs.path);
  EXPECT_THROW(film(), InputError);
  EXPECT_NE(message_of(film).find("there is none in PATH"), std::string::npos);

  write_program(programs / "ffmpeg", "echo one >&2; echo Unknown encoder libx264 >&2; exit 3\n");
  EXPECT_THROW(film(), InputError);
  EXPECT_NE(message_of(film).find("(exit code 3): one\nUnknown encoder libx264"), std::string::npos);

  write_program(programs / "ffmpeg",
                "echo 'av_interleaved_write_frame(): No space left on device' >&2; exit 1\n");
  EXPECT_THROW(film(), DiskError);

  write_program(programs / "ffmpeg", "while read -r x; do :; done; exit 0\n");  // ends well without a film
  EXPECT_THROW(film(), DiskError);
  EXPECT_EQ(files_in(folder), 3);
}

TEST(Film, AFolderThatIsMissingIsNamed) {
  const Folder folder;
  const auto frames = write_frames(folder, 2, 32, 16);
  EXPECT_THROW(make_film(frames, 24, folder / "missing" / "a.mp4"), InputError);
}

TEST(Sheet, HoldsEveryFrameInItsPlace) {
  const Folder folder;
  const auto frames = write_frames(folder, 5, 60, 30);
  SheetLook look;
  look.columns = 3, look.tile_width_px = 20, look.margin_px = 4;
  const Image8 sheet = contact_sheet(frames, {}, look);
  EXPECT_EQ(sheet.width, 3 * 20 + 4 * 4);
  EXPECT_EQ(sheet.height, 2 * 10 + 3 * 4);
  const auto color = [&](int x, int y) {
    return Eigen::Map<const Eigen::Matrix<std::uint8_t, 3, 1>>(
               &sheet.rgb[3 * (std::size_t(y) * sheet.width + x)])
        .cast<int>()
        .eval();
  };
  for (int f = 0; f < 5; ++f) {
    const Image8 frame = read_png(frames[f]);
    EXPECT_EQ(color(4 + 24 * (f % 3) + 10, 4 + 14 * (f / 3) + 5),
              Eigen::Vector3i(frame.rgb[0], frame.rgb[1], frame.rgb[2]))
        << f;
  }
  EXPECT_EQ(color(4 + 48 + 10, 4 + 14 + 5), Eigen::Vector3i(255, 255, 255));
  EXPECT_THROW(contact_sheet({}, {}), InputError);
  EXPECT_THROW(contact_sheet({folder / "none.png"}, {}), InputError);
}

TEST(Sheet, ALongCaptionStaysUnderItsOwnFrame) {
  const Folder folder;
  const auto frames = write_frames(folder, 2, 60, 30);
  SheetLook look;
  look.columns = 2, look.tile_width_px = 60, look.margin_px = 5;
  const Image8 sheet = contact_sheet(frames, {std::string(200, 'W'), ""}, look);
  int ink = 0, elsewhere = 0;
  for (int y = 5 + 30; y < sheet.height; ++y)
    for (int x = 0; x < sheet.width; ++x) {
      const bool dark = sheet.rgb[3 * (std::size_t(y) * sheet.width + x)] < 200;
      (5 <= x && x < 65 ? ink : elsewhere) += dark;
    }
  EXPECT_GT(ink, 20);
  EXPECT_EQ(elsewhere, 0);
}

TEST(Sheet, CaptionsAreReadable) {
  // Each printable letter leaves ink within its own box, and no two letters look alike.
  std::map<std::vector<std::uint8_t>, char> seen;
  for (char letter = '!'; letter <= '~'; ++letter) {
    Image8 box = filled(24, 36, {1, 1, 1});
    detail::draw_text(box, std::string(1, letter), 0, 26, {.height_px = 18, .color_srgb = {0, 0, 0}});
    EXPECT_NE(box, filled(24, 36, {1, 1, 1})) << letter;
    const auto [other, is_new] = seen.insert({box.rgb, letter});
    EXPECT_TRUE(is_new) << letter << " looks like " << other->second;
  }
}

TEST(Sheet, FramesAreSpreadEvenly) {
  EXPECT_EQ(spread_over(101, 5), (std::vector<int>{0, 25, 50, 75, 100}));
  EXPECT_EQ(spread_over(3, 8), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(spread_over(9, 1), std::vector<int>{0});
  EXPECT_TRUE(spread_over(0, 4).empty());
}

}  // namespace
}  // namespace limber::render
