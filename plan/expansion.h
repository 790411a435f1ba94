// What chance decides about one expansion, and the control that follows from it. Method: docs/planning.md.
#pragma once

#include "plan/settings.h"

namespace limber::plan {

// A pure function of (seed, iteration): whoever draws expansion 17, and when, draws the same.
struct Draw {
  Vec3 point = Vec3::Zero();  // x of Algorithm 1, metres: random, or the goal
  bool towards_goal = false;
  Manipulation manipulation = Manipulation::none;
  double force_n = 0;  // magnitude on the whole robot
  int robot_node = 0;  // of a control point
  int steps = 1;
};
Draw draw(const Settings&, const System&, std::int64_t iteration);

// The control of an expansion from a node whose robot has its centre of mass at `center`: body and control
// point push along point − center, interpolation draws to the goal. largest_force() never exceeds
// max_force_n.
// The goal is where the settings have it, moved by `goal_shift`.
Control control_of(const Draw&, const Settings&, const Vec3& center, const Vec3& goal_shift = Vec3::Zero());

// The interpolation that ends a path; `steps` long.
Control settle_control(const Settings&, int steps);

// Whole steps nearest to a duration, at least one.
int steps_of(double duration_s, double dt_s);

}  // namespace limber::plan
