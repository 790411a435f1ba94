// What the user may choose about the search. The defaults are the preset `paper`: Algorithm 1 of Rodriguez,
// Lien and Amato, "Planning Motion in Completely Deformable Environments" (ICRA 2006).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/json.h"
#include "plan/system.h"

namespace limber::plan {

// How often each manipulation is chosen, relative to the others; each ≥ 0. Interpolation is only possible
// towards the goal, so elsewhere the other two share.
struct ManipulationWeights {
  double body = 1;
  double control_point = 1;
  double interpolation = 1;
};

struct Goal {
  Vec3 center_of_mass_m = Vec3::Zero();  // what is aimed at
  double radius_m = 0;                   // > 0: a node whose centre of mass is within it solves the query
  // Instead: whose centre of mass is in this box. radius_m is then that of a ball that holds the box.
  std::optional<Box> box_m = std::nullopt;
};
// `center`: the robot's, less the goal's shift. What else the system asks for is not looked at.
bool holds(const Goal&, const Vec3& center);

// A goal on the way to the last one.
struct Via {
  Goal goal;
  bool rest = false;  // the robot comes to rest in it, as in the last, before it goes on
};

// At the end of a path that reached the goal, the robot is drawn to it until it rests.
struct Settle {
  double max_duration_s = 3;     // 0: none
  double mean_speed_m_s = 0.02;  // slower is at rest
  double max_force_share = 1;    // of max_force_n, in [0, 1]
  double pressure_pa = 0;        // in the robot meanwhile, ≥ 0; not in goals on the way
  bool hold = false;             // as it is, in whatever turn and shape; else by interpolation
};

// What the preset `fast` does beyond Algorithm 1; each can be switched alone. Method: docs/planning.md.
enum class Metric { distance, time_to_go };
struct SearchOptions {
  // An expansion knows the nodes of all expansions but the `lag` before it, so that those can be computed
  // side by side for certain; 0: of all.
  int lag = 0;
  Metric metric = Metric::distance;
  double time_weight = 0;     // of a node's own time in the metric time_to_go, in [0, 1]
  double guidance = 0;        // share of expansions led by the cost-to-go of a grid; needs a lag, in [0, 1]
  double soft_price = 0;      // a metre in a passage so tight that nothing is left costs so many more
  bool learn_prices = false;  // where pushing does not help, going on gets dearer
  // Of guided draws: each node that was there before it, half the robot's radius about, counts against a node
  // as so many children of its own do.
  double density_price = 0;
  bool steer = false;  // pushes reckon with the robot's velocity, and last as long as the way takes
  double look_s = 0;   // rollouts are looked at so often, 0: never; needed by the following
  bool stop_in_goal = false;
  bool hold = false;          // towards the goal the robot is held, not interpolated: it may arrive turned
  bool end_hopeless = false;  // a rollout that gets nowhere, or leads away, ends there
};

inline constexpr std::int64_t iteration_limit = 1'000'000'000;
inline constexpr double min_frames_per_second = 1e-3, max_frames_per_second = 10000;

struct Settings {
  std::uint64_t seed = 1;
  std::int64_t max_iterations = 1000;  // in total, those of an earlier plan included; at most iteration_limit
  std::vector<Via> via;  // reached before `goal`, in this order; each begins a leg of the search
  Goal goal;
  double goal_bias = 0.1;  // share of expansions drawn towards the goal, in [0, 1]
  ManipulationWeights weights;
  double max_force_n = 0;      // on the whole robot, ≥ 0
  double max_pressure_pa = 0;  // ≥ 0; > 0: the robot is a balloon
  double min_force_share = 0;  // the magnitude is drawn from [min, max] × max_force_n, 0 ≤ min ≤ max ≤ 1
  double max_force_share = 1;
  double min_duration_s = 0.2;  // of an expansion, rounded to whole steps and at least one
  double max_duration_s = 1;
  double control_point_radius_m = 0.25;  // > 0, in the rest shape
  Settle settle;
  SearchOptions search_options;
  double frames_per_second = 30;  // of the trajectory's stored states, in the range below
  // None of these changes the tree, save for how far it gets.
  int in_flight = 0;  // expansions computed ahead; 0: chosen from the threads and the lanes
  double time_limit_s = std::numeric_limits<double>::infinity();  // wall
};

// Those of the search to the goal with this number: `goal` is via[leg]'s, or the last one.
Settings settings_of_leg(const Settings&, int leg);

// Throws InputError naming the setting, its value and its range; without a system all but what its time step
// bounds.
void validate(const Settings&);
void validate(const Settings&, const System&);

// Every number exactly; no time limit is null. Throws InputError, beginning with `what`, when a key is
// missing or of another type.
Json json_of(const Settings&);
Settings settings_from_json(const Json&, const std::string& what);

// The name of the first setting that shapes the tree and differs, or "" when one tree can go on from the
// other.
std::string first_difference(const Settings&, const Settings&);

}  // namespace limber::plan
