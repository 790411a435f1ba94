// The steppers' code in double, slow and for proofs: what float32 results are compared with.
#pragma once

#include <vector>

#include "core/state.h"
#include "fem/world.h"

namespace limber::fem {

struct ReferenceState {
  std::int64_t step = 0;
  std::vector<double> positions, velocities;  // (3 × moving_nodes)
};
ReferenceState reference_state(const State&);

// Takes control.steps steps.
void advance(const World&, const Control&, ReferenceState&);

// Elastic and damping forces on all moving nodes, newtons, (3 × moving_nodes), and the energy whose gradient
// they are at rest.
std::vector<double> elastic_forces(const World&, const ReferenceState&);
double elastic_energy_j(const World&, const ReferenceState&);
double elastic_energy_j(const World&, const ReferenceState&, int body);

}  // namespace limber::fem
