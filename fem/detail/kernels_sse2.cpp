// The kernels in SSE2, which every x86-64 has.
#include "fem/detail/kernels.h"

#include <immintrin.h>

namespace limber::fem::detail {
namespace {
#include "fem/detail/kernels.inc"
}  // namespace
const Kernels<float>* sse2_float() { return kernels_float; }
const Kernels<double>* sse2_double() { return kernels_double; }
}  // namespace limber::fem::detail
