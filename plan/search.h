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
  std::int64_t diverged = 0;  // of those: no node, the dynamics diverged
  // Of those: no node, System::acceptable said no, or what it grew from was refused meanwhile.
  std::int64_t rejected = 0;
  std::int64_t refused = 0;        // ways to a goal: System::first_refused found one of their frames
  std::string last_refusal;        // System::why_refused of the last of them
  std::int64_t rollout_steps = 0;  // asked for by those
  // The work really done; varies with threads and in_flight.
  std::int64_t rollouts = 0;        // computed; the surplus over iterations was in vain
  std::int64_t rollouts_wrong = 0;  // computed, then redone from a node that had come nearer meanwhile
  double cpu_s = 0;                 // of the search; the trajectory's simulation is not in it
  double wall_s = 0;
};

Json json_of(const Statistics&);

enum class Ending { goal, iterations, time, stopped };

// One goal of several: a search of its own, from the state in which the goal before was reached.
struct Leg {
  int root = 0;                      // node it starts from; those after it, up to the next root, are its own
  std::int64_t first_iteration = 0;  // of all that the search counts
};

// What was not searched, but only simulated (plan/simulation.h): where Plan has one, its tree is the start
// and the end, nothing is said of a goal, and of its settings frames_per_second counts alone.
struct Simulation {
  double duration_s = 0;  // asked for
  enum Ending { whole, stopped, diverged } ending = whole;
  bool steered = false;  // controls were chosen on the way: its tree is a chain, a node after each
};

// What the whole tree was, of which the way to best_node alone is kept: a chain, each node after its parent.
struct LeftOut {
  int nodes = 0;                                 // of the whole tree
  std::uint64_t tree_hash = 0, search_hash = 0;  // hash_of and hash_of_search
  std::vector<std::int32_t> numbers;             // of the kept nodes in it, ascending from 0
};

struct Plan {
  Settings settings;
  std::uint64_t system_hash = 0;
  Tree tree;
  std::vector<Leg> legs = {Leg{}};  // as far as the search got
  int goal_node = -1;               // in the last goal, and comes to rest there; −1: none
  int best_node = 0;           // of the last leg the nearest to its goal, the first of equals, or goal_node
  double best_distance_m = 0;  // of its centre of mass from the goal's
  Ending ending = Ending::iterations;
  Statistics statistics;
  std::optional<Simulation> simulation;
  bool measured = true;  // false: a signal came before what is told of its motion was worked out
  // To best_node, and with a settle when that is goal_node. The start alone where a stop signal came and the
  // path would have taken longer than a second.
  Trajectory trajectory;
  std::optional<LeftOut> left_out;  // nothing: the tree is whole
  bool solved() const { return goal_node >= 0; }
  int leg() const { return int(legs.size()) - 1; }  // the last that began; its goal is the one sought
};

// Leaves out all nodes but those on the way to best_node. No search goes on from such a plan.
void keep_path(Plan&);
// Of the whole tree, whatever is kept of it.
int nodes_of(const Plan&);
std::uint64_t tree_hash_of(const Plan&);

// Where a search stands after an iteration; times include those of an earlier plan that it goes on from.
struct SearchProgress {
  Statistics statistics;
  int leg = 0;
  int nodes = 0;
  double best_distance_m = 0;  // from the leg's goal
};
// Called after every iteration, in their order, by one thread at a time.
using ProgressCallback = std::function<void(const SearchProgress&)>;

// Searches until a node lies in the goal and comes to rest there (one goal after the other where there are
// several) by a way no frame of which is refused, or a limit ends it. A refused way stays in the tree, but
// nothing grows from the edge that leads into the refused frame any more. SIGINT and SIGTERM
// (core/progress.h) end it too, and what was found is kept. Tree and trajectory depend on system and settings
// alone; in_flight and threads are free. With `earlier` (the plan of a search that was cut short, of the same
// system and settings save for limits) goes on from there, to the bytes that one uninterrupted search gives.
// Throws InputError when settings are out of range or `earlier` is not of this system and these settings.
Plan plan(const System&, const Settings&, std::optional<Plan> earlier = std::nullopt,
          const ProgressCallback& = {});

// "via 1 of 2", or "the goal".
std::string name_of_goal(const Settings&, int leg);

// A sentence or two for the user: reached or not, how near, which limit ended it, what to try.
std::string explain(const Plan&);

}  // namespace limber::plan
