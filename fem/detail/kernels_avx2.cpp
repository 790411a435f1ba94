// The kernels in AVX2.
#include "fem/detail/kernels.h"

#include <immintrin.h>

namespace limber::fem::detail {
namespace {
#include "fem/detail/kernels.inc"
}  // namespace
const Kernels<float>* avx2_float() { return kernels_float; }
const Kernels<double>* avx2_double() { return kernels_double; }
}  // namespace limber::fem::detail
