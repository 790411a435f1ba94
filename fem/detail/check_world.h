// Whether a world may be built of what was given. Each throws InputError, which names the body and the
// element and says what to try. Two moments of checking: specs first, before anything is made of them, and
// places last, when bodies are there and lie in the world's bounds. What passes here never has to be asked
// again: no later code looks whether a mesh is valid or a number in its range. Why the ranges are what they
// are: check_world.cpp.
#pragma once

#include "fem/world.h"

namespace limber::fem::detail {

void check(const BodySpec&);   // its cage, material, fixed nodes and keyframes
void check(const WorldSpec&);  // what is not of one body
// Bodies lie within the bounds, where these are walls; cages do not overlap, where contact is between them.
void check_places(const World&);

}  // namespace limber::fem::detail
