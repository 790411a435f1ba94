#include "core/content_hash.h"

#include <fmt/format.h>
#include <xxhash.h>

#include "core/error.h"
#include "core/file.h"

namespace limber {

std::string content_hash(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

const std::string& program_hash() {
  static const std::string hash = []() -> std::string {
    try {
      return content_hash(read_file("/proc/self/exe"));
    } catch (const InputError&) {
      return "unknown";
    }
  }();
  return hash;
}

}  // namespace limber
