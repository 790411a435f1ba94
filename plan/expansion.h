// What chance decides about one expansion, and the control that follows from it. Method: docs/planning.md.
#pragma once

#include "plan/settings.h"

namespace limber::plan {

// Float rounding of a vector of exactly the largest force could exceed it; of this share of it, not.
constexpr double just_below_one = 1 - 1e-6;

// A pure function of (seed, iteration): whoever draws expansion 17, and when, draws the same.
struct Sample {
  Vec3 point = Vec3::Zero();  // x of Algorithm 1, metres: random, or the goal
  bool towards_goal = false;
  Manipulation manipulation = Manipulation::none;
  double force_n = 0;  // magnitude on the whole robot
  int robot_node = 0;  // of a control point
  int steps = 1;
  // For the laws of the preset `fast`, each in [0, 1).
  bool guided = false;
  double rank = 0;            // of the node among the most promising
  double ahead = 0;           // how far ahead it aims
  double stretch = 0;         // how much longer than it should take it pushes
  Vec3 aside = Vec3::Zero();  // unit; where it aims besides
  double pressure_pa = 0;     // in a balloon
  double lift = 0;            // share of the robot's weight that carriers bear
};
Sample draw_sample(const Settings&, const System&, std::int64_t iteration);

// Where an expansion begins: a node's robot, and the goal as it is there.
struct NodeMotion {
  Vec3 center = Vec3::Zero(), velocity = Vec3::Zero();
  Vec3 goal_shift = Vec3::Zero(), goal_velocity = Vec3::Zero();
  std::array<NodePlace, 2> carried{};  // where the system has carriers
  Windings windings = {};
};

// Pushes towards `target` (which moves at `target_velocity`) reckoning with the velocity; the way there takes
// as long as the control lasts, save for the settings' limits and the draw's stretch.
Control steered_control(const Sample&, const Settings&, const System&, const NodeMotion&, const Vec3& target,
                        const Vec3& target_velocity);

// Both carriers push, each on half of the robot with the force that is drawn: it bears its part of the
// weight, and what is left of the force drives it, the first towards targets[0]. They push as long as the
// longer way takes, save for the settings' limits and the draw's stretch.
Control carriers_control(const Sample&, const Settings&, const System&, const NodeMotion&,
                         const std::array<Vec3, 2>& targets, const Vec3& target_velocity);

// The control of an expansion from a node whose robot has its centre of mass at `center`: body and control
// point push along point − center, interpolation draws to the goal. largest_force() never exceeds
// max_force_n.
// The goal is where the settings have it, moved by `goal_shift`.
Control control_of(const Sample&, const Settings&, const Vec3& center, const Vec3& goal_shift = Vec3::Zero());

// Draws the robot to the goal with the force of the settle, by interpolation or as the laws have it; and as
// the settle has it, which ends a path. `steps` long.
Control goal_control(const Settings&, int steps);
Control settle_control(const Settings&, int steps);

// Whole steps nearest to a duration, at least one.
int steps_of(double duration_s, double dt_s);

}  // namespace limber::plan
