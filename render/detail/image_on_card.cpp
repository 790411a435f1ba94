#include "render/detail/image_on_card.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>
#include <array>
#include <vector>

namespace limber::render::detail {

namespace {

struct Level {
  int width, height;
  std::vector<std::uint16_t> rgba;
};

Level largest(const Image8& image, bool colors) {
  std::array<std::uint16_t, 256> level_of;
  for (int i = 0; i < 256; ++i)
    level_of[std::size_t(i)] =
        std::uint16_t(65535 * (colors ? linear_from_srgb(i / 255.0) : i / 255.0) + 0.5);
  Level level{image.width, image.height, {}};
  level.rgba.reserve(4 * std::size_t(image.width) * std::size_t(image.height));
  for (int y = image.height - 1; y >= 0; --y) {
    const std::uint8_t* row = &image.rgb[std::size_t(3) * std::size_t(y) * std::size_t(image.width)];
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) level.rgba.push_back(level_of[row[3 * x + c]]);
      level.rgba.push_back(65535);
    }
  }
  return level;
}

// Means of two by two; an odd last row or column is left out, as sizes of OpenGL are rounded down.
Level halved(const Level& from) {
  Level to{std::max(from.width / 2, 1), std::max(from.height / 2, 1), {}};
  to.rgba.resize(4 * std::size_t(to.width) * std::size_t(to.height));
  const auto at = [&](int x, int y, int c) {
    return int(from.rgba[4 * (std::size_t(std::min(y, from.height - 1)) * std::size_t(from.width) +
                              std::size_t(std::min(x, from.width - 1))) +
                         std::size_t(c)]);
  };
  for (int y = 0; y < to.height; ++y)
    for (int x = 0; x < to.width; ++x)
      for (int c = 0; c < 4; ++c)
        to.rgba[4 * (std::size_t(y) * std::size_t(to.width) + std::size_t(x)) + std::size_t(c)] =
            std::uint16_t((at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) + at(2 * x, 2 * y + 1, c) +
                           at(2 * x + 1, 2 * y + 1, c) + 2) /
                          4);
  return to;
}

}  // namespace

ImageOnCard image_on_card(const Image8& image, bool colors) {
  ImageOnCard made;
  glGenTextures(1, &made.texture.id);
  made.texture.bind(0);
  for (const auto& [name, value] :
       {std::pair{GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR},
        std::pair{GL_TEXTURE_MAG_FILTER, GL_LINEAR}, std::pair{GL_TEXTURE_WRAP_S, GL_REPEAT},
        std::pair{GL_TEXTURE_WRAP_T, GL_REPEAT}})
    glTexParameteri(GL_TEXTURE_2D, GLenum(name), value);
  Level level = largest(image, colors);
  while (std::max(level.width, level.height) > max_texels_a_side) level = halved(level);
  for (GLint number = 0;; ++number) {
    glTexImage2D(GL_TEXTURE_2D, number, GL_RGBA16, level.width, level.height, 0, GL_RGBA, GL_UNSIGNED_SHORT,
                 level.rgba.data());
    if (level.width == 1 && level.height == 1) {
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, number);
      break;
    }
    level = halved(level);
  }
  made.mean = Vec3(level.rgba[0], level.rgba[1], level.rgba[2]) / 65535;
  return made;
}

}  // namespace limber::render::detail
