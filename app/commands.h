// The subcommands of the program, each as a function from its options to what it prints.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/json.h"

namespace limber::app {

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
  std::vector<std::string> exports;  // of export_formats (app/export.h)
  double density_kg_m3 = 1000;       // of their masses
  std::string only;                  // as of PrepareSettings (app/body.h)
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

struct SceneOptions {
  std::string scene;              // a file, or the name of a scene that comes with limber
  std::vector<std::string> sets;  // --set a.b=value
  std::vector<fs::path> data;     // more folders to look for model files in
  fs::path store = {};            // of bodies (app/body_store.h); empty: none
};

struct PlanOptions {
  SceneOptions scene;
  fs::path out;
  std::optional<std::int64_t> seed, iterations;
  int portfolio = 1;   // searches, with this seed and those after it, of which the quickest wins
  std::string preset;  // empty: the scene's
  double time_limit_s = std::numeric_limits<double>::infinity();
  int in_flight = 0;  // 0: chosen from threads and lanes
  bool resume = false;
  std::optional<fs::path> stats;  // JSON lines: how the search went
  fs::path from;                  // a folder with a plan or a simulation; empty: the scene's start
  std::optional<int> frame;       // of `from`; nothing: its last

  std::optional<int> shortcut_rounds;  // nothing: the scene's
  std::string cost = "duration";       // what shortcutting and improving make less of
  bool improve = false;                // go on after the first solution
};
Outcome plan(const PlanOptions&);

struct SimulateOptions {
  SceneOptions scene;
  fs::path out;
  std::optional<double> duration_s;  // > 0, from the start; nothing: 5 s, or as long as the plan followed
  fs::path script;                   // more forces and motions; empty: the scene's alone
  fs::path from;                     // a folder with a plan or a simulation; empty: the scene's start
  std::optional<int> frame;          // of `from`
  bool resume = false;               // go on from the simulation in `out`
  fs::path follow;  // a folder with a plan that is followed by feedback; empty: no control acts
};
// The scene left to itself: initial velocities, forces and motions that it tells, no search.
Outcome simulate(const SimulateOptions&);

struct RenderOptions {
  fs::path folder;
  std::string frames;   // "1-30,47-327:2"; empty: all
  std::string chunk;    // "i/n"; empty: 1/1
  bool resume = false;  // keep the frames that already show what they should
  std::string size;     // "1920x1080"; empty: the scene's
  std::string camera = "main";
  std::vector<std::string> passes;  // of depth, normal, object, scalar
  int bits = 8;                     // a channel, 8 or 16
  std::vector<std::string> sets;    // of film, cameras and the looks of bodies
  // Names frames-NAME/, film-NAME.mp4 and sheet-NAME.png; empty: the camera's, and none for "main".
  std::string name;
  std::optional<fs::path> video;  // default film.mp4 in the folder, made when every frame is there
};
Outcome render(const RenderOptions&);

// The start of a scene, before any plan.
struct StillOptions {
  SceneOptions scene;
  std::string camera = "main", size;  // as of RenderOptions
  std::optional<fs::path> out;        // a PNG; default: the scene's name
};
Outcome render_still(const StillOptions&);
// Makes it anew whenever the scene, a model, or an image of one is edited, and prints its name; what is wrong
// with an edit is told, and waited for. Ends by Interrupted alone, or when the picture cannot be written.
Outcome watch_still(StillOptions);

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

inline const std::vector<std::string> motion_formats{"gltf", "pc2", "usd", "vtu"};
struct ExportOptions {
  fs::path folder;
  std::vector<std::string> formats;  // of motion_formats
  std::optional<fs::path> out;       // default: export in the folder
  std::string frames;                // as of RenderOptions
};
// The planned motion as files for other programs.
Outcome export_motion(const ExportOptions&);

// prepare, plan and render; stages that are up to date are skipped.
Outcome run(const PlanOptions&, const RenderOptions&);

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

struct VerifyOptions {
  fs::path folder;
  std::optional<fs::path> observables;  // of a work folder: also a CSV with the figures of every frame
  SceneOptions scene;                   // the one that the plan must be of; none where its `scene` is empty
  bool remake = false;                  // of large bodies shells are made again, too
};
Outcome verify(const VerifyOptions&);

// One HTML page about a planned folder, that needs nothing else: docs/files.md. Default: report.html there.
Outcome report(const fs::path& folder, const std::optional<fs::path>& file = {});

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

struct RefineOptions {
  fs::path folder, out;
  double tets_factor = 4;
  std::vector<std::string> sets;  // after those of the plan and of the factor
  std::vector<fs::path> data;
  fs::path store;  // as of SceneOptions
  std::optional<std::int64_t> iterations;
  double time_limit_s = std::numeric_limits<double>::infinity();
  int in_flight = 0;
};
// Carries a plan to finer cages of the same bodies, in another work folder.
Outcome refine(const RefineOptions&);

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

Outcome info(const fs::path& path);
Outcome info_of_scene(const fs::path& file);
Outcome list_scenes();

// Parses the arguments, runs the subcommand, prints, and answers the exit code. Throws nothing.
int run_command_line(int argc, const char* const* argv);

}  // namespace limber::app
