// Where a motion begins: at the scene's start, or as a frame of another motion (--from). All that follows
// hangs on that state; so every number of it is compared. Rows: docs/verify.md, "Of the plan".
#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/hash.h"
#include "core/same_bits.h"
#include "limber/detail/plan/simulate.h"
#include "limber/detail/verify/plan_checks.h"

namespace limber::detail {

// Where bodies overlap in the scene, `world` has parted them anew (docs/contact.md); the tree's first state
// must be what came out, to the bit.
void check_start(const plan::Plan& plan, const fem::World& world, Promises& table) {
  const fem::Parting& parting = world.parting;
  if (parting.pairs.empty()) return;
  const auto deepest =
      std::max_element(parting.pairs.begin(), parting.pairs.end(),
                       [](const auto& one, const auto& other) { return one.depth_m < other.depth_m; });
  double least = std::numeric_limits<double>::infinity();
  for (const fem::Parting::Pair& pair : parting.pairs) least = std::min(least, pair.gap_m);
  const State start = plan.tree.states[0];
  table.row(
      "bodies that overlap at the start are parted again: the same start",
      same_bits(start, fem::start_state(world)),
      fmt::format("{} pairs, up to {:.2f} mm deep ({} and {}), now {:.2f} mm apart or more; {} steps",
                  parting.pairs.size(), 1e3 * deepest->depth_m, world.bodies[std::size_t(deepest->body)].name,
                  world.bodies[std::size_t(deepest->other)].name, 1e3 * least, parting.steps));
}

namespace {

// Also false where no motion could begin there.
bool starts_from(const fs::path& folder, const PlanFolder& other, int frame, const scenes::Scene& scene,
                 const fem::World& world, const State& start) {
  try {
    return same_bits(start_from(folder, other, frame, scene, world), start);
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

// Of a frame of another motion the folder must be here, and hold the motion of then, by its hash: else nobody
// can tell, and the promise is not kept. What happened in that motion is verified there.
void check_beginning(const fs::path& folder, const PlanFolder& planned, const fem::World& world,
                     Promises& table) {
  const State start = planned.plan.tree.states[0];
  if (!begins_elsewhere(planned)) {
    table.row("it starts as the scene says", same_bits(start, fem::start_state(world)), "");
    return;
  }
  const BeginningTold& from = planned.told.from.value();
  const fs::path other = folder / from.folder;
  const int frame = from.frame;
  const std::string promise = fmt::format("it starts as frame {} of another motion", frame),
                    name = other.lexically_normal().string();
  std::string why;
  try {
    const PlanFolder there = read_plan_folder(other);
    read_world_of(there, other);
    if (hex(plan::hash_of(there.plan.trajectory)) == from.trajectory_hash) {
      table.row(promise, starts_from(other, there, frame, planned.scene, world, start),
                fmt::format("{}, of which limber verify tells apart", name));
      return;
    }
    why = "holds another motion";
  } catch (const InputError& error) {
    why = "is not here";
  }
  table.row(promise, false, fmt::format("{} {}, so nobody can tell; put back what it began from", name, why));
}

}  // namespace limber::detail
