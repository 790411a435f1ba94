// Builds what contact on the fine surfaces reads, from the bodies' ContactShapes.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

// Sets world.surfaces and surfaces64, where all bodies have shapes; the rest of the world is there already.
// The offset of two bodies is at most their gap at the start, so that nothing pushes there; how deep those
// that overlap do is negative offset. Throws InputError naming two bodies that overlap at the start by more
// than the offset asked for, or a body that does so with itself.
void make_surface_tables(double offset_m, World& world);

}  // namespace limber::fem::detail
