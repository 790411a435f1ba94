// Compiled with contraction, unlike all else, so that the compiler makes fused instructions where there are
// any.
#include "bench/dynamics/peak.h"

#include "core/error.h"
#include "fem/cost.h"

namespace limber::bench {
namespace {

constexpr int chains = 12, turns = 100'000;  // more chains than latency × units, fewer than registers

template <int N>
struct VectorOf {
  typedef float type __attribute__((vector_size(N * sizeof(float))));
};

template <int N>
[[gnu::always_inline]] inline void run(float* out) {
  using Vector = typename VectorOf<N>::type;
  Vector value[chains], factor, term;
  for (int i = 0; i < N; ++i) factor[i] = out[0], term[i] = out[1];
  for (Vector& v : value) v = term;
  for (int turn = 0; turn < turns; ++turn)
#pragma GCC unroll 12
    for (int k = 0; k < chains; ++k) value[k] = value[k] * factor + term;
  Vector sum = value[0];
  for (int k = 1; k < chains; ++k) sum += value[k];
  for (int i = 0; i < N; ++i) out[i] = sum[i];
}

void of_sse2(float* out) { run<4>(out); }
__attribute__((target("avx2,fma"))) void of_avx2(float* out) { run<8>(out); }
__attribute__((target("avx512f,fma,prefer-vector-width=512"))) void of_avx512(float* out) { run<16>(out); }

}  // namespace

double peak_gflops(fem::InstructionSet set) {
  const bool wide = set == fem::InstructionSet::avx512, middle = set == fem::InstructionSet::avx2;
  float numbers[16] = {0.999f, 0.001f};
  const double before = fem::thread_cpu_s();
  (wide ? of_avx512 : middle ? of_avx2 : of_sse2)(numbers);
  const double seconds = fem::thread_cpu_s() - before;
  LIMBER_CHECK(numbers[3] > 0, numbers[3]);  // the sum is used
  return 2e-9 * chains * turns * (wide ? 16 : middle ? 8 : 4) / seconds;
}

}  // namespace limber::bench
