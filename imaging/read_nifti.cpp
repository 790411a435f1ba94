// NIfTI-1 (Cox and others, 2004) and NIfTI-2: a header of 348 or 540 bytes with fields at fixed places.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>

#include <zlib.h>

#include "core/error.h"
#include "imaging/detail/raw_voxels.h"

namespace limber::imaging {

namespace detail {

namespace {

class Header {
 public:
  Header(std::string_view bytes, const std::string& file) : bytes_(bytes) {
    second_ = bytes.substr(4, 2) == "n+" || bytes.substr(4, 2) == "ni";
    if (bytes.size() < (second_ ? 540u : 348u))
      throw InputError(fmt::format("{}: ends within its header, after {} bytes", file, bytes.size()));
    swap_ = get<std::int32_t>(0) != (second_ ? 540 : 348);
  }
  bool second() const { return second_; }
  bool big_endian() const { return swap_ != (std::endian::native == std::endian::big); }
  template <class T>
  T get(std::size_t at) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  // The same field in either version: an int16, float32 or int32 of the first, an int64, float64 or int32 of
  // the second.
  std::int64_t whole(std::size_t first, std::size_t second) const {
    return second_ ? get<std::int64_t>(second) : get<std::int16_t>(first);
  }
  double real(std::size_t first, std::size_t second) const {
    return second_ ? get<double>(second) : double(get<float>(first));
  }
  int code(std::size_t first, std::size_t second) const {
    return second_ ? get<std::int32_t>(second) : int(get<std::int16_t>(first));
  }

 private:
  std::string_view bytes_;
  bool second_ = false, swap_ = false;
};

Number number_of(int code, const std::string& file) {
  static const std::map<int, Number> known{
      {2, Number::u8},   {4, Number::i16},   {8, Number::i32},   {16, Number::f32},   {64, Number::f64},
      {256, Number::i8}, {512, Number::u16}, {768, Number::u32}, {1024, Number::i64}, {1280, Number::u64}};
  const auto found = known.find(code);
  if (found == known.end())
    throw InputError(
        fmt::format("{}: has voxels of type {}, which are no labels; write whole numbers", file, code));
  return found->second;
}

// Turns by the unit quaternion (√(1 − b² − c² − d²), b, c, d), then steps, the third reversed where qfac is
// −1.
Eigen::Matrix3d axes_of_quaternion(const Header& h, const Vec3& steps) {
  const double b = h.real(256, 352), c = h.real(260, 360), d = h.real(264, 368);
  const double rest = 1 - (b * b + c * c + d * d);
  const double a = rest < 1e-6 ? 0 : std::sqrt(rest);  // float32: half a turn is half a turn
  Eigen::Quaterniond turn(a, b, c, d);
  turn.normalize();
  Eigen::Matrix3d axes = turn.toRotationMatrix() * steps.asDiagonal();
  if (h.real(76, 104) < 0) axes.col(2) *= -1;
  return axes;
}

}  // namespace

LabelMap read_nifti(std::string bytes, const std::string& file) {
  const Header h(bytes, file);
  if (bytes.substr(h.second() ? 4 : 344, 2) == "ni")
    throw InputError(
        fmt::format("{}: its voxels are in a file of their own (.img); write both as one .nii", file));
  LabelMap map;
  RawVoxels raw;
  const std::int64_t dimensions = h.whole(40, 16);
  if (dimensions < 3 || dimensions > 7)
    throw InputError(fmt::format("{}: has {} dimensions; a label map has 3", file, dimensions));
  for (std::size_t d = 0; d < 7; ++d) {
    const std::int64_t size = h.whole(42 + 2 * d, 24 + 8 * d);
    if (d < 3)
      raw.size[d] = size;
    else if (std::int64_t(d) < dimensions && size > 1)
      throw InputError(
          fmt::format("{}: has {} volumes in dimension {}; write one of them", file, size, d + 1));
  }
  require_size(raw.size, file);
  raw.number = number_of(h.second() ? h.get<std::int16_t>(12) : h.get<std::int16_t>(70), file);
  raw.big_endian = h.big_endian();
  const double slope = h.real(112, 176), intercept = h.real(116, 184);
  if (std::isfinite(slope) && slope != 0 && (slope != 1 || intercept != 0))
    throw InputError(
        fmt::format("{}: its voxels are to be scaled by {} and shifted by {}, as no labels are; write whole "
                    "numbers",
                    file, slope, intercept));

  double unit = metres_a_millimetre;
  // One byte in the first version, beside the unit of time.
  switch ((h.second() ? h.get<std::int32_t>(500) : h.get<std::int8_t>(123)) & 7) {
    case 1:
      unit = 1;
      break;
    case 2:
      break;
    case 3:
      unit = 1e-6;
      break;
    default:
      map.notes.push_back("the file names no unit of length: millimetres");
  }
  Vec3 steps;
  for (int d = 0; d < 3; ++d) steps[d] = h.real(80 + 4 * std::size_t(d), 112 + 8 * std::size_t(d));
  Eigen::Matrix3d axes;
  Vec3 origin;
  if (h.code(254, 348) > 0) {
    for (int r = 0; r < 3; ++r) {
      const std::size_t first = 280 + 16 * std::size_t(r), second = 400 + 32 * std::size_t(r);
      for (int c = 0; c < 3; ++c)
        axes(r, c) = h.real(first + 4 * std::size_t(c), second + 8 * std::size_t(c));
      origin[r] = h.real(first + 12, second + 24);
    }
  } else if (h.code(252, 344) > 0) {
    axes = axes_of_quaternion(h, steps);
    for (int r = 0; r < 3; ++r) origin[r] = h.real(268 + 4 * std::size_t(r), 376 + 8 * std::size_t(r));
  } else {
    map.notes.push_back("the file names no orientation: i to the right, j to the front, k up");
    axes = steps.asDiagonal();
    origin.setZero();
  }
  // NIfTI's x is to the right and its y to the front.
  const Eigen::DiagonalMatrix<double, 3> turned(-unit, -unit, unit);
  map.axes_m = turned * axes, map.origin_m = turned * origin;

  const double offset = h.second() ? double(h.get<std::int64_t>(168)) : double(h.get<float>(108));
  if (!(offset >= (h.second() ? 540 : 348)) || offset > double(bytes.size()))
    throw InputError(
        fmt::format("{}: says that its voxels begin at byte {}, and has {}", file, offset, bytes.size()));
  raw.bytes = std::move(bytes);
  raw.bytes.erase(0, std::size_t(offset));
  take_voxels(raw, file, map);
  return map;
}

}  // namespace detail

void write_nifti(const fs::path& path, const LabelMap& map) {
  std::string bytes(352, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(bytes.data() + at, &value, sizeof value); };
  put(0, std::int32_t(348));
  put(40, std::int16_t(3));
  for (std::size_t d = 0; d < 7; ++d) put(42 + 2 * d, std::int16_t(d < 3 ? map.size[d] : 1));
  put(70, std::int16_t(8)), put(72, std::int16_t(32));  // int32
  for (int d = 0; d < 3; ++d)
    put(80 + 4 * std::size_t(d), float(map.axes_m.col(d).norm() / detail::metres_a_millimetre));
  put(76, float(1)), put(108, float(352)), put(112, float(1));
  bytes[123] = 2;  // millimetres
  put(254, std::int16_t(1));
  for (int r = 0; r < 3; ++r) {
    const double unit = (r < 2 ? -1 : 1) / detail::metres_a_millimetre;
    for (int c = 0; c < 3; ++c)
      put(280 + 16 * std::size_t(r) + 4 * std::size_t(c), float(unit * map.axes_m(r, c)));
    put(292 + 16 * std::size_t(r), float(unit * map.origin_m[r]));
  }
  std::memcpy(bytes.data() + 344, "n+1", 3);
  for (const std::uint16_t row : map.material) {
    const auto label = std::int32_t(map.labels[row]);
    bytes.append(reinterpret_cast<const char*>(&label), sizeof label);
  }
  if (!path.string().ends_with(".gz")) return write_file(path, bytes);
  std::string packed(::compressBound(uLong(bytes.size())) + 64, '\0');
  z_stream stream{};
  LIMBER_CHECK(::deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) == Z_OK,
               "deflateInit2");
  stream.next_in = reinterpret_cast<Bytef*>(bytes.data()), stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data()), stream.avail_out = uInt(packed.size());
  const int state = ::deflate(&stream, Z_FINISH);
  packed.resize(packed.size() - stream.avail_out);
  ::deflateEnd(&stream);
  LIMBER_CHECK(state == Z_STREAM_END, state);
  write_file(path, packed);
}

}  // namespace limber::imaging
