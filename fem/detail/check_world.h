// Whether a world may be built of what was given. Each throws InputError that names the body and the element.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

void check(const BodySpec&);   // its cage, material, fixed nodes and keyframes
void check(const WorldSpec&);  // what is not of one body
// Bodies lie within the bounds, where these are walls; cages do not overlap, where contact is between them.
void check_places(const World&);

}  // namespace limber::fem::detail
