// What the readers of both formats share.
#pragma once

#include <string>

#include "imaging/label_map.h"

namespace limber::imaging::detail {

enum class Number { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };
int bytes_of(Number);

struct RawVoxels {
  std::array<std::int64_t, 3> size{};
  Number number = Number::u8;
  bool big_endian = false;
  std::string bytes;
};

constexpr std::int64_t max_voxels = std::int64_t(1) << 31;
constexpr double metres_a_millimetre = 1e-3;

// Throws InputError where a size is not positive or there are too many voxels.
void require_size(const std::array<std::int64_t, 3>&, const std::string& file);

// At most `most` bytes; throws InputError where that is no gzip stream or ends early. More than that is left
// out.
std::string inflate(std::string_view gzip, std::uint64_t most, const std::string& file);
bool is_gzip(std::string_view bytes);

// Throws InputError for too few bytes, for numbers that are not whole, and for more than 65,535 labels.
void take_voxels(const RawVoxels&, const std::string& file, LabelMap&);

LabelMap read_nifti(std::string bytes, const std::string& file);
// `path` is where a detached data file is looked for.
LabelMap read_nrrd(std::string bytes, const fs::path& path);

// Throws InputError where a number is not finite or the axes span no volume.
void require_frame(const LabelMap&, const std::string& file);

}  // namespace limber::imaging::detail
