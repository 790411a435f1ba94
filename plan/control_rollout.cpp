// Courses of controls: run, cut where something is due, brought to rest, and raced against one another.
//
//     controls ──► reach (interpolation until in the goal) ──► settle (until at rest) ──► ended
//
// What always holds: pieces are cut at frames, at looks for rest and, where a stop can end them, after a
// while by the clock; a cut changes no state (fem: 100 steps are 40 and then 60), so the course is a function
// of itself. A race ends a course once one that rests in the goal is cheaper, which changes who is looked at
// and never who wins.
#include "plan/control_rollout.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"
#include "plan/expansion.h"
#include "plan/frame_times.h"

namespace limber::plan {

namespace {

constexpr double settle_check_s = 0.05;  // rest is looked for this often
constexpr int looks_at_rest = 5;         // and looked at so often in as long

// Who can be stopped runs pieces of about so long, of so many steps at most.
constexpr double min_piece_s = 0.05, max_piece_s = 0.1;
constexpr int first_piece = 16, max_steps_a_piece = 1000;

constexpr std::pair<const char*, CostKind> cost_kinds[] = {{"duration", CostKind::duration},
                                                           {"effort", CostKind::effort},
                                                           {"strain", CostKind::strain},
                                                           {"volume", CostKind::volume}};

// One course on its way: says which piece of a control comes next, and takes its end. Pieces are cut where a
// frame is due or rest is looked for; the cuts do not change the states.
class Runner {
 public:
  Runner(const System& system, const Settings& settings, const ControlRolloutOptions& options,
         ControlRollout& course)
      : system_(system),
        settings_(settings),
        options_(options),
        course_(course),
        state_(course.from),
        times_(system, settings.frames_per_second),
        next_frame_(times_.frame_from(state_.step)),
        settle_limit_(int(std::lround(settings.settle.max_duration_s / system.dt_s()))) {
    course_.states.clear(), course_.costs_of_states.clear(), course_.frames.clear();
    course_.settle_steps = 0;
    if (course_.next) course_.controls.clear();
    take_due_frames();
    begin_control();
  }

  bool ended() const { return phase_ == Phase::ended; }
  double cost() const { return cost_in(course_.costs, options_.cost); }
  bool rests_in_goal() const { return ended() && course_.result == ControlRollout::rests_in_goal; }

  // The next piece: to the end of the control, to the next frame, or as far as is allowed.
  void next(Rollout& rollout, int max_steps) const {
    rollout.from = &state_;
    rollout.control = control_;
    rollout.control.steps =
        int(std::min<std::int64_t>({steps_left_, step_of_next_frame() - state_.step, max_steps}));
  }

  // What became of it. First what it cost, then whether the state may be one of a plan, then what follows.
  void take(Rollout& rollout) {
    if (!rollout.ok) return end(ControlRollout::diverged);
    const int steps = rollout.control.steps;
    LIMBER_CHECK(rollout.to.step == state_.step + steps, rollout.to.step, state_.step, steps);
    std::swap(state_, rollout.to);
    steps_left_ -= steps;
    (phase_ == Phase::settle ? course_.settle_steps : control_.steps) += steps;
    course_.costs.duration_s = double(state_.step - times_.first_step) * system_.dt_s();
    course_.costs.effort_n_s += double(largest_force(control_)) * steps * system_.dt_s();
    const bool frame = state_.step == step_of_next_frame();
    take_due_frames();
    if (cost() > options_.most || state_.step > course_.last_step) return end(ControlRollout::too_costly);
    if (options_.ask_acceptable && (frame || steps_left_ == 0) &&
        !(rollout.clear && system_.acceptable(state_)))
      return end(ControlRollout::not_acceptable);
    if (phase_ == Phase::reach && !in_goal()) return;
    if (steps_left_ == 0 || phase_ == Phase::reach) end_of_piece();
  }

  void end(ControlRollout::Result result) {
    course_.result = result;
    course_.end = state_;
    phase_ = Phase::ended;
  }

 private:
  enum class Phase { controls, reach, settle, ended };

  void end_of_piece() {
    if (phase_ == Phase::settle) return settle_on();
    course_.states.push_back(state_);
    course_.costs_of_states.push_back(course_.costs);
    if (phase_ == Phase::reach) {
      course_.controls.push_back(control_);
      return begin_settle();
    }
    begin_control();
  }

  // Controls of no step have ends, too: states and costs are one for each control.
  void begin_control() {
    const std::size_t done = course_.states.size();
    if (course_.next)
      if (const std::optional<Control> control = course_.next(state_)) {
        LIMBER_CHECK(control->steps > 0, control->steps, state_.step);
        course_.controls.push_back(*control);
      }
    if (done == course_.controls.size()) return begin_reach();
    control_ = course_.controls[done];
    steps_left_ = std::exchange(control_.steps, 0);
    if (steps_left_ == 0) end_of_piece();
  }

  // Reaching follows the goal, and goes on for as long as the course may last.
  void begin_reach() {
    if (in_goal() || course_.reach_force_n == 0) return begin_settle();
    LIMBER_CHECK(course_.last_step < std::numeric_limits<std::int64_t>::max(), course_.last_step);
    phase_ = Phase::reach;
    control_ = goal_control(settings_, 0);
    control_.target_m = (settings_.goal.center_of_mass_m + system_.goal_shift(state_)).cast<float>();
    control_.max_force_n = float(course_.reach_force_n);
    steps_left_ = std::numeric_limits<std::int64_t>::max() - state_.step;
  }

  void begin_settle() {
    if (options_.settle == ControlRolloutOptions::never ||
        (options_.settle == ControlRolloutOptions::in_goal && !in_goal()))
      return end(ControlRollout::ends_elsewhere);
    phase_ = Phase::settle;
    control_ = settle_control(settings_, 0);
    settle_on();
  }

  // Rest is looked for every 0.05 s. What has come to rest by itself is left to itself.
  void settle_on() {
    const bool rested = system_.goal_holds(state_) && rests(system_, settings_.settle, state_,
                                                            course_.settle_steps > 0 ? control_ : Control());
    if (rested || course_.settle_steps >= settle_limit_)
      return end(rested && in_goal() ? ControlRollout::rests_in_goal : ControlRollout::ends_elsewhere);
    steps_left_ = std::min(steps_of(settle_check_s, system_.dt_s()), settle_limit_ - course_.settle_steps);
  }

  void take_due_frames() {
    if (step_of_next_frame() > state_.step) return;
    for (; step_of_next_frame() <= state_.step; ++next_frame_)  // several where a step lasts longer
      if (options_.keep_frames) course_.frames.push_back(state_);
    if (options_.keep_frames && options_.on_progress) options_.on_progress(state_);
    if (!options_.measure) return;
    const Measures now = system_.measures(state_);
    Costs& costs = course_.costs;
    costs.strain_energy_j = std::max(costs.strain_energy_j, now.strain_energy_j);
    costs.volume_change = std::max(costs.volume_change, now.volume_change);
  }

  bool in_goal() const {
    return holds(settings_.goal, system_.robot_center(state_) - system_.goal_shift(state_));
  }

  std::int64_t step_of_next_frame() const { return times_.step_of(next_frame_); }

  const System& system_;
  const Settings& settings_;
  const ControlRolloutOptions& options_;
  ControlRollout& course_;
  State state_;
  FrameTimes times_;
  std::int64_t next_frame_;
  int settle_limit_;
  Phase phase_ = Phase::controls;
  Control control_;              // its steps are those taken
  std::int64_t steps_left_ = 0;  // of it, until something is to be decided
};

// In lanes: all take a piece, and then the next.
void run_batch(const System& system, const Settings& settings, std::span<ControlRollout> courses,
               const ControlRolloutOptions& options) {
  const std::unique_ptr<Propagator> propagator = system.make_propagator();
  std::vector<Runner> runners;
  runners.reserve(courses.size());
  for (ControlRollout& course : courses) runners.emplace_back(system, settings, options, course);
  std::vector<Runner*> going;
  std::vector<Rollout> rollouts;
  double cheapest = std::numeric_limits<double>::infinity();  // in the race so far
  const bool stoppable = options.stoppable || nothing_to_keep();
  int max_steps = stoppable ? first_piece : std::numeric_limits<int>::max();
  std::optional<std::chrono::steady_clock::time_point> stopped;
  while (true) {
    if (stoppable && stop_signal() != 0) {
      const auto now = std::chrono::steady_clock::now();
      if (!stopped) stopped = now;
      if (now - *stopped >= std::chrono::duration<double>(options.grace_s)) throw_if_stopped();
    }
    for (const Runner& runner : runners)
      if (options.race && runner.rests_in_goal()) cheapest = std::min(cheapest, runner.cost());
    going.clear();
    for (Runner& runner : runners) {
      if (!runner.ended() && runner.cost() > cheapest) runner.end(ControlRollout::too_costly);
      if (!runner.ended()) going.push_back(&runner);
    }
    if (going.empty()) return;
    rollouts.resize(going.size());
    for (std::size_t i = 0; i < going.size(); ++i) going[i]->next(rollouts[i], max_steps);
    const auto began = std::chrono::steady_clock::now();
    propagator->propagate(rollouts);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    if (stoppable && seconds < min_piece_s) max_steps = std::min(2 * max_steps, max_steps_a_piece);
    if (stoppable && seconds > max_piece_s) max_steps = std::max(1, max_steps / 2);
    for (std::size_t i = 0; i < going.size(); ++i) going[i]->take(rollouts[i]);
  }
}

}  // namespace

bool rests(const System& system, const Settle& settle, const State& state, Control held_by) {
  if (settle.max_duration_s == 0) return true;
  const auto slow = [&](const State& s) { return system.mean_speed(s) < settle.mean_speed_m_s; };
  if (!slow(state)) return false;
  const std::unique_ptr<Propagator> propagator = system.make_propagator();
  held_by.steps = steps_of(settle_check_s / looks_at_rest, system.dt_s());
  State now = state;
  for (int look = 0; look < looks_at_rest; ++look) {
    Rollout on;
    on.from = &now, on.control = held_by;
    propagator->propagate({&on, 1});
    if (!on.ok || !slow(on.to)) return false;
    now = std::move(on.to);
  }
  return true;
}

bool may_be_shown(const System& system, const Settings& settings, const ControlRollout& course) {
  ControlRollout shown;
  shown.from = course.from, shown.controls = course.controls;
  run(system, settings, {&shown, 1}, {.keep_frames = true, .ask_acceptable = false, .stoppable = true});
  return system.first_refused(shown.frames) == shown.frames.size();
}

double cost_in(const Costs& costs, CostKind kind) {
  switch (kind) {
    case CostKind::duration:
      return costs.duration_s;
    case CostKind::effort:
      return costs.effort_n_s;
    case CostKind::strain:
      return costs.strain_energy_j;
    case CostKind::volume:
      return costs.volume_change;
  }
  return 0;
}

const char* name_of(CostKind kind) {
  return std::find_if(std::begin(cost_kinds), std::end(cost_kinds),
                      [&](const auto& k) { return k.second == kind; })
      ->first;
}

CostKind cost_kind_from(const std::string& name) {
  for (const auto& [known, kind] : cost_kinds)
    if (name == known) return kind;
  throw InputError(
      fmt::format("there is no cost \"{}\"; there are duration, effort, strain and volume", name));
}

Json json_of(const Costs& costs) {
  return {{"duration_s", costs.duration_s},
          {"effort_n_s", costs.effort_n_s},
          {"strain_energy_j", costs.strain_energy_j},
          {"volume_change", costs.volume_change}};
}

void run(const System& system, const Settings& settings, std::span<ControlRollout> courses,
         const ControlRolloutOptions& options) {
  const std::size_t threads = std::size_t(thread_count());
  const std::size_t lanes = std::min(std::size_t(std::max(1, system.lanes())),
                                     std::max<std::size_t>(1, (courses.size() + threads - 1) / threads));
  const std::size_t batches = (courses.size() + lanes - 1) / lanes;
  const auto run_one = [&](int b) {
    const std::size_t first = std::size_t(b) * lanes;
    run_batch(system, settings, courses.subspan(first, std::min(lanes, courses.size() - first)), options);
  };
  if (batches == 1) return run_one(0);
  parallel_for(int(batches), run_one);
}

}  // namespace limber::plan
