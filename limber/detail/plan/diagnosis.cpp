#include "limber/detail/plan/diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "plan/control_rollout.h"
#include "plan/passage.h"

namespace limber::detail {

namespace {

// What pushes the robot back from the goal, hardest first: −1 a wall, −2 nothing.
struct Block {
  int body = -2;
  double force_n = 0;  // against the way to the goal
};

Block block_at(const fem::World& world, const State& state, const Vec3& way) {
  Block block;
  for (const fem::PairForce& pair : fem::pair_forces(fem::contact_forces(world, state))) {
    if ((pair.body != world.robot && pair.other != world.robot) || pair.body == pair.other) continue;
    const Vec3 on_robot = pair.body == world.robot ? pair.force_n : Vec3(-pair.force_n);
    const double against = -on_robot.dot(way);
    if (against <= block.force_n) continue;
    block = {pair.body == world.robot ? pair.other : pair.body, against};
  }
  return block;
}

// Why pushes come to nothing there, as many as push so, most first. They are fourteen, to the sides and the
// corners of a box round the robot, with all the force that is allowed and of a middling length. Where steps
// are short they take minutes: each is run in pieces, between which a stop is heard.
std::vector<std::pair<std::string, int>> refusals_at(const fem::World& world, const FemSystem& system,
                                                     const State& state, const plan::Settings& settings) {
  std::map<std::string, int> counted;
  Control push;
  push.manipulation = Manipulation::body;
  push.steps =
      std::max(1, int(std::lround((settings.min_duration_s + settings.max_duration_s) / 2 / system.dt_s())));
  constexpr int piece_steps = 64, pushes = 14;
  Progress progress("what is refused", pushes);
  int asked = 0;
  fem::Batch batch(world, 1);
  for (int k = 0; k < 27; ++k) {
    const Vec3 way(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    if (const double axes = way.cwiseAbs().sum(); axes != 1 && axes != 3) continue;
    progress.update(asked++, "pushes");
    push.force_n = (settings.max_force_n * way.normalized()).cast<float>();
    fem::Rollout rollout{&state, push, state, {}};
    State before;
    for (int left = push.steps; left > 0 && rollout.outcome.status != fem::RunStatus::diverged;) {
      throw_if_stopped();
      before = std::move(rollout.end);
      rollout = {&before, push, {}, {}};
      rollout.control.steps = std::min(left, piece_steps);
      left -= rollout.control.steps;
      fem::propagate(batch, {&rollout, 1});
    }
    if (rollout.outcome.status == fem::RunStatus::diverged)
      ++counted["it diverges"];
    else if (!rollout.clear)
      ++counted["two bodies overlap by more than they may"];
    else if (const std::string why = system.why_not_acceptable(rollout.end); !why.empty())
      ++counted[why];
  }
  std::vector<std::pair<std::string, int>> sorted(counted.begin(), counted.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return sorted;
}

// A node in the goal that solves nothing: what becomes of the robot there once it is drawn to the goal, to
// come to rest. Throws Interrupted.
void tell_rest(const FemSystem& system, const plan::Settings& settings, const State& state, Diagnosis& d) {
  Progress progress("where it comes to rest", 0);
  progress.update(0);
  plan::ControlRollout settle;
  settle.from = state;
  plan::run(system, settings, {&settle, 1}, {.stoppable = true});
  const Vec3 center = system.robot_center(settle.end), shift = system.goal_shift(settle.end);
  const double distance_m = (center - shift - settings.goal.center_of_mass_m).norm(),
               speed = system.mean_speed(settle.end), after_s = settle.settle_steps * system.dt_s();
  const bool ended = settle.result == plan::ControlRollout::ends_elsewhere;
  d.json["rest"] = {{"after_s", after_s}, {"distance_m", distance_m}, {"mean_speed_m_s", speed}};
  if (settle.result == plan::ControlRollout::rests_in_goal) {
    d.text += " It would come to rest there, but what frames of the way show is refused.";
  } else if (ended && !holds(settings.goal, center - shift)) {
    d.text += fmt::format(
        " What holds it there is too weak: drawn to the goal it is {:.3g} m from its middle after {:.3g} s, "
        "at ({:.4g} {:.4g} {:.4g}) m, with {:.2g} m/s; try a goal where something bears it, or a larger one.",
        distance_m, after_s, center.x(), center.y(), center.z(), speed);
  } else if (ended && speed >= settings.settle.mean_speed_m_s) {
    d.text += fmt::format(
        " Drawn to the goal it still moves with {:.2g} m/s after {:.3g} s (settle_speed_m_s is {:.2g}); "
        "try a longer settle_time_s.",
        speed, after_s, settings.settle.mean_speed_m_s);
  } else if (ended) {
    d.text += " It comes to rest in the goal's place, but not turned, shaped or placed as the goal asks.";
  } else {
    const std::string why = system.why_not_acceptable(settle.end);
    d.text += fmt::format(" On its way to rest, after {:.3g} s, {}.", after_s,
                          settle.result == plan::ControlRollout::diverged ? "the dynamics diverge"
                          : why.empty() ? "two bodies overlap by more than they may"
                                        : why);
  }
}

}  // namespace

Diagnosis diagnose(const fem::World& world, const FemSystem& system, const plan::Plan& plan) {
  Diagnosis d;
  const State state = plan.tree.states[std::size_t(plan.best_node)];
  const plan::Settings settings = plan::settings_of_leg(plan.settings, plan.leg());
  const plan::Goal& goal = settings.goal;
  const Vec3 shift = system.on_leg(plan.leg()).goal_shift(state);
  const Vec3 to_goal = goal.center_of_mass_m + shift - system.robot_center(state);
  const Block block = block_at(world, state, to_goal.normalized());
  if (block.body == -2) {
    d.json["blocked_by"] = nullptr;
    d.text = "No contact pushes the robot back there.";
  } else {
    const std::string name = block.body < 0 ? "a wall" : world.bodies[std::size_t(block.body)].name;
    d.json["blocked_by"] = name;
    d.json["blocking_force_n"] = block.force_n;
    d.text = fmt::format(
        "There {} pushes the robot back from the goal with {:.3g} N; the largest force allowed is {:.3g} N.",
        name, block.force_n, plan.settings.max_force_n);
  }

  const double weight_n = system.robot_mass_kg() * world.bodies[std::size_t(world.robot)].gravity_m_s2.norm();
  d.json["weight_n"] = weight_n;
  if (weight_n > settings.max_force_n)
    d.text +=
        fmt::format(" It weighs {:.3g} N, and is pushed with {:.3g} N at most; try a larger max_force_n.",
                    weight_n, settings.max_force_n);
  if (settings.settle.max_duration_s > 0 && holds(goal, system.robot_center(state) - shift))
    tell_rest(dynamic_cast<const FemSystem&>(system.on_leg(plan.leg())), settings, state, d);

  const plan::Statistics& statistics = plan.statistics;
  if (2 * statistics.rejected > statistics.iterations) {
    d.text += " Most pushes led to states that are refused";
    const auto refusals = refusals_at(world, system, state, plan.settings);
    d.json["refused_pushes_there"] = Json::object();
    for (const auto& [why, count] : refusals) d.json["refused_pushes_there"][why] = count;
    if (refusals.empty())
      d.text += ", though none of fourteen from there does";
    else
      d.text += fmt::format(": of fourteen from there {}, since {}", refusals[0].second, refusals[0].first);
    d.text += "; try a larger limit or a smaller max_force_n.";
  }

  const plan::Workspace space = system.workspace();
  const State from = plan.tree.states[std::size_t(plan.legs.back().root)];
  const double passage = plan::widest_passage_m(space, system.robot_center(from), goal);
  d.widest_passage_m = passage, d.robot_radius_m = space.robot_radius_m;
  d.json["widest_rigid_passage_m"] = passage;
  d.json["robot_inner_radius_m"] = space.robot_radius_m;
  if (passage < 0)
    d.text += fmt::format(
        " Rigid bodies and walls, where they stand at the start, leave no way to the goal even for a point "
        "(openings under {:.2g} m are not seen).",
        space.cell_m);
  else if (passage < space.robot_radius_m)
    d.text += fmt::format(
        " Between rigid bodies and walls it can only pass by squeezing: the widest way lets a ball of radius "
        "{:.3g} m through, and it holds one of {:.3g} m.",
        passage, space.robot_radius_m);
  else
    d.text += " Rigid bodies and walls leave it a way that is wide enough.";
  return d;
}

}  // namespace limber::detail
