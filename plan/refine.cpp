#include "plan/refine.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/progress.h"
#include "plan/control_rollout.h"
#include "plan/expansion.h"
#include "plan/frame_times.h"
#include "plan/shortcut.h"

namespace limber::plan {

namespace {

constexpr double piece_s = 0.1;
constexpr double response_rad_s = 3;  // of the critically damped follower; ten pieces a radian are enough
constexpr double reach_s = 5;         // interpolation may take so long from the reference's end into the goal

Vec3 at(const std::vector<Vec3>& of_frames, double frame) {
  const double last = double(of_frames.size() - 1), f = std::clamp(frame, 0.0, last);
  const auto i = std::size_t(f);
  const double share = f - double(i);
  return share == 0 ? of_frames[i] : Vec3((1 - share) * of_frames[i] + share * of_frames[i + 1]);
}

double distance_from_goal(const System& system, const Settings& settings, const State& state) {
  return (system.robot_center(state) - system.goal_shift(state) - settings.goal.center_of_mass_m).norm();
}

// The states of a path as a tree of one branch, each an iteration; not solved.
Plan chain(const System& system, const Settings& settings, const std::vector<Control>& controls,
           const std::vector<State>& states) {
  Plan plan;
  plan.settings = settings;
  plan.system_hash = system.hash();
  const State start = system.start();
  plan.tree.add(start, -1, Control{}, -1, system.robot_center(start).cast<float>());
  plan.best_distance_m = distance_from_goal(system, settings, start);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const int node = plan.tree.add(states[i], int(i), controls[i], std::int64_t(i),
                                   system.robot_center(states[i]).cast<float>());
    const double distance = distance_from_goal(system, settings, states[i]);
    if (distance < plan.best_distance_m) plan.best_node = node, plan.best_distance_m = distance;
  }
  plan.statistics.iterations = std::int64_t(states.size());
  return plan;
}

Plan solved_by(const System& system, const Settings& settings, const ControlRollout& path) {
  Plan plan = chain(system, settings, path.controls, path.states);
  plan.best_node = plan.tree.size() - 1;
  adopt(system, plan, path, {0});
  return plan;
}

// Follows the reference piece by piece.
class ReferenceFollower {
 public:
  ReferenceFollower(const System& system, const Settings& settings, const Reference& reference)
      : system_(system),
        settings_(settings),
        reference_(reference),
        base_(in_steps_of(system.dt_s(), reference.controls, reference.dt_s)),
        propagator_(system.make_propagator()),
        first_step_(system.start().step),
        frames_(system, settings.frames_per_second) {}

  // What was run, from the start. The last state is the last good one: acceptable, and not far from where the
  // reference was.
  ControlRollout follow(RefineReport& report) {
    ControlRollout path;
    path.from = system_.start();
    State state = path.from;
    const int piece = steps_of(piece_s, system_.dt_s());
    for (const Control& base : base_)
      for (int left = base.steps; left > 0;) {
        const int steps = std::min(left, piece);
        Rollout rollout;
        rollout.from = &state;
        rollout.control = control(base, state);
        rollout.control.steps = steps;
        if (!passes(rollout)) return path;
        const double error =
            (at(reference_.centers, frame_of(rollout.to)) - system_.robot_center(rollout.to)).norm();
        if (error > 2 * settings_.goal.radius_m) return path;
        report.largest_error_m = std::max(report.largest_error_m, error);
        report.mean_error_m += (error - report.mean_error_m) * steps / double(rollout.to.step - first_step_);
        state = rollout.to;
        path.controls.push_back(rollout.control);
        path.states.push_back(std::move(rollout.to));
        report.tracked_s = seconds(state);
        left -= steps;
      }
    complete_ = true;
    return path;
  }
  bool complete() const { return complete_; }

 private:
  // Fills `to`; whether it and all frames on the way are acceptable.
  bool passes(Rollout& rollout) {
    State now = *rollout.from;
    const std::int64_t end = now.step + rollout.control.steps;
    while (now.step < end) {
      throw_if_stopped();
      Rollout piece{&now, rollout.control, {}, false};
      piece.control.steps = int(std::min(end, frames_.next_step(now.step)) - now.step);
      propagator_->propagate({&piece, 1});
      if (!piece.ok || !piece.clear || !system_.acceptable(piece.to)) return false;
      now = std::move(piece.to);
    }
    rollout.to = std::move(now);
    return true;
  }

  double seconds(const State& state) const { return double(state.step - first_step_) * system_.dt_s(); }
  double frame_of(const State& state) const { return seconds(state) * reference_.frames_per_second; }

  // A push on the whole robot is corrected; any other is kept as long as the robot is where it should be, for
  // such a push cannot stand for it.
  Control control(const Control& base, const State& state) const {
    const double frame = frame_of(state);
    const Vec3 behind = at(reference_.centers, frame) - system_.robot_center(state);
    const Vec3 slower = at(reference_.velocities, frame) - system_.robot_velocity(state);
    const double mass = system_.robot_mass_kg(), w = response_rad_s;
    Vec3 force = mass * (w * w * behind + 2 * w * slower);
    if (base.manipulation == Manipulation::body || base.manipulation == Manipulation::none) {
      force += base.force_n.cast<double>();
    } else {
      if (behind.norm() < 0.1 * settings_.goal.radius_m) return base;
      const double next = frame + piece_s * reference_.frames_per_second;
      force += mass * (at(reference_.velocities, next) - at(reference_.velocities, frame)) / piece_s;
    }
    const double most = settings_.max_force_n * just_below_one, length = force.norm();
    if (length > most) force *= most / length;
    Control push;
    push.manipulation = Manipulation::body;
    push.force_n = force.cast<float>();
    return push;
  }

  const System& system_;
  const Settings& settings_;
  const Reference& reference_;
  std::vector<Control> base_;  // in steps of this system
  std::unique_ptr<Propagator> propagator_;
  std::int64_t first_step_;
  FrameTimes frames_;
  bool complete_ = false;
};

const char* name_of(ControlRollout::Result result) {
  switch (result) {
    case ControlRollout::rests_in_goal:
      return "rests_in_goal";
    case ControlRollout::ends_elsewhere:
      return "ends_elsewhere";
    case ControlRollout::not_acceptable:
      return "not_acceptable";
    case ControlRollout::diverged:
      return "diverged";
    case ControlRollout::too_costly:
      return "too_costly";
  }
  return "";
}

void tell_of_replay(const System& system, const Settings& settings, const Reference& reference,
                    const ControlRollout& replay, RefineReport& report) {
  report.replay_ends = name_of(replay.result);
  report.replay_s = replay.costs.duration_s;
  report.replay_distance_m = distance_from_goal(system, settings, replay.end);
  const double step = reference.frames_per_second / settings.frames_per_second;
  for (std::size_t i = 0; i < replay.frames.size(); ++i) {
    const double error =
        (at(reference.centers, double(i) * step) - system.robot_center(replay.frames[i])).norm();
    report.replay_largest_error_m = std::max(report.replay_largest_error_m, error);
    report.replay_mean_error_m += error / double(replay.frames.size());
  }
}

// As may_be_shown(), of a course whose frames were kept.
bool looks_right(const System& system, const ControlRollout& course) {
  return system.first_refused(course.frames) == course.frames.size();
}

// From the end of what was followed into the goal and to rest.
ControlRollout arrive(const System& system, const Settings& settings, const ControlRollout& followed) {
  ControlRollout path;
  path.from = system.start();
  path.controls = followed.controls;
  path.reach_force_n = settings.max_force_n * just_below_one;
  const std::int64_t now = followed.states.empty() ? path.from.step : followed.states.back().step;
  path.last_step = now + steps_of(reach_s + settings.settle.max_duration_s, system.dt_s());
  run(system, settings, {&path, 1}, {.keep_frames = true, .stoppable = true});
  return path;
}

const char* name_of(RefineReport::How how) {
  switch (how) {
    case RefineReport::replayed:
      return "replayed";
    case RefineReport::tracked:
      return "tracked";
    case RefineReport::replanned:
      return "replanned";
    case RefineReport::failed:
      return "failed";
  }
  return "";
}

}  // namespace

Json json_of(const RefineReport& report) {
  return {{"how", name_of(report.how)},
          {"replay_ends", report.replay_ends},
          {"replay_s", report.replay_s},
          {"replay_distance_m", report.replay_distance_m},
          {"replay_mean_error_m", report.replay_mean_error_m},
          {"replay_largest_error_m", report.replay_largest_error_m},
          {"tracked_s", report.tracked_s},
          {"mean_error_m", report.mean_error_m},
          {"largest_error_m", report.largest_error_m},
          {"iterations", report.iterations},
          {"replay_cpu_s", report.replay_cpu_s},
          {"track_cpu_s", report.track_cpu_s},
          {"search_cpu_s", report.search_cpu_s}};
}

Reference reference_of(const System& system, const Trajectory& trajectory) {
  Reference reference{system.dt_s(), trajectory.frames_per_second, trajectory.controls, {}, {}};
  if (trajectory.settle_steps > 0) reference.controls.pop_back();
  for (const State& frame : trajectory.frames) {
    reference.centers.push_back(system.robot_center(frame));
    reference.velocities.push_back(system.robot_velocity(frame));
  }
  return reference;
}

std::vector<Control> in_steps_of(double dt_s, std::vector<Control> controls, double their_dt_s) {
  std::int64_t theirs = 0, ours = 0;
  for (Control& control : controls) {
    theirs += control.steps;
    const std::int64_t end = std::llround(double(theirs) * (their_dt_s / dt_s));
    control.steps = std::int32_t(end - std::exchange(ours, end));
  }
  return controls;
}

Plan refine(const System& system, const Settings& settings, const Reference& reference,
            RefineReport& report) {
  LIMBER_CHECK(!reference.centers.empty(), reference.centers.size());
  report = {};
  validate(settings, system);
  if (!settings.via.empty())
    throw InputError(
        "a path by way of via points is not carried to finer cages; plan in the finer cages at once, with "
        "limber plan and --set bodies.NAME.cage.…");
  double before = cpu_seconds();
  const auto spent = [&before] {
    const double now = cpu_seconds();
    return now - std::exchange(before, now);
  };

  ControlRollout replay;
  replay.from = system.start();
  replay.controls = in_steps_of(system.dt_s(), reference.controls, reference.dt_s);
  run(system, settings, {&replay, 1}, {.keep_frames = true, .stoppable = true});
  tell_of_replay(system, settings, reference, replay, report);
  const bool rests = replay.result == ControlRollout::rests_in_goal,
             good = rests && looks_right(system, replay);
  if (rests && !good) report.replay_ends = "looks_wrong";
  replay.frames = {};
  report.replay_cpu_s = spent();
  if (good) {
    report.how = RefineReport::replayed;
    return solved_by(system, settings, replay);
  }

  ReferenceFollower follower(system, settings, reference);
  const ControlRollout followed = follower.follow(report);
  const ControlRollout arrived = follower.complete() ? arrive(system, settings, followed) : ControlRollout{};
  const bool arrives = arrived.result == ControlRollout::rests_in_goal && looks_right(system, arrived);
  report.track_cpu_s = spent();
  if (arrives) {
    report.how = RefineReport::tracked;
    return solved_by(system, settings, arrived);
  }

  Plan begun = chain(system, settings, followed.controls, followed.states);
  Settings more = settings;
  more.max_iterations = std::min(iteration_limit, more.max_iterations + begun.statistics.iterations);
  Plan plan = plan::plan(system, more, std::move(begun));
  report.iterations = plan.statistics.iterations - std::int64_t(followed.states.size());
  report.search_cpu_s = spent();
  report.how = plan.solved() ? RefineReport::replanned : RefineReport::failed;
  return plan;
}

}  // namespace limber::plan
