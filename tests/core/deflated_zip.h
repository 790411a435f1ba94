// Archives as limber does not write them: packed.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>

namespace limber {

inline void append_number(std::string& bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes += char(value >> 8 * i & 255);
}

// A .zip with one deflated entry (APPNOTE 6.3, sections 4.3.7, 4.3.12 and 4.3.16).
inline std::string deflated_zip(const std::string& name, const std::string& content) {
  uLongf size = compressBound(uLong(content.size()));
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(content.data()),
            uLong(content.size()), 9);
  packed = packed.substr(2, size - 6);  // without zlib's own head and tail
  const auto crc =
      std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(content.data()), uInt(content.size())));
  std::string common;  // version, flags, method, time, date, crc, sizes, lengths of name and extra field
  for (const auto& [value, bytes] : {std::pair(20u, 2),
                                     {0u, 2},
                                     {8u, 2},
                                     {0u, 2},
                                     {0x21u, 2},
                                     {crc, 4},
                                     {std::uint32_t(packed.size()), 4},
                                     {std::uint32_t(content.size()), 4},
                                     {std::uint32_t(name.size()), 2},
                                     {0u, 2}})
    append_number(common, value, bytes);
  std::string local = "PK\3\4", central("PK\1\2\24\0", 6);
  local += common + name + packed;
  central += common;
  central.append(14, '\0').append(name);  // comment, disk, attributes, offset: all none
  std::string end("PK\5\6\0\0\0\0\1\0\1\0", 12);
  append_number(end, std::uint32_t(central.size()), 4), append_number(end, std::uint32_t(local.size()), 4),
      append_number(end, 0, 2);
  return local + central + end;
}

}  // namespace limber
