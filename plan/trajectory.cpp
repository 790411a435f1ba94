#include "plan/trajectory.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "plan/detail/hash_control.h"

namespace limber::plan {

namespace {

// Rest is looked for this often.
constexpr double settle_check_s = 0.05;

// Runs controls one after the other, cut where a frame is due; the cuts do not change the states.
class Recorder {
 public:
  Recorder(const System& system, const State& start, double frames_per_second)
      : propagator_(system.make_propagator()),
        steps_per_frame_(1 / (frames_per_second * system.dt_s())),
        state_(start),
        first_step_(state_.step) {
    take_due_frames();
  }

  // False when the dynamics diverged: then the state is the last good one.
  bool run(const Control& control) {
    for (std::int64_t left = control.steps; left > 0;) {
      const std::int64_t piece = std::min(left, step_of_next_frame() - state_.step);
      if (!advance(control, int(piece))) return false;
      left -= piece;
      take_due_frames();
    }
    return true;
  }

  const State& state() const { return state_; }
  std::vector<State>& frames() { return frames_; }

 private:
  std::int64_t step_of_next_frame() const {
    return first_step_ + std::llround(double(frames_.size()) * steps_per_frame_);
  }

  void take_due_frames() {
    while (step_of_next_frame() <= state_.step) frames_.push_back(state_);
  }

  bool advance(Control control, int steps) {
    control.steps = steps;
    rollout_.from = &state_;
    rollout_.control = control;
    propagator_->propagate({&rollout_, 1});
    if (!rollout_.ok) return false;
    LIMBER_CHECK(rollout_.to.step == state_.step + steps, rollout_.to.step, state_.step, steps);
    std::swap(state_, rollout_.to);
    return true;
  }

  std::unique_ptr<Propagator> propagator_;
  double steps_per_frame_;
  State state_;
  std::int64_t first_step_;
  std::vector<State> frames_;
  Rollout rollout_;
};

// The steps it took, 0 where the robot was already at rest.
int run_settle(const System& system, const Settings& s, Recorder& recorder) {
  const int limit = int(std::lround(s.settle.max_duration_s / system.dt_s()));
  const int piece = steps_of(settle_check_s, system.dt_s());
  int steps = 0;
  while (steps < limit && system.mean_speed(recorder.state()) >= s.settle.mean_speed_m_s) {
    const int next = std::min(piece, limit - steps);
    if (!recorder.run(settle_control(s, next))) break;
    steps += next;
  }
  return steps;
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
  Recorder recorder(system, system.start(), frames_per_second);
  for (const Control& control : controls)
    if (!recorder.run(control)) break;
  return {controls, 0, frames_per_second, std::move(recorder.frames()), recorder.state()};
}

bool comes_to_rest(const System& system, const Settings& s, const State& in_goal) {
  if (s.settle.max_duration_s == 0) return true;
  Recorder recorder(system, in_goal, s.frames_per_second);
  run_settle(system, s, recorder);
  const Vec3 center = system.robot_center(recorder.state());
  return system.mean_speed(recorder.state()) < s.settle.mean_speed_m_s &&
         (center - s.goal.center_of_mass_m).norm() <= s.goal.radius_m;
}

Trajectory trajectory_to(const System& system, const Settings& s, const Tree& tree, int node, bool settle) {
  Trajectory t;
  t.frames_per_second = s.frames_per_second;
  Recorder recorder(system, system.start(), s.frames_per_second);
  for (const int step : path_to(tree, node)) {
    if (step == 0) continue;
    const Control& control = tree.controls[std::size_t(step)];
    const bool ok = recorder.run(control);
    const bool same = limber::hash_of(recorder.state()) == limber::hash_of(tree.states[std::size_t(step)]);
    LIMBER_CHECK(ok && same, ok, same, step, recorder.state().step);
    t.controls.push_back(control);
  }
  if (settle) t.settle_steps = run_settle(system, s, recorder);
  if (t.settle_steps > 0) t.controls.push_back(settle_control(s, t.settle_steps));
  t.frames = std::move(recorder.frames());
  t.end = recorder.state();
  return t;
}

}  // namespace limber::plan
