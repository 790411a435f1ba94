// Images of models: what a file shows comes in, and no file does harm.
#include "render/image_file.h"

#include <cstdio>
// after cstdio, which it needs
#include <gtest/gtest.h>
#include <jpeglib.h>
#include <zlib.h>

#include "core/error.h"
#include "core/progress.h"
#include "core/random.h"
#include "render/png_file.h"

namespace limber::render {
namespace {

Image8 ramp(int width, int height) {
  Image8 image{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.rgb.insert(image.rgb.end(), {std::uint8_t(255 * x / width), std::uint8_t(255 * y / height), 128});
  return image;
}

std::string jpeg_bytes(const Image8& image, bool progressive) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = JDIMENSION(image.width), jpeg.image_height = JDIMENSION(image.height);
  jpeg.input_components = 3, jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 98, TRUE);
  if (progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  for (int y = 0; y < image.height; ++y) {
    std::vector<std::uint8_t> row(&image.rgb[std::size_t(3 * y * image.width)],
                                  &image.rgb[std::size_t(3 * y * image.width)] + 3 * image.width);
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&jpeg, &pointer, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::string made(reinterpret_cast<char*>(bytes), size);
  jpeg_destroy_compress(&jpeg);
  std::free(bytes);
  return made;
}

std::string complaint_about(const std::string& bytes) {
  try {
    decoded_image(bytes, "it");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ImageFile, PngsOfAllKindsComeInAsTheyAre) {
  const Image8 image = ramp(37, 21);
  EXPECT_EQ(decoded_image(png_bytes(image), "it"), image);
  Raster16 deep{37, 21, 3, {}};
  Raster8 clear{37, 21, 4, {}}, grey{37, 21, 1, {}};
  Image8 of_grey{37, 21, {}};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    deep.levels.push_back(std::uint16_t(257 * image.rgb[i]));
    clear.levels.push_back(image.rgb[i]);
    if (i % 3 != 2) continue;
    clear.levels.push_back(std::uint8_t(i));  // transparency is left out
    grey.levels.push_back(image.rgb[i - 1]);
    of_grey.rgb.insert(of_grey.rgb.end(), 3, image.rgb[i - 1]);
  }
  EXPECT_EQ(decoded_image(png_bytes(deep), "it"), image);
  EXPECT_EQ(decoded_image(png_bytes(clear), "it"), image);
  EXPECT_EQ(decoded_image(png_bytes(grey), "it"), of_grey);
}

TEST(ImageFile, JpegsComeInWithinTheirRounding) {
  const Image8 image = ramp(64, 48);
  for (const bool progressive : {false, true}) {
    const Image8 read = decoded_image(jpeg_bytes(image, progressive), "it");
    ASSERT_EQ(read.rgb.size(), image.rgb.size());
    int most = 0;
    for (std::size_t i = 0; i < image.rgb.size(); ++i)
      most = std::max(most, std::abs(int(read.rgb[i]) - int(image.rgb[i])));
    EXPECT_LE(most, 12);
  }
}

TEST(ImageFile, NothingCutShortIsTaken) {
  const Image8 image = ramp(40, 30);
  for (const std::string& whole : {png_bytes(image), jpeg_bytes(image, false), jpeg_bytes(image, true)})
    for (std::size_t size = 0; size < whole.size() - 2; ++size)
      EXPECT_NE(complaint_about(whole.substr(0, size)), "") << size << " of " << whole.size();
}

TEST(ImageFile, NoChangedByteCrashes) {
  const Image8 image = ramp(40, 30);
  Rng rng(7, 0);
  for (const std::string& whole : {png_bytes(image), jpeg_bytes(image, false), jpeg_bytes(image, true)})
    for (int i = 0; i < 3000; ++i) {
      std::string changed = whole;
      for (int n = 1 + rng.below(4); n > 0; --n)
        changed[std::size_t(rng.below(int(whole.size())))] = char(rng.below(256));
      complaint_about(changed);
    }
}

TEST(ImageFile, WhatIsTooLargeIsToldByItsSize) {
  std::string jpeg = jpeg_bytes(ramp(8, 8), false);
  const std::size_t frame = jpeg.find("\xff\xc0");
  ASSERT_NE(frame, jpeg.npos);
  for (const std::size_t at : {5u, 7u}) jpeg[frame + at] = '\x50';  // height and width: 0x5008 each
  EXPECT_NE(complaint_about(jpeg).find("20488 × 20488 pixels"), std::string::npos) << complaint_about(jpeg);
  EXPECT_NE(complaint_about(png_bytes(Raster8{16385, 1, 1, std::vector<std::uint8_t>(16385)}))
                .find("16385 × 1 pixels; at most 16384 a side"),
            std::string::npos);
  EXPECT_NE(complaint_about("GIF89a").find("neither PNG nor JPEG"), std::string::npos);
}

// Headers of 2^26 pixels, whole and with checksums that fit, over next to nothing.
TEST(ImageFile, WhatOnlySaysThatItIsHugeTakesNoMemory) {
  std::string png = png_bytes(ramp(4, 4)), jpeg = jpeg_bytes(ramp(8, 8), true);
  const auto put = [](std::string& bytes, std::size_t at, std::initializer_list<int> values) {
    for (const int value : values) bytes[at++] = char(value);
  };
  put(png, 16, {0, 0, 0x40, 0, 0, 0, 0x10, 0});  // width 16384, height 4096
  const auto sum = std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(&png[12]), 17));
  put(png, 29, {int(sum >> 24), int(sum >> 16), int(sum >> 8), int(sum)});
  const std::size_t frame = jpeg.find("\xff\xc2");
  ASSERT_NE(frame, jpeg.npos);
  put(jpeg, frame + 5, {0x10, 0, 0x40, 0});
  const double before_mb = peak_memory_mb();
  for (const std::string& bytes : {png, jpeg})
    EXPECT_NE(complaint_about(bytes).find("bytes cannot hold 16384 × 4096 pixels"), std::string::npos)
        << complaint_about(bytes);
  EXPECT_LT(peak_memory_mb() - before_mb, 20);
}

}  // namespace
}  // namespace limber::render
