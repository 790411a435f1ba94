// Where the fine surface of a body is, as it is drawn.
#pragma once

#include "core/state.h"
#include "fem/world.h"
#include "limber/detail/body/body.h"

namespace limber::detail {

// (V × 3), metres, in that state.
Points surface_at(const fem::World&, const PreparedBody&, const State&, int body);
// The same where the cage is at rest. Not quite surface.ply where a vertex far outside its cage is bound with
// clamped weights.
Points surface_at_rest(const fem::Body&, const PreparedBody&);

}  // namespace limber::detail
