// A body under a force of fixed size and free direction, as the robot's centre of mass nearly is.
#pragma once

#include "core/types.h"

namespace limber::plan {

// What moves it, and what slows it: v' = a u − α v with a unit vector u that is chosen.
struct Drive {
  double acceleration = 0;  // a > 0, m/s²
  double drag_per_s = 0;    // α ≥ 0: a medium at rest, as in Rayleigh's damping by mass
};

// How far it gets in `t` seconds, metres: by a velocity of 1 m/s alone, (1 − e^−αt)/α, and by the force
// alone.
double drift_m(const Drive&, double t);
double driven_m(const Drive&, double t);

// A time in which a point with velocity v covers `way` where the force has the best direction throughout:
// t ≥ 0 with |way − v drift(t)| = driven(t). There can be three such; for v = 0 or straight away there is
// one. Seconds.
double time_to_go(const Vec3& way, const Vec3& velocity, const Drive&);

// No time is shorter: v points straight there, or, below 0, straight away.
double min_time_to_go(double distance, double speed, const Drive&);

// Until a point at this speed stands.
double time_to_stop(double speed, const Drive&);

// The direction of that force, unit; zero where the way is zero.
Vec3 best_direction(const Vec3& way, const Vec3& velocity, const Drive&);

}  // namespace limber::plan
