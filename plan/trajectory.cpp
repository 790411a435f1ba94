#include "plan/trajectory.h"

#include "core/error.h"
#include "plan/control_rollout.h"
#include "plan/detail/hash_control.h"
#include "plan/frame_times.h"

namespace limber::plan {

namespace {

// Without the settle's control.
Trajectory trajectory_of(ControlRollout course, double frames_per_second) {
  return {std::move(course.controls), course.settle_steps, frames_per_second, std::move(course.frames),
          std::move(course.end)};
}

}  // namespace

std::uint64_t hash_of(const Trajectory& t) {
  Hasher hasher;
  hasher.value(std::int64_t(t.controls.size())).value(t.settle_steps).value(t.frames_per_second);
  for (const Control& control : t.controls) detail::hash_control(hasher, control);
  hasher.value(std::int64_t(t.frames.size()));
  for (const State& frame : t.frames) hasher.value(limber::hash_of(frame));
  return hasher.value(limber::hash_of(t.end)).digest();
}

void require_frame_times(const Trajectory& t, double dt_s, const std::string& what) {
  LIMBER_CHECK(!t.frames.empty(), t.frames.size());
  const FrameTimes times(t.frames.front().step, dt_s, t.frames_per_second);
  const auto count = std::int64_t(t.frames.size());
  const auto refuse = [&](const std::string& why) {
    throw InputError(
        fmt::format("{}: {}, at {} frames a second and steps of {:.4g} s; the file was changed, or another "
                    "limber made it: plan "
                    "anew with limber plan",
                    what, why, t.frames_per_second, dt_s));
  };
  for (std::int64_t f = 0; f < count; ++f)
    if (const std::int64_t step = t.frames[std::size_t(f)].step; step != times.step_of(f))
      refuse(fmt::format("frame {} is at step {}, and belongs at step {}", f, step, times.step_of(f)));
  if (times.step_of(count) <= t.end.step)
    refuse(fmt::format("its path ends at step {}, and lacks the frame at step {}", t.end.step,
                       times.step_of(count)));
}

Trajectory simulate(const System& system, const std::vector<Control>& controls, double frames_per_second) {
  Settings settings;
  settings.frames_per_second = frames_per_second;
  ControlRollout course;
  course.from = system.start();
  course.controls = controls;
  run(system, settings, {&course, 1},
      {.settle = ControlRolloutOptions::never,
       .keep_frames = true,
       .ask_acceptable = false,
       .stoppable = true});
  return trajectory_of(std::move(course), frames_per_second);
}

bool comes_to_rest(const System& system, const Settings& s, const State& in_goal) {
  if (s.settle.max_duration_s == 0) return system.goal_holds(in_goal);
  ControlRollout course;
  course.from = in_goal;
  run(system, s, {&course, 1}, {});
  return course.result == ControlRollout::rests_in_goal;
}

namespace {

Trajectory trajectory_of_path(const System& system, const Settings& s, const Tree& tree, int node,
                              ControlRolloutOptions options) {
  const std::vector<int> path = path_to(tree, node);
  ControlRollout course;
  course.from = system.start();
  for (std::size_t i = 1; i < path.size(); ++i)
    course.controls.push_back(tree.controls[std::size_t(path[i])]);
  options.keep_frames = true, options.ask_acceptable = false;
  run(system, s, {&course, 1}, options);
  const std::vector<State>& states = course.states;
  LIMBER_CHECK(states.size() + 1 == path.size(), states.size(), path.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const bool same = limber::hash_of(states[i]) == limber::hash_of(tree.states[std::size_t(path[i + 1])]);
    LIMBER_CHECK(same, i, states[i].step);
  }
  Trajectory t = trajectory_of(std::move(course), s.frames_per_second);
  if (t.settle_steps > 0) t.controls.push_back(settle_control(s, t.settle_steps));
  return t;
}

}  // namespace

Trajectory trajectory_to(const System& system, const Settings& s, const Tree& tree, int node, bool settle) {
  return trajectory_of_path(
      system, s, tree, node,
      {.settle = settle ? ControlRolloutOptions::anywhere : ControlRolloutOptions::never});
}

std::optional<Trajectory> trajectory_within(double grace_s, const System& system, const Settings& s,
                                            const Tree& tree, int node) try {
  return trajectory_of_path(system, s, tree, node,
                            {.settle = ControlRolloutOptions::never, .stoppable = true, .grace_s = grace_s});
} catch (const Interrupted&) {
  return std::nullopt;
}

}  // namespace limber::plan
