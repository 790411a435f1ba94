// Whose back is never seen from outside.
#pragma once

#include "core/mesh.h"

namespace limber::render::detail {

// Whether the surface is closed, all of its pieces, and each of them encloses a positive volume: its
// triangles are counter-clockwise as seen from outside. A piece is what hangs together by vertices.
bool looks_outward(const Points&, const Triangles&);

}  // namespace limber::render::detail
