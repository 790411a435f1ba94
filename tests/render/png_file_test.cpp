#include "render/png_file.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>

#include "core/error.h"
#include "core/random.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

Image8 noise(int width, int height) {
  Rng rng(21, 0);
  Image8 image{width, height, {}};
  for (int i = 0; i < width * height * 3; ++i) image.rgb.push_back(std::uint8_t(rng.below(256)));
  return image;
}

TEST(PngFile, RoundTrip) {
  const Folder folder;
  for (const auto& [width, height] : {std::pair{1, 1}, std::pair{7, 5}, std::pair{64, 33}}) {
    const Image8 image = noise(width, height);
    const Texts texts{{"limber-hash", "00ff00ff00ff00ff"}, {"Title", "a robot, squeezed"}};
    write_png(folder / "a.png", image, texts);
    Texts back;
    EXPECT_EQ(read_png(folder / "a.png", &back), image);
    EXPECT_EQ(back, texts);
    EXPECT_EQ(frame_hash(folder / "a.png"), "00ff00ff00ff00ff");
  }
  EXPECT_EQ(png_bytes(noise(9, 9)), png_bytes(noise(9, 9)));
}

TEST(PngFile, EveryKindOfRasterComesBack) {
  const Folder folder;
  Rng rng(22, 0);
  for (int channels = 1; channels <= 4; ++channels) {
    Raster8 eight{13, 7, channels, {}};
    Raster16 sixteen{13, 7, channels, {}};
    for (int i = 0; i < 13 * 7 * channels; ++i) {
      eight.levels.push_back(std::uint8_t(rng.below(256)));
      sixteen.levels.push_back(std::uint16_t(rng.below(65536)));
    }
    write_png(folder / "16.png", sixteen, {{"limber-hash", "1"}});
    Texts texts;
    EXPECT_EQ(read_png_16(folder / "16.png", &texts), sixteen);
    EXPECT_EQ(texts, (Texts{{"limber-hash", "1"}}));
    write_png(folder / "8.png", eight);
    Raster16 times_257 = sixteen;
    std::transform(eight.levels.begin(), eight.levels.end(), times_257.levels.begin(),
                   [](std::uint8_t v) { return std::uint16_t(257 * v); });
    EXPECT_EQ(read_png_16(folder / "8.png"), times_257);
  }
  // Without alpha the two readers agree.
  const Image8 image = noise(9, 4);
  write_png(folder / "a.png", image);
  const Raster16 wide = read_png_16(folder / "a.png");
  for (std::size_t i = 0; i < image.rgb.size(); ++i) EXPECT_EQ(wide.levels[i], 257 * image.rgb[i]);
}

// core's write_file waits for the disk each time.
void write_quickly(const fs::path& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

TEST(PngFile, EveryPrefixAndEveryChangedByteIsRecognised) {
  const Folder folder;
  const std::string good = png_bytes(noise(8, 6), {{"limber-hash", "0123456789abcdef"}});
  for (std::size_t size = 0; size < good.size(); ++size) {
    write_quickly(folder / "a.png", good.substr(0, size));
    EXPECT_EQ(frame_hash(folder / "a.png"), std::nullopt) << size;
    EXPECT_THROW(read_png(folder / "a.png"), InputError) << size;
    EXPECT_THROW(read_png_16(folder / "a.png"), InputError) << size;
  }
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = char(bad[at] ^ 0x10);
    write_quickly(folder / "a.png", bad);
    EXPECT_EQ(frame_hash(folder / "a.png"), std::nullopt) << at;
  }
}

// A chunk: length, kind, data, checksum of kind and data (PNG, section 5.3).
std::string chunk(const std::string& kind, const std::string& data) {
  const auto big_endian = [](std::uint32_t n) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += char(n >> shift & 255);
    return bytes;
  };
  const std::string body = kind + data;
  std::string bytes = big_endian(std::uint32_t(data.size()));
  bytes += body;
  return bytes +
         big_endian(std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(body.data()), uInt(body.size()))));
}

// One header for those who look and one for those who decode.
TEST(PngFile, OneHeaderComesFirstAndSaysNoMoreThanTheFileCanHold) {
  const Folder folder;
  const auto header = [](char high) {  // high << 8 pixels, both ways, 8 bits of grey
    return std::string("\0\0", 2) + high + std::string("\0\0\0", 3) + high + std::string("\0\10\0\0\0\0", 6);
  };
  const std::string signature = "\x89PNG\r\n\x1a\n", end = chunk("IEND", ""), pixels = chunk("IDAT", "x");
  const auto refused = [&](const std::string& chunks) {
    std::string bytes = signature;
    bytes += chunks;
    std::ofstream(folder.path / "a.png", std::ios::binary) << bytes;
    EXPECT_THROW(read_png(folder.path / "a.png"), InputError);
    EXPECT_THROW(read_png_16(folder.path / "a.png"), InputError);
    return !inspect_png(folder.path / "a.png");
  };
  EXPECT_TRUE(refused(chunk("IHDR", header(64)) + chunk("IHDR", header(1)) + pixels + end));
  EXPECT_TRUE(refused(chunk("tEXt", std::string("a\0b", 3)) + chunk("IHDR", header(1)) + pixels + end));
  EXPECT_FALSE(refused(chunk("IHDR", header(40)) + pixels + end));  // of one piece, and yet it cannot be
  try {
    read_png(folder.path / "a.png");
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("cannot hold 10240 × 10240 pixels"), std::string::npos)
        << error.what();
  }
}

TEST(PngFile, AFrameWithoutHashOrFileHasNone) {
  const Folder folder;
  write_png(folder / "a.png", noise(3, 3));
  EXPECT_EQ(frame_hash(folder / "a.png"), std::nullopt);
  EXPECT_TRUE(inspect_png(folder / "a.png"));
  EXPECT_EQ(frame_hash(folder / "none.png"), std::nullopt);
  EXPECT_EQ(frame_hash(folder.path), std::nullopt);
  EXPECT_THROW(read_png(folder / "none.png"), InputError);
}

TEST(PngFile, AnUnwritableFolderIsADiskError) {
  const Folder folder;
  write_file(folder / "file", "");
  EXPECT_THROW(write_png(folder / "file" / "a.png", noise(3, 3)), DiskError);
  EXPECT_THROW(write_png(folder / "missing" / "a.png", noise(3, 3)), DiskError);
}

}  // namespace
}  // namespace limber::render
