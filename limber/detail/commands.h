// The subcommands of the program, each as a function from its options to what it prints.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/json.h"
#include "limber/detail/film/render.h"
#include "limber/detail/world/scene_world.h"

namespace limber::detail {

// What the process says when it ends; docs/cli.md tells users.
enum ExitCode : int {
  exit_done = 0,
  exit_defect = 1,     // ours
  exit_bad_input = 2,  // or usage
  exit_no_plan = 3,    // the best one found is kept, and can be rendered
  exit_frames_failed = 4,
  exit_disk = 5,
  exit_models_failed = 6,  // some of many; the others are prepared
  exit_signal = 128,       // plus the signal's number
};

// Of exit code 2.
inline constexpr const char* not_enough_memory =
    "the machine's memory is not enough for this; ask for fewer tets, shells or iterations";

struct Outcome {
  int exit_code = exit_done;
  Json json;         // what --json prints
  std::string text;  // what is printed otherwise
};

struct PrepareOptions {
  fs::path model, out;
  int shells = 32;       // at most so many convex shells
  double concavity = 0;  // stop cutting below this overshoot, share of the diagonal; 0: only the count rules
  double inflate = 0;    // shells take in all that is this share of the diagonal away
  double threshold = 0;  // the same as CoACD measures: share of half the longest edge of the model's box
  int corners = 64;      // of a shell, at most
  bool exact = false;    // exact convex parts of a small closed model
  int tets = 1000;       // budget of the cage
  std::string mode = "lattice";
  double scale = 1;  // metres a file unit
  bool y_up = false;
  bool preview = false;              // pictures beside the files
  bool picture = false;              // a small one
  std::vector<std::string> exports;  // of export_formats (limber/detail/body/export.h)
  double density_kg_m3 = 1000;       // of their masses
  std::string only;                  // as of PrepareSettings (limber/detail/body/body.h)
  fs::path store;                    // of bodies; empty: none, or, of many models, store in `out`
  std::string format;                // of a model on stdin: an ending, without its dot
  std::string label;                 // of a label map: a number or a name
  double label_gap = 0.2;            // as imaging::SurfaceNetOptions
  int label_rounds = 10;
  double least_island = 8;
};
Outcome prepare(const PrepareOptions&);

// Many models, each in a process of its own. docs/batch.md.
struct BatchOptions {
  std::vector<std::string> models;  // files, folders, @lists
  PrepareOptions each;              // its `model` and `format` are not read
  int jobs = 0;                     // at once; 0: as many as there are threads
  double time_limit_s = 600;        // of a model, CPU time; five times that by the clock
  double memory_mb = 0;             // of a model; 0: three quarters of the machine's, shared by the jobs
  bool retry_failed = false;        // those, too, that would only fail again
};
Outcome prepare_many(const BatchOptions&);

// The start of a scene, before any plan.
struct StillOptions {
  SceneOptions scene;
  std::string camera = "main", size;  // as of RenderOptions
  std::optional<fs::path> out;        // a PNG; default: the scene's name
};
Outcome render_still(const StillOptions&);

struct SceneCheckOptions {
  SceneOptions scene;
  std::string preset;             // empty: the scene's
  std::optional<fs::path> work;   // a work folder: bodies are prepared there, and a search is tried
  std::optional<fs::path> still;  // a PNG of the start
  std::string camera = "main", size;
};
// What can be said of a scene before it is planned; exit code 2 with all that is wrong where it cannot be.
Outcome check_scene(const SceneCheckOptions&);

struct ScenePrepareOptions {
  SceneOptions scene;
  fs::path out;
  std::vector<std::string> bodies;  // these alone; empty: all, and what the scene has beside them
};
// The bodies of a scene in its work folder, as plan and run would make them first: of several machines each
// may make some of them.
Outcome prepare_scene(const ScenePrepareOptions&);

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

Outcome info_of_scene(const fs::path& file);

}  // namespace limber::detail
