// One lane's arrays, as contact reads and writes them.
#pragma once

#include <cstdint>

#include "fem/detail/kernels.h"

namespace limber::fem::detail {

template <class Real>
struct LaneView {
  const Real *x, *v;
  Real* f;
  Layout state, force;  // of x and v, of f
  int stride;           // lanes
  // Boxes of the bodies, [(3 body + c) stride], and how far each body's fastest node can have come since
  // load, [body stride]; that against the mean of its nodes too, of deformable bodies.
  const Real *lower, *upper, *travel, *inner_travel;
  // Bodies that take no part in this step, [body stride], or null: nothing is looked for between two of them.
  const Real* asleep = nullptr;
  // How often each body has changed its place since load, [body stride], or null: while two bodies' counts
  // stay, so do their contacts.
  const std::uint32_t* changes = nullptr;
  bool sleeps(int body) const { return asleep && asleep[body * stride] > 0; }
};

// The place of a node, metres.
template <class Real>
void fetch(const LaneView<Real>& view, int node, Real out[3]) {
  for (int c = 0; c < 3; ++c) out[c] = view.x[view.state.at(node, c)];
}

}  // namespace limber::fem::detail
