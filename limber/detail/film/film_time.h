// Which moment of a motion each frame of a film shows. Method: docs/rendering.md, "Time".
#pragma once

#include <optional>
#include <vector>

#include "core/mesh.h"
#include "core/state.h"

namespace limber::detail {

// 0 … 1 a frame of the motion: what it is made to rise before and to fall after, so that the largest within
// `frames` on either side are reached where they were, without a jump.
std::vector<double> eased(const std::vector<double>& shares, int frames);

// How many frames of the motion a frame of the film goes on by.
struct PaceRange {
  double slowest, quickest;  // 0 < slowest ≤ quickest
};

struct Moment {
  double at;    // frames of the motion, 0 … their number − 1
  double pace;  // frames of the motion a frame of the film
};

// From first to last frame of the motion, `contact` of each 0 … 1: quickest where it is 0, slowest where it
// is 1. Time goes on smoothly: the pace has no jumps. `length`, which the range must allow: so many frames of
// the film between the first and the last. Paces are out of the range by what whole frames ask for, half a
// frame in the whole film.
std::vector<Moment> paced(const std::vector<double>& contact, const PaceRange&,
                          std::optional<double> length = {});

// Between stored frames a cubic through the places and velocities of both; at one the stored state itself.
State state_at(const std::vector<State>& frames, double dt_s, double moment);

// The first of these frames from which on no node is farther than this from where it is in the last.
int first_at_rest(const std::vector<State>& frames, double tolerance_m);

}  // namespace limber::detail
