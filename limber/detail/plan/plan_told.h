// What a plan's summary tells that others go by; the rest of it is for people. docs/files.md.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/json_fields.h"
#include "plan/control_rollout.h"

namespace limber::detail {

struct CostsTold {
  plan::Costs costs;
  template <class Fields>
  void fields(Fields& f) {
    f("duration_s", costs.duration_s), f("effort_n_s", costs.effort_n_s);
    f("strain_energy_j", costs.strain_energy_j), f("volume_change", costs.volume_change);
  }
};

// As plan::ShortcutReport, AnytimeReport, RefineReport and PortfolioReport are written, without what it cost.
struct ShortcutTold {
  int rounds = 0;
  std::string cost;
  int accepted = 0;
  CostsTold before, after;
  template <class Fields>
  void fields(Fields& f) {
    f("rounds", rounds), f("cost", cost), f("accepted", accepted), f("before", before), f("after", after);
  }
};

struct ImproveTold {
  struct Improvement {
    std::int64_t iterations = 0;
    int search = 0;
    CostsTold costs;
    template <class Fields>
    void fields(Fields& f) {
      f("iterations", iterations), f("search", search), f("costs", costs);
    }
  };
  std::string cost;
  CostsTold first;
  std::vector<Improvement> improvements;
  std::int64_t searches = 0, solved = 0, iterations = 0;
  template <class Fields>
  void fields(Fields& f) {
    f("cost", cost), f("first", first), f("improvements", improvements), f("searches", searches);
    f("solved", solved), f("iterations", iterations);
  }
};

struct RefineTold {
  std::string how;
  // Not told by older limbers.
  std::optional<std::string> replay_ends;
  std::optional<double> replay_s, replay_distance_m, replay_mean_error_m, replay_largest_error_m,
      mean_error_m;
  double tracked_s = 0, largest_error_m = 0;
  std::int64_t iterations = 0, coarse_tets = 0, tets = 0;
  template <class Fields>
  void fields(Fields& f) {
    f("how", how), f.if_there("replay_ends", replay_ends), f.if_there("replay_s", replay_s);
    f.if_there("replay_distance_m", replay_distance_m),
        f.if_there("replay_mean_error_m", replay_mean_error_m);
    f.if_there("replay_largest_error_m", replay_largest_error_m), f.if_there("mean_error_m", mean_error_m);
    f("tracked_s", tracked_s);
    f("largest_error_m", largest_error_m), f("iterations", iterations);
    f("coarse_tets", coarse_tets), f("tets", tets);
  }
};

struct PortfolioTold {
  struct Search {
    std::uint64_t seed = 0;
    std::int64_t iterations = 0;
    bool solved = false;
    template <class Fields>
    void fields(Fields& f) {
      f("seed", seed), f("iterations", iterations), f("solved", solved);
    }
  };
  std::vector<Search> searches;
  std::int64_t iterations = 0;  // of all of them
  template <class Fields>
  void fields(Fields& f) {
    f("searches", searches), f("iterations", iterations);
  }
};

// The frame of another motion that it begins as. `folder` is told from the work folder's.
struct BeginningTold {
  std::string folder;
  int frame = 0;
  std::string trajectory_hash;
  template <class Fields>
  void fields(Fields& f) {
    f("folder", folder), f("frame", frame), f("trajectory_hash", trajectory_hash);
  }
};

// The plan that a simulation follows, and how it keeps to it and ends.
struct FollowingTold {
  std::string folder, trajectory_hash;
  double farthest_from_path_m = 0, largest_force_n = 0, distance_m = 0, speed_m_s = 0;
  bool reaches = false;  // the plan's goal
  template <class Fields>
  void fields(Fields& f) {
    f("folder", folder), f("trajectory_hash", trajectory_hash);
    f("farthest_from_path_m", farthest_from_path_m), f("largest_force_n", largest_force_n);
    f("distance_m", distance_m), f("speed_m_s", speed_m_s), f("reaches", reaches);
  }
};

struct PlanTold {
  std::string explanation;
  std::optional<ShortcutTold> shortcut;
  std::map<std::string, double> stiffness_shares;  // by body; of older limbers none
  std::optional<BeginningTold> from;
  std::optional<FollowingTold> follows;
  // Nothing goes by these three but whether they could be so: where one is of another kind, `wrong` says
  // what.
  std::optional<ImproveTold> improve;
  std::optional<RefineTold> refine;
  std::optional<PortfolioTold> portfolio;
  std::string wrong;
  template <class Fields>
  void fields(Fields& f) {
    f.if_there("explanation", explanation), f.if_there("shortcut", shortcut);
    f.if_there("stiffness_shares", stiffness_shares), f.if_there("from", from);
    f.if_there("follows", follows);
  }
};

}  // namespace limber::detail
