#include "core/npz.h"

#include <zip.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
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
auto guarded(T* resource, Close* close) {
  return std::unique_ptr<T, Close*>(resource, close);
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

namespace {

// The .npy format, version 1.0: magic, header length, a Python dict padded to 64 bytes, then the elements.
std::string npy_head(const std::string& dtype, const std::vector<std::int64_t>& sizes) {
  std::string shape;
  for (const std::int64_t n : sizes) shape += fmt::format("{}, ", n);
  std::string header =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", dtype,
                  sizes.size() == 1 ? fmt::format("{},", sizes[0])
                                    : shape.substr(0, shape.size() - std::min<std::size_t>(2, shape.size())));
  header.append(63 - (npy_magic.size() + 2 + header.size()) % 64, ' ');
  header += '\n';
  std::string text(npy_magic);
  text += char(header.size() & 255), text += char(header.size() >> 8);
  return text + header;
}

// So many rows at a time.
std::int64_t rows_at_once(std::size_t row_bytes) {
  constexpr std::size_t piece_bytes = 1 << 20;
  return std::int64_t(std::max<std::size_t>(1, piece_bytes / std::max<std::size_t>(1, row_bytes)));
}

// Rows of an array, piece by piece.
template <class Take>
void for_pieces(const NpyRows& array, const Take& take) {
  const std::int64_t at_once = array.row_bytes() == 0 ? 0 : rows_at_once(array.row_bytes());
  std::vector<std::byte> piece;
  for (std::int64_t from = 0; at_once > 0 && from < array.rows(); from += at_once) {
    const std::int64_t to = std::min(array.rows(), from + at_once);
    piece.resize(std::size_t(to - from) * array.row_bytes());
    array.fill(from, to, piece.data());
    take(from, std::span<const std::byte>(piece));
  }
}

}  // namespace

std::string npy_file(const NpyArray& array) {
  std::string text = npy_head(array.dtype, array.shape);
  text.append(reinterpret_cast<const char*>(array.bytes.data()), array.bytes.size());
  return text;
}

std::size_t NpyRows::row_bytes() const {
  std::size_t bytes = item_size(dtype);
  for (std::size_t d = 1; d < shape.size(); ++d) bytes *= std::size_t(shape[d]);
  return bytes;
}

NpzRows rows_of(const Npz& npz) {
  NpzRows all{{}, npz.texts};
  for (const auto& [name, array] : npz.arrays) {
    NpyRows& rows = all.arrays[name] = {array.dtype, array.shape, {}};
    rows.fill = [bytes = &array.bytes, row = rows.row_bytes()](std::int64_t from, std::int64_t to,
                                                               std::byte* there) {
      std::copy(bytes->begin() + from * std::int64_t(row), bytes->begin() + to * std::int64_t(row), there);
    };
  }
  return all;
}

Npz whole(const NpzRows& all) {
  Npz npz{{}, all.texts, {}};
  for (const auto& [name, rows] : all.arrays) {
    NpyArray& array = npz.arrays[name] = {rows.dtype, rows.shape, {}};
    for_pieces(rows, [&](std::int64_t, std::span<const std::byte> piece) {
      array.bytes.insert(array.bytes.end(), piece.begin(), piece.end());
    });
  }
  return npz;
}

NpzHasher::NpzHasher() : hasher_(std::make_unique<Hasher>()) {}
NpzHasher::~NpzHasher() = default;
void NpzHasher::begin(const std::string& name, const NpyArray& head) {
  hasher_->text(name).text(head.dtype).values(std::span(head.shape));
  hasher_->value(std::uint64_t(head.size()) * item_size(head.dtype));
}
void NpzHasher::rows(std::span<const std::byte> bytes) { hasher_->bytes(bytes.data(), bytes.size()); }
void NpzHasher::text(const std::string& name, const std::string& content) {
  hasher_->text(name).text(content);
}
std::uint64_t NpzHasher::digest() const { return hasher_->digest(); }

std::uint64_t hash_of(const NpzRows& npz, std::string_view left_out) {
  NpzHasher hasher;
  for (const auto& [name, array] : npz.arrays) {
    hasher.begin(name, {array.dtype, array.shape, {}});
    for_pieces(array, [&](std::int64_t, std::span<const std::byte> piece) { hasher.rows(piece); });
  }
  for (const auto& [name, text] : npz.texts)
    if (name != left_out) hasher.text(name, text);
  return hasher.digest();
}

std::uint64_t hash_of(const Npz& npz, std::string_view left_out) {
  NpzHasher hasher;
  for (const auto& [name, array] : npz.arrays) {
    hasher.begin(name, array);
    hasher.rows(array.bytes);
  }
  for (const auto& [name, text] : npz.texts)
    if (name != left_out) hasher.text(name, text);
  return hasher.digest();
}

namespace {

// What libzip asks of its sources, each through one function of C, which no exception may leave: it is kept
// here, and thrown once libzip is out of the way.
class Source {
 public:
  virtual ~Source() = default;
  zip_source_t* source() {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* made = zip_source_function_create(&Source::asked, this, &error);
    LIMBER_CHECK(made != nullptr, zip_error_strerror(&error));
    return made;
  }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 protected:
  virtual zip_int64_t answer(void* data, zip_uint64_t size, zip_source_cmd_t command) = 0;

 private:
  static zip_int64_t asked(void* self, void* data, zip_uint64_t size, zip_source_cmd_t command) {
    auto* source = static_cast<Source*>(self);
    try {
      if (command != ZIP_SOURCE_ERROR) return source->answer(data, size, command);
    } catch (...) {
      source->failure_ = std::current_exception();
      return -1;
    }
    const int codes[] = {ZIP_ER_INTERNAL, 0};
    std::memcpy(data, codes, sizeof codes);
    return sizeof codes;
  }
  std::exception_ptr failure_;
};

zip_int64_t told_size(void* data, zip_uint64_t bytes) {
  auto* status = static_cast<zip_stat_t*>(data);
  zip_stat_init(status);
  status->size = bytes, status->valid = ZIP_STAT_SIZE;
  return sizeof *status;
}

// An entry that is put together as it is read.
class EntrySource final : public Source {
 public:
  explicit EntrySource(const std::string& text) : head_(text) {}
  explicit EntrySource(const NpyRows& array) : head_(npy_head(array.dtype, array.shape)), array_(&array) {}

 private:
  zip_int64_t answer(void* data, zip_uint64_t size, zip_source_cmd_t command) override {
    switch (command) {
      case ZIP_SOURCE_OPEN:
        piece_.assign(reinterpret_cast<const std::byte*>(head_.data()),
                      reinterpret_cast<const std::byte*>(head_.data() + head_.size()));
        at_ = 0, row_ = 0;
        return 0;
      case ZIP_SOURCE_READ: {
        if (at_ == piece_.size()) next_piece();
        const std::size_t n = std::min<std::size_t>(size, piece_.size() - at_);
        std::copy_n(piece_.begin() + std::ptrdiff_t(at_), n, static_cast<std::byte*>(data));
        at_ += n;
        return zip_int64_t(n);
      }
      case ZIP_SOURCE_STAT:
        return told_size(data,
                         head_.size() + (array_ ? std::uint64_t(array_->rows()) * array_->row_bytes() : 0));
      case ZIP_SOURCE_SUPPORTS:
        return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE,
                                              ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE, -1);
      default:
        return 0;
    }
  }

  void next_piece() {
    piece_.clear(), at_ = 0;
    if (!array_ || array_->row_bytes() == 0) return;
    const std::int64_t to = std::min(array_->rows(), row_ + rows_at_once(array_->row_bytes()));
    piece_.resize(std::size_t(to - row_) * array_->row_bytes());
    if (to > row_) array_->fill(row_, to, piece_.data());
    row_ = to;
  }

  const std::string head_;
  const NpyRows* array_ = nullptr;
  std::vector<std::byte> piece_;  // the head, then rows
  std::size_t at_ = 0;            // in it
  std::int64_t row_ = 0;
};

// The archive itself: nothing yet, then what is written to it.
class Destination final : public Source {
 public:
  explicit Destination(FileWriter& file) : file_(file) {}

 private:
  zip_int64_t answer(void* data, zip_uint64_t size, zip_source_cmd_t command) override {
    switch (command) {
      case ZIP_SOURCE_STAT:
        return told_size(data, 0);
      case ZIP_SOURCE_BEGIN_WRITE:
        at_ = 0;
        return 0;
      case ZIP_SOURCE_WRITE:
        file_.write_at(at_, {static_cast<const char*>(data), std::size_t(size)});
        at_ += size;
        return zip_int64_t(size);
      case ZIP_SOURCE_SEEK_WRITE: {
        const zip_int64_t to = zip_source_seek_compute_offset(at_, file_.size(), data, size, nullptr);
        if (to < 0) return -1;
        at_ = std::uint64_t(to);
        return 0;
      }
      case ZIP_SOURCE_TELL_WRITE:
        return zip_int64_t(at_);
      case ZIP_SOURCE_SUPPORTS:
        return zip_source_make_command_bitmap(
            ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR,
            ZIP_SOURCE_FREE, ZIP_SOURCE_SEEK, ZIP_SOURCE_TELL, ZIP_SOURCE_BEGIN_WRITE,
            ZIP_SOURCE_COMMIT_WRITE, ZIP_SOURCE_ROLLBACK_WRITE, ZIP_SOURCE_WRITE, ZIP_SOURCE_SEEK_WRITE,
            ZIP_SOURCE_TELL_WRITE, ZIP_SOURCE_REMOVE, -1);
      default:
        return 0;  // there is nothing to read
    }
  }

  FileWriter& file_;
  std::uint64_t at_ = 0;
};

}  // namespace

void write_npz(const fs::path& path, const Npz& npz) { write_npz(path, rows_of(npz)); }

void write_npz(const fs::path& path, const NpzRows& npz) {
  std::map<std::string, std::unique_ptr<EntrySource>> entries;
  for (const auto& [name, text] : npz.texts) entries[name] = std::make_unique<EntrySource>(text);
  for (const auto& [name, array] : npz.arrays) entries[name + ".npy"] = std::make_unique<EntrySource>(array);

  FileWriter file(path);
  Destination destination(file);
  zip_error_t error;
  zip_error_init(&error);
  auto archive = guarded(zip_open_from_source(destination.source(), ZIP_TRUNCATE, &error), zip_discard);
  LIMBER_CHECK(archive != nullptr, zip_error_strerror(&error));
  for (const auto& [name, entry] : entries) {
    const zip_int64_t index = zip_file_add(archive.get(), name.c_str(), entry->source(), ZIP_FL_ENC_UTF_8);
    LIMBER_CHECK(index >= 0, name, zip_strerror(archive.get()));
    const auto i = zip_uint64_t(index);
    zip_set_file_compression(archive.get(), i, ZIP_CM_STORE, 0);
    zip_file_set_dostime(archive.get(), i, 0, 0x21, 0);  // 1980-01-01: same arrays, same bytes
    zip_file_set_external_attributes(archive.get(), i, 0, ZIP_OPSYS_UNIX, 0644u << 16);
  }
  if (zip_close(archive.get()) == 0) {
    archive.release();
  } else {
    destination.rethrow();
    for (const auto& [name, entry] : entries) entry->rethrow();
    LIMBER_CHECK(false, zip_strerror(archive.get()));
  }
  file.commit();
}

// An archive that is being read.
struct NpzReader::Archive {
  struct Entry {
    zip_uint64_t index;
    std::string name;    // in the archive
    std::uint64_t size;  // unpacked
  };

  explicit Archive(const fs::path& path) : path_(path) {
    FileReader file(path);
    bytes_ = file.size();
    std::FILE* const stream = ::fdopen(file.release(), "rb");
    LIMBER_CHECK(stream != nullptr, path.string());
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* const source = zip_source_filep_create(stream, 0, -1, &error);
    LIMBER_CHECK(source != nullptr, zip_error_strerror(&error));
    // libzip takes an empty file for an archive.
    if (bytes_ > 0) archive_ = zip_open_from_source(source, ZIP_RDONLY | ZIP_CHECKCONS, &error);
    if (!archive_) {
      zip_source_free(source);
      refuse(bytes_ == 0
                 ? "is empty"
                 : fmt::format("is not a whole .npz archive ({}); it may be cut short: copy it again, or "
                               "make it anew",
                               zip_error_strerror(&error)));
    }
    try {
      find_entries();
    } catch (...) {
      zip_discard(archive_);
      throw;
    }
  }
  ~Archive() { zip_discard(archive_); }
  Archive(const Archive&) = delete;
  Archive& operator=(const Archive&) = delete;

  // What they unpack to is bounded before any is unpacked.
  void find_entries() {
    constexpr zip_int64_t max_entries = 1000;
    constexpr std::uint64_t always_allowed = 64 << 20, max_growth = 64;  // plans that sleep much: tenfold
    const zip_int64_t count = zip_get_num_entries(archive_, 0);
    if (count > max_entries) refuse(fmt::format("has {} entries; at most {} are read", count, max_entries));
    const std::uint64_t allowed = always_allowed + max_growth * bytes_;
    std::uint64_t sum = 0;
    for (zip_int64_t i = 0; i < count; ++i) {
      zip_stat_t status;
      if (zip_stat_index(archive_, zip_uint64_t(i), 0, &status) != 0 || !(status.valid & ZIP_STAT_NAME) ||
          !(status.valid & ZIP_STAT_SIZE))
        refuse(fmt::format("entry {} has no name or size", i));
      const Entry entry{zip_uint64_t(i), status.name, status.size};
      if (status.size > allowed - sum)
        refuse(fmt::format("unpacks to more than {} bytes, though it has {}; no plan or binding does that",
                           allowed, bytes_));
      sum += status.size;
      const bool is_array = entry.name.ends_with(".npy");
      std::string name = is_array ? entry.name.substr(0, entry.name.size() - 4) : entry.name;
      if (!(is_array ? array_names_ : text_names_).insert(name).second)
        refuse(fmt::format("has two entries {}", entry.name));
      (is_array ? arrays_ : texts_)[std::move(name)] = entry;
    }
  }

  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError(fmt::format("{}: {}", path_.string(), why));
  }
  std::string what(const Entry& entry) const {
    return fmt::format("{}: entry {}", path_.string(), entry.name);
  }

  auto opened(const Entry& entry) const {
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

  NpyHeader head(zip_file_t* file, const Entry& entry) const {
    std::string start(std::min<std::uint64_t>(npy_preamble, entry.size), '\0');
    fill(file, entry, start.data(), start.size());
    if (start.size() == npy_preamble) {
      start.resize(std::min<std::uint64_t>(npy_preamble + npy_header_size(start), entry.size));
      fill(file, entry, start.data() + npy_preamble, start.size() - npy_preamble);
    }
    return npy_header(start, entry.size, what(entry));
  }

  const fs::path path_;
  std::uint64_t bytes_ = 0;
  zip_t* archive_ = nullptr;
  std::set<std::string> array_names_, text_names_;
  std::map<std::string, Entry> arrays_, texts_;
};

NpzReader::NpzReader(const fs::path& path) : archive_(std::make_unique<Archive>(path)) {}
NpzReader::~NpzReader() = default;
const std::set<std::string>& NpzReader::arrays() const { return archive_->array_names_; }
const std::set<std::string>& NpzReader::texts() const { return archive_->text_names_; }

bool NpzReader::bare() const {
  // Heads of an entry, in its place and in the directory, and the directory's own end; beyond 4 GiB those of
  // zip64 come on top.
  constexpr std::uint64_t local = 30, central = 46, end = 22, local64 = 20, central64 = 28, end64 = 76;
  std::uint64_t least = end, more = end64;
  for (const auto* entries : {&archive_->arrays_, &archive_->texts_})
    for (const auto& [name, entry] : *entries)
      least += local + central + 2 * entry.name.size() + entry.size, more += local64 + central64;
  return archive_->bytes_ >= least && archive_->bytes_ - least <= (least >> 32 ? more : 0);
}

NpyArray NpzReader::head(const std::string& name) const {
  const Archive::Entry& entry = archive_->arrays_.at(name);
  return archive_->head(archive_->opened(entry).get(), entry).array;
}

void NpzReader::read(const std::string& name, const Take& take) const {
  const Archive::Entry& entry = archive_->arrays_.at(name);
  const auto file = archive_->opened(entry);
  const auto [array, element_bytes] = archive_->head(file.get(), entry);
  const std::int64_t rows = array.shape.empty() ? 1 : array.shape[0];
  const std::uint64_t row_bytes = rows == 0 ? 0 : element_bytes / std::uint64_t(rows);
  const std::int64_t at_once = rows_at_once(row_bytes);
  std::vector<std::byte> piece;
  for (std::int64_t from = 0; row_bytes > 0 && from < rows; from += at_once) {
    piece.resize(std::size_t(std::min(at_once, rows - from)) * row_bytes);
    archive_->fill(file.get(), entry, piece.data(), piece.size());
    take(from, piece);
  }
  archive_->expect_end(file.get(), entry);
}

NpyArray NpzReader::array(const std::string& name) const {
  const Archive::Entry& entry = archive_->arrays_.at(name);
  const auto file = archive_->opened(entry);
  auto [array, element_bytes] = archive_->head(file.get(), entry);
  array.bytes.resize(element_bytes);
  archive_->fill(file.get(), entry, array.bytes.data(), array.bytes.size());
  archive_->expect_end(file.get(), entry);
  return std::move(array);
}

std::string NpzReader::text(const std::string& name) const {
  const Archive::Entry& entry = archive_->texts_.at(name);
  if (entry.size > max_json_bytes)
    archive_->refuse(fmt::format("entry {} is a text of {} bytes; at most {} are read", entry.name,
                                 entry.size, max_json_bytes));
  const auto file = archive_->opened(entry);
  std::string content(entry.size, '\0');
  archive_->fill(file.get(), entry, content.data(), content.size());
  archive_->expect_end(file.get(), entry);
  return content;
}

Npz read_npz(const fs::path& path) {
  const NpzReader reader(path);
  Npz npz;
  npz.source = path;
  for (const std::string& name : reader.arrays()) npz.arrays[name] = reader.array(name);
  for (const std::string& name : reader.texts()) npz.texts[name] = reader.text(name);
  return npz;
}

}  // namespace limber
