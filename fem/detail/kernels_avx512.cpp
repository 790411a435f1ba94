// The kernels in AVX-512 (F, DQ, VL, BW).
#include "fem/detail/kernels.h"

#include <immintrin.h>

namespace limber::fem::detail {
namespace {
#include "fem/detail/kernels.inc"
}  // namespace
const Kernels<float>* avx512_float() { return kernels_float; }
const Kernels<double>* avx512_double() { return kernels_double; }
}  // namespace limber::fem::detail
