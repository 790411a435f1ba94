#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "core/error.h"
#include "core/log.h"
#include "core/process.h"
#include "limber/detail/farm/engines.h"
#include "limber/detail/farm/run_program.h"

namespace limber::detail {

namespace {

// In single quotes of a shell.
std::string shell_word(const std::string& text) {
  std::string safe;
  for (const char c : text) safe += c == '\'' ? "'\\''" : std::string(1, c);
  return "'" + safe + "'";
}

std::string said_by(const std::vector<std::string>& words, const char* doing) {
  const RanProgram ran = run_program(words);
  if (ran.code != 0)
    throw InputError(fmt::format("{} failed: {}: {}", doing, words[0],
                                 ran.err.empty() ? fmt::format("exit code {}", ran.code) : ran.err));
  return ran.out;
}

constexpr const char* after_the_one_before = "--dependency=afterany:$BEFORE";

std::string job_name(const FarmFolder& farm) { return "limber-" + farm.work().filename().string(); }

}  // namespace

bool slurm_is_there() { return is_in_path("sbatch"); }

std::string slurm_script(const FarmFolder& farm) {
  return fmt::format(R"sh(#!/bin/bash
# Written by limber farm submit, which writes it anew. One task: a worker of this folder, with its words behind.
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@60
limber={0}
folder={1}
tries=0
while :; do
  stopped=
  trap 'stopped=1; kill -TERM $pid 2>/dev/null' TERM
  "$limber" farm work "$folder" "$@" &
  pid=$!
  wait $pid; code=$?
  if [ "$stopped" ]; then wait $pid 2>/dev/null; code=143; fi
  trap - TERM
  # Killed, or crashed: what it did is kept, and the next one goes on.
  if [ $code -gt 128 ] && [ $code -ne 130 ] && [ $code -ne 143 ] && [ $((tries += 1)) -le 5 ]; then continue; fi
  break
done
# Told to end, as a minute before the time is up. Slurm takes 143 for a failure, so the task sends itself again,
# by its number within the array: the last task of an array has the number of the whole array, too.
task=$SLURM_JOB_ID
if [ "$SLURM_ARRAY_JOB_ID" ]; then task=${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID; fi
if [ $code -eq 143 ] && [ ! -e "$folder/farm/cancelled" ] && [ "${{SLURM_RESTART_COUNT:-0}}" -lt 100 ] &&
   [ "$(squeue -h -j "$task" -o %T)" = RUNNING ]; then
  scontrol requeue "$task" && sleep 60
fi
exit $code
)sh",
                     shell_word(program_file().string()), shell_word(farm.work().string()));
}

std::vector<std::vector<std::string>> slurm_commands(const FarmFolder& farm) {
  const FarmOptions& options = farm.spec().options;
  std::vector<std::vector<std::string>> commands;
  const auto add = [&](Stage until, std::size_t tasks, bool is_last) {
    std::vector<std::string> words{"sbatch",
                                   "--parsable",
                                   "--job-name=" + job_name(farm) + "-" + name_of(until),
                                   fmt::format("--array=1-{}", std::max<std::size_t>(1, tasks)),
                                   fmt::format("--cpus-per-task={}", options.threads),
                                   "--chdir=/",
                                   "--output=" + (farm.logs() / "%x.%A_%a.log").string()};
    if (!commands.empty()) words.push_back(after_the_one_before);
    words.insert(words.end(), options.sbatch.begin(), options.sbatch.end());
    words.insert(words.end(), {(farm.folder() / "worker.sh").string(), "--until", name_of(until), "--threads",
                               std::to_string(options.threads)});
    if (is_last) words.insert(words.end(), {"--wait", "--again"});
    commands.push_back(words);
  };
  const auto open = [&](Stage stage) {
    const std::vector<Unit> units = farm.units(stage);
    return std::size_t(
        std::count_if(units.begin(), units.end(), [&](const Unit& unit) { return !farm.is_done(unit); }));
  };
  const auto at_most = [&](std::size_t units) { return std::min(units, std::size_t(options.workers)); };
  const Stage last = options.until;
  const auto add_open = [&](Stage stage) {
    if (const std::size_t units = open(stage)) add(stage, at_most(units), false);
  };
  add_open(options.batch ? Stage::models : Stage::bodies);
  if (options.bench) add_open(Stage::runs);
  if (options.bench || options.batch) {
    add(last, 1, true);
    return commands;
  }
  const bool has_plan = last < Stage::plan || farm.is_done(farm.plan_unit());
  if (!has_plan) add(Stage::plan, at_most(open(Stage::search)), false);
  // How many frames there are is only known when there is a plan.
  if (last >= Stage::frames && (!has_plan || open(Stage::frames) > 0))
    add(Stage::frames, has_plan ? at_most(open(Stage::frames)) : std::size_t(options.workers), false);
  add(last, 1, true);
  return commands;
}

void send_to_slurm(const FarmFolder& farm, int round) {
  write_file(farm.folder() / "worker.sh", slurm_script(farm));
  SentJobs sent{.jobs = {}, .rounds = round};
  if (round > 0) sent.jobs = farm.jobs().jobs;
  std::string before;
  try {
    for (std::vector<std::string> words : slurm_commands(farm)) {
      for (std::string& word : words)
        if (word == after_the_one_before) word = "--dependency=afterany:" + before;
      std::string id = said_by(words, "sending a job");
      id = id.substr(0, id.find_first_not_of("0123456789"));  // "17;CLUSTER\n"
      if (id.empty()) throw InputError("sending a job failed: sbatch told no number");
      before = id;
      sent.jobs.push_back(id);
      farm.write_jobs(sent);  // one by one: what was sent is known, whatever comes
    }
  } catch (...) {
    if (!before.empty()) cancel_slurm(sent.jobs);
    throw;
  }
}

std::vector<SlurmTask> slurm_tasks(const std::vector<std::string>& jobs) {
  std::vector<SlurmTask> tasks;
  if (jobs.empty()) return tasks;
  // All of this user: a number that Slurm has forgotten would fail the question after the others.
  std::istringstream lines(
      said_by({"squeue", "--noheader", "--me", "--array", "--format=%F|%i|%T|%r"}, "asking for the jobs"));
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> parts;
    std::istringstream words(line);
    for (std::string part; std::getline(words, part, '|');) parts.push_back(part);
    if (parts.size() == 4 && std::find(jobs.begin(), jobs.end(), parts[0]) != jobs.end())
      tasks.push_back({.job = parts[0], .id = parts[1], .state = parts[2], .why = parts[3]});
  }
  return tasks;
}

void cancel_slurm(const std::vector<std::string>& jobs) {
  if (jobs.empty()) return;
  std::vector<std::string> words{"scancel", "--quiet"};
  words.insert(words.end(), jobs.begin(), jobs.end());
  said_by(words, "cancelling the jobs");
}

}  // namespace limber::detail
