// What makes motions and shows them: plan, simulate, render, export, run, bench.
//
// Options that several of these commands have are functions here; those that other commands have, too, are in
// command_options.h. run writes into the same structs as plan and render: only one command is ever given.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <map>

#include "cli/described_commands.h"
#include "core/error.h"

namespace limber::cli {

namespace {

void add_from(CLI::App& command, fs::path& folder, std::optional<int>& frame) {
  CLI::Option* const from =
      command
          .add_option(
              "--from", folder,
              "begin as a frame of the plan or simulation in this folder, positions and velocities as it "
              "stores them; the clock goes on from there")
          ->type_name("DIR");
  command.add_option("--frame", frame, "of --from, counted from 0; default: its last")
      ->type_name("N")
      ->needs(from);
}

void add_plan(CLI::App& command, PlanOptions& options) {
  command.add_option("-o,--out", options.out, "work folder; it is made where it is missing")
      ->required()
      ->type_name("DIR");
  command.add_option("--seed", options.seed, "seed of the random numbers, 0 … 2^53; default: the scene's")
      ->check(whole_number());
  command
      .add_option("--portfolio", options.portfolio,
                  "this many searches in turns, with the seed and those after it, 2 … 1000; the one with the "
                  "fewest iterations wins")
      ->check(CLI::Range(2, 1000))
      ->type_name("N");
  command
      .add_option("--preset", options.preset,
                  "paper: Algorithm 1 of Rodriguez, Lien and Amato 2006 but for what docs/table1.md names; "
                  "fast: what we found to be better; "
                  "default: the scene's")
      ->check(CLI::IsMember({"paper", "fast"}));
  add_limits(command, options);
  command
      .add_option(
          "--keep-tree", options.keep_tree,
          "what plan.npz keeps: all nodes of the tree, or those of the path alone, from which no search "
          "can be resumed; an unfinished search keeps all")
      ->check(CLI::IsMember({"all", "path"}))
      ->capture_default_str();
  command
      .add_option("--stats", options.stats,
                  "how the search goes, a line of JSON for every tenth iteration; whole at any time")
      ->type_name("FILE.jsonl");
}

void add_simulate(CLI::App& command, SimulateOptions& options) {
  command.add_option("-o,--out", options.out, "work folder; it is made where it is missing")
      ->required()
      ->type_name("DIR");
  command
      .add_option("--duration", options.duration_s,
                  "how long, from its start: 5, 5s, 2min or 1h; default: 5s, or as long as the plan that is "
                  "followed")
      ->transform(seconds());
  command
      .add_option("--follow", options.follow,
                  "push the robot along the path of the plan in this folder, by feedback, with no more than "
                  "planner.max_force_n of this scene")
      ->type_name("DIR");
  command
      .add_option("--control", options.script,
                  "a TOML file with more [[forces]], [[pressures]] and [[motions]], as the scene has them")
      ->type_name("FILE");
  add_from(command, options.from, options.frame);
  command.add_flag("--resume", options.resume,
                   "go on from the simulation in the work folder: longer, or after it was stopped");
}

void add_shortcut(CLI::App& command, PlanOptions& options) {
  command
      .add_option("--shortcut", options.shortcut_rounds,
                  "rounds of sixteen changes to the path that is found, each simulated, 0 … 100000; default: "
                  "the scene's")
      ->check(CLI::Range(0, 100000))
      ->type_name("N");
  command
      .add_option("--cost", options.cost,
                  "what they make less of: duration (s), effort (N s), strain (the largest elastic energy), "
                  "volume (the largest change)")
      ->check(CLI::IsMember({"duration", "effort", "strain", "volume"}))
      ->capture_default_str();
  command.add_flag("--improve", options.improve,
                   "go on after the first path until --iterations or --time-limit, and keep the best");
}

void add_render(CLI::App& command, FilmOptions& options) {
  command
      .add_option(
          "--frames", options.frames,
          "frames to render: 0-30,47-327:2 (or x2); beyond the last is left out with a warning; default: all")
      ->check(no_empty_list());
  command.add_option("--chunk", options.chunk, "render the i-th of n parts of these frames, 1 ≤ i ≤ n")
      ->type_name("I/N");
  command.add_option("--size", options.size, "pixels of a frame, 16x16 … 8192x8192; default: the scene's")
      ->type_name("WxH");
  command.add_option("--camera", options.camera, "one of the scene's cameras")->capture_default_str();
  command
      .add_option("--passes", options.passes,
                  "pictures beside each frame, any of depth, normal, object, scalar (what film.color_by "
                  "says); passes.json says "
                  "what their levels mean")
      ->type_name("PASS[,PASS…]")
      ->delimiter(',')
      ->check(CLI::IsMember(pass_names))
      ->allow_extra_args(false);
  command.add_option("--bits", options.bits, "a channel of frames and passes, 8 or 16")
      ->check(CLI::IsMember({8, 16}))
      ->capture_default_str();
  command
      .add_option("--as", options.name,
                  "name of this film: frames-NAME, film-NAME.mp4, sheet-NAME.png; default: the camera's, "
                  "none for main")
      ->check(no_empty_name())
      ->type_name("NAME");
  command
      .add_option("--video", options.video,
                  "the film, .mp4, .webm or .gif, made when every frame is there; default: film.mp4 in the "
                  "work folder")
      ->type_name("FILE");
}

}  // namespace

void add_runs(CLI::App& command, BenchOptions& options) {
  command.add_option("SCENE", options.scenes,
                     "scene files, or names of scenes that come with limber (see limber scenes)");
  command.add_option("-o,--out", options.out, "folder of the records; what is in it is not run again")
      ->type_name("DIR");
  command.add_option("--seeds", options.seeds, "seeds of the runs: 1-30,40,50-90:10")->capture_default_str();
  command
      .add_option("--presets", options.presets, "presets of the planner, as paper,fast; default: the scene's")
      ->type_name("PRESET[,PRESET…]")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_edits(command, options.sets, options.data);
  add_store(command, options.store, "none");
  add_limits(command, options);
}

namespace {

void add_bench(CLI::App& command, BenchOptions& options) {
  add_runs(command, options);
  command.add_option("--chunk", options.chunk, "do the i-th of n parts of the runs, 1 ≤ i ≤ n")
      ->type_name("I/N");
  command.add_option("--merge", options.merge, "run nothing: make one table of the records in these folders")
      ->type_name("DIR…")
      ->check(CLI::ExistingDirectory);
  command
      .add_option("--ompl-log", options.ompl_log,
                  "also write OMPL's benchmark log, for Planner Arena; of several scenes one each")
      ->type_name("FILE");
}

}  // namespace

void DescribedCommands::add_motion_commands() {
  CLI::App& plan_command = *program.add_subcommand("plan", "scene → bodies, tree, path");
  add_scene(plan_command, plan_options.scene), add_plan(plan_command, plan_options);
  add_shortcut(plan_command, plan_options), add_from(plan_command, plan_options.from, plan_options.frame);
  plan_command.add_flag("--resume", plan_options.resume,
                        "go on from the plan in the work folder: more iterations, or after it was stopped");
  add_global(plan_command, global), add_threads(plan_command, global), add_progress(plan_command, global);
  plan_command.callback([&] { chosen = [&] { return cli::plan(plan_options); }; });

  CLI::App& simulate_command = *program.add_subcommand(
      "simulate", "scene left to itself → bodies, motion: velocities, forces and motions that it tells");
  add_scene(simulate_command, simulate_options.scene), add_simulate(simulate_command, simulate_options);
  add_global(simulate_command, global), add_threads(simulate_command, global),
      add_progress(simulate_command, global);
  simulate_command.callback([&] { chosen = [&] { return cli::simulate(simulate_options); }; });

  CLI::App& render_command = *program.add_subcommand("render", "path → frames, contact sheet, film");
  render_command.add_option("DIR", folder, "work folder with a plan; with --still or --storyboard a scene")
      ->required();
  add_render(render_command, film_options);
  render_command
      .add_option("--set", film_options.sets,
                  "edit how it is filmed: film.KEY=VALUE, camera.KEY=VALUE, bodies.NAME.color=… (also "
                  "opacity, look, roughness, metallic, deformation)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  CLI::Option* const still_flag = render_command.add_flag(
      "--still", still, "paint the start of a scene, a file or a name, before any plan: one PNG");
  CLI::Option* const storyboard_flag = render_command.add_flag(
      "--storyboard", storyboard,
      "before any plan: one sheet of what each camera of a scene sees at the start and at the goal");
  storyboard_flag->excludes(still_flag);
  CLI::Option* const watch_flag =
      render_command
          .add_flag("--watch", watch,
                    "of --still: paint it anew whenever the scene, or a model of it, is edited, until Ctrl-C")
          ->needs(still_flag);
  render_command
      .add_option(
          "-o,--out", still_options.out,
          "of --still and --storyboard: the picture; default: the scene's name.png, name-storyboard.png")
      ->type_name("FILE.png");
  render_command
      .add_option(
          "--data", still_options.scene.data,
          "of --still and --storyboard: a folder in which model files of the scene are looked for first")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->allow_extra_args(false);
  render_command.add_flag("--resume", film_options.resume, "keep frames that already show what they should");
  add_global(render_command, global), add_threads(render_command, global),
      add_progress(render_command, global);
  watch_flag->excludes(render_command.get_option("--json"));
  for (const char* of_a_film : {"--frames", "--chunk", "--passes", "--bits", "--as", "--video", "--resume"})
    still_flag->excludes(of_a_film), storyboard_flag->excludes(of_a_film);
  storyboard_flag->excludes("--camera");
  render_command.callback([&] {
    chosen = [&] {
      if (!still && !storyboard) {
        if (still_options.out || !still_options.scene.data.empty())
          throw InputError("-o and --data are of --still and --storyboard; a film is in its work folder");
        return cli::render(folder, film_options);
      }
      still_options.scene.scene = folder.string();
      still_options.scene.sets = film_options.sets;
      still_options.camera = film_options.camera, still_options.size = film_options.size;
      if (storyboard)
        return cli::write_storyboard({still_options.scene, still_options.size, still_options.out});
      return watch ? cli::watch_still(still_options) : cli::render_still(still_options);
    };
  });

  CLI::App& export_command =
      *program.add_subcommand("export", "path, or body → files for viewers, simulators and ParaView");
  export_command.add_option("DIR", export_options.folder, "work folder with a plan, or a body's folder")
      ->required();
  std::vector<std::string> formats = motion_formats;
  for (const std::string& of_a_body : export_formats)
    if (std::find(formats.begin(), formats.end(), of_a_body) == formats.end()) formats.push_back(of_a_body);
  export_command
      .add_option(
          "--format", export_options.formats,
          "of a plan any of gltf (motion.glb), pc2 (pc2/: OBJ and point caches for Blender), usd "
          "(motion.usda), vtu (vtu/: cages and surfaces for ParaView); of a body those of prepare --export, "
          "and msh")
      ->required()
      ->type_name("FORMAT[,FORMAT…]")
      ->delimiter(',')
      ->check(CLI::IsMember(formats))
      ->allow_extra_args(false);
  export_command
      .add_option("-o,--out", export_options.out,
                  "folder for them; default: export in the work folder, or the body's folder itself")
      ->type_name("DIR");
  export_command
      .add_option("--frames", export_options.frames,
                  "frames to export: 0-300:2; beyond the last is left out with a warning; default: all")
      ->check(no_empty_list());
  CLI::Option* density_option =
      export_command
          .add_option("--density", export_density_kg_m3, "kg/m³, of the masses in a body's files; 1e-6 … 1e6")
          ->check(within(1e-6, 1e6))
          ->capture_default_str();
  add_global(export_command, global);
  export_command.callback([&, density_option] {
    chosen = [&, density_option] {
      const fs::path& folder = export_options.folder;
      const bool of_body = fs::exists(folder / "report.json") && !fs::exists(folder / "plan.npz");
      const auto refuse = [&](const std::string& what) {
        throw InputError(fmt::format("{} is of {}, and {} holds {}", what, of_body ? "motions" : "bodies",
                                     folder.string(),
                                     of_body ? "a body; its formats are those of limber prepare --export"
                                             : "no body by itself; the formats of motions are gltf, pc2, "
                                               "usd, vtu"));
      };
      const std::vector<std::string>& formats = of_body ? export_formats : motion_formats;
      for (const std::string& format : export_options.formats)
        if (std::find(formats.begin(), formats.end(), format) == formats.end())
          refuse("the format " + format);
      if (of_body && !export_options.frames.empty()) refuse("--frames");
      if (!of_body && density_option->count() > 0) refuse("--density");
      if (!of_body) return cli::export_motion(export_options);
      return cli::export_body({folder, export_options.formats, export_options.out, export_density_kg_m3});
    };
  });

  CLI::App& run_command =
      *program.add_subcommand("run", "all of it: prepare, plan, render; what is up to date is skipped");
  add_scene(run_command, plan_options.scene), add_plan(run_command, plan_options),
      add_shortcut(run_command, plan_options), add_render(run_command, film_options);
  add_global(run_command, global), add_threads(run_command, global), add_progress(run_command, global);
  run_command.callback([&] { chosen = [&] { return cli::run(plan_options, film_options); }; });

  CLI::App& bench_command = *program.add_subcommand(
      "bench", "many runs: scenes × seeds × presets → a record a run, a table; what is done is skipped");
  add_bench(bench_command, bench_options);
  add_global(bench_command, global), add_threads(bench_command, global), add_progress(bench_command, global);
  bench_command.callback([&] { chosen = [&] { return cli::bench(bench_options); }; });
}

}  // namespace limber::cli
