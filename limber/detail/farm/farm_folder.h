// A work folder that several machines fill: what was asked for, its units of work, and how far they are. All
// of it is in DIR/farm, and is found anew from there by whoever comes. docs/farm.md.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/json_fields.h"
#include "limber/detail/batch/prepare_many.h"
#include "limber/detail/bench/bench.h"
#include "limber/detail/film/render.h"
#include "limber/detail/plan/plan.h"
#include "limber/farm.h"

namespace limber::detail {

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

Json json_of(FarmSpec);
// That of a work folder, which may have been moved. Throws InputError where there is none, or it is damaged.
FarmSpec read_spec(const fs::path& work);

// What is told of a unit that was done; each key by units of some stages.
struct UnitDone {
  std::optional<std::string> ended;  // of search: "goal", "iterations", "beaten"
  std::optional<std::int64_t> iterations;
  std::optional<bool> solved;
  std::optional<std::string> explanation;  // of plan, as all to frame_hashes
  std::optional<std::uint64_t> seed;
  std::optional<std::string> tree_hash, trajectory_hash, plan_file, frames_folder;
  std::optional<std::vector<std::string>> frame_hashes;
  std::optional<int> leg;  // of search: where it got to
  std::optional<double> distance_m;
  std::optional<std::string> film, sheet;  // within the work folder
  std::optional<int> frames, painted;
  std::optional<bool> all_kept;                     // of report
  std::optional<std::vector<std::string>> records;  // of runs
  std::optional<int> runs, models, failed_models;   // of table, of models and page
  std::optional<std::map<std::string, int>> reasons;
  std::optional<double> seconds, cpu_s;
  std::optional<std::string> worker;
  template <class Fields>
  void fields(Fields& f) {
    f.if_there("ended", ended), f.if_there("iterations", iterations), f.if_there("solved", solved);
    f.if_there("explanation", explanation), f.if_there("seed", seed), f.if_there("tree_hash", tree_hash);
    f.if_there("trajectory_hash", trajectory_hash), f.if_there("plan_file", plan_file);
    f.if_there("frames_folder", frames_folder), f.if_there("frame_hashes", frame_hashes);
    f.if_there("leg", leg), f.if_there("distance_m", distance_m), f.if_there("film", film);
    f.if_there("sheet", sheet), f.if_there("frames", frames), f.if_there("painted", painted);
    f.if_there("all_kept", all_kept), f.if_there("records", records), f.if_there("runs", runs);
    f.if_there("models", models), f.if_there("failed_models", failed_models);
    f.if_there("reasons", reasons), f.if_there("seconds", seconds), f.if_there("cpu_s", cpu_s);
    f.if_there("worker", worker);
  }
};

struct UnitFailed {
  std::string reason, message;
  int exit_code = 1;
  template <class Fields>
  void fields(Fields& f) {
    f("reason", reason), f("message", message), f("exit_code", exit_code);
  }
};

// The jobs of the engine that were sent, and how often.
struct SentJobs {
  std::vector<std::string> jobs;
  int rounds = 0;
  template <class Fields>
  void fields(Fields& f) {
    f("jobs", jobs), f("rounds", rounds);
  }
};

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
  // What was told when it was done; nothing of a damaged file.
  UnitDone told_of(const Unit&) const;
  std::optional<UnitFailed> failure_of(const Unit&) const;
  void mark_done(const Unit&, const UnitDone&) const;
  void mark_failed(const Unit&, const UnitFailed&) const;
  void forget(const Unit&) const;
  Unit plan_unit() const {
    return {.stage = Stage::plan, .name = "plan", .body = {}, .frames = {}, .runs = {}, .models = {}};
  }

  void cancel() const;
  bool is_cancelled() const;

  SentJobs jobs() const;
  void write_jobs(const SentJobs&) const;

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
  std::int64_t iterations_to_beat(std::uint64_t for_seed) const {
    return for_seed < seed ? iterations : iterations - 1;
  }
};
std::optional<Best> best_search(const FarmFolder&);

}  // namespace limber::detail
