// The subcommands of the program, each as a function from its options to what it prints.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/json.h"
#include "limber/detail/exit_codes.h"
#include "limber/detail/film/render.h"
#include "limber/detail/world/scene_world.h"

namespace limber::detail {

struct Outcome {
  int exit_code = exit_done;
  Json json;         // what --json prints
  std::string text;  // what is printed otherwise
};

// Scenes × seeds × presets, each planned as `plan` would, one record a run. docs/bench.md.
struct BenchOptions {
  std::vector<std::string> scenes;  // files, or names of scenes that come with limber
  std::vector<std::string> sets;
  std::vector<fs::path> data;
  fs::path store;  // as of SceneOptions
  std::string seeds = "1-30";
  std::vector<std::string> presets;  // empty: each scene's own
  std::optional<std::int64_t> iterations;
  double time_limit_s = std::numeric_limits<double>::infinity();  // of a run
  int in_flight = 0;
  std::string chunk;                 // "i/n": the i-th of n parts of the runs; empty: all
  std::vector<fs::path> merge;       // nothing is run: folders whose records make one table
  fs::path out;                      // may be empty with `merge`
  std::optional<fs::path> ompl_log;  // also OMPL's benchmark log
};
Outcome bench(const BenchOptions&);

struct RobustOptions {
  fs::path folder;
  int perturbations = 16;
  std::uint64_t seed = 1;
  double material_share = 0.1;  // Young's modulus, density and friction of each body: ± this
  double force_share = 0.1;     // each control's force: ± this,
  double force_deg = 5;         // and turned by up to so much
  bool follow = false;          // besides open loop
};
// The found plan replayed in worlds that are a little different: a report, no verdict.
Outcome robust(const RobustOptions&);

struct NewSceneOptions {
  fs::path from, out;  // models in one frame: a folder, a label map, an atlas; the scene file to write
  fs::path labels;     // names of a label map's labels; empty: as it has them
  std::string robot;
  std::vector<std::string> only;  // names without ending, labels, an atlas' names or ids; empty: all
  std::vector<std::string> see_through, rigid;  // besides those whose names say so
  double scale = 0.001;                         // metres a file unit
  double shrink = 1;                            // at most so much of every organ's true size
  int tets = 160;                               // of a soft cage
  std::string up = "+z", front = "-y";
  std::string goal = "front";  // or back, left, right, up, down
};
Outcome new_scene(const NewSceneOptions&);

}  // namespace limber::detail
