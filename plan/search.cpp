// A plan, leg by leg: a search to each goal in turn (plan/detail/leg_search.h), in one tree. Method and
// measurements: docs/planning.md.
//
// What always holds: a tree goes on only in the world and with the settings that it grew by, and the next leg
// begins in a node of the last one, so a path through several goals is one way in the tree.
#include "plan/search.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "plan/control_rollout.h"
#include "plan/detail/leg_search.h"

namespace limber::plan {

namespace {

// What a stop signal ends is kept soon: the path to the nearest node if it takes no longer than this.
constexpr double grace_s = 1;

// At the root of a leg, with the system and settings of that leg: it may already lie in the leg's goal.
void begin_leg(const System& system, const Settings& settings, Plan& plan) {
  const int root = plan.legs.back().root;
  const State state = plan.tree.states[std::size_t(root)];
  const Vec3 center = system.robot_center(state) - system.goal_shift(state);
  plan.best_node = root;
  plan.best_distance_m = (center - settings.goal.center_of_mass_m).norm();
  const bool solves = holds(settings.goal, center) && comes_to_rest(system, settings, state);
  plan.goal_node = solves ? root : -1;
}

// A tree of one node, the start, of no iteration (−1).
Plan begin(const System& system, const Settings& settings) {
  Plan plan;
  plan.system_hash = system.hash();
  const State start = system.start();
  const Vec3 center = system.robot_center(start);
  LIMBER_CHECK(center.allFinite(), center.x(), center.y(), center.z());
  plan.tree.add(start, -1, Control{}, -1, center.cast<float>());
  begin_leg(system.on_leg(0), settings_of_leg(settings, 0), plan);
  return plan;
}

// Where the next leg begins: the goal's node, or a node behind it in which the robot has come to rest. That
// node's control is the settle, so the legs hang together in one tree, and a path through several goals is
// one way in it.
int reached(const System& system, const Settings& settings, Plan& plan) {
  if (settings.settle.max_duration_s == 0) return plan.goal_node;
  ControlRollout settle;
  settle.from = plan.tree.states[std::size_t(plan.goal_node)];
  run(system, settings, {&settle, 1}, {.ask_acceptable = false});
  if (settle.settle_steps == 0) return plan.goal_node;
  return plan.tree.add(settle.end, plan.goal_node, settle_control(settings, settle.settle_steps), -1,
                       system.robot_center(settle.end).cast<float>());
}

// A tree goes on only in the world and with the settings that it grew by; limits may differ.
void require_same_search(const System& system, const Settings& settings, const Plan& earlier) {
  if (earlier.left_out)
    throw InputError(
        "the earlier plan holds its path alone (--keep-tree path), and a search goes on from the whole tree; "
        "plan anew, without resuming it");
  if (earlier.system_hash != system.hash())
    throw InputError(
        fmt::format("the earlier plan is of another world (hash {}, now {}); plan anew, without resuming it",
                    hex(earlier.system_hash), hex(system.hash())));
  const std::string name = first_difference(earlier.settings, settings);
  if (name == "seed")
    throw InputError(fmt::format(
        "the earlier plan was made with seed {}, and {} is asked for; go on with --seed {}, or plan "
        "anew, without resuming it",
        earlier.settings.seed, settings.seed, earlier.settings.seed));
  if (!name.empty())
    throw InputError(fmt::format(
        "the earlier plan was made with another {}; plan anew, without resuming it, or set {} back", name,
        name));
}

}  // namespace

void keep_path(Plan& plan) {
  if (plan.left_out) return;
  const Tree& tree = plan.tree;
  std::vector<std::int32_t> path = path_to(tree, plan.best_node);
  for (Leg& leg : plan.legs) {
    const auto root = std::find(path.begin(), path.end(), leg.root);
    LIMBER_CHECK(root != path.end(), leg.root);
    leg.root = int(root - path.begin());
  }
  Tree kept;
  for (const int node : path)
    kept.add(tree.states[std::size_t(node)], kept.size() - 1, tree.controls[std::size_t(node)],
             tree.iterations[std::size_t(node)], tree.centers[node]);
  plan.left_out = {tree.size(), hash_of(tree), hash_of_search(tree), std::move(path)};
  plan.tree = std::move(kept);
  plan.best_node = plan.tree.size() - 1;
  if (plan.solved()) plan.goal_node = plan.best_node;
}

int nodes_of(const Plan& plan) { return plan.left_out ? plan.left_out->nodes : plan.tree.size(); }
std::uint64_t tree_hash_of(const Plan& plan) {
  return plan.left_out ? plan.left_out->tree_hash : hash_of(plan.tree);
}

// One search a leg. The trajectory of a plan with one leg was run when its way was judged; else it is run
// once more, to the best node.
Plan plan(const System& system, const Settings& settings, std::optional<Plan> earlier,
          const ProgressCallback& on_progress) {
  validate(settings, system);
  if (earlier) require_same_search(system, settings, *earlier);
  Plan plan = earlier ? std::move(*earlier) : begin(system, settings);
  plan.settings = settings;
  const auto started = detail::Clock::now();
  while (true) {
    const int leg = plan.leg();
    const System& on_leg = system.on_leg(leg);
    const Settings of_leg = settings_of_leg(settings, leg);
    // A goal on the way may be reached already where its leg begins; then there is nothing to prepare a
    // search for.
    std::optional<Trajectory> way;
    if (!plan.solved() || leg == int(settings.via.size()))
      way = detail::search_leg(on_leg, of_leg, plan, on_progress, started);
    if (plan.solved() && leg < int(settings.via.size())) {
      plan.legs.push_back({reached(on_leg, of_leg, plan), plan.statistics.iterations});
      begin_leg(system.on_leg(leg + 1), settings_of_leg(settings, leg + 1), plan);
      continue;
    }
    const auto to = [&](int node) { return trajectory_to(on_leg, of_leg, plan.tree, node, plan.solved()); };
    if (way && leg == 0)
      plan.trajectory = std::move(*way);
    else if (plan.solved())
      plan.trajectory = to(plan.best_node);
    else if (auto nearest = trajectory_within(grace_s, on_leg, of_leg, plan.tree, plan.best_node))
      plan.trajectory = std::move(*nearest);
    else
      plan.trajectory = to(0);
    return plan;
  }
}

}  // namespace limber::plan
