// A body under a force of fixed size and free direction, as the robot's centre of mass nearly is.
#pragma once

#include "core/types.h"

namespace limber::plan {

// A time in which a point with velocity v covers `way` under a constant acceleration of size a > 0 in the
// best direction: t ≥ 0 with |way − v t| = a t² / 2. There can be three such; for v = 0 or along the way
// there is one. Seconds.
double time_to_go(const Vec3& way, const Vec3& velocity, double acceleration);

// No time is shorter: v points straight there.
double min_time_to_go(double distance, double speed, double acceleration);

// The direction of that acceleration, unit; zero where the way is zero.
Vec3 best_direction(const Vec3& way, const Vec3& velocity, double acceleration);

}  // namespace limber::plan
