// How large a step the damped elastic body stands.
#pragma once

#include <span>
#include <vector>

#include "fem/detail/kernels.h"

namespace limber::fem::detail {

// The largest ω² of M⁻¹K of the undeformed elements, by power iteration from a written seed; 2 % are added,
// because the iteration comes from below. positions (3 a node) and inverse_mass are indexed as the elements
// index them; nodes with inverse mass 0 do not move.
double highest_frequency2(std::span<const Spring<double>>, std::span<const VolumeElement<double>>,
                          const std::vector<double>& positions, const std::vector<double>& inverse_mass);

// Largest stable step of kick-drift with the velocity of the step's start in the damping, for a mode ω damped
// by k_d = τ k: 2 (√(1+ζ²) − ζ)/ω with ζ = τω/2.
double stable_step(double frequency2, double damping_time);

}  // namespace limber::fem::detail
