// Kinodynamic RRT over full deformable states: Algorithm 1 of Rodriguez, Lien and Amato (ICRA 2006), computed
// ahead of itself on several threads and lanes without changing its result. Method: docs/planning.md.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "plan/trajectory.h"

namespace limber::plan {

struct Statistics {
  // Expansions of the sequential algorithm; the same for any thread count and any in_flight.
  std::int64_t iterations = 0;
  std::int64_t diverged = 0;       // of those: no node, the dynamics diverged
  std::int64_t rejected = 0;       // of those: no node, System::acceptable said no
  std::int64_t rollout_steps = 0;  // asked for by those
  // The work really done; varies with threads and in_flight.
  std::int64_t rollouts = 0;        // computed; the surplus over iterations was in vain
  std::int64_t rollouts_wrong = 0;  // computed, then redone from a node that had come nearer meanwhile
  double cpu_s = 0;                 // of the search; the trajectory's simulation is not in it
  double wall_s = 0;
};

Json json_of(const Statistics&);

enum class Ending { goal, iterations, time, stopped };

struct Plan {
  Settings settings;
  std::uint64_t system_hash = 0;
  Tree tree;
  int goal_node = -1;          // in the goal, and comes to rest there; −1: none
  int best_node = 0;           // nearest to the goal, the first of equals; goal_node when there is one
  double best_distance_m = 0;  // of its centre of mass from the goal's
  Ending ending = Ending::iterations;
  Statistics statistics;
  Trajectory trajectory;  // to best_node, and with a settle when that is goal_node
  bool solved() const { return goal_node >= 0; }
};

// Where a search stands after an iteration; times include those of an earlier plan that it goes on from.
struct Moment {
  Statistics statistics;
  int nodes = 0;
  double best_distance_m = 0;
};
// Called after every iteration, in their order, by one thread at a time.
using Watch = std::function<void(const Moment&)>;

// Searches until a node lies in the goal and comes to rest there, or a limit ends it; SIGINT and SIGTERM
// (core/progress.h) end it too, and what was found is kept. Tree and trajectory depend on system and settings
// alone; in_flight and threads are free. With `earlier` (the plan of a search that was cut short, of the same
// system and settings save for limits) goes on from there, to the bytes that one uninterrupted search gives.
// Throws InputError when settings are out of range or `earlier` is not of this system and these settings.
Plan plan(const System&, const Settings&, std::optional<Plan> earlier = std::nullopt, const Watch& = {});

// A sentence or two for the user: reached or not, how near, which limit ended it, what to try.
std::string explain(const Plan&);

}  // namespace limber::plan
