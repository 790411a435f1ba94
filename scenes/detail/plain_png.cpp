#include "scenes/detail/plain_png.h"

#include <zlib.h>

#include <algorithm>

namespace limber::scenes {

namespace {

// One block of deflate (RFC 1951) in the fixed code: bytes as they are, and runs of one byte.
class RunLengths {
 public:
  explicit RunLengths(const std::string& bytes) {
    put(1, 1), put(1, 2);  // the last block; fixed code
    for (std::size_t i = 0; i < bytes.size();) {
      literal(std::uint8_t(bytes[i]));
      std::size_t more = 0;
      while (i + 1 + more < bytes.size() && bytes[i + 1 + more] == bytes[i]) ++more;
      i += 1 + more;
      for (; more >= 258; more -= 258) code(0xc0 + 285 - 280, 8), code(0, 5);
      for (; more >= 10; more -= 10) code(264 - 256, 7), code(0, 5);
      for (; more > 0; --more) literal(std::uint8_t(bytes[i - 1]));
    }
    code(0, 7);
    put(0, 7);  // what is left of the last byte
  }
  std::string take() { return std::move(out_); }

 private:
  void put(std::uint32_t bits, int count) {
    held_ |= bits << held_bits_;
    for (held_bits_ += count; held_bits_ >= 8; held_bits_ -= 8, held_ >>= 8) out_ += char(held_ & 255);
  }
  void code(std::uint32_t word, int length) {  // the highest bit first
    for (int b = length - 1; b >= 0; --b) put(word >> b & 1, 1);
  }
  void literal(std::uint8_t byte) { byte < 144 ? code(0x30 + byte, 8) : code(0x190 + byte - 144u, 9); }

  std::string out_;
  std::uint32_t held_ = 0;
  int held_bits_ = 0;
};

std::string big_endian(std::uint32_t n) {
  return {char(n >> 24), char(n >> 16 & 255), char(n >> 8 & 255), char(n & 255)};
}

std::string chunk(const std::string& type, const std::string& data) {
  const std::string sum_of = type + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(sum_of.data()), uInt(sum_of.size()));
  return big_endian(std::uint32_t(data.size())) + sum_of + big_endian(std::uint32_t(sum));
}

}  // namespace

std::string plain_png(const Picture& picture) {
  const std::size_t row = 3 * std::size_t(picture.width);
  std::string filtered;
  for (int y = 0; y < picture.height; ++y) {
    filtered += '\2';  // differences from the row above
    for (std::size_t i = 0; i < row; ++i) {
      const std::uint8_t* at = &picture.rgb[std::size_t(y) * row + i];
      filtered += char(std::uint8_t(*at - (y > 0 ? *(at - row) : 0)));
    }
  }
  const auto sum = adler32(1, reinterpret_cast<const Bytef*>(filtered.data()), uInt(filtered.size()));
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", big_endian(std::uint32_t(picture.width)) + big_endian(std::uint32_t(picture.height)) +
                           std::string("\x08\x02\0\0\0", 5)) +
         chunk("IDAT", "\x78\x01" + RunLengths(filtered).take() + big_endian(std::uint32_t(sum))) +
         chunk("IEND", "");
}

}  // namespace limber::scenes
