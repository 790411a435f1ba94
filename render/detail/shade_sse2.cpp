// The light of bodies in SSE2.
#include "render/detail/shade_light.h"

#include <immintrin.h>

namespace limber::render::detail {
namespace {
#include "render/detail/shade_light.inc"
}  // namespace
Shade shade_sse2() { return &shade; }
}  // namespace limber::render::detail
