#include "plan/trajectory.h"

#include "core/error.h"
#include "plan/course.h"
#include "plan/detail/hash_control.h"

namespace limber::plan {

namespace {

// Without the settle's control.
Trajectory trajectory_of(Course course, double frames_per_second) {
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

Trajectory simulate(const System& system, const std::vector<Control>& controls, double frames_per_second) {
  Settings settings;
  settings.frames_per_second = frames_per_second;
  Course course;
  course.from = system.start();
  course.controls = controls;
  run(system, settings, {&course, 1},
      {.settle = CourseOptions::never, .keep_frames = true, .ask_acceptable = false});
  return trajectory_of(std::move(course), frames_per_second);
}

bool comes_to_rest(const System& system, const Settings& s, const State& in_goal) {
  if (s.settle.max_duration_s == 0) return system.goal_holds(in_goal);
  Course course;
  course.from = in_goal;
  run(system, s, {&course, 1}, {});
  return course.result == Course::rests_in_goal;
}

Trajectory trajectory_to(const System& system, const Settings& s, const Tree& tree, int node, bool settle) {
  const std::vector<int> path = path_to(tree, node);
  Course course;
  course.from = system.start();
  for (std::size_t i = 1; i < path.size(); ++i)
    course.controls.push_back(tree.controls[std::size_t(path[i])]);
  run(system, s, {&course, 1},
      {.settle = settle ? CourseOptions::anywhere : CourseOptions::never,
       .keep_frames = true,
       .ask_acceptable = false});
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

}  // namespace limber::plan
