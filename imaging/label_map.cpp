#include "imaging/label_map.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <unordered_map>

#include <fmt/ranges.h>

#include "core/error.h"
#include "core/progress.h"
#include "imaging/detail/raw_voxels.h"

namespace limber::imaging {

namespace detail {

namespace {

// Calls body(T()) with the type that the numbers have.
template <class Body>
auto with_type_of(Number number, const Body& body) {
  switch (number) {
    case Number::i8:
      return body(std::int8_t());
    case Number::u8:
      return body(std::uint8_t());
    case Number::i16:
      return body(std::int16_t());
    case Number::u16:
      return body(std::uint16_t());
    case Number::i32:
      return body(std::int32_t());
    case Number::u32:
      return body(std::uint32_t());
    case Number::i64:
      return body(std::int64_t());
    case Number::u64:
      return body(std::uint64_t());
    case Number::f32:
      return body(float());
    case Number::f64:
      return body(double());
  }
  throw InternalError("a type of numbers that is none");
}

}  // namespace

int bytes_of(Number number) {
  return with_type_of(number, [](auto value) { return int(sizeof value); });
}

void require_size(const std::array<std::int64_t, 3>& size, const std::string& file) {
  for (const std::int64_t n : size)
    if (n < 1 || n > 65535)
      throw InputError(fmt::format("{}: has sizes {}; each must be from 1 to 65535", file, size));
  if (size[0] * size[1] * size[2] > max_voxels)
    throw InputError(fmt::format("{}: has {} voxels, more than {}; resample it", file,
                                 size[0] * size[1] * size[2], max_voxels));
}

bool is_gzip(std::string_view bytes) { return bytes.size() > 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b'; }

std::string inflate(std::string_view gzip, std::uint64_t most, const std::string& file) {
  struct Stream {
    z_stream z{};
    ~Stream() { ::inflateEnd(&z); }
  } stream;
  LIMBER_CHECK(::inflateInit2(&stream.z, 15 + 16) == Z_OK, "inflateInit2");
  std::string plain;
  std::size_t taken = 0;
  constexpr std::size_t piece = std::size_t(1) << 24;
  for (int state = Z_OK; state != Z_STREAM_END && plain.size() < most;) {
    throw_if_stopped();
    const std::size_t before = plain.size(),
                      room = std::size_t(std::min<std::uint64_t>(piece, most - before));
    plain.resize(before + room);
    if (stream.z.avail_in == 0) {
      const std::size_t more = std::min(piece, gzip.size() - taken);
      stream.z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data() + taken));
      stream.z.avail_in = uInt(more);
      taken += more;
    }
    stream.z.next_out = reinterpret_cast<Bytef*>(plain.data() + before);
    stream.z.avail_out = uInt(room);
    state = ::inflate(&stream.z, Z_NO_FLUSH);
    plain.resize(before + room - stream.z.avail_out);
    const bool at_end = stream.z.avail_in == 0 && taken == gzip.size();
    if (state != Z_STREAM_END && (state != Z_OK || (at_end && stream.z.avail_out > 0)))
      throw InputError(fmt::format("{}: its compressed data ends or breaks after {} bytes; copy it once more",
                                   file, plain.size()));
  }
  return plain;
}

namespace {

template <class T>
std::int64_t label_at(const char* bytes, bool swap, std::int64_t voxel, const std::string& file) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes + voxel * std::int64_t(sizeof(T)), sizeof(T));
  if (swap) std::reverse(raw.begin(), raw.end());
  const T value = std::bit_cast<T>(raw);
  if constexpr (std::is_floating_point_v<T>) {
    if (!(std::abs(value) < T(1e15)) || value != std::floor(value))
      throw InputError(fmt::format("{}: voxel {} is {}, no whole number; an image has to be segmented first",
                                   file, voxel, value));
  } else if constexpr (std::is_same_v<T, std::uint64_t>) {
    if (value > std::uint64_t(INT64_MAX))
      throw InputError(fmt::format("{}: voxel {} is {}, too large for a label", file, voxel, value));
  }
  return std::int64_t(value);
}

template <class T>
void take(const RawVoxels& raw, const std::string& file, LabelMap& map) {
  const bool swap = raw.big_endian != (std::endian::native == std::endian::big);
  std::unordered_map<std::int64_t, std::uint16_t> row{{0, std::uint16_t(0)}};
  std::vector<std::int64_t> labels{0};
  std::int64_t last = 0;
  std::uint16_t last_row = 0;
  for (std::int64_t v = 0; v < map.voxels(); ++v) {
    if (v % (1 << 22) == 0) throw_if_stopped();
    const std::int64_t label = label_at<T>(raw.bytes.data(), swap, v, file);
    if (label != last) {
      const auto [at, is_new] = row.try_emplace(label, std::uint16_t(labels.size()));
      if (is_new) labels.push_back(label);
      if (labels.size() > 65535)
        throw InputError(
            fmt::format("{}: has more than 65535 labels; an image has to be segmented first", file));
      last = label, last_row = at->second;
    }
    map.material[std::size_t(v)] = last_row;
  }
  // In order, so that they do not depend on where the voxels are.
  map.labels = labels;
  std::sort(map.labels.begin() + 1, map.labels.end());
  std::vector<std::uint16_t> sorted(labels.size());
  for (std::size_t old = 0; old < labels.size(); ++old)
    sorted[old] =
        old == 0 ? std::uint16_t(0)
                 : std::uint16_t(std::lower_bound(map.labels.begin() + 1, map.labels.end(), labels[old]) -
                                 map.labels.begin());
  for (std::uint16_t& m : map.material) m = sorted[m];
  map.names.assign(labels.size(), "");
}

}  // namespace

void take_voxels(const RawVoxels& raw, const std::string& file, LabelMap& map) {
  for (int d = 0; d < 3; ++d) map.size[std::size_t(d)] = int(raw.size[std::size_t(d)]);
  const std::uint64_t needed = std::uint64_t(map.voxels()) * std::uint64_t(bytes_of(raw.number));
  if (raw.bytes.size() < needed)
    throw InputError(
        fmt::format("{}: has {} bytes of voxels and needs {}; it was cut short, or its sizes {} are "
                    "wrong",
                    file, raw.bytes.size(), needed, map.size));
  map.material.resize(std::size_t(map.voxels()));
  with_type_of(raw.number, [&](auto value) { take<decltype(value)>(raw, file, map); });
}

void require_frame(const LabelMap& map, const std::string& file) {
  double edges = 1;
  for (int d = 0; d < 3; ++d) edges *= map.axes_m.col(d).norm();
  if (!map.axes_m.allFinite() || !map.origin_m.allFinite() || !(edges > 0) || !(edges < 1e9) ||
      !(std::abs(map.axes_m.determinant()) > 1e-6 * edges) || !(map.origin_m.cwiseAbs().maxCoeff() < 1e6))
    throw InputError(fmt::format(
        "{}: its axes span no volume, or its place is beyond all measure; its header's orientation "
        "is wrong",
        file));
}

}  // namespace detail

namespace {

constexpr std::size_t head_bytes = 352;

// More of them than that, compressed or not, or all that there are.
std::string first_bytes(const fs::path& path) {
  std::error_code none;
  if (!fs::is_regular_file(path, none)) return "";
  std::string bytes(4 * head_bytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), std::streamsize(bytes.size()));
  bytes.resize(std::size_t(file.gcount()));
  return bytes;
}

// Of either version and byte order; with the voxels in the same file ("n+") or beside it ("ni").
bool is_nifti(std::string_view bytes) {
  const auto begins_with = [&](std::uint32_t size, std::size_t magic) {
    const std::array<char, 4> little{char(size & 255), char(size >> 8 & 255), 0, 0};
    return bytes.size() >= magic + 3 && (bytes.substr(magic, 2) == "n+" || bytes.substr(magic, 2) == "ni") &&
           (std::equal(little.begin(), little.end(), bytes.begin()) ||
            std::equal(little.rbegin(), little.rend(), bytes.begin()));
  };
  return begins_with(348, 344) || begins_with(540, 4);
}

bool is_nrrd(std::string_view bytes) { return bytes.starts_with("NRRD000"); }

}  // namespace

bool is_label_map(const fs::path& path) {
  std::string bytes = first_bytes(path);
  if (detail::is_gzip(bytes)) try {
      bytes = detail::inflate(bytes, head_bytes, path.string());
    } catch (const InputError&) {
      return false;
    }
  return is_nifti(bytes) || is_nrrd(bytes);
}

LabelMap read_label_map(const fs::path& path) {
  const std::string file = path.string();
  std::string bytes = read_file(path);
  if (detail::is_gzip(bytes)) bytes = detail::inflate(bytes, max_bytes_read, file);
  LabelMap map;
  if (is_nifti(bytes))
    map = detail::read_nifti(std::move(bytes), file);
  else if (is_nrrd(bytes))
    map = detail::read_nrrd(std::move(bytes), path);
  else
    throw InputError(fmt::format("{}: is neither a NIfTI nor an NRRD file", file));
  detail::require_frame(map, file);
  if (map.labels.size() == 1)
    throw InputError(fmt::format("{}: all of its {} voxels are 0: nothing is labelled", file, map.voxels()));
  return map;
}

int row_of_label(const LabelMap& map, const std::string& word, const std::string& file) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  const bool is_number = error == std::errc() && end == word.data() + word.size();
  std::vector<std::string> known;
  for (std::size_t row = 1; row < map.labels.size(); ++row) {
    if (is_number ? map.labels[row] == number : !word.empty() && map.names[row] == word) return int(row);
    if (known.size() < 40)
      known.push_back(map.names[row].empty() ? std::to_string(map.labels[row])
                                             : fmt::format("{} ({})", map.labels[row], map.names[row]));
  }
  throw InputError(fmt::format("{}: has no label {}; it has {}{}", file, word, fmt::join(known, ", "),
                               map.labels.size() - 1 > known.size() ? " …" : ""));
}

}  // namespace limber::imaging
