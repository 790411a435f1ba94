// Which kernels this machine can run.
#include "fem/detail/kernels.h"

#include "core/error.h"

namespace limber::fem::detail {

const Kernels<float>* sse2_float();
const Kernels<float>* avx2_float();
const Kernels<float>* avx512_float();
const Kernels<double>* sse2_double();
const Kernels<double>* avx2_double();
const Kernels<double>* avx512_double();

bool machine_has(Isa isa) {
  if (isa == Isa::avx512)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("fma");
  return isa == Isa::sse2 || (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"));
}

Isa best_isa() {
  return machine_has(Isa::avx512) ? Isa::avx512 : machine_has(Isa::avx2) ? Isa::avx2 : Isa::sse2;
}

template <>
const Kernels<float>& kernels(Isa isa, int lanes) {
  const Kernels<float>* all = isa == Isa::avx512 ? avx512_float()
                              : isa == Isa::avx2 ? avx2_float()
                                                 : sse2_float();
  for (int k = 0; k < 4; ++k)
    if (all[k].lanes == lanes) return all[k];
  LIMBER_CHECK(false, lanes);
}

template <>
const Kernels<double>& kernels(Isa isa, int lanes) {
  LIMBER_CHECK(lanes == 1, lanes);
  return isa == Isa::avx512 ? avx512_double()[0] : isa == Isa::avx2 ? avx2_double()[0] : sse2_double()[0];
}

}  // namespace limber::fem::detail
