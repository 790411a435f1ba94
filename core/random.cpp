#include "core/random.h"

#include <cmath>

#include "core/error.h"

namespace limber {

std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> c, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = std::uint64_t(0xD2511F53u) * c[0], p1 = std::uint64_t(0xCD9E8D57u) * c[2];
    c = {std::uint32_t(p1 >> 32) ^ c[1] ^ key[0], std::uint32_t(p1), std::uint32_t(p0 >> 32) ^ c[3] ^ key[1],
         std::uint32_t(p0)};
    key[0] += 0x9E3779B9u, key[1] += 0xBB67AE85u;
  }
  return c;
}

std::uint32_t Rng::bits() {
  if (drawn_ % 4 == 0) {
    const std::uint64_t block = drawn_ / 4;
    block_ = philox4x32({std::uint32_t(block), std::uint32_t(block >> 32), std::uint32_t(stream_),
                         std::uint32_t(stream_ >> 32)},
                        {std::uint32_t(seed_), std::uint32_t(seed_ >> 32)});
  }
  return block_[drawn_++ % 4];
}

double Rng::uniform() { return bits() * 0x1p-32; }
double Rng::uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }

int Rng::below(int n) {
  LIMBER_CHECK(n > 0, n);
  return int((std::uint64_t(bits()) * std::uint64_t(n)) >> 32);
}

// Marsaglia 1972: a point of the unit disc lifted to the sphere; no sine, so the same bytes everywhere.
Vec3 Rng::direction() {
  while (true) {
    const double a = uniform(-1, 1), b = uniform(-1, 1), s = a * a + b * b;
    if (s >= 1) continue;
    const double root = 2 * std::sqrt(1 - s);
    return {a * root, b * root, 1 - 2 * s};
  }
}

}  // namespace limber
