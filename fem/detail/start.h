// Where the bodies of a world begin, and how near their fine surfaces may come. Method: docs/contact.md,
// "Overlap at the start".
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

// Sets start_positions, parting and the offsets of surfaces; all else of the world is there already. Throws
// InputError naming two bodies that overlap and are not parted, or a body that overlaps itself; Interrupted.
void set_start(const WorldSpec&, World&);

}  // namespace limber::fem::detail
