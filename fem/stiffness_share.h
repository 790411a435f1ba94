// By how much linear tets are too stiff, of one body.
#pragma once

#include "fem/world.h"

namespace limber::fem {

// What build_world finds for a body of this spec, which takes seconds: Body::stiffness_share. Method:
// docs/dynamics.md, "One material, any mesh". Throws InputError as build_world does.
double stiffness_share_of(const BodySpec&);

}  // namespace limber::fem
