#include "plan/anytime.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/progress.h"

namespace limber::plan {

namespace {

constexpr double slack_for_shortcuts = 1.5;
constexpr std::int64_t fewest_iterations = 200;  // of a search

// A system in which states that come too late are not acceptable.
class Bounded final : public System {
 public:
  Bounded(const System& system, const Settings& settings, double bound_s)
      : Bounded(system, system, settings, bound_s) {
    for (int leg = 0; leg < int(settings.via.size()); ++leg)
      legs_.push_back(std::unique_ptr<Bounded>(new Bounded(system.on_leg(leg), system, settings, bound_s)));
  }

  State start() const override { return system_.start(); }
  Vec3 robot_center(const State& s) const override { return system_.robot_center(s); }
  Vec3 robot_velocity(const State& s) const override { return system_.robot_velocity(s); }
  double robot_mass_kg() const override { return system_.robot_mass_kg(); }
  double mean_speed(const State& s) const override { return system_.mean_speed(s); }
  int robot_nodes() const override { return system_.robot_nodes(); }
  int control_node(int drawn) const override { return system_.control_node(drawn); }
  Box sample_bounds() const override { return system_.sample_bounds(); }
  double dt_s() const override { return system_.dt_s(); }
  std::uint64_t hash() const override { return system_.hash(); }
  bool acceptable(const State& s) const override {
    const double now = double(s.step - first_step_) * system_.dt_s();
    return now + min_to_go_s(s) < bound_s_ && system_.acceptable(s);
  }
  std::size_t first_refused(std::span<const State> frames) const override {
    return system_.first_refused(frames);
  }
  bool goal_holds(const State& s) const override { return system_.goal_holds(s); }
  Vec3 goal_shift(const State& s) const override { return system_.goal_shift(s); }
  const System& on_leg(int leg) const override {
    return leg < int(legs_.size()) ? static_cast<const System&>(*legs_[std::size_t(leg)]) : *this;
  }
  Measures measures(const State& s) const override { return system_.measures(s); }
  Vec3 goal_velocity(const State& s) const override { return system_.goal_velocity(s); }
  Workspace workspace() const override { return system_.workspace(); }
  int lanes() const override { return system_.lanes(); }
  std::unique_ptr<Propagator> make_propagator() const override { return system_.make_propagator(); }

 private:
  Bounded(const System& system, const System& last, const Settings& settings, double bound_s)
      : system_(system),
        last_(last),
        settings_(settings),
        bound_s_(bound_s),
        first_step_(system.start().step) {}

  // Of a mass that flies at the last goal under the largest force and need not stop: v t + a t²/2 = d.
  double min_to_go_s(const State& s) const {
    const Vec3 way = settings_.goal.center_of_mass_m + last_.goal_shift(s) - system_.robot_center(s);
    const double d = way.norm() - settings_.goal.radius_m,
                 a = settings_.max_force_n / system_.robot_mass_kg();
    if (d <= 0 || a == 0) return 0;
    const double v = (system_.robot_velocity(s) - last_.goal_velocity(s)).dot(way) / way.norm();
    return (std::sqrt(v * v + 2 * a * d) - v) / a;
  }

  const System &system_, &last_;  // on its leg, and on the last
  const Settings& settings_;
  double bound_s_;
  std::int64_t first_step_;
  std::vector<std::unique_ptr<Bounded>> legs_;
};

}  // namespace

Json json_of(const AnytimeReport& report) {
  Json improvements = Json::array();
  for (const Improvement& i : report.improvements)
    improvements.push_back({{"wall_s", i.wall_s},
                            {"iterations", i.iterations},
                            {"search", i.search},
                            {"costs", json_of(i.costs)}});
  return {{"cost", name_of(report.settings.cost)},
          {"first", json_of(report.first)},
          {"improvements", improvements},
          {"searches", report.searches},
          {"solved", report.solved},
          {"iterations", report.iterations},
          {"cpu_s", report.cpu_s},
          {"wall_s", report.wall_s}};
}

AnytimeReport improve(const System& system, Plan& plan, const AnytimeSettings& anytime) {
  using Clock = std::chrono::steady_clock;
  LIMBER_CHECK(plan.solved(), plan.best_node);
  const Clock::time_point started = Clock::now();
  const auto wall_s = [&] { return std::chrono::duration<double>(Clock::now() - started).count(); };
  const double cpu_before = cpu_seconds();
  std::vector<Control> controls = plan.trajectory.controls;
  if (plan.trajectory.settle_steps > 0) controls.pop_back();
  ControlRollout best = path_of(system, plan.settings, controls);
  std::vector<int> before_legs = controls_before_legs(plan);

  AnytimeReport report;
  report.settings = anytime, report.first = best.costs;
  report.iterations = plan.statistics.iterations;
  const double time_left_s = plan.settings.time_limit_s - plan.statistics.wall_s;
  const std::int64_t of_a_search = std::max(fewest_iterations, 2 * plan.statistics.iterations);
  while (report.iterations < plan.settings.max_iterations && wall_s() < time_left_s && stop_signal() == 0) {
    const bool by_time = anytime.cost == CostKind::duration;
    const double slack = anytime.shortcut_rounds > 0 ? slack_for_shortcuts : 1;
    const Bounded bounded(system, plan.settings,
                          by_time ? slack * best.costs.duration_s : std::numeric_limits<double>::infinity());
    Settings settings = plan.settings;
    settings.seed += std::uint64_t(++report.searches);
    settings.max_iterations = std::min(of_a_search, plan.settings.max_iterations - report.iterations);
    settings.time_limit_s = std::max(0.0, time_left_s - wall_s());
    Plan found = plan::plan(bounded, settings);
    report.iterations += found.statistics.iterations;
    if (found.statistics.iterations == 0) break;  // the start solves the query, or the time was up
    if (!found.solved()) continue;
    ++report.solved;
    if (anytime.shortcut_rounds > 0)
      shorten(system, found, {.rounds = anytime.shortcut_rounds, .cost = anytime.cost});
    controls = found.trajectory.controls;
    if (found.trajectory.settle_steps > 0) controls.pop_back();
    ControlRollout path = path_of(system, plan.settings, controls);
    if (path.result != ControlRollout::rests_in_goal ||
        cost_in(path.costs, anytime.cost) >= cost_in(best.costs, anytime.cost))
      continue;
    best = std::move(path);
    before_legs = controls_before_legs(found);
    report.improvements.push_back({wall_s(), report.iterations, report.searches, best.costs});
  }
  report.ending = stop_signal() != 0                                 ? Ending::stopped
                  : report.iterations < plan.settings.max_iterations ? Ending::time
                                                                     : Ending::iterations;
  if (!report.improvements.empty()) adopt(system, plan, best, before_legs);
  report.cpu_s = cpu_seconds() - cpu_before;
  report.wall_s = wall_s();
  return report;
}

}  // namespace limber::plan
