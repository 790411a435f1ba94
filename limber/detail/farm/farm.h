// One scene on many machines: sent, looked after, ended. docs/farm.md.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/farm/engines.h"

namespace limber::detail {

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
  bool solved = true;                 // as far as is known
  int models = 0, failed_models = 0;  // of a batch that is done
  std::string explanation;            // of the plan
  fs::path film, report;              // where they are there
  int exit_code = 0;                  // of the first unit that failed
};
// The folder first, and then the engine. Throws InputError where nothing was submitted.
FarmStatus farm_status(const fs::path& work_folder);
std::string name_of(FarmStatus::State);

struct Submitted {
  std::string engine;
  std::vector<std::string> would;  // with dry_run: files and commands, and nothing was done
  std::vector<std::string> jobs;   // Slurm's numbers
  fs::path file;                   // a template
  bool was_done = false, was_at_work = false;
  FarmStatus status;  // of what ran here
};
// Goes on where the same was submitted before. Without a scene goes on with what is in the folder. Of engine
// "local" waits for the end. Throws InputError also where something else is at work in the folder.
Submitted submit(FarmOptions);

// Throws InputError where nothing was submitted. The jobs that it ended.
struct Cancelled {
  std::vector<std::string> jobs;
  bool was_at_work = false;
};
Cancelled cancel_farm(const fs::path& work_folder);

}  // namespace limber::detail
