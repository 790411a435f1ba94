// Builds what contact on the fine surfaces reads, from the bodies' ContactShapes.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

// Sets world.surfaces and surfaces64, where all bodies have shapes; the rest of the world is there already.
// Any two bodies have the offset asked for, and so has a body with itself.
void make_surface_tables(double offset_m, World& world);

}  // namespace limber::fem::detail
