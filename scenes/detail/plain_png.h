// A PNG file of pictures with large areas of one color, which is the same bytes whatever zlib there is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace limber::scenes {

struct Picture {  // sRGB, or numbers; row 0 is at the top
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // (3 × width × height)
};
std::string plain_png(const Picture&);

}  // namespace limber::scenes
