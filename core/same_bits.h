// Stricter than ==, for which −0 is 0.
#pragma once

#include "core/state.h"

namespace limber {

bool same_bits(const State&, const State&);
bool same_bits(const Control&, const Control&);
bool same_bits(const Vec3f&, const Vec3f&);

}  // namespace limber
