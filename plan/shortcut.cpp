#include "plan/shortcut.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/progress.h"
#include "core/random.h"
#include "plan/expansion.h"

namespace limber::plan {

namespace {

constexpr int changes_a_round = 16;
constexpr std::uint64_t first_stream = std::uint64_t(1) << 62;  // those below are the expansions'

// Controls from node `first` of the path on; what is not in the goal after them reaches for it.
struct Change {
  int first = 0;
  std::vector<Control> controls;
  double reach_force_n = 0;
};

class Changes {
 public:
  Changes(const System& system, const Settings& settings, const ShortcutSettings& shortcuts,
          const ControlRollout& path)
      : system_(system), settings_(settings), cost_(shortcuts.cost), keep_(shortcuts.keep), path_(path) {}

  Change draw_change(int round, int number) const {
    Rng rng(settings_.seed, first_stream + std::uint64_t(round) * changes_a_round + std::uint64_t(number));
    const double largest = settings_.max_force_n * just_below_one;
    Change c;
    // Haste costs nothing where only time counts.
    c.reach_force_n = cost_ == CostKind::duration ? largest : largest * rng.uniform(0.2, 1);
    if (!interpolates()) c.reach_force_n = 0;
    const int n = int(path_.controls.size()), free = n - keep_;
    // The first round looks at every part of the path from where the goal might be reached directly.
    const int cuts = std::min(free, changes_a_round);
    c.first = keep_;
    if (round == 0 && number < cuts && interpolates()) {
      c.first = keep_ + number * free / cuts;
      return c;
    }
    if (free == 0) return c;
    const int i = keep_ + rng.below(free), j = i + 1 + rng.below(n - i);  // a stretch [i, j)
    c.first = i;
    int kind = rng.below(8);
    const bool draws = kind <= 1, pushes_all = kind == 4 || kind == 5;
    if ((draws && !interpolates()) || (pushes_all && settings_.weights.body == 0)) kind = 3;
    switch (kind) {
      case 0:  // straight to the goal
        break;
      case 1:  // by way of a later node to the goal
        c.controls = {interpolation_to(j, steps_of_stretch(i, j) * rng.uniform(0.1, 1), c.reach_force_n)};
        break;
      case 2:  // one left out
        append_rest(c, i + 1);
        break;
      case 3:  // one shortened
        c.controls = {path_.controls[std::size_t(i)]};
        c.controls[0].steps = whole(c.controls[0].steps * rng.uniform(0.1, 0.95));
        append_rest(c, i + 1);
        break;
      case 4:  // neighbours merged
        c.controls = {merged(i, std::min(j, i + 1 + 3))};
        append_rest(c, std::min(j, i + 1 + 3));
        break;
      case 5:  // a stretch as one push along it
        c.controls = {push(i, j, rng)};
        append_rest(c, j);
        break;
      case 6: {  // all that follows in another time; a double integrator goes the same way
        const double slower = cost_ == CostKind::duration ? rng.uniform(0.5, 1) : rng.uniform(0.7, 1.4);
        append_rest(c, i);
        for (Control& control : c.controls) control = in_other_time(control, slower);
        break;
      }
      default:  // one bent
        c.controls = {path_.controls[std::size_t(i)]};
        bend(c.controls[0], rng);
        append_rest(c, i + 1);
    }
    return c;
  }

 private:
  // Nobody is pushed as the search may not push.
  bool interpolates() const { return settings_.weights.interpolation > 0; }
  static int whole(double steps) { return std::max(1, int(std::lround(steps))); }

  Vec3 center(int node) const { return system_.robot_center(state_before(node)); }
  const State& state_before(int node) const {
    return node == 0 ? path_.from : path_.states[std::size_t(node - 1)];
  }
  int steps_of_stretch(int i, int j) const { return int(state_before(j).step - state_before(i).step); }

  void append_rest(Change& c, int from) const {
    c.controls.insert(c.controls.end(), path_.controls.begin() + from, path_.controls.end());
  }

  Control interpolation_to(int node, double steps, double force_n) const {
    Control control = goal_control(settings_, whole(steps));
    control.target_m = center(node).cast<float>();
    control.max_force_n = float(force_n);
    return control;
  }

  Control body_push(const Vec3& way, double force_n, int steps) const {
    Control control;
    control.manipulation = Manipulation::body;
    const double length = way.norm();
    if (length > 0) control.force_n = (way * (force_n * just_below_one / length)).cast<float>();
    control.steps = steps;
    return control;
  }

  // The same impulse by the largest force; interpolations have none of their own.
  Control merged(int i, int j) const {
    Vec3 impulse = Vec3::Zero();
    int steps = 0;
    for (int k = i; k < j; ++k) {
      const Control& control = path_.controls[std::size_t(k)];
      impulse += control.force_n.cast<double>() * control.steps;
      steps += control.steps;
    }
    const double least = settings_.max_force_n > 0 ? impulse.norm() / settings_.max_force_n : 0;
    if (cost_ == CostKind::duration) steps = whole(std::ceil(least));
    steps = std::max(1, steps);
    return body_push(impulse, impulse.norm() / steps, steps);
  }

  Control push(int i, int j, Rng& rng) const {
    const Vec3 way = (center(j) - center(i)).normalized() + 0.3 * rng.direction();
    const double force_n = settings_.max_force_n * rng.uniform(0.3, 1);
    return body_push(way, force_n, whole(steps_of_stretch(i, j) * rng.uniform(0.1, 1)));
  }

  Control in_other_time(Control control, double slower) const {
    const double most = settings_.max_force_n * just_below_one, now = double(largest_force(control));
    const double force = now > 0 ? std::min(1 / (slower * slower), most / now) : 1;
    for (Vec3f* force_n : {&control.force_n, &control.second_force_n})
      *force_n = (force_n->cast<double>() * force).cast<float>();
    control.max_force_n = float(double(control.max_force_n) * std::min(force, 1.0));
    control.steps = whole(control.steps * slower);
    return control;
  }

  void bend(Control& control, Rng& rng) const {
    const Vec3 force = control.force_n.cast<double>();
    const double share = cost_ == CostKind::duration ? rng.uniform(0.7, 1.5) : rng.uniform(0.5, 1.1);
    const double length = std::min(force.norm() * share, settings_.max_force_n);
    if (length > 0)
      control.force_n = body_push(force / force.norm() + 0.5 * rng.direction(), length, 1).force_n;
    control.steps = whole(control.steps * rng.uniform(0.5, 1.05));
  }

  const System& system_;
  const Settings& settings_;
  CostKind cost_;
  int keep_;
  const ControlRollout& path_;
};

// The path as far as the course's start, then the course.
ControlRollout joined(const ControlRollout& path, int first, ControlRollout course) {
  const auto n = std::size_t(first);
  const auto before = [n](auto& list, const auto& of_path) {
    list.insert(list.begin(), of_path.begin(), of_path.begin() + std::ptrdiff_t(n));
  };
  before(course.controls, path.controls);
  before(course.states, path.states);
  before(course.costs_of_states, path.costs_of_states);
  course.from = path.from;
  return course;
}

bool measured(CostKind cost) { return cost == CostKind::strain || cost == CostKind::volume; }

}  // namespace

Json json_of(const ShortcutReport& report) {
  return {{"rounds", report.settings.rounds_done},
          {"cost", name_of(report.settings.cost)},
          {"accepted", report.accepted},
          {"before", json_of(report.before)},
          {"after", json_of(report.after)},
          {"cpu_s", report.cpu_s},
          {"wall_s", report.wall_s}};
}

ControlRollout path_of(const System& system, const Settings& settings, const std::vector<Control>& controls) {
  ControlRollout path;
  path.from = system.start();
  path.controls = controls;
  run(system, settings, {&path, 1}, {.ask_acceptable = false, .measure = true});
  return path;
}

ControlRollout shortcut(const System& system, const Settings& settings, const ShortcutSettings& shortcuts,
                        ControlRollout path, ShortcutReport& report) {
  using Clock = std::chrono::steady_clock;
  LIMBER_CHECK(path.result == ControlRollout::rests_in_goal, int(path.result));
  const Clock::time_point started = Clock::now();
  const double cpu_before = cpu_seconds();
  report.settings = shortcuts;
  report.before = path.costs;
  Progress progress("shortcut", shortcuts.rounds);
  for (int& round = report.settings.rounds_done; round < shortcuts.rounds && stop_signal() == 0; ++round) {
    const Changes changes(system, settings, shortcuts, path);
    const double now = cost_in(path.costs, shortcuts.cost);
    std::vector<ControlRollout> courses(changes_a_round);
    std::vector<int> first(courses.size());
    for (std::size_t i = 0; i < courses.size(); ++i) {
      const Change change = changes.draw_change(round, int(i));
      const auto n = std::size_t(change.first);
      first[i] = change.first;
      courses[i].from = n == 0 ? path.from : path.states[n - 1];
      if (n > 0) courses[i].costs = path.costs_of_states[n - 1];
      courses[i].controls = change.controls;
      courses[i].reach_force_n = change.reach_force_n;
      courses[i].last_step = path.end.step;
    }
    run(system, settings, courses,
        {.measure = measured(shortcuts.cost), .cost = shortcuts.cost, .most = now, .race = true});
    int best = -1;
    double least = now;
    for (std::size_t i = 0; i < courses.size(); ++i) {
      const double cost = cost_in(courses[i].costs, shortcuts.cost);
      if (courses[i].result == ControlRollout::rests_in_goal && cost < least) best = int(i), least = cost;
    }
    try {
      // Where it may not, the next best is not asked: how many of the others a race lets end is chance.
      if (best >= 0 && may_be_shown(system, settings, courses[std::size_t(best)])) {
        path = joined(path, first[std::size_t(best)], std::move(courses[std::size_t(best)]));
        ++report.accepted;
      }
    } catch (const Interrupted&) {
      break;  // the round is not done
    }
    progress.update(round + 1, fmt::format("{:.3g} s", path.costs.duration_s));
  }
  if (!measured(shortcuts.cost)) path = path_of(system, settings, path.controls);
  report.after = path.costs;
  report.cpu_s = cpu_seconds() - cpu_before;
  report.wall_s = std::chrono::duration<double>(Clock::now() - started).count();
  return path;
}

std::vector<int> controls_before_legs(const Plan& plan) {
  const std::vector<int> path = path_to(plan.tree, plan.best_node);
  std::vector<int> counts;
  for (const Leg& leg : plan.legs)
    counts.push_back(int(std::find(path.begin(), path.end(), leg.root) - path.begin()));
  return counts;
}

void adopt(const System& system, Plan& plan, const ControlRollout& path,
           const std::vector<int>& controls_before_legs) {
  const std::vector<int> old = path_to(plan.tree, plan.best_node);
  LIMBER_CHECK(path.from == plan.tree.states[0] && path.states.size() == path.controls.size(),
               path.states.size(), path.controls.size());
  LIMBER_CHECK(controls_before_legs.size() == plan.legs.size(), controls_before_legs.size());
  int node = 0;
  bool shared = true;
  std::vector<int> nodes{node};
  for (std::size_t i = 0; i < path.controls.size(); ++i) {
    shared = shared && i + 1 < old.size() && plan.tree.controls[std::size_t(old[i + 1])] == path.controls[i];
    node = shared ? old[i + 1]
                  : plan.tree.add(path.states[i], node, path.controls[i], -1,
                                  system.robot_center(path.states[i]).cast<float>());
    nodes.push_back(node);
  }
  for (std::size_t leg = 0; leg < plan.legs.size(); ++leg)
    plan.legs[leg].root = nodes.at(std::size_t(controls_before_legs[leg]));
  const State end = plan.tree.states[std::size_t(node)];
  const Vec3 center = system.robot_center(end) - system.goal_shift(end);
  plan.goal_node = plan.best_node = node;
  plan.best_distance_m = (center - plan.settings.goal.center_of_mass_m).norm();
  plan.ending = Ending::goal;
  plan.trajectory = trajectory_to(system, plan.settings, plan.tree, node, true);
}

ShortcutReport shorten(const System& system, Plan& plan, const ShortcutSettings& shortcuts) {
  LIMBER_CHECK(plan.solved(), plan.best_node);
  std::vector<Control> controls = plan.trajectory.controls;
  if (plan.trajectory.settle_steps > 0) controls.pop_back();
  const std::vector<int> before_legs = controls_before_legs(plan);
  ShortcutSettings of_last_leg = shortcuts;
  of_last_leg.keep = before_legs.back();
  ShortcutReport report;
  const ControlRollout path =
      shortcut(system, plan.settings, of_last_leg, path_of(system, plan.settings, controls), report);
  if (report.accepted > 0) adopt(system, plan, path, before_legs);
  return report;
}

}  // namespace limber::plan
