// A body's outline from a few of its vertices: enough for cameras, and for words that keep clear of bodies.
#pragma once

#include "ffd/binding.h"
#include "limber/detail/body/body.h"

namespace limber::detail {

// The binding of the body's outermost vertices at rest alone: where these are, deform() tells from the nodes
// of the cage, for a fraction of what the whole surface costs.
ffd::Binding outermost_part(const PreparedBody&);

}  // namespace limber::detail
