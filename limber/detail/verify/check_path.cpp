// That a plan's path, the way through its tree and the replay are one and the same.
//
// The path is stored three times over: as controls, as frames, and as nodes of the tree. A path that was
// edited in one place only is found here; one that was edited everywhere alike is another path, and must keep
// all other promises.
#include "core/error.h"
#include "core/hash.h"
#include "core/same_bits.h"
#include "limber/detail/verify/plan_checks.h"

namespace limber::detail {

// Frames and end bit for bit (−0 is not 0). Of the tree: one control an edge from the root to best_node, each
// node the state that the replay has there, and behind them, where the robot was brought to rest, the settle
// that the scene asks for.
void check_path(const plan::Plan& plan, const plan::Settings& settings, const Replay& replay,
                Promises& table) {
  const plan::Trajectory& path = plan.trajectory;
  const plan::ControlRollout& course = replay.course();
  table.row("replay gives the same bits",
            replay.whole() && same_bits(course.end, path.end) &&
                std::equal(course.frames.begin(), course.frames.end(), path.frames.begin(), path.frames.end(),
                           [](const State& a, const State& b) { return same_bits(a, b); }),
            fmt::format("{} frames, end {}", course.frames.size(), hex(hash_of(course.end))));

  const std::vector<int> nodes = plan::path_to(plan.tree, plan.best_node);
  const bool settles = path.settle_steps > 0;
  bool same = path.controls.size() + 1 == nodes.size() + std::size_t(settles);
  for (std::size_t i = 1; same && i < nodes.size(); ++i)
    same = same_bits(path.controls[i - 1], plan.tree.controls[std::size_t(nodes[i])]) &&
           same_bits(replay.after(i), plan.tree.states[std::size_t(nodes[i])]);
  if (same && settles)
    same = same_bits(path.controls.back(), plan::settle_control(settings, path.settle_steps));
  table.row("the path is the way through the tree", same,
            lacks_path(plan) ? "it was left out when the search was stopped; go on with --resume"
                             : fmt::format("{} nodes", nodes.size()));
}

}  // namespace limber::detail
