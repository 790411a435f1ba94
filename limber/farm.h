// A scene, a benchmark or many models on many machines that see one folder. docs/farm.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "limber/batch.h"
#include "limber/bench.h"
#include "limber/film.h"

namespace limber {

// In the order in which they are done: those of a scene; bodies, runs and table of a benchmark; models and
// page of a batch. Units of a stage depend on the stages before, and not on one another.
enum class Stage { bodies, search, plan, frames, film, report, runs, table, models, page };
LIMBER_API std::string name_of(Stage);
// Throws InputError where it is none.
LIMBER_API Stage stage_named(const std::string&);
inline const std::vector<std::string> stage_names{"bodies", "search", "plan",  "frames", "film",
                                                  "report", "runs",   "table", "models", "page"};
inline constexpr Stage last_stage = Stage::page;

struct FarmOptions {
  PlanOptions plan = {};  // of a scene, with its seeds and presets; not resumed, improved or begun elsewhere
  FilmOptions film = {};  // of all frames
  // Instead of a scene's plan and film: all runs of a benchmark, nothing merged or parted; `plan` has its
  // folder
  std::optional<BenchOptions> bench = {};
  // Or instead the bodies of many models; `jobs` is not read, a worker has as many as threads
  std::optional<BatchOptions> batch = {};
  std::string engine = {};  // "slurm", "local", "openjd", "none"; empty: slurm where there is one, else local
  int workers = 0;          // at once; 0: local as many as the machine has threads, else 8
  int threads = 1;          // of a worker
  int frames_per_task = 10;
  int chunks = 0;                        // > 0: the film in so many parts instead
  int runs_per_task = 1;                 // of a benchmark
  int models_per_task = 10;              // of a batch
  std::vector<std::string> sbatch = {};  // words for sbatch
  Stage until = Stage::report;           // the last that is wanted
  bool dry_run = false;

  const std::filesystem::path& out() const { return bench ? bench->out : batch ? batch->each.out : plan.out; }
};

struct SlurmTask {
  std::string job, id, state, why;  // "17", "17_3", "RUNNING", "Resources"
};

struct FarmStatus {
  struct OfStage {
    Stage stage;
    bool known = true;  // else its units are not: there is no plan yet
    int units = 0, done = 0, running = 0, failed = 0, waiting = 0;
    double seconds = 0;  // of the units that are done, added up
  };
  std::vector<OfStage> stages;
  std::vector<std::string> running;  // "UNIT: HOST, job 17_3"
  std::vector<std::string> failed;   // "UNIT: REASON: MESSAGE"
  std::string engine;
  std::vector<SlurmTask> tasks;  // of the engine, that have not ended
  std::string engine_fails;      // why it does not answer
  bool local_engine_runs = false;
  std::vector<std::string> notes;  // why its workers would refuse to go on
  enum State { done, at_work, failing, cancelled, stopped } state = stopped;
  bool solved = true;                  // as far as is known
  int models = 0, failed_models = 0;   // of a batch that is done
  std::string explanation;             // of the plan
  std::filesystem::path film, report;  // where they are there
  int exit_code = 0;                   // of the first unit that failed
};
LIMBER_API std::string name_of(FarmStatus::State);
// The folder first, and then the engine. Throws InputError where nothing was submitted.
LIMBER_API FarmStatus farm_status(const std::filesystem::path& work_folder, const Context& = {});

struct Submitted {
  std::string engine;
  std::vector<std::string> would;  // with dry_run: files and commands, and nothing was done
  std::vector<std::string> jobs;   // Slurm's numbers
  std::filesystem::path file;      // a template
  bool was_done = false, was_at_work = false;
  FarmStatus status;  // of what ran here
};
// Goes on where the same was submitted before. Without a scene goes on with what is in the folder. Of engine
// "local" waits for the end. Work is done by the program `limber`: other programs run `limber farm submit`,
// and here get an InputError; as do all where something else is at work in the folder.
LIMBER_API Submitted submit_to_farm(const FarmOptions&, const Context& = {});

struct Cancelled {
  std::vector<std::string> jobs;  // that it ended
  bool was_at_work = false;
};
// Throws InputError where nothing was submitted.
LIMBER_API Cancelled cancel_farm(const std::filesystem::path& work_folder, const Context& = {});

// A worker takes units of a folder until none is left for it.
struct WorkOptions {
  std::filesystem::path folder = {};
  Stage until = last_stage;  // this one and those before it
  int threads = 0;           // 0: as was submitted
  bool wait = false;         // for units that others do, too, and for those after them
  bool again = false;        // frames that others were to paint and did not are sent to them once more
};

struct WorkDone {
  int units = 0;  // by this one
  enum Ending { all_done, others_at_work, some_failed, sent_again } ending = all_done;
  std::vector<std::string> failed;  // "NAME: REASON: MESSAGE"
  int exit_code = 0;                // of the first that failed
};
// Throws InputError where nothing was submitted, or by another program, or the scene was edited since;
// DiskError; Interrupted, also where the farm is cancelled.
LIMBER_API WorkDone work_at_farm(const WorkOptions&, const Context& = {});

}  // namespace limber
