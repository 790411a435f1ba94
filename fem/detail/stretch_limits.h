// What keeps the tets of a body from being drawn out or pressed flat: as tissue does, they stiffen towards
// the body's max_stretch. Method and figures: docs/dynamics.md.
#pragma once

#include <vector>

#include "fem/detail/lane_view.h"
#include "fem/detail/tables.h"

namespace limber::fem {
struct World;
}

namespace limber::fem::detail {

template <class Real>
class StretchLimits {
 public:
  StretchLimits(const World&, const Kernels<Real>&);
  void forget(int lane);  // the lane holds another state now
  // Finds the tets that are stretched in some lane; x of all lanes. `inner_travel` [body][lane]: how far
  // nodes can have come since then against their body's mean. Bodies that are all asleep are left out.
  void find(const Real* x, const Real* inner_travel, const std::vector<bool>& all_asleep);
  // Adds to view.f the forces of those of this lane.
  void add_forces(int lane, const LaneView<Real>& view);

 private:
  struct Body {
    int index;
    StretchedTets<Real> tets;
    Real least, most;  // of singular values, where the force begins
    Real half_stiff;   // so far beyond it has half of its stiffness
    int found = 0;
    std::vector<Real> reach;         // a tet: of the kernel
    std::vector<Real> asleep_until;  // [tet][lane] inner travel; filled up for the kernel
    std::vector<int> stretched;      // of the body's tets
    std::vector<unsigned> lanes;     // of each of these, bits
  };
  // A singular value beyond its limit: which the tet's nodes take farther by weight × movement along the
  // direction. Weights without their signs sum to 2, as those of a contact.
  struct Limit {
    int node[4];
    Real weight[4], direction[3], depth, stiffness;  // share of what is stable
  };
  void measure(const LaneView<Real>&, const Body&, int tet);

  const Tables<Real>& tables_;
  const Kernels<Real>& kernels_;
  Real step_;
  std::vector<Body> bodies_;
  std::vector<int> nodes_;          // (4 a tet) of bodies with a limit
  std::vector<Real> inverse_rest_;  // (9 a tet) of the edges at rest from node 0 as columns, row by row
  std::vector<Limit> limits_;
  std::vector<Real> loads_;  // a node
};

extern template class StretchLimits<float>;
extern template class StretchLimits<double>;

}  // namespace limber::fem::detail
