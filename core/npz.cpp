#include "core/npz.h"

#include <zip.h>

#include <cstring>
#include <memory>

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"

namespace limber {

namespace {

constexpr std::string_view npy_magic("\x93NUMPY\x01\x00", 8);

constexpr std::size_t npy_preamble = 10;  // magic, version, two bytes of header length

std::size_t npy_header_size(std::string_view preamble) {
  return std::size_t((unsigned char)preamble[8]) + 256 * std::size_t((unsigned char)preamble[9]);
}

std::size_t item_size(std::string_view dtype) {
  for (const auto& [name, size] :
       {std::pair{"<f4", 4}, {"<f8", 8}, {"<i2", 2}, {"<i4", 4}, {"<i8", 8}, {"<u8", 8}, {"|u1", 1}})
    if (dtype == name) return std::size_t(size);
  return 0;
}

struct NpyHeader {
  NpyArray array;               // without its elements
  std::uint64_t element_bytes;  // so many
};

// `start`: the entry up to the end of its header, or as much of that as there is.
NpyHeader npy_header(std::string_view start, std::uint64_t entry_size, const std::string& what) {
  const auto refuse = [&](std::string_view why) -> void {
    throw InputError(fmt::format("{}: {}", what, why));
  };
  if (start.size() < npy_preamble || start.substr(0, 8) != npy_magic)
    refuse("is not a version 1.0 .npy array");
  const std::size_t header_size = npy_header_size(start);
  if (start.size() < npy_preamble + header_size) refuse("ends inside its header");
  const std::string_view header = start.substr(npy_preamble, header_size);
  const auto field = [&](std::string_view key) {
    const auto at = header.find(key);
    if (at == header.npos) refuse(fmt::format("its header has no {}", key));
    return header.substr(at + key.size());
  };
  NpyHeader found{{}, entry_size - npy_preamble - header_size};
  NpyArray& array = found.array;
  const std::string_view dtype = field("'descr': '");
  array.dtype = dtype.substr(0, dtype.find('\''));
  if (item_size(array.dtype) == 0)
    refuse(fmt::format("has elements of type {}, which limber does not use", array.dtype));
  if (!field("'fortran_order': ").starts_with("False")) refuse("is in Fortran order; save it in C order");
  std::string_view shape = field("'shape': (");
  shape = shape.substr(0, shape.find(')'));
  std::uint64_t total = 1;
  while (true) {
    const auto digit = shape.find_first_of("0123456789");
    if (digit == shape.npos) break;
    shape.remove_prefix(digit);
    std::uint64_t n = 0;
    while (!shape.empty() && shape[0] >= '0' && shape[0] <= '9' && n < (1ull << 40))
      n = 10 * n + std::uint64_t(shape[0] - '0'), shape.remove_prefix(1);
    if (n > 0 && total > (1ull << 50) / n) refuse("has a shape beyond any memory");
    total *= n;
    array.shape.push_back(std::int64_t(n));
  }
  if (total * item_size(array.dtype) != found.element_bytes)
    refuse(fmt::format("holds {} bytes, which its shape does not explain", found.element_bytes));
  return found;
}

template <class Close, class T>
auto guarded(T* resource, Close close) {
  return std::unique_ptr<T, Close>(resource, close);
}

}  // namespace

template <>
const char* NpyArray::dtype_of<float>() {
  return "<f4";
}
template <>
const char* NpyArray::dtype_of<double>() {
  return "<f8";
}
template <>
const char* NpyArray::dtype_of<std::int16_t>() {
  return "<i2";
}
template <>
const char* NpyArray::dtype_of<std::int32_t>() {
  return "<i4";
}
template <>
const char* NpyArray::dtype_of<std::int64_t>() {
  return "<i8";
}
template <>
const char* NpyArray::dtype_of<std::uint64_t>() {
  return "<u8";
}
template <>
const char* NpyArray::dtype_of<std::uint8_t>() {
  return "|u1";
}

std::int64_t NpyArray::size() const {
  std::int64_t product = 1;
  for (const std::int64_t n : shape) product *= n;
  return product;
}

void NpyArray::require_dtype(const char* wanted, std::string_view name) const {
  if (dtype != wanted)
    throw InputError(fmt::format("array {} has elements of type {} where {} belong", name, dtype, wanted));
}

void NpyArray::require_consistent() const {
  LIMBER_CHECK(std::size_t(size()) * item_size(dtype) == bytes.size(), size(), dtype, bytes.size());
}

const NpyArray& Npz::array(const std::string& name) const {
  const auto found = arrays.find(name);
  if (found == arrays.end()) throw InputError(fmt::format("{}: has no array \"{}\"", source.string(), name));
  return found->second;
}

const std::string& Npz::text(const std::string& name) const {
  const auto found = texts.find(name);
  if (found == texts.end()) throw InputError(fmt::format("{}: has no entry \"{}\"", source.string(), name));
  return found->second;
}

void Npz::require_only(const std::set<std::string>& known_arrays,
                       const std::set<std::string>& known_texts) const {
  const auto refuse = [&](const std::string& entry) {
    throw InputError(
        fmt::format("{}: has an entry \"{}\", which limber does not write", source.string(), entry));
  };
  for (const auto& [name, array] : arrays)
    if (!known_arrays.contains(name)) refuse(name + ".npy");
  for (const auto& [name, text] : texts)
    if (!known_texts.contains(name)) refuse(name);
}

// The .npy format, version 1.0: magic, header length, a Python dict padded to 64 bytes, then the elements.
std::string npy_file(const NpyArray& array) {
  std::string shape;
  for (const std::int64_t n : array.shape) shape += fmt::format("{}, ", n);
  std::string header = fmt::format(
      "{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", array.dtype,
      array.shape.size() == 1 ? fmt::format("{},", array.shape[0])
                              : shape.substr(0, shape.size() - std::min<std::size_t>(2, shape.size())));
  header.append(63 - (npy_magic.size() + 2 + header.size()) % 64, ' ');
  header += '\n';
  std::string text(npy_magic);
  text += char(header.size() & 255), text += char(header.size() >> 8);
  text += header;
  text.append(reinterpret_cast<const char*>(array.bytes.data()), array.bytes.size());
  return text;
}

std::uint64_t hash_of(const Npz& npz, std::string_view left_out) {
  Hasher hasher;
  for (const auto& [name, array] : npz.arrays)
    hasher.text(name)
        .text(array.dtype)
        .values(std::span(array.shape))
        .values(std::span<const std::byte>(array.bytes));
  for (const auto& [name, text] : npz.texts)
    if (name != left_out) hasher.text(name).text(text);
  return hasher.digest();
}

void write_npz(const fs::path& path, const Npz& npz) {
  std::map<std::string, std::string> entries = npz.texts;
  for (const auto& [name, array] : npz.arrays) entries[name + ".npy"] = npy_file(array);

  // The archive is built in memory, so that the file is written by write_file alone.
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* memory = zip_source_buffer_create(nullptr, 0, 0, &error);
  LIMBER_CHECK(memory != nullptr, zip_error_strerror(&error));
  zip_t* archive = zip_open_from_source(memory, ZIP_TRUNCATE, &error);
  LIMBER_CHECK(archive != nullptr, zip_error_strerror(&error));
  zip_source_keep(memory);
  const auto kept = guarded(memory, zip_source_free);
  for (const auto& [name, content] : entries) {
    zip_source_t* entry = zip_source_buffer(archive, content.data(), content.size(), 0);
    const zip_int64_t index = zip_file_add(archive, name.c_str(), entry, ZIP_FL_ENC_UTF_8);
    LIMBER_CHECK(index >= 0, name, zip_strerror(archive));
    zip_set_file_compression(archive, zip_uint64_t(index), ZIP_CM_STORE, 0);
    zip_file_set_dostime(archive, zip_uint64_t(index), 0, 0x21, 0);  // 1980-01-01: same arrays, same bytes
    zip_file_set_external_attributes(archive, zip_uint64_t(index), 0, ZIP_OPSYS_UNIX, 0644u << 16);
  }
  LIMBER_CHECK(zip_close(archive) == 0, zip_strerror(archive));

  zip_stat_t status;
  zip_source_stat(memory, &status);
  std::string bytes(status.size, '\0');
  zip_source_open(memory);
  zip_source_read(memory, bytes.data(), bytes.size());
  zip_source_close(memory);
  write_file(path, bytes);
}

namespace {

// An archive that is being read.
class Archive {
 public:
  struct Entry {
    zip_uint64_t index;
    std::string name;
    std::uint64_t size;  // unpacked
  };

  explicit Archive(const fs::path& path) : path_(path), bytes_(read_file(path)) {
    if (bytes_.empty()) refuse("is empty");  // libzip takes it for an archive
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* memory = zip_source_buffer_create(bytes_.data(), bytes_.size(), 0, &error);
    LIMBER_CHECK(memory != nullptr, zip_error_strerror(&error));
    archive_ = zip_open_from_source(memory, ZIP_RDONLY | ZIP_CHECKCONS, &error);
    if (archive_) return;
    zip_source_free(memory);
    refuse(fmt::format("is not a whole .npz archive ({}); it may be cut short", zip_error_strerror(&error)));
  }
  ~Archive() { zip_discard(archive_); }
  Archive(const Archive&) = delete;
  Archive& operator=(const Archive&) = delete;

  // What they unpack to is bounded before any is unpacked.
  std::vector<Entry> entries() const {
    constexpr zip_int64_t max_entries = 1000;
    constexpr std::uint64_t always_allowed = 64 << 20, max_growth = 64;  // plans that sleep much: tenfold
    const zip_int64_t count = zip_get_num_entries(archive_, 0);
    if (count > max_entries) refuse(fmt::format("has {} entries; at most {} are read", count, max_entries));
    const std::uint64_t allowed = always_allowed + max_growth * bytes_.size();
    std::uint64_t sum = 0;
    std::vector<Entry> entries;
    for (zip_int64_t i = 0; i < count; ++i) {
      zip_stat_t status;
      if (zip_stat_index(archive_, zip_uint64_t(i), 0, &status) != 0 || !(status.valid & ZIP_STAT_NAME) ||
          !(status.valid & ZIP_STAT_SIZE))
        refuse(fmt::format("entry {} has no name or size", i));
      entries.push_back({zip_uint64_t(i), status.name, status.size});
      if (status.size > allowed - sum)
        refuse(fmt::format("unpacks to more than {} bytes, though it has {}; no plan or binding does that",
                           allowed, bytes_.size()));
      sum += status.size;
    }
    return entries;
  }

  std::string what(const Entry& entry) const {
    return fmt::format("{}: entry {}", path_.string(), entry.name);
  }

  NpyArray array(const Entry& entry) const {
    const auto file = opened(entry);
    std::string start(std::min<std::uint64_t>(npy_preamble, entry.size), '\0');
    fill(file.get(), entry, start.data(), start.size());
    if (start.size() == npy_preamble) {
      start.resize(std::min<std::uint64_t>(npy_preamble + npy_header_size(start), entry.size));
      fill(file.get(), entry, start.data() + npy_preamble, start.size() - npy_preamble);
    }
    auto [array, element_bytes] = npy_header(start, entry.size, what(entry));
    array.bytes.resize(element_bytes);
    fill(file.get(), entry, array.bytes.data(), array.bytes.size());
    expect_end(file.get(), entry);
    return std::move(array);
  }

  std::string text(const Entry& entry) const {
    if (entry.size > max_json_bytes)
      refuse(fmt::format("entry {} is a text of {} bytes; at most {} are read", entry.name, entry.size,
                         max_json_bytes));
    const auto file = opened(entry);
    std::string content(entry.size, '\0');
    fill(file.get(), entry, content.data(), content.size());
    expect_end(file.get(), entry);
    return content;
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError(fmt::format("{}: {}", path_.string(), why));
  }

  std::unique_ptr<zip_file_t, decltype(&zip_fclose)> opened(const Entry& entry) const {
    auto file = guarded(zip_fopen_index(archive_, entry.index, 0), zip_fclose);
    if (!file) throw InputError(fmt::format("{}: cannot be read: {}", what(entry), zip_strerror(archive_)));
    return file;
  }

  void fill(zip_file_t* file, const Entry& entry, void* to, std::size_t size) const {
    for (auto* at = static_cast<char*>(to); size > 0;) {
      const zip_int64_t n = zip_fread(file, at, size);
      if (n <= 0) throw InputError(fmt::format("{}: is damaged ({})", what(entry), zip_file_strerror(file)));
      at += n, size -= std::size_t(n);
    }
  }

  // Checks the CRC, too.
  void expect_end(zip_file_t* file, const Entry& entry) const {
    if (char extra; zip_fread(file, &extra, 1) != 0)
      throw InputError(fmt::format("{}: is damaged", what(entry)));
  }

  const fs::path& path_;
  std::string bytes_;
  zip_t* archive_;
};

}  // namespace

Npz read_npz(const fs::path& path) {
  const Archive archive(path);
  Npz npz;
  npz.source = path;
  for (const Archive::Entry& entry : archive.entries())
    if (entry.name.ends_with(".npy"))
      npz.arrays[entry.name.substr(0, entry.name.size() - 4)] = archive.array(entry);
    else
      npz.texts[entry.name] = archive.text(entry);
  return npz;
}

}  // namespace limber
