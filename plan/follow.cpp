#include "plan/follow.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "plan/expansion.h"
#include "plan/refine.h"

namespace limber::plan {

namespace {

// Who is off by this share of the goal's radius is pushed back with all of the largest force.
constexpr double share_of_radius = 0.25;
constexpr double pieces_a_radian = 5, longest_piece_s = 0.05;
constexpr double grace_s = 5;  // after the guide's end

}  // namespace

Guide guide_of(const System& system, const Settings& settings, const Trajectory& trajectory) {
  Guide guide;
  guide.dt_s = system.dt_s();
  guide.robot_mass_kg = system.robot_mass_kg();
  guide.response_rad_s =
      std::sqrt(settings.max_force_n / guide.robot_mass_kg / (share_of_radius * settings.goal.radius_m));
  guide.piece_s = 1 / std::max(1 / longest_piece_s, pieces_a_radian * guide.response_rad_s);
  const int longest = steps_of(guide.piece_s, system.dt_s());
  const std::size_t controls = trajectory.controls.size() - (trajectory.settle_steps > 0);
  for (std::size_t c = 0; c < controls; ++c)
    for (int left = trajectory.controls[c].steps; left > 0;) {
      Control& piece = guide.pieces.emplace_back(trajectory.controls[c]);
      piece.steps = std::min(left, longest);
      guide.control.push_back(int(c));
      left -= piece.steps;
    }
  ControlRollout course;
  course.from = system.start();
  course.controls = guide.pieces;
  run(system, settings, {&course, 1},
      {.settle = ControlRolloutOptions::never, .ask_acceptable = false, .stoppable = true});
  LIMBER_CHECK(course.states.size() == guide.pieces.size(), course.states.size(), guide.pieces.size());
  const auto add = [&](const State& state) {
    guide.centers.push_back(system.robot_center(state));
    guide.velocities.push_back(system.robot_velocity(state));
  };
  add(course.from);
  for (const State& state : course.states) add(state);
  return guide;
}

Follower::Follower(const System& system, const Settings& settings, Guide guide)
    : system_(system), settings_(settings), guide_(std::move(guide)) {
  guide_.pieces =
      in_steps_of(system.dt_s(), std::move(guide_.pieces), std::exchange(guide_.dt_s, system.dt_s()));
  std::int64_t end = system.start().step;
  for (const Control& piece : guide_.pieces) ends_.push_back(end += piece.steps);
}

std::size_t Follower::piece_at(const State& state) const {
  return std::size_t(std::upper_bound(ends_.begin(), ends_.end(), state.step) - ends_.begin());
}

Control Follower::next(const State& state) const {
  const std::size_t piece = piece_at(state);
  if (piece < ends_.size()) return correct(state, piece);
  Control control = settle_control(settings_, steps_of(guide_.piece_s, system_.dt_s()));
  control.target_m = (settings_.goal.center_of_mass_m + system_.goal_shift(state)).cast<float>();
  return control;
}

bool Follower::is_over(const State& state) const {
  if (piece_at(state) < ends_.size()) return false;
  const std::int64_t end = ends_.empty() ? system_.start().step : ends_.back();
  return in_goal(state) || state.step >= end + steps_of(grace_s, system_.dt_s());
}

// The settle looks whether the robot rests, and is as the goal asks; without one it is to be so now.
bool Follower::in_goal(const State& state) const {
  return holds(settings_.goal, system_.robot_center(state) - system_.goal_shift(state)) &&
         (settings_.settle.max_duration_s > 0 || system_.goal_holds(state));
}

// A push is corrected, where it falls stays as it is. Other controls are drawn to a place by themselves;
// where that is not enough, a push takes their place that has the path's acceleration in it.
Control Follower::correct(const State& state, std::size_t piece) const {
  Control control = guide_.pieces[piece];
  control.steps = std::int32_t(ends_[piece] - state.step);
  const Vec3 behind = guide_.centers[piece] - system_.robot_center(state);
  const Vec3 slower = guide_.velocities[piece] - system_.robot_velocity(state);
  if (behind.isZero(0) && slower.isZero(0)) return control;
  const double mass = guide_.robot_mass_kg, w = guide_.response_rad_s;
  Vec3 force = mass * (w * w * behind + 2 * w * slower);
  switch (control.manipulation) {
    case Manipulation::none:
      control.manipulation = Manipulation::body;
      break;
    case Manipulation::control_point:
      if (control.second_node >= 0) return shared_by_carriers(control, force);
      [[fallthrough]];
    case Manipulation::body:
      force += control.force_n.cast<double>();
      break;
    case Manipulation::interpolation:
    case Manipulation::hold: {
      if (behind.norm() < 0.1 * settings_.goal.radius_m) return control;
      const double lasts = guide_.pieces[piece].steps * system_.dt_s();
      force += mass * (guide_.velocities[piece + 1] - guide_.velocities[piece]) / lasts;
      control = {
          .manipulation = Manipulation::body, .steps = control.steps, .pressure_pa = control.pressure_pa};
    }
  }
  control.force_n = limited(force);
  return control;
}

// Each carrier takes half of the correction.
Control Follower::shared_by_carriers(Control control, const Vec3& correction) const {
  control.force_n = limited(control.force_n.cast<double>() + 0.5 * correction);
  control.second_force_n = limited(control.second_force_n.cast<double>() + 0.5 * correction);
  return control;
}

Vec3f Follower::limited(const Vec3& force) const {
  const double most = settings_.max_force_n * just_below_one, length = force.norm();
  return (length > most ? Vec3(force * (most / length)) : force).cast<float>();
}

}  // namespace limber::plan
