#include "plan/simulation.h"

#include <cmath>

#include "core/error.h"
#include "core/progress.h"
#include "plan/control_rollout.h"

namespace limber::plan {

namespace {

Control nothing_for(std::int64_t steps) {
  Control control;
  control.steps = std::int32_t(steps);
  return control;
}

// A simulation of no time.
Plan begun(const System& system, double frames_per_second) {
  Plan plan;
  plan.settings.frames_per_second = frames_per_second;
  plan.system_hash = system.hash();
  plan.trajectory.frames_per_second = frames_per_second;
  plan.trajectory.end = system.start();
  return plan;
}

void require_earlier(const System& system, const Plan& earlier, double frames_per_second) {
  if (!earlier.simulation) throw InputError("what is there is no simulation; simulate anew");
  if (earlier.simulation->steered)
    throw InputError("the earlier simulation was steered, and is not gone on with; simulate anew");
  if (earlier.system_hash != system.hash())
    throw InputError("the earlier simulation is of another world, script or start; simulate anew");
  if (earlier.trajectory.frames_per_second != frames_per_second)
    throw InputError(
        fmt::format("the earlier simulation has {} frames a second, and this one {}; simulate anew",
                    earlier.trajectory.frames_per_second, frames_per_second));
}

Vec3f center(const System& system, const State& state) { return system.robot_center(state).cast<float>(); }

void put_tree(const System& system, Plan& plan) {
  const State start = system.start(), &end = plan.trajectory.end;
  plan.trajectory.controls = {nothing_for(end.step - start.step)};
  plan.tree = {};
  plan.tree.add(start, -1, Control{}, -1, center(system, start));
  plan.best_node = plan.tree.add(end, 0, plan.trajectory.controls.front(), -1, center(system, end));
}

// As far as whole controls go.
void put_chain(const System& system, Plan& plan, ControlRollout& course) {
  Trajectory& path = plan.trajectory;
  course.controls.resize(course.states.size());
  plan.tree = {};
  plan.best_node = plan.tree.add(course.from, -1, Control{}, -1, center(system, course.from));
  for (std::size_t i = 0; i < course.states.size(); ++i)
    plan.best_node =
        plan.tree.add(course.states[i], int(i), course.controls[i], -1, center(system, course.states[i]));
  path.end = course.states.empty() ? course.from : std::move(course.states.back());
  path.controls = std::move(course.controls);
  while (path.frames.back().step > path.end.step) path.frames.pop_back();
}

}  // namespace

std::int64_t steps_of_simulation(const System& system, double duration_s) {
  const double steps = std::round(duration_s / system.dt_s()), most = 2e9;
  if (!(steps >= 1 && steps <= most))
    throw InputError(
        fmt::format("a simulation of {:g} s cannot be; its duration is at least a step, {:.3g} s, and "
                    "at most {:.3g} s",
                    duration_s, system.dt_s(), most * system.dt_s()));
  return std::int64_t(steps);
}

Plan simulate_for(const System& system, double duration_s, double frames_per_second,
                  std::optional<Plan> earlier, const std::function<void(double)>& on_progress,
                  const Steer& steer) {
  LIMBER_CHECK(!steer || !earlier, bool(steer));
  const std::int64_t first_step = system.start().step,
                     last_step = first_step + steps_of_simulation(system, duration_s);
  if (earlier) require_earlier(system, *earlier, frames_per_second);
  Plan plan = earlier ? std::move(*earlier) : begun(system, frames_per_second);
  Trajectory& path = plan.trajectory;
  if (path.end.step > last_step)
    throw InputError(fmt::format("{:g} s are simulated already; ask for a longer duration than that",
                                 double(path.end.step - first_step) * system.dt_s()));

  Settings settings;
  settings.frames_per_second = frames_per_second;
  ControlRollout course;
  course.from = path.end;
  if (steer)
    course.next = [&](const State& state) -> std::optional<Control> {
      if (state.step == last_step) return std::nullopt;
      Control control = steer(state);
      control.steps = std::int32_t(std::min<std::int64_t>(control.steps, last_step - state.step));
      return control;
    };
  else
    course.controls = {nothing_for(last_step - path.end.step)};
  bool stopped = false;
  try {
    run(system, settings, {&course, 1},
        {.settle = ControlRolloutOptions::never,
         .keep_frames = true,
         .ask_acceptable = false,
         .stoppable = true,
         .on_progress = [&](const State& frame) {
           if (on_progress) on_progress(double(frame.step - first_step) * system.dt_s());
         }});
  } catch (const Interrupted&) {
    stopped = true;
  }
  const std::int64_t shown = path.frames.empty() ? -1 : path.frames.back().step;
  for (State& frame : course.frames)
    if (frame.step > shown) path.frames.push_back(std::move(frame));
  const bool whole = !stopped && course.result != ControlRollout::diverged;
  if (!steer) path.end = whole ? std::move(course.end) : path.frames.back();
  plan.simulation = Simulation{duration_s,
                               whole     ? Simulation::whole
                               : stopped ? Simulation::stopped
                                         : Simulation::diverged,
                               bool(steer)};
  steer ? put_chain(system, plan, course) : put_tree(system, plan);
  return plan;
}

}  // namespace limber::plan
