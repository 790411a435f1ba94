#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/commands.h"

namespace limber::cli {

namespace {

Json json_of_farm(const FarmStatus& status) {
  Json stages = Json::array(), tasks = Json::array();
  for (const FarmStatus::OfStage& of : status.stages)
    stages.push_back({{"stage", name_of(of.stage)},
                      {"units", of.known ? Json(of.units) : Json()},
                      {"done", of.done},
                      {"running", of.running},
                      {"failed", of.failed},
                      {"waiting", of.waiting},
                      {"seconds", of.seconds}});
  for (const SlurmTask& task : status.tasks)
    tasks.push_back({{"id", task.id}, {"state", task.state}, {"why", task.why}});
  Json json{{"state", name_of(status.state)}, {"engine", status.engine}, {"stages", stages},
            {"running", status.running},      {"failed", status.failed}, {"tasks", tasks}};
  json["notes"] = status.notes;
  if (!status.engine_fails.empty()) json["engine_fails"] = status.engine_fails;
  if (!status.explanation.empty()) json["solved"] = status.solved, json["explanation"] = status.explanation;
  if (status.models > 0) json["models"] = status.models, json["failed_models"] = status.failed_models;
  if (!status.film.empty()) json["film"] = status.film.string();
  if (!status.report.empty()) json["report"] = status.report.string();
  return json;
}

std::string text_of_farm(const FarmStatus& status) {
  std::string text = fmt::format("  {:<8} {:>6} {:>6} {:>8} {:>7} {:>8} {:>10}\n", "stage", "units", "done",
                                 "running", "failed", "waiting", "seconds");
  for (const FarmStatus::OfStage& of : status.stages)
    text += of.known ? fmt::format("  {:<8} {:>6} {:>6} {:>8} {:>7} {:>8} {:>10.1f}\n", name_of(of.stage),
                                   of.units, of.done, of.running, of.failed, of.waiting, of.seconds)
                     : fmt::format("  {:<8} {:>6} known when there is a plan\n", name_of(of.stage), "-");
  for (const std::string& running : status.running) text += "running  " + running + "\n";
  for (const std::string& failed : status.failed) text += "failed   " + failed + "\n";
  if (!status.explanation.empty()) text += "plan     " + status.explanation + "\n";
  if (status.models > 0)
    text += fmt::format("models   {}, of which {} failed\n", status.models, status.failed_models);
  if (!status.film.empty()) text += "film     " + status.film.string() + "\n";
  if (!status.report.empty()) text += "report   " + status.report.string() + "\n";
  for (const std::string& note : status.notes) text += "note     " + note + "\n";
  if (!status.engine_fails.empty()) text += "slurm    " + status.engine_fails + "\n";
  for (const SlurmTask& task : status.tasks)
    text += fmt::format("slurm    {} {}{}\n", task.id, task.state,
                        task.why.empty() || task.why == "None" ? "" : " (" + task.why + ")");
  return text + "state    " + name_of(status.state) + "\n";
}

int exit_code_of_farm(const FarmStatus& status) {
  if (status.state == FarmStatus::done)
    return !status.solved ? exit_no_plan : status.failed_models > 0 ? exit_models_failed : exit_done;
  return status.exit_code != 0 ? status.exit_code : exit_defect;
}

}  // namespace

Outcome farm_submit(const FarmOptions& options) {
  const Submitted submitted = submit_to_farm(options, at_terminal());
  if (options.dry_run)
    return {exit_done,
            {{"engine", submitted.engine}, {"would", submitted.would}},
            fmt::format("{}\n", fmt::join(submitted.would, "\n"))};
  const std::string folder = options.out().string();
  Json json{{"engine", submitted.engine},
            {"jobs", submitted.jobs},
            {"was_done", submitted.was_done},
            {"was_at_work", submitted.was_at_work},
            {"status", json_of_farm(submitted.status)}};
  if (!submitted.file.empty()) json["template"] = submitted.file.string();
  const std::string later =
      fmt::format("limber farm status {0} tells how far it is, limber farm cancel {0} ends it\n", folder);
  if (submitted.was_done)
    return {exit_code_of_farm(submitted.status), json,
            text_of_farm(submitted.status) + "all is done already\n"};
  if (submitted.was_at_work)
    return {exit_done, json,
            text_of_farm(submitted.status) + "it was submitted before, and is at work\n" + later};
  if (submitted.engine == "slurm")
    return {exit_done, json, fmt::format("sent as jobs {}\n", fmt::join(submitted.jobs, ", ")) + later};
  if (submitted.engine == "openjd")
    return {exit_done, json, fmt::format("a job template in {}\n", submitted.file.string()) + later};
  if (submitted.engine == "none")
    return {
        exit_done, json,
        fmt::format("ready: limber farm work {} on any machine that sees the folder, as often as you like\n",
                    folder) +
            later};
  return {exit_code_of_farm(submitted.status), json, text_of_farm(submitted.status)};
}

Outcome farm_status(const fs::path& folder) {
  const FarmStatus status = limber::farm_status(folder, at_terminal());
  return {exit_done, json_of_farm(status), text_of_farm(status)};
}

Outcome farm_cancel(const fs::path& folder) {
  const Cancelled cancelled = cancel_farm(folder, at_terminal());
  std::string text = cancelled.was_at_work ? "cancelled" : "nothing was at work";
  if (!cancelled.jobs.empty()) text += fmt::format(": jobs {}", fmt::join(cancelled.jobs, ", "));
  return {exit_done,
          {{"was_at_work", cancelled.was_at_work}, {"jobs", cancelled.jobs}},
          text + fmt::format("; limber farm submit -o {} goes on\n", folder.string())};
}

Outcome farm_work(const WorkOptions& options) {
  const WorkDone done = work_at_farm(options, at_terminal());
  using enum WorkDone::Ending;
  const char* how = done.ending == all_done         ? "all is done"
                    : done.ending == others_at_work ? "others are at the rest"
                    : done.ending == sent_again     ? "what is missing was sent once more"
                                                    : "some failed";
  std::string text = fmt::format("{} unit{} done here; {}\n", done.units, done.units == 1 ? "" : "s", how);
  for (const std::string& failed : done.failed) text += "failed   " + failed + "\n";
  return {done.ending == some_failed ? done.exit_code : exit_done,
          {{"units", done.units}, {"ending", how}, {"failed", done.failed}},
          text};
}

}  // namespace limber::cli
