// A work folder that several machines fill: what was asked for, its units of work, and how far they are. All
// of it is in DIR/farm, and is found anew from there by whoever comes. docs/farm.md.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/json.h"
#include "limber/detail/batch/prepare_many.h"
#include "limber/detail/bench/bench.h"
#include "limber/detail/film/render.h"
#include "limber/detail/plan/plan.h"

namespace limber::detail {

// In the order in which they are done: those of a scene; bodies, runs and table of a benchmark; models and
// page of a batch. Units of a stage depend on the stages before, and not on one another.
enum class Stage { bodies, search, plan, frames, film, report, runs, table, models, page };
std::string name_of(Stage);
// Throws InputError where it is none.
Stage stage_named(const std::string&);
inline const std::vector<std::string> stage_names{"bodies", "search", "plan",  "frames", "film",
                                                  "report", "runs",   "table", "models", "page"};
inline constexpr Stage last_stage = Stage::page;

struct FarmOptions {
  PlanOptions plan;    // of a scene, with its seeds and presets; not resumed, improved or begun elsewhere
  RenderOptions film;  // of all frames
  // Instead of a scene's plan and film: all runs of a benchmark, nothing merged or parted; `plan` has its
  // folder
  std::optional<BenchOptions> bench;
  // Or instead the bodies of many models; `jobs` is not read, a worker has as many as threads
  std::optional<BatchOptions> batch;
  std::string engine;  // "slurm", "local", "openjd", "none"; empty: slurm where there is one, else local
  int workers = 0;     // at once; 0: local as many as the machine has threads, else 8
  int threads = 1;     // of a worker
  int frames_per_task = 10;
  int chunks = 0;                   // > 0: the film in so many parts instead
  int runs_per_task = 1;            // of a benchmark
  int models_per_task = 10;         // of a batch
  std::vector<std::string> sbatch;  // words for sbatch
  Stage until = Stage::report;      // the last that is wanted
  bool dry_run = false;

  const fs::path& out() const { return bench ? bench->out : batch ? batch->each.out : plan.out; }
};

struct Unit {
  Stage stage;
  std::string name;        // of its lease and its files
  std::string body;        // of bodies; empty: what the scene has beside them
  std::size_t scene = 0;   // of a benchmark's bodies
  std::uint64_t seed = 0;  // of search
  std::vector<int> frames;
  std::vector<std::size_t> runs;    // of a benchmark
  std::vector<std::size_t> models;  // of a batch, by their places in its list
};

// What was submitted, as farm.json keeps it.
struct FarmSpec {
  FarmOptions options;
  std::vector<std::string> bodies;
  std::uint64_t first_seed = 1;
  std::string scene_hash, program;  // of the scenes' texts, of limber's file
  std::string key;                  // of all that the result depends on
};
// Reads the scene and looks for its models. Throws InputError for what could not be done: an unknown scene,
// no goal, a model or camera that is not there, a size, no ffmpeg.
FarmSpec spec_of(FarmOptions);
// Of the files as they are now; of a batch, whose models are looked at as their turn comes, of none. Throws
// InputError.
std::string hash_of_scenes(const FarmOptions&);

Json json_of(const FarmSpec&);
// That of a work folder, which may have been moved. Throws InputError where there is none, or it is damaged.
FarmSpec read_spec(const fs::path& work);

class FarmFolder {
 public:
  // Throws InputError where nothing was submitted, or farm.json is none of ours.
  explicit FarmFolder(const fs::path& work_folder);
  static bool is_there(const fs::path& work_folder);
  // Begins, or goes on: writes farm.json; what failed may be tried again, and what was done for another key
  // is forgotten.
  static FarmFolder begin(const FarmSpec&);
  static FarmFolder imagined(const FarmSpec&);  // writes nothing

  const FarmSpec& spec() const { return spec_; }
  const fs::path& work() const { return work_; }
  fs::path folder() const { return work_ / "farm"; }
  fs::path leases() const { return folder() / "leases"; }
  fs::path logs() const { return folder() / "log"; }
  fs::path search_file(const Unit&) const;  // of a search that is to go on

  std::vector<Stage> stages() const;  // that are wanted, in their order
  // Frames are known once there is a plan: empty before.
  std::vector<Unit> units(Stage) const;
  bool is_done(const Unit&) const;
  // What was told when it was done; null: nothing.
  Json told_of(const Unit&) const;
  std::optional<Json> failure_of(const Unit&) const;  // "reason", "message", "exit_code"
  void mark_done(const Unit&, const Json& told) const;
  void mark_failed(const Unit&, const std::string& reason, const std::string& message, int exit_code) const;
  void forget(const Unit&) const;
  Unit plan_unit() const {
    return {.stage = Stage::plan, .name = "plan", .body = {}, .frames = {}, .runs = {}, .models = {}};
  }

  void cancel() const;
  bool is_cancelled() const;

  // The jobs of the engine that were sent, and how often: "jobs": [ids], "rounds".
  Json jobs() const;
  void write_jobs(const Json&) const;

 private:
  FarmFolder(fs::path work, FarmSpec spec);
  fs::path done_file(const Unit&) const;
  fs::path failed_file(const Unit&) const;
  struct Frames {
    fs::path folder;
    std::vector<std::string> hashes;
  };
  const Frames& frames() const;  // of the plan, read once for each file of it
  fs::path work_;
  FarmSpec spec_;
  bool forgets_ = false;  // what was done for another key: nothing is done
  mutable std::pair<fs::file_time_type, Frames> frames_;
};

// The first of equals that needs the fewest iterations, of what the searches that are done told; nothing
// while none is solved. A search that has done as many iterations as `for_seed` may, and is not solved,
// cannot win.
struct Best {
  std::int64_t iterations;
  std::uint64_t seed;
  std::int64_t most_of(std::uint64_t for_seed) const { return for_seed < seed ? iterations : iterations - 1; }
};
std::optional<Best> best_search(const FarmFolder&);

}  // namespace limber::detail
