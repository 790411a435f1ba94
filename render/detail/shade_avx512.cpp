// The light of bodies in AVX-512 (F, DQ, VL, BW).
#include "render/detail/shade_light.h"

#include <immintrin.h>

namespace limber::render::detail {
namespace {
#include "render/detail/shade_light.inc"
}  // namespace
Shade shade_avx512() { return &shade; }
}  // namespace limber::render::detail
