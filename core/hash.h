// 64-bit hashes (XXH3) of states and files: to see a change, not to resist an attacker.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/contact_shape.h"
#include "core/file.h"
#include "core/mesh.h"

namespace limber {

class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher& bytes(const void* data, std::size_t size);
  template <class T>
  requires std::is_trivially_copyable_v<T> Hasher& values(std::span<const T> v) {
    return value(std::uint64_t(v.size())).bytes(v.data(), v.size_bytes());
  }
  template <class T>
  requires std::is_arithmetic_v<T> Hasher& value(T v) { return bytes(&v, sizeof v); }
  Hasher& text(std::string_view s) { return value(std::uint64_t(s.size())).bytes(s.data(), s.size()); }
  template <class Derived>
  Hasher& matrix(const Eigen::PlainObjectBase<Derived>& m) {
    value(std::int64_t(m.rows())), value(std::int64_t(m.cols()));
    return bytes(m.data(), sizeof(typename Derived::Scalar) * std::size_t(m.size()));
  }
  std::uint64_t digest() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

std::uint64_t hash_of(std::string_view bytes);
std::uint64_t hash_of_file(const fs::path&);  // of its bytes, read piece by piece; throws as read_file()
std::uint64_t hash_of(const SurfaceMesh&);
std::uint64_t hash_of(const TetMesh&);
std::uint64_t hash_of(const ContactShape&);
std::string hex(std::uint64_t);  // 16 lower-case digits
// Throws InputError when the text is not 16 hexadecimal digits.
std::uint64_t hash_from_hex(std::string_view);

}  // namespace limber
