// A body's outline from a few of its vertices: enough to frame a camera, and for words that keep clear of
// bodies, for a fraction of what moving the whole surface costs. The vertices are found at rest, in
// directions all round, so they stay the outermost however the body turns; where it bends, others may come to
// stand a little farther out.
#pragma once

#include "ffd/binding.h"
#include "limber/detail/body/body.h"

namespace limber::detail {

// The binding of those vertices alone, for deform().
ffd::Binding outermost_part(const PreparedBody&);

}  // namespace limber::detail
