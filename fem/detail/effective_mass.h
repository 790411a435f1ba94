// What a rigid body sets against contact: all its mass, not that of the node which happens to touch.
// Derivation and why it is stable: docs/dynamics.md, "Rigid bodies".
#pragma once

#include "fem/detail/lane_view.h"
#include "fem/detail/tables.h"

namespace limber::fem::detail {

// One body in one lane and step; a function of the present positions.
class EffectiveMass {
 public:
  double depths = 0;  // the sum over all points of contact in which the body takes part now, walls among them

  // Finds the centre of mass and the inertia of the nodes where they are.
  template <class Real>
  void measure(const LaneView<Real>&, const Topology::Body&, const std::vector<Real>& node_mass);
  // What a point at `at`, so deep, sets against a push along a unit vector n: its share of the body,
  // depth/depths, of 1/(1/M + (r × n)·J⁻¹(r × n)); inverted. A point that comes or goes has no share yet, so
  // none jumps.
  template <class Real>
  double inverse_mass(const Real at[3], const Real along[3], Real depth) const;
  // As measured: of the whole body, and about its centre of mass (xx xy xz yy yz zz).
  double inverse_mass() const { return inverse_mass_; }
  const double* center() const { return center_; }
  const double* inverse_inertia() const { return inverse_inertia_; }

 private:
  double inverse_mass_ = 0, center_[3], inverse_inertia_[6];  // xx xy xz yy yz zz
};

}  // namespace limber::fem::detail
