#include "core/hash.h"

#include <xxhash.h>

#include <charconv>

#include "core/error.h"

namespace limber {

struct Hasher::Impl {
  XXH3_state_t* state = XXH3_createState();
  ~Impl() { XXH3_freeState(state); }
};

Hasher::Hasher() : impl_(std::make_unique<Impl>()) { XXH3_64bits_reset(impl_->state); }
Hasher::~Hasher() = default;

Hasher& Hasher::bytes(const void* data, std::size_t size) {
  if (size > 0) XXH3_64bits_update(impl_->state, data, size);
  return *this;
}

std::uint64_t Hasher::digest() const { return XXH3_64bits_digest(impl_->state); }

std::uint64_t hash_of(std::string_view bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }
std::uint64_t hash_of_file(const fs::path& path) {
  FileReader file(path);
  Hasher hasher;
  std::string piece(1 << 20, '\0');
  while (const std::size_t n = file.read(piece)) hasher.bytes(piece.data(), n);
  return hasher.digest();
}
std::uint64_t hash_of(const SurfaceMesh& mesh) {
  return Hasher().matrix(mesh.positions).matrix(mesh.triangles).digest();
}
std::uint64_t hash_of(const ContactShape& shape) {
  const auto& [field, samples, min_weight, usable] = shape;
  return Hasher()
      .matrix(field.lower_m)
      .value(field.cell_m)
      .value(field.unit_m)
      .values(std::span<const int>(field.nodes))
      .values(std::span<const std::int16_t>(field.values))
      .matrix(samples.positions_m)
      .matrix(samples.tet_from_sample)
      .matrix(samples.weights)
      .matrix(samples.area_m2)
      .matrix(min_weight)
      .value(int(usable))
      .digest();
}

std::uint64_t hash_of(const TetMesh& mesh) {
  return Hasher().matrix(mesh.positions).matrix(mesh.tets).digest();
}

std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

std::uint64_t hash_from_hex(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.size() != 16 || error != std::errc() || end != text.data() + text.size())
    throw InputError(fmt::format("\"{}\" is not a hash of 16 hexadecimal digits", text));
  return value;
}

}  // namespace limber
