// How large a step the damped elastic body stands.
#pragma once

#include <vector>

#include "fem/detail/tables.h"

namespace limber::fem::detail {

// The fastest mode of the elements at rest: ω² of M⁻¹K, and the share of critical damping that it has.
struct FastestMode {
  double frequency2, damping_ratio;
};
// By power iteration from a written seed, and 2 % more than that gives. K and the damping are taken as
// differences of the forces. rest_positions (3 a node) and inverse_mass are indexed as the elements index
// them; nodes with inverse mass 0 do not move.
FastestMode fastest_mode(const ElementLists&, const std::vector<double>& rest_positions,
                         const std::vector<double>& inverse_mass);

// The forces (3 a node) at these positions and velocities.
std::vector<double> forces_of(const ElementTables<double>&, const std::vector<double>& positions,
                              const std::vector<double>& velocities);

// Largest stable step of kick-drift with the velocity of the step's start in the damping: 2 (√(1+ζ²) − ζ)/ω.
double stable_step(const FastestMode&);

}  // namespace limber::fem::detail
