// That the tree is what a search from the scene finds.
//
// A search is a function of scene, bodies, settings and seed, so it is done again, and its tree must come out
// the same, node by node. That proves more than checking each node by itself: a tree whose nodes all follow
// from their parents may still not be the one that was searched. Nodes that came after the search (shortcuts
// and better paths, of the iteration −1), and all nodes of a plan that was carried to finer cages, are
// replayed one by one.
#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "core/same_bits.h"
#include "limber/detail/verify/plan_checks.h"
#include "plan/search.h"

namespace limber::detail {

namespace {

bool same_nodes(const plan::Tree& a, const plan::Tree& b, int count) {
  for (int n = 0; n < count; ++n) {
    const auto i = std::size_t(n);
    if (a.parents[i] != b.parents[i] || a.iterations[i] != b.iterations[i] ||
        !same_bits(a.controls[i], b.controls[i]) || !same_bits(a.centers[n], b.centers[n]) ||
        !same_bits(a.states[i], b.states[i]))
      return false;
  }
  return true;
}

// Whether each node from `first` on is where its control leads from its parent. As many at once as the system
// has lanes: a rollout's result does not depend on its neighbours.
bool nodes_follow(const FemSystem& system, const plan::Tree& tree, int first) {
  const std::unique_ptr<plan::Propagator> propagator = system.make_propagator();
  for (int from = first; from < tree.size();) {
    throw_if_stopped();
    const int to = std::min(tree.size(), from + system.lanes());
    std::vector<State> parents;
    for (int n = from; n < to; ++n) parents.push_back(tree.states[std::size_t(tree.parents[std::size_t(n)])]);
    std::vector<plan::Rollout> rollouts;
    for (int n = from; n < to; ++n)
      rollouts.push_back({&parents[std::size_t(n - from)], tree.controls[std::size_t(n)], {}, false});
    propagator->propagate(rollouts);
    for (int n = from; n < to; ++n) {
      const plan::Rollout& end = rollouts[std::size_t(n - from)];
      if (!end.ok || !same_bits(end.to, tree.states[std::size_t(n)]) ||
          !same_bits(tree.centers[n], system.robot_center(end.to).cast<float>()))
        return false;
    }
    from = to;
  }
  return true;
}

// Told by a search that has gone another way than the plan's: who made the file may ask for any number of
// iterations.
struct GoneAstray {};

// With the plan's seed and as many iterations as it took, without a time limit. Counts only ever grow, so the
// search ends as soon as one is beyond the plan's.
plan::Plan searched_again(const FemSystem& system, plan::Settings settings, const plan::Plan& then) {
  settings.max_iterations = then.statistics.iterations;
  settings.time_limit_s = std::numeric_limits<double>::infinity();
  const plan::Plan found = plan::plan(system, settings, std::nullopt, [&](const plan::SearchProgress& now) {
    if (now.nodes > plan::nodes_of(then) || now.statistics.diverged > then.statistics.diverged ||
        now.statistics.rejected > then.statistics.rejected ||
        now.statistics.refused > then.statistics.refused)
      throw GoneAstray{};
  });
  throw_if_stopped();
  return found;
}

// Of a plan that keeps its path alone. `searched` is the tree that was found again; what came after the
// search and is on the path is put behind it. Where that is all there was, the tree's hash is asked for.
// Branches of better paths that were given up are not kept, and of those nothing can be told.
struct PathAlone {
  bool same = true;
  int first_later = 0;  // of the kept nodes the first that no search made
  int untold = 0;       // nodes that nobody can check
};
PathAlone compare_path(const plan::Plan& plan, plan::Tree searched) {
  const plan::LeftOut& left_out = *plan.left_out;
  const plan::Tree& kept = plan.tree;
  PathAlone result;
  result.same = hash_of_search(searched) == left_out.search_hash;
  plan::Tree whole = std::move(searched);
  const int found = whole.size();
  for (int n = 0; n < kept.size(); ++n) {
    const auto i = std::size_t(n);
    const int number = left_out.numbers[i], parent = n == 0 ? -1 : left_out.numbers[i - 1];
    if (number == whole.size())
      whole.add(kept.states[i], parent, kept.controls[i], kept.iterations[i], kept.centers[n]);
    if (number >= found) continue;
    result.first_later = n + 1;
    const auto w = std::size_t(number);
    result.same = result.same && whole.parents[w] == parent && whole.iterations[w] == kept.iterations[i] &&
                  same_bits(whole.controls[w], kept.controls[i]) &&
                  same_bits(whole.centers[number], kept.centers[n]) &&
                  same_bits(whole.states[w], kept.states[i]);
  }
  result.untold = left_out.nodes - whole.size();
  if (result.untold == 0) result.same = result.same && hash_of(whole) == left_out.tree_hash;
  return result;
}

}  // namespace

// The search once more, as far as the plan's went. What came after it, shortcuts and better paths, hangs on
// its tree as nodes of no iteration. A plan that `refine` carried over comes from no search in this world: of
// it only the start is compared, and every node is replayed.
void check_search(const PlanFolder& planned, const FemSystem& system, const plan::Settings& settings,
                  Promises& table) {
  const plan::Plan& plan = planned.plan;
  const plan::Tree& tree = plan.tree;
  const bool carried = planned.told.refine.has_value();
  int searched = 1, searched_of_kept = 1;  // the start is the world's
  bool same = same_bits(tree.states[0], system.start()) && tree.iterations[0] == -1 &&
              same_bits(tree.controls[0], Control{}) &&
              same_bits(tree.centers[0], system.robot_center(system.start()).cast<float>());
  if (!carried) {
    plan::Plan found;
    try {
      found = searched_again(system, settings, plan);
    } catch (const GoneAstray&) {
    }
    const plan::Statistics &now = found.statistics, &then = plan.statistics;
    const bool counted = now.iterations == then.iterations && now.diverged == then.diverged &&
                         now.rejected == then.rejected && now.refused == then.refused &&
                         now.last_refusal == then.last_refusal && now.rollout_steps == then.rollout_steps;
    searched = found.tree.size();  // none where it went astray
    const bool later = planned.told.shortcut || planned.told.improve;
    const auto number = [&](int node) {
      return plan.left_out ? plan.left_out->numbers[std::size_t(node)] : node;
    };
    same = searched > 0 && searched <= nodes_of(plan) && found.legs.size() == plan.legs.size() &&
           found.solved() == plan.solved();
    for (std::size_t leg = 0; same && leg < plan.legs.size(); ++leg)
      same = found.legs[leg].first_iteration == plan.legs[leg].first_iteration &&
             (later || found.legs[leg].root == number(plan.legs[leg].root));
    same = same && (later || (searched == nodes_of(plan) && found.best_node == number(plan.best_node) &&
                              (lacks_path(plan) ||  // which check_path() tells
                               hash_of(found.trajectory) == hash_of(plan.trajectory))));
    if (plan.left_out && searched > 0) {
      const PathAlone path = compare_path(plan, std::move(found.tree));
      same = same && path.same && path.untold >= 0 && (path.untold == 0 || planned.told.improve);
      table.measured("nodes of the tree that are not kept",
                     path.untold > 0
                         ? fmt::format("{}; {} of them came with better paths, and nobody can check them",
                                       nodes_of(plan) - tree.size(), path.untold)
                         : fmt::format("{}; they are compared with the search by their hash alone",
                                       nodes_of(plan) - tree.size()));
      searched_of_kept = path.first_later;
    } else if (!plan.left_out) {
      same = same && same_nodes(found.tree, tree, searched);
      searched_of_kept = searched;
    }
    table.row("searched again from the scene: the same tree", same,
              fmt::format("seed {}, {} nodes", settings.seed, searched));
    table.row("searched again from the scene: the same counts", counted,
              fmt::format("{} iterations, {} diverged, {} rejected, {} ways refused, {} steps",
                          now.iterations, now.diverged, now.rejected, now.refused, now.rollout_steps));
  } else {
    same = same && !plan.left_out;  // limber keeps all of it
    table.row("the tree starts where the world does", same, plan.left_out ? "and is not whole" : "");
  }
  if (!same || searched_of_kept == tree.size()) return;
  bool later = true;
  for (int n = searched_of_kept; n < tree.size() && !carried; ++n)
    later = later && tree.iterations[std::size_t(n)] == -1;
  table.row("each other node is where its control leads",
            later && nodes_follow(system, tree, searched_of_kept),
            fmt::format("{} nodes", tree.size() - searched_of_kept));
}

}  // namespace limber::detail
