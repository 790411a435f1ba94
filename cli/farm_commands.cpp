// farm: a scene, a benchmark or a batch of models on many machines (docs/farm.md). What submit is told is
// kept in the folder: who works, asks or cancels names that alone.
#include <CLI/CLI.hpp>

#include "cli/described_commands.h"
#include "core/error.h"

namespace limber::cli {

namespace {

// Of what comes out: with a folder that has it already none of these is told again.
std::vector<CLI::Option*> add_result(CLI::App& command, FarmOptions& options) {
  PlanOptions& plan = options.plan;
  FilmOptions& film = options.film;
  std::vector<CLI::Option*> of_result{
      command.add_option("--seed", plan.seed, "as of limber plan, 0 … 2^53")->check(whole_number()),
      command
          .add_option("--portfolio", plan.portfolio,
                      "this many searches, with the seed and those after it, 2 … 1000, a unit each; the one "
                      "with the fewest iterations wins, the least seed of equals")
          ->check(CLI::Range(2, 1000))
          ->type_name("N"),
      command.add_option("--preset", plan.preset, "as of limber plan; default: the scene's")
          ->check(CLI::IsMember({"paper", "fast"})),
      command
          .add_option("--iterations", plan.iterations, "limit of each search, 0 … 1e9; default: the scene's")
          ->check(within(0.0, 1e9)),
      command
          .add_option("--shortcut", plan.shortcut_rounds,
                      "rounds of shortcuts, 0 … 100000; default: the scene's")
          ->check(CLI::Range(0, 100000))
          ->type_name("N"),
      command.add_option("--cost", plan.cost, "what they make less of")
          ->check(CLI::IsMember({"duration", "effort", "strain", "volume"}))
          ->capture_default_str(),
      command
          .add_option("--keep-tree", plan.keep_tree,
                      "what plan.npz keeps: all nodes of the tree, or those of the path alone")
          ->check(CLI::IsMember({"all", "path"}))
          ->capture_default_str(),
      command.add_option("--size", film.size, "pixels of a frame, 16x16 … 8192x8192; default: the scene's")
          ->type_name("WxH"),
      command.add_option("--camera", film.camera, "one of the scene's cameras")->capture_default_str(),
      command.add_option("--passes", film.passes, "pictures beside each frame, as of limber render")
          ->type_name("PASS[,PASS…]")
          ->delimiter(',')
          ->check(CLI::IsMember(pass_names))
          ->allow_extra_args(false),
      command.add_option("--bits", film.bits, "a channel of frames and passes, 8 or 16")
          ->check(CLI::IsMember({8, 16}))
          ->capture_default_str(),
      command.add_option("--frames-per-task", options.frames_per_task, "frames of a unit, 1 … 1000000")
          ->check(CLI::Range(1, 1000000))
          ->type_name("N")
          ->capture_default_str(),
      command.add_option("--chunks", options.chunks, "instead: so many units, 1 … 1000000")
          ->check(CLI::Range(1, 1000000))
          ->type_name("N")};
  add_edits(command, plan.scene.sets, plan.scene.data);
  for (const char* edit : {"--set", "--data"}) of_result.push_back(command.get_option(edit));
  return of_result;
}

// Who does it, and how.
void add_engine(CLI::App& command, FarmOptions& options) {
  command
      .add_option(
          "--engine", options.engine,
          "who runs the workers: slurm (sbatch); local (this machine, waits for the end); openjd (writes "
          "farm/template.yaml); none (you do: limber farm work DIR); default: slurm where sbatch is in "
          "PATH, else local; what goes on keeps its own")
      ->check(CLI::IsMember({"slurm", "local", "openjd", "none"}));
  command
      .add_option("--workers", options.workers,
                  "at once, 1 … 1000; default: local as many as --threads leave room for, else 8")
      ->check(CLI::Range(1, 1000))
      ->type_name("N");
  command
      .add_option("--threads", options.threads,
                  "of each worker, 1 … 256; Slurm's --cpus-per-task. Results do not depend on it")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command
      .add_option("--sbatch", options.sbatch,
                  "a word for sbatch, as --sbatch=--partition=long; may be given several times")
      ->type_name("WORD")
      ->allow_extra_args(false);
  command.add_flag("--dry-run", options.dry_run, "say what would be written and sent, and do nothing");
}

const std::vector<std::string> stages_of_a_scene(stage_names.begin(), stage_names.begin() + 6);

}  // namespace

void DescribedCommands::add_farm_commands() {
  CLI::App& farm =
      *program.add_subcommand("farm", "on many machines: a scene's film, a benchmark, many models");
  farm.require_subcommand(1);

  CLI::App& submit_command = *farm.add_subcommand(
      "submit", "sends a scene's bodies, plan, frames, film and report; what is done is skipped");
  CLI::Option* const scene = submit_command.add_option(
      "SCENE", farm_options.plan.scene.scene,
      "a scene file, or the name of a scene that comes with limber; default: what was "
      "submitted in DIR before, with all that was said of it");
  submit_command
      .add_option("-o,--out", farm_options.plan.out,
                  "work folder, which all machines see; made where it is missing")
      ->required()
      ->type_name("DIR");
  const std::vector<CLI::Option*> of_result = add_result(submit_command, farm_options);
  add_store(submit_command, farm_options.plan.scene.store, "none");
  add_engine(submit_command, farm_options);
  submit_command.add_option("--until", farm_until, "the last stage that is wanted")
      ->check(CLI::IsMember(stages_of_a_scene))
      ->capture_default_str();
  add_global(submit_command, global);
  submit_command.callback([this, scene, of_result] {
    chosen = [this, scene, of_result] {
      if (scene->count() == 0)
        for (const CLI::Option* option : of_result)
          if (option->count() > 0)
            throw InputError(fmt::format(
                "{} is of a scene, and none is named: what was submitted before goes on as it was; name the "
                "scene, or leave {} out",
                option->get_name(), option->get_name()));
      farm_options.until = stage_named(farm_until);
      return farm_submit(farm_options);
    };
  });

  CLI::App& runs_command = *farm.add_subcommand(
      "bench", "sends the runs of a benchmark, and its table and page; what is done is skipped");
  add_runs(runs_command, bench_options);
  runs_command.add_option("--runs-per-task", farm_options.runs_per_task, "runs of a unit, 1 … 1000000")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N")
      ->capture_default_str();
  add_engine(runs_command, farm_options);
  add_global(runs_command, global);
  runs_command.callback([this] {
    chosen = [this] {
      if (bench_options.scenes.empty() || bench_options.out.empty())
        throw InputError("name the scenes, and with -o the folder, which all machines see");
      farm_options.bench = bench_options;
      return farm_submit(farm_options);
    };
  });

  CLI::App& models_command = *farm.add_subcommand(
      "prepare", "sends many models to be prepared, each in a process of its own; what is done is skipped");
  models_command
      .add_option(
          "MODEL", batch_options.models,
          "files, folders of models, @LIST (a file with a path a line, @- on stdin), which all machines "
          "see")
      ->required();
  models_command
      .add_option(
          "-o,--out", prepare_options.out,
          "folder, which all machines see, for bodies, failed, manifest.jsonl, manifest.csv, index.html")
      ->required()
      ->type_name("DIR");
  add_body_options(models_command, prepare_options);
  add_store(models_command, prepare_options.store, "store in -o");
  add_model_limits(models_command, batch_options);
  models_command
      .add_option("--models-per-task", farm_options.models_per_task, "models of a unit, 1 … 1000000")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N")
      ->capture_default_str();
  add_engine(models_command, farm_options);
  add_global(models_command, global);
  models_command.callback([this] {
    chosen = [this] {
      farm_options.batch = batch_options;
      return farm_submit(farm_options);
    };
  });

  CLI::App& status_command =
      *farm.add_subcommand("status", "how far it is: units of each stage, who is at them, what failed");
  status_command.add_option("DIR", folder, "work folder")->required();
  add_global(status_command, global);
  status_command.callback([&] { chosen = [&] { return farm_status(folder); }; });

  CLI::App& cancel_command =
      *farm.add_subcommand("cancel", "ends what was submitted; all that is done is kept");
  cancel_command.add_option("DIR", folder, "work folder")->required();
  add_global(cancel_command, global);
  cancel_command.callback([&] { chosen = [&] { return farm_cancel(folder); }; });

  CLI::App& work_command = *farm.add_subcommand(
      "work",
      "a worker: does units of what was submitted until none is left for it; on any machine that sees DIR");
  work_command.add_option("DIR", work_options.folder, "work folder")->required();
  work_command
      .add_option("--until", work_until, "the last stage that it takes units of; default: the last of all")
      ->check(CLI::IsMember(stage_names));
  work_command.add_flag("--wait", work_options.wait,
                        "where others are at all that is left, wait for them, and go on after them");
  work_command.add_flag(
      "--again", work_options.again,
      "where frames are missing and nobody is at them, send all workers of Slurm once more");
  add_global(work_command, global), add_threads(work_command, global);
  work_command.callback([&] {
    chosen = [&] {
      if (!work_until.empty()) work_options.until = stage_named(work_until);
      work_options.threads = global.threads;
      return farm_work(work_options);
    };
  });
}

}  // namespace limber::cli
