// The system left to itself, or steered on its way: nothing is searched. Method: docs/simulation.md.
#pragma once

#include "plan/search.h"

namespace limber::plan {

// From the system's start for duration_s, to the nearest whole step: a tree of two nodes, and the path
// between them. Where the dynamics diverge it ends, as by SIGINT and SIGTERM, with the last frame before
// that. With `earlier` goes on from its end, to the bytes that one uninterrupted simulation gives. `watch`
// gets the seconds simulated so far, at every frame. Throws InputError when the duration is no time or
// shorter than what is there already, or `earlier` is no simulation from this system's start at as many
// frames a second.
//
// With `steer` no control is none: it is asked at the start and at each control's end for the next, from the
// state reached, and the last is cut at the end. The tree is then a chain, and where it ends early it ends
// with a whole control. Such a simulation is no `earlier`.
using Steer = std::function<Control(const State&)>;
Plan simulate_for(const System&, double duration_s, double frames_per_second,
                  std::optional<Plan> earlier = std::nullopt,
                  const std::function<void(double)>& on_progress = {}, const Steer& steer = {});

// The steps that a simulation of that duration has.
std::int64_t steps_of_simulation(const System&, double duration_s);

}  // namespace limber::plan
