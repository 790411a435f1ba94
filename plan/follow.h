// Follows a planned path by feedback: each piece's control is chosen from the state that was reached. Method
// and figures: docs/planning.md.
#pragma once

#include "plan/control_rollout.h"
#include "plan/trajectory.h"

namespace limber::plan {

// The path to follow, cut into pieces, and where its robot was when each of them began.
struct Guide {
  double dt_s = 0;
  double robot_mass_kg = 0;      // as the planner knows it
  double response_rad_s = 0;     // of the follower, critically damped
  double piece_s = 0;            // so long a force is held at most
  std::vector<Control> pieces;   // from the start, without the settle; of piece_s at most
  std::vector<int> control;      // [piece]: which of the path's controls it is a part of
  std::vector<Vec3> centers;     // [piece], and after the last: of the robot, metres
  std::vector<Vec3> velocities;  // metres a second
};
// `trajectory` is one of this system: it is run again.
Guide guide_of(const System&, const Settings&, const Trajectory&);

// Chooses controls from (state, guide) alone. In the system that the guide is of they are the guide's own,
// bit for bit; in another, which may have another time step, the difference of the robot's centre and
// velocity is made up for, with no more than max_force_n. After the guide's end the robot is drawn to the
// goal, for some seconds at most, and then settles.
class Follower {
 public:
  // System and settings must outlive it.
  Follower(const System&, const Settings&, Guide);

  // To be held for its steps; after the guide's end the settle's, aimed anew.
  Control next(const State&) const;
  // The guide is behind it, and the robot in the goal, or too late for that: the settle is next.
  bool is_over(const State&) const;
  // The guide's piece that is due at this state's step; pieces.size() after the last.
  std::size_t piece_at(const State&) const;
  const Guide& guide() const { return guide_; }  // in steps of this system

 private:
  Control correct(const State&, std::size_t piece) const;
  Control shared_by_carriers(Control, const Vec3& correction) const;
  Vec3f limited(const Vec3& force) const;  // to the largest that is allowed
  bool in_goal(const State&) const;

  const System& system_;
  const Settings& settings_;
  Guide guide_;
  std::vector<std::int64_t> ends_;  // [piece]: State::step at its end
};

}  // namespace limber::plan
