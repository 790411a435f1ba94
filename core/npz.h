// Arrays in an ordinary zip of .npy files: numpy.load opens it. Written without timestamps: same arrays, same
// bytes.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/file.h"

namespace limber {

struct NpyArray {
  std::string dtype;                // "<f4", "<f8", "<i2", "<i4", "<i8", "<u8", "|u1"
  std::vector<std::int64_t> shape;  // C order
  std::vector<std::byte> bytes;

  bool operator==(const NpyArray&) const = default;
  std::int64_t size() const;  // product of the shape
  // The elements; throws InputError naming `name` when T is not the array's type.
  template <class T>
  std::span<const T> as(std::string_view name) const {
    require_dtype(dtype_of<T>(), name);
    return {reinterpret_cast<const T*>(bytes.data()), std::size_t(size())};
  }
  template <class T>
  static NpyArray of(std::span<const T> v, std::vector<std::int64_t> shape) {
    NpyArray a{dtype_of<T>(), std::move(shape), {}};
    a.bytes.assign(reinterpret_cast<const std::byte*>(v.data()),
                   reinterpret_cast<const std::byte*>(v.data() + v.size()));
    a.require_consistent();
    return a;
  }
  template <class Matrix>
  static NpyArray of_matrix(const Matrix& m) {  // row-major Eigen matrix or vector
    using T = typename Matrix::Scalar;
    std::vector<std::int64_t> shape{m.rows()};
    if (Matrix::ColsAtCompileTime != 1) shape.push_back(m.cols());
    return of(std::span<const T>(m.data(), std::size_t(m.size())), shape);
  }

  template <class T>
  static const char* dtype_of();

 private:
  void require_dtype(const char* wanted, std::string_view name) const;
  void require_consistent() const;
};
template <>
const char* NpyArray::dtype_of<float>();
template <>
const char* NpyArray::dtype_of<double>();
template <>
const char* NpyArray::dtype_of<std::int16_t>();
template <>
const char* NpyArray::dtype_of<std::int32_t>();
template <>
const char* NpyArray::dtype_of<std::int64_t>();
template <>
const char* NpyArray::dtype_of<std::uint64_t>();
template <>
const char* NpyArray::dtype_of<std::uint8_t>();

struct Npz {
  std::map<std::string, NpyArray> arrays;    // "weights" is the entry weights.npy
  std::map<std::string, std::string> texts;  // other entries as they are: "meta.json"

  // Throws InputError that names the file's missing entry.
  const NpyArray& array(const std::string& name) const;
  const std::string& text(const std::string& name) const;
  // Throws InputError that names an entry that is none of these.
  void require_only(const std::set<std::string>& arrays, const std::set<std::string>& texts) const;
  fs::path source;  // for messages
};

std::string npy_file(const NpyArray&);  // the bytes of its entry

// Of the names, types, shapes and bytes of all entries but this one.
std::uint64_t hash_of(const Npz&, std::string_view left_out);

void write_npz(const fs::path&, const Npz&);
// Throws InputError when it is not a zip, is cut short, fails a checksum, holds an entry twice, or an array
// of another kind.
Npz read_npz(const fs::path&);

// Archives too large to be held beside what they are of: rows come when they are asked for, some at a time.

struct NpyRows {
  std::string dtype;
  std::vector<std::int64_t> shape;
  // Puts the rows [from, to) there; asked in order, more than once for all.
  std::function<void(std::int64_t from, std::int64_t to, std::byte* there)> fill;

  std::int64_t rows() const { return shape.empty() ? 1 : shape[0]; }
  std::size_t row_bytes() const;
  // `put` writes row i, of as many T as the rest of the shape says.
  template <class T>
  static NpyRows of(std::vector<std::int64_t> shape, std::function<void(std::int64_t i, T* row)> put) {
    NpyRows rows{NpyArray::dtype_of<T>(), std::move(shape), {}};
    const std::size_t width = rows.row_bytes() / sizeof(T);
    rows.fill = [put = std::move(put), width](std::int64_t from, std::int64_t to, std::byte* there) {
      for (T* row = reinterpret_cast<T*>(there); from < to; ++from, row += width) put(from, row);
    };
    return rows;
  }
};

struct NpzRows {
  std::map<std::string, NpyRows> arrays;
  std::map<std::string, std::string> texts;
};

NpzRows rows_of(const Npz&);  // which must outlive them
Npz whole(const NpzRows&);
std::uint64_t hash_of(const NpzRows&, std::string_view left_out);
void write_npz(const fs::path&, const NpzRows&);  // the same bytes as of the whole

// An archive on the disk. All throw as read_npz().
class NpzReader {
 public:
  // Some rows, never none, in order.
  using Take = std::function<void(std::int64_t from, std::span<const std::byte> rows)>;

  explicit NpzReader(const fs::path&);
  ~NpzReader();
  const std::set<std::string>& arrays() const;  // their names
  const std::set<std::string>& texts() const;
  // Nothing is in the file but these, none of them packed: as write_npz() has it.
  bool bare() const;
  NpyArray head(const std::string& array) const;  // without its elements
  void read(const std::string& array, const Take&) const;
  NpyArray array(const std::string& name) const;
  std::string text(const std::string& name) const;

 private:
  struct Archive;
  std::unique_ptr<Archive> archive_;
};

// Of entries as hash_of has them: arrays by their names, then texts by theirs.
class NpzHasher {
 public:
  NpzHasher();
  ~NpzHasher();
  void begin(const std::string& name, const NpyArray& head);
  void rows(std::span<const std::byte>);  // of that array
  void text(const std::string& name, const std::string& content);
  std::uint64_t digest() const;

 private:
  std::unique_ptr<class Hasher> hasher_;
};

}  // namespace limber
