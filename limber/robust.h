// A plan replayed in worlds that are a little different: a report, no verdict. docs/verify.md.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "limber/error.h"
#include "limber/export.h"
#include "limber/watcher.h"

namespace limber {

struct RobustOptions {
  std::filesystem::path folder = {};
  int perturbations = 16;
  std::uint64_t seed = 1;
  double material_share = 0.1;  // Young's modulus, density and friction of each body: ± this
  double force_share = 0.1;     // each control's force: ± this,
  double force_deg = 5;         // and turned by up to so much
  bool follow = false;          // besides open loop
  // > 0: besides, followed by who looks ahead so often, and where following would not do plans anew from the
  // state reached, in the world as it was planned in; of plans with one goal. Seconds.
  double replan_s = 0;
  int worlds = 4;  // of other materials, at most; perturbations are spread over them
};

// What became of one perturbed replay.
struct Fate {
  int world = 0;
  bool reaches = false;
  std::string end;                                       // how, in words
  double distance_m = 0, speed_m_s = 0, duration_s = 0;  // from the goal, at the end; how long it took
  std::array<double, 3> end_center_m{};
  double volume_change = 0, penetration_m = 0;
  double min_stretch = 1, largest_stretch = 1, overlap_m = 0, self_overlap_m = 0;
  double asked_n = 0, force_n = 0;  // the largest that a control asked for, and that acted
  std::vector<std::string> broken;  // of the promises that `limber verify` looks at
  int searches = 0;                 // where it is planned anew: how often
};

// The same worlds and errors, open loop, followed, or planned anew on the way.
struct Tally {
  std::vector<Fate> fates;
  int reached = 0, keep_all = 0, searches = 0;
  double spread_m = 0, farthest_m = 0;
  Fate worst;  // of each figure
  std::map<std::string, int> broken;
};

struct Robustness {
  Tally open_loop;
  std::optional<Tally> followed, replanned;
  double max_force_n = 0;  // that the plan's controls may ask for
  bool settles = false;    // whether the robot is to come to rest
};
// What is replayed is kept in the folder's `robust`, so that one that was stopped goes on, and nothing is
// replayed twice. Throws InputError where the folder holds no plan from its scene's start that reaches its
// goal.
LIMBER_API Robustness test_robustness(const RobustOptions&, const Context& = {});

}  // namespace limber
