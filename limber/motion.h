// Motions in their work folders, as the commands make them: bodies prepared, a plan searched, a scene left to
// itself, a plan carried to finer cages. docs/planning.md, docs/simulation.md. In memory: limber/scene.h.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "limber/scene.h"

namespace limber {

struct PlanOptions {
  SceneSource scene = {};
  std::filesystem::path out = {};  // the work folder; it is made where it is missing
  std::optional<std::int64_t> seed = {}, iterations = {};
  int portfolio = 1;        // searches, with this seed and those after it, of which the quickest wins
  std::string preset = {};  // empty: the scene's
  double time_limit_s = std::numeric_limits<double>::infinity();
  int in_flight = 0;    // expansions computed ahead; 0: chosen from threads and lanes. The plan is the same
  bool resume = false;  // go on from the plan in `out`
  std::optional<std::filesystem::path> stats = {};  // JSON lines: how the search went
  std::filesystem::path from = {};  // a folder with a plan or a simulation; empty: the scene's start
  std::optional<int> frame = {};    // of `from`; nothing: its last

  std::optional<int> shortcut_rounds = {};  // nothing: the scene's
  std::string cost = "duration";            // what shortcutting and improving make less of
  bool improve = false;                     // go on after the first solution
  // What plan.npz keeps: "all" nodes of the tree, or those of the "path" alone, once the search is finished.
  // No search goes on from that.
  std::string keep_tree = "all";
};

struct SimulateOptions {
  SceneSource scene = {};
  std::filesystem::path out = {};
  // > 0, from the start; nothing: 5 s, or as long as the plan that is followed.
  std::optional<double> duration_s = {};
  std::filesystem::path script = {};  // more forces and motions; empty: the scene's alone
  std::filesystem::path from = {};    // a folder with a plan or a simulation; empty: the scene's start
  std::optional<int> frame = {};      // of `from`
  bool resume = false;                // go on from the simulation in `out`
  // A folder with a plan that is followed by feedback; empty: no control acts.
  std::filesystem::path follow = {};
};

struct RefineOptions {
  std::filesystem::path folder = {}, out = {};  // of the plan; of the finer bodies, another one
  double tets_factor = 4;                       // tets of each cage, about, as a multiple of the coarse one's
  std::vector<std::string> sets = {};           // after those of the plan and of the factor
  std::vector<std::filesystem::path> data = {};
  std::filesystem::path store = {};  // as of SceneSource
  std::optional<std::int64_t> iterations = {};
  double time_limit_s = std::numeric_limits<double>::infinity();
  int in_flight = 0;
};

// A plan or a simulation in its work folder.
struct KeptPlan {
  std::filesystem::path file;  // plan.npz
  std::string summary_json;    // as Plan::summary_json
  bool is_simulation = false;
  bool reached = false;     // its goal; of a simulation: it has not diverged
  bool measured = true;     // else a stop ended it, and its summary has no figures
  bool up_to_date = false;  // it was there
  // What this call did beside one search, of "portfolio", "shortcut", "improve", "refine", in this order: the
  // summary has its figures under that name.
  std::vector<std::string> also_done = {};
};
// Searched, unless what is there is up to date. Throws InputError, DiskError, and Interrupted once what was
// found by then is kept.
LIMBER_API KeptPlan plan_scene(const PlanOptions&, const Context& = {});
// Initial velocities, forces and motions that the scene tells; no search. Throws as plan_scene().
LIMBER_API KeptPlan simulate_scene(const SimulateOptions&, const Context& = {});
// Throws InputError where the plan does not reach its goal, and as plan_scene().
LIMBER_API KeptPlan refine_plan(const RefineOptions&, const Context& = {});

struct ScenePrepareOptions {
  SceneSource scene = {};
  std::filesystem::path out = {};
  std::vector<std::string> bodies = {};  // these alone; empty: all, and what the scene has beside them
};
struct PreparedScene {
  struct Body {
    std::string name;
    std::filesystem::path folder;
    int triangles = 0, tets = 0;
  };
  std::vector<Body> bodies;  // that were asked for
  std::size_t bodies_of_scene = 0;
};
// The bodies that plan_scene() would make first. Of several machines each may make some of them. Throws
// InputError, DiskError.
LIMBER_API PreparedScene prepare_scene_bodies(const ScenePrepareOptions&, const Context& = {});

}  // namespace limber
