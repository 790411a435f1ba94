// Carries a path to another System of the same scene: the same bodies in finer cages. Method and figures:
// docs/planning.md.
#pragma once

#include "plan/search.h"

namespace limber::plan {

// The path to carry, as it was in the system it was found in.
struct Reference {
  double dt_s = 0;
  double frames_per_second = 0;
  std::vector<Control> controls;  // from the start, without the settle; their nodes are the new system's
  std::vector<Vec3> centers;      // of the robot at every frame time, metres
  std::vector<Vec3> velocities;   // metres a second
};
// The reference without its nodes changed; `trajectory` is one of this system.
Reference reference_of(const System&, const Trajectory&);

struct RefineReport {
  enum How { replayed, tracked, replanned, failed } how = failed;
  // Of the reference's controls as they are. What ends them, by its name in JSON; looks_wrong: it rests in
  // the goal, and System::first_refused lets not all frames pass.
  std::string replay_ends;
  double replay_s = 0;                                         // so long, with the settle if it came to that
  double replay_distance_m = 0;                                // of their end from the goal
  double replay_mean_error_m = 0, replay_largest_error_m = 0;  // between the centres at the frame times
  double tracked_s = 0;                          // of the reference; all of it unless the robot lost it
  double mean_error_m = 0, largest_error_m = 0;  // between the centres while it was tracked
  std::int64_t iterations = 0;                   // of the search from the states tracked so far
  double replay_cpu_s = 0, track_cpu_s = 0, search_cpu_s = 0;
};
Json json_of(const RefineReport&);

// Controls of one time step as such of another, each end at the nearest whole step.
std::vector<Control> in_steps_of(double dt_s, std::vector<Control>, double their_dt_s);

// Tries one after the other: the reference's controls as they are; its robot's centre and velocity followed
// by a force at most max_force_n, anew every 0.1 s, and interpolation into the goal; a search from all states
// on that way as far as it was good. Each piece is a control like any other, so the plan is one like any
// other, and counts as an iteration. Throws InputError where the settings have via points, Interrupted where
// a signal comes before the search, which keeps what it has.
Plan refine(const System&, const Settings&, const Reference&, RefineReport&);

}  // namespace limber::plan
