#include "limber/detail/farm/farm.h"

#include <fmt/ranges.h>

#include <optional>
#include <set>

#include "core/error.h"
#include "core/log.h"
#include "core/threads.h"
#include "limber/detail/farm/lease.h"
#include "limber/exit_codes.h"

namespace limber::detail {

namespace {

constexpr const char* engine_lease = "engine";  // of who submits, and of the local engine while it runs

std::string with(const fs::path& work, const char* what) {
  return fmt::format("limber farm {} {}", what, work.string());
}

// Whether somebody is at work for what is in the folder already, of which is said who.
std::string who_is_at_work(const fs::path& work) {
  for (const auto& [unit, lease] : Leases::look_once(work / "farm" / "leases"))
    if (unit != engine_lease && !lease.lost) return fmt::format("{} at {}", lease.owner, unit);
  return "";
}

std::unique_ptr<Lease> begin_to_submit(const fs::path& work) {
  const fs::path folder = work / "farm" / "leases";
  make_folder(folder);
  const auto held = Leases::look_once(folder);
  const auto before = held.find(engine_lease);
  Leases leases(folder);
  std::unique_ptr<Lease> lease;
  if (before == held.end() || before->second.lost)
    lease = leases.take(engine_lease, before == held.end() ? nullptr : &before->second);
  if (!lease)
    throw InputError(fmt::format(
        "{}: is being worked on by another limber farm submit{}; {} tells how far it is, {} ends it",
        work.string(), before == held.end() ? "" : " (" + before->second.owner + ")", with(work, "status"),
        with(work, "cancel")));
  return lease;
}

std::vector<std::string> told_dry(const FarmFolder& farm) {
  const FarmOptions& options = farm.spec().options;
  std::vector<std::string> would{fmt::format("write {}", (farm.folder() / "farm.json").string())};
  for (const Stage stage : farm.stages()) {
    const std::size_t units = farm.units(stage).size();
    would.push_back(stage == Stage::frames && units == 0
                        ? fmt::format("{}: {}, known when there is a plan", name_of(stage),
                                      options.chunks > 0 ? fmt::format("{} parts", options.chunks)
                                                         : fmt::format("{} a unit", options.frames_per_task))
                        : fmt::format("{}: {} unit{}", name_of(stage), units, units == 1 ? "" : "s"));
  }
  if (options.engine == "slurm") {
    would.push_back(fmt::format("write {}", (farm.folder() / "worker.sh").string()));
    for (const auto& words : slurm_commands(farm)) would.push_back(fmt::format("{}", fmt::join(words, " ")));
  } else if (options.engine == "local") {
    would.push_back(fmt::format("{} times limber farm work {} --wait --threads {}", options.workers,
                                farm.work().string(), options.threads));
  } else if (options.engine == "openjd") {
    would.push_back(fmt::format("write {}", (farm.folder() / "template.yaml").string()));
  }
  return would;
}

FarmSpec spec_to_submit(FarmOptions options) {
  std::optional<FarmSpec> before;  // where nothing is named, and what was submitted goes on
  if (!options.bench && !options.batch && options.plan.scene.scene.empty())
    before = FarmFolder(options.plan.out).spec();
  if (options.engine.empty())
    options.engine = before ? before->options.engine : slurm_is_there() ? "slurm" : "local";
  if (options.engine == "slurm" && !slurm_is_there() && !options.dry_run)
    throw InputError(
        "--engine slurm: sbatch is not in PATH; submit on a machine of the cluster, or --engine "
        "local");
  if (!options.sbatch.empty() && options.engine != "slurm")
    throw InputError(fmt::format("--sbatch is for Slurm, and the engine is {}", options.engine));
  if (!before) return spec_of(std::move(options));
  const FarmSpec& spec = *before;
  options.plan = spec.options.plan, options.film = spec.options.film, options.bench = spec.options.bench;
  options.batch = spec.options.batch;
  options.runs_per_task = spec.options.runs_per_task, options.models_per_task = spec.options.models_per_task;
  const bool another_engine = options.engine != spec.options.engine;
  if (options.workers == 0 && !another_engine) options.workers = spec.options.workers;
  if (options.sbatch.empty() && !another_engine) options.sbatch = spec.options.sbatch;
  options.frames_per_task = spec.options.frames_per_task, options.chunks = spec.options.chunks;
  return spec_of(std::move(options));
}

}  // namespace

FarmStatus farm_status(const fs::path& work_folder) {
  const FarmFolder farm(work_folder);
  FarmStatus status;
  status.engine = farm.spec().options.engine;
  const auto held = Leases::look_once(farm.leases());
  const auto engine = held.find(engine_lease);
  status.local_engine_runs = engine != held.end() && !engine->second.lost;
  const UnitDone plan = farm.told_of(farm.plan_unit());
  bool all_done = true;
  for (const Stage stage : farm.stages()) {
    FarmStatus::OfStage& of = status.stages.emplace_back(FarmStatus::OfStage{.stage = stage});
    const std::vector<Unit> units = farm.units(stage);
    of.known = !units.empty();
    of.units = int(units.size());
    all_done &= of.known;
    for (const Unit& unit : units) {
      const auto owner = held.find(unit.name);
      if (owner != held.end() && !owner->second.lost) {
        ++of.running, all_done = false;
        status.running.push_back(fmt::format("{}: {}", unit.name, owner->second.owner));
      } else if (farm.is_done(unit)) {
        ++of.done;
        of.seconds += farm.told_of(unit).seconds.value_or(0);
      } else if (const auto failure = farm.failure_of(unit)) {
        ++of.failed, all_done = false;
        if (status.failed.empty()) status.exit_code = failure->exit_code;
        status.failed.push_back(fmt::format("{}: {}: {}", unit.name, failure->reason, failure->message));
      } else {
        ++of.waiting, all_done = false;
      }
    }
  }
  status.solved = plan.solved.value_or(status.solved);
  status.explanation = plan.explanation.value_or("");
  for (const Unit& unit : farm.units(Stage::film))
    if (farm.is_done(unit)) status.film = farm.work() / farm.told_of(unit).film.value_or("");
  for (const Unit& unit : farm.units(Stage::report))
    if (farm.is_done(unit)) status.report = farm.work() / "report.html";
  for (const Unit& unit : farm.units(Stage::table))
    if (farm.is_done(unit)) status.report = farm.work() / "bench.html";
  for (const Unit& unit : farm.units(Stage::page))
    if (farm.is_done(unit)) {
      const UnitDone told = farm.told_of(unit);
      status.report = farm.work() / "index.html";
      status.models = told.models.value_or(0), status.failed_models = told.failed_models.value_or(0);
    }
  if (slurm_is_there()) try {
      status.tasks = slurm_tasks(farm.jobs().jobs);
    } catch (const InputError& error) {
      status.engine_fails = error.what();
    }
  const FarmSpec& spec = farm.spec();
  if (spec.program != program_hash())
    status.notes.push_back("it was submitted by another build of limber; submit it anew with this one");
  try {
    if (hash_of_scenes(spec.options) != spec.scene_hash)
      status.notes.push_back(
          fmt::format("{} was edited since; submit it anew",
                      spec.options.bench ? "one of its scenes" : spec.options.plan.scene.scene));
  } catch (const InputError& error) {
    status.notes.push_back(error.what());
  }
  using enum FarmStatus::State;
  const bool works = !status.running.empty() || !status.tasks.empty() || status.local_engine_runs;
  status.state = all_done                 ? done
                 : works                  ? at_work
                 : farm.is_cancelled()    ? cancelled
                 : !status.failed.empty() ? failing
                                          : stopped;
  return status;
}

Submitted submit(FarmOptions options) {
  const FarmSpec spec = spec_to_submit(std::move(options));
  const fs::path& work = spec.options.plan.out;
  Submitted result{.engine = spec.options.engine, .would = {}, .jobs = {}, .file = {}, .status = {}};
  if (spec.options.dry_run) {
    result.would = told_dry(FarmFolder::imagined(spec));
    return result;
  }
  make_folder(work);
  std::unique_ptr<Lease> lease = begin_to_submit(work);
  if (FarmFolder::is_there(work)) {
    std::string before;
    try {
      before = FarmFolder(work).spec().key;
    } catch (const InputError& error) {
      log::warn("{}; it is made anew", error.what());
    }
    const FarmFolder jobs_before = FarmFolder::imagined(spec);
    result.jobs = jobs_before.jobs().jobs;
    // Where Slurm cannot be asked nothing is sent beside what may be there.
    if (slurm_is_there()) result.was_at_work = !slurm_tasks(result.jobs).empty();
    const std::string who = who_is_at_work(work);
    if (before != spec.key && (result.was_at_work || !who.empty()))
      throw InputError(
          fmt::format("{}: is being worked on for something else{}; end that with {}, or name another folder",
                      work.string(), who.empty() ? "" : " (" + who + ")", with(work, "cancel")));
    if (result.was_at_work) {
      result.status = farm_status(work);
      return result;
    }
  }
  const FarmFolder farm = FarmFolder::begin(spec);
  result.jobs.clear();
  farm.write_jobs({});
  result.status = farm_status(work);
  if (result.status.state == FarmStatus::done) {
    result.was_done = true;
    return result;
  }
  if (result.engine == "slurm") {
    send_to_slurm(farm, 0);
    result.jobs = farm.jobs().jobs;
  } else if (result.engine == "openjd") {
    result.file = farm.folder() / "template.yaml";
    write_file(result.file, openjd_template(farm));
  } else if (result.engine == "local") {
    run_here(farm);
  }
  lease.reset();
  result.status = farm_status(work);
  return result;
}

Cancelled cancel_farm(const fs::path& work_folder) {
  const FarmFolder farm(work_folder);
  const FarmStatus status = farm_status(work_folder);
  Cancelled result{.jobs = {}, .was_at_work = status.state == FarmStatus::at_work};
  // First, so that nothing that ends by it is begun again.
  farm.cancel();
  if (!status.engine_fails.empty()) throw InputError(status.engine_fails);
  std::set<std::string> live;
  for (const SlurmTask& task : status.tasks) live.insert(task.job);
  result.jobs.assign(live.begin(), live.end());
  cancel_slurm(result.jobs);
  return result;
}

}  // namespace limber::detail
