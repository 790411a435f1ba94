// Kernels without fused products, for 1, 4, 8 and 16 lanes.
#pragma once

#include "fem/detail/kernels.h"

namespace limber::fem::detail {

const Kernels<float>* unfused_avx2();
const Kernels<float>* unfused_avx512();

}  // namespace limber::fem::detail
