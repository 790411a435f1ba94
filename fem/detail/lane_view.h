// One lane's arrays, as contact reads and writes them.
#pragma once

#include "fem/detail/kernels.h"

namespace limber::fem::detail {

template <class Real>
struct LaneView {
  const Real *x, *v;
  Real* f;
  Layout state, force;  // of x and v, of f
  int stride;           // lanes
  // Boxes of the bodies, [(3 body + c) stride], and how far each body's fastest node can have come since
  // load, [body stride].
  const Real *lower, *upper, *travel;
};

}  // namespace limber::fem::detail
