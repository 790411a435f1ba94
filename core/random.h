// Counter-based random numbers: Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC 2011). A stream is a pure
// function of (seed, stream), so expansion 17 draws the same numbers whoever computes it, and when.
#pragma once

#include <array>
#include <cstdint>

#include "core/types.h"

namespace limber {

std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key);

class Rng {
 public:
  Rng(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  std::uint32_t bits();
  double uniform();                      // [0, 1), 32 bits
  double uniform(double lo, double hi);  // [lo, hi)
  int below(int n);                      // 0 … n−1, n > 0
  Vec3 direction();                      // uniform on the unit sphere

 private:
  std::uint64_t seed_, stream_;
  std::uint64_t drawn_ = 0;
  std::array<std::uint32_t, 4> block_{};
};

}  // namespace limber
