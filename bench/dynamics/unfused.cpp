// The kernels as they would be with a product and a sum rounded one after the other, as they were until edges
// rode with tets; to be measured beside those of today. Compiled for the instruction set that UNFUSED names.
#include "bench/dynamics/unfused.h"

#include <immintrin.h>

#define _mm_fmadd_ps(a, b, c) ((a) * (b) + (c))
#define _mm256_fmadd_ps(a, b, c) ((a) * (b) + (c))
#define _mm512_fmadd_ps(a, b, c) ((a) * (b) + (c))

namespace limber::fem::detail {
namespace {
#include "fem/detail/kernels.inc"
}  // namespace
const Kernels<float>* UNFUSED() { return kernels_float; }
}  // namespace limber::fem::detail
