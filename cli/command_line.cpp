#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <new>

#include "cli/command_line.h"
#include "cli/command_words.h"
#include "cli/commands.h"
#include "core/error.h"
#include "core/events.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/threads.h"
#include "core/version.h"
#include "core/words.h"
#include "limber/detail/batch/model_list.h"
#include "limber/detail/body/export.h"
#include "limber/detail/film/shot.h"

namespace limber::cli {

namespace {

struct GlobalOptions {
  bool json = false, quiet = false, verbose = false;
  std::string progress;
  int threads = 0;
};

// CLI::Range, which takes nan.
CLI::Validator within(double low, double high) {
  return CLI::Validator(
      [low, high](std::string& text) {
        double value = 0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        return is_number && value >= low && value <= high
                   ? std::string()
                   : fmt::format("{} is no number from {} to {}", text, low, high);
      },
      fmt::format("FLOAT in [{:g} - {:g}]", low, high));
}

void add_global(CLI::App& command, GlobalOptions& options) {
  command.add_flag("--json", options.json, "print one JSON document on stdout, and nothing else there");
  command.add_flag("-q,--quiet", options.quiet, "only warnings and errors on stderr; no progress bars");
  command.add_flag("-v,--verbose", options.verbose, "more on stderr");
}

void add_threads(CLI::App& command, GlobalOptions& options) {
  command
      .add_option("--threads", options.threads,
                  "threads to use, 0 … 256; 0: as many as the machine has. Results do not depend on it")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
}

void add_progress(CLI::App& command, GlobalOptions& options) {
  command
      .add_option("--progress", options.progress,
                  "tell what goes on, a line of JSON an event: json (on stderr, which has nothing else then) "
                  "or a file whose name ends in .jsonl")
      ->type_name("json|FILE.jsonl")
      ->check(CLI::Validator(
          [](const std::string& where) {
            return where == "json" || where.ends_with(".jsonl") ? "" : "neither json nor a file FILE.jsonl";
          },
          ""));
}

// A variable that a farm's script has not set must not mean all.
CLI::Validator no_empty_list() {
  return {
      [](const std::string& text) { return text.empty() ? "names no frame; write for example 0-30" : ""; },
      ""};
}

void add_edits(CLI::App& command, std::vector<std::string>& sets, std::vector<fs::path>& data) {
  command
      .add_option("--set", sets,
                  "edit the scene before it is read: --set bodies.robot.material.youngs_modulus_pa=5e4")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command.add_option("--data", data, "a folder in which model files of the scene are looked for first")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->allow_extra_args(false);
}

void add_store(CLI::App& command, fs::path& store, const char* otherwise) {
  command
      .add_option(
          "--store", store,
          fmt::format("folder in which prepared bodies are kept and found, shared by models, scenes and "
                      "machines; default: LIMBER_STORE of the environment, else {}",
                      otherwise))
      ->type_name("DIR")
      ->envname("LIMBER_STORE");
}

void add_scene(CLI::App& command, detail::SceneOptions& options) {
  command
      .add_option("SCENE", options.scene,
                  "a scene file, or the name of a scene that comes with limber (see limber scenes)")
      ->required();
  add_edits(command, options.sets, options.data);
  add_store(command, options.store, "none");
}

// Of one search: PlanOptions or BenchOptions.
template <class Options>
void add_limits(CLI::App& command, Options& options) {
  command
      .add_option("--iterations", options.iterations, "limit of the search, 0 … 1e9; default: the scene's")
      ->check(within(0.0, 1e9));
  command
      .add_option("--time-limit", options.time_limit_s,
                  "wall time of the search: 30, 30s, 5min or 1h; the best so far is kept; default: none")
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}},
                                        CLI::AsNumberWithUnit::DEFAULT, "s|min|h"));
  command
      .add_option("--in-flight", options.in_flight,
                  "expansions computed ahead, 0 … 4096; 0: chosen from threads and lanes. The plan does not "
                  "depend on it")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
}

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

void add_plan(CLI::App& command, detail::PlanOptions& options) {
  command.add_option("-o,--out", options.out, "work folder; it is made where it is missing")
      ->required()
      ->type_name("DIR");
  command.add_option("--seed", options.seed, "seed of the random numbers, 0 … 2^53; default: the scene's")
      ->check(within(0.0, 0x1p53));
  command
      .add_option("--portfolio", options.portfolio,
                  "this many searches in turns, with the seed and those after it, 2 … 1000; the one with the "
                  "fewest iterations wins")
      ->check(CLI::Range(2, 1000))
      ->type_name("N");
  command
      .add_option("--preset", options.preset,
                  "paper: Algorithm 1 of Rodriguez, Lien and Amato 2006; fast: what we found to be better; "
                  "default: the scene's")
      ->check(CLI::IsMember({"paper", "fast"}));
  add_limits(command, options);
  command
      .add_option("--stats", options.stats,
                  "how the search goes, a line of JSON for every tenth iteration; whole at any time")
      ->type_name("FILE.jsonl");
}

void add_simulate(CLI::App& command, detail::SimulateOptions& options) {
  command.add_option("-o,--out", options.out, "work folder; it is made where it is missing")
      ->required()
      ->type_name("DIR");
  command
      .add_option("--duration", options.duration_s,
                  "how long, from its start: 5, 5s, 2min or 1h; default: 5s, or as long as the plan that is "
                  "followed")
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}},
                                        CLI::AsNumberWithUnit::DEFAULT, "s|min|h"));
  command
      .add_option("--follow", options.follow,
                  "push the robot along the path of the plan in this folder, by feedback, with no more than "
                  "planner.max_force_n of this scene")
      ->type_name("DIR");
  command
      .add_option("--control", options.script,
                  "a TOML file with more [[forces]] and [[motions]], as the scene has them")
      ->type_name("FILE");
  add_from(command, options.from, options.frame);
  command.add_flag("--resume", options.resume,
                   "go on from the simulation in the work folder: longer, or after it was stopped");
}

void add_shortcut(CLI::App& command, detail::PlanOptions& options) {
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

void add_render(CLI::App& command, detail::RenderOptions& options) {
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
      ->check(CLI::IsMember(detail::pass_names))
      ->allow_extra_args(false);
  command.add_option("--bits", options.bits, "a channel of frames and passes, 8 or 16")
      ->check(CLI::IsMember({8, 16}))
      ->capture_default_str();
  command
      .add_option("--as", options.name,
                  "name of this film: frames-NAME, film-NAME.mp4, sheet-NAME.png; default: the camera's, "
                  "none for main")
      ->type_name("NAME");
  command
      .add_option("--video", options.video,
                  "the film, .mp4, .webm or .gif, made when every frame is there; default: film.mp4 in the "
                  "work folder")
      ->type_name("FILE");
}

void add_bench(CLI::App& command, detail::BenchOptions& options) {
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

void print(const Outcome& outcome, bool json) {
  const std::string text = json ? text_of(outcome.json, 2) + "\n" : outcome.text;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw DiskError("stdout: writing the result failed");
}

// The first word that is no command or option, and what was meant; else empty.
std::string misspelt(const CLI::App& program, int argc, const char* const* argv) {
  const auto told = [](const std::string& word, const std::string& what,
                       const std::vector<std::string>& known, const char* help) {
    const std::string meant = nearest(word, known);
    return fmt::format(
        "{} is no {}; {}", word, what,
        meant.empty() ? fmt::format("see {} --help", help) : fmt::format("did you mean {}?", meant));
  };
  const CLI::App* command = &program;
  std::string name = "limber";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    std::vector<std::string> known;
    if (word.starts_with("--")) {
      for (const CLI::Option* option : command->get_options())
        for (const std::string& long_name : option->get_lnames()) known.push_back("--" + long_name);
      const std::string option = word.substr(0, word.find('='));
      if (std::find(known.begin(), known.end(), option) == known.end())
        return told(option, "option of " + name, known, name.c_str());
      continue;
    }
    const std::vector<const CLI::App*> commands = command->get_subcommands({});
    if (word.starts_with("-") || commands.empty()) continue;
    for (const CLI::App* one : commands) known.push_back(one->get_name());
    const auto found = std::find(known.begin(), known.end(), word);
    if (found == known.end()) return told(word, "command of " + name, known, name.c_str());
    command = commands[std::size_t(found - known.begin())];
    name += " " + word;
  }
  return "";
}

Outcome manual(const CLI::App& program, const std::vector<std::string>& words) {
  const std::string wanted = words.empty() ? "limber" : fmt::format("limber {}", fmt::join(words, " "));
  std::vector<std::string> known;
  for (const CLI::App* command : all_commands(program)) {
    if (full_name(*command) == wanted) {
      const std::string page = manual_of(program, *command);
      return {exit_done, {{"page", page}}, page};
    }
    known.push_back(full_name(*command));
  }
  const std::string meant = nearest(wanted, known);
  throw InputError(fmt::format("{} is no command; {}", wanted,
                               meant.empty() ? "see limber --help" : "did you mean " + meant + "?"));
}

Outcome write_manual(const CLI::App& program, const fs::path& folder) {
  make_folder(folder);
  Json files = Json::array();
  for (const CLI::App* command : all_commands(program)) {
    const fs::path file = folder / manual_file(*command);
    write_file(file, manual_of(program, *command));
    files.push_back(file.string());
  }
  return {exit_done, {{"pages", files}}, fmt::format("{}: {} pages\n", folder.string(), files.size())};
}

int report_failure(int code, const std::string& what, bool json) {
  log::warn("limber: {}", what);
  events::tell({{"event", "end"}, {"exit_code", code}, {"error", what}});
  if (json) fmt::print("{}\n", text_of(Json{{"error", what}, {"exit_code", code}}, 2));
  return code;
}

}  // namespace

int run_command_line(int argc, const char* const* argv) {
  log::set_up(0);
  install_stop_signals();

  CLI::App program{"limber: plans the motion of soft things among soft things, and films it"};
  program.name("limber");
  program.set_version_flag("--version", std::string("limber ") + version);
  program.require_subcommand(1);
  program.footer(
      "Exit codes: 0 done; 1 a defect of limber; 2 bad input or usage; 3 no plan reached the goal (the best "
      "is kept);\n"
      "4 frames failed; 5 the disk failed; 6 some of many models failed; 130 and 143 stopped by a signal, "
      "with all finished work kept.");
  GlobalOptions global;
  detail::BatchOptions batch_options;
  detail::PrepareOptions& prepare_options = batch_options.each;
  std::string format;
  detail::PlanOptions plan_options;
  detail::SimulateOptions simulate_options;
  detail::RenderOptions render_options;
  detail::BenchOptions bench_options;
  fs::path folder;
  detail::VerifyOptions verify_options;
  std::function<Outcome()> chosen;

  CLI::App& prepare_command =
      *program.add_subcommand("prepare", "model → convex shells, enclosing cage, binding, report");
  prepare_command
      .add_option("MODEL", batch_options.models,
                  "a surface model in any format that assimp reads, or - for one on stdin; or many: files, "
                  "folders of models, @LIST (a file with a path a line, @- on stdin)")
      ->required();
  prepare_command
      .add_option(
          "-o,--out", prepare_options.out,
          "folder for surface.ply, shells.obj, cage.msh, binding.npz, contact.npz, report.json; of many "
          "models for bodies, failed, manifest.jsonl, manifest.csv, index.html")
      ->required()
      ->type_name("DIR");
  prepare_command
      .add_option("--shells,--max-convex-hull,--max-hulls", prepare_options.shells,
                  "convex shells, at most; 1 … 1000")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  prepare_command
      .add_option(
          "--concavity", prepare_options.concavity,
          "cut no further below this overshoot, share of the model's diagonal, 0 … 1; 0: only --shells rules")
      ->check(within(0.0, 1.0))
      ->capture_default_str();
  prepare_command
      .add_option("--threshold", prepare_options.threshold,
                  "--concavity in CoACD's unit, half of the longest edge of the model's box, 0 … 1")
      ->check(within(0.0, 1.0));
  prepare_command
      .add_option("--shell-corners,--max-hull-vertices,--max-ch-vertex", prepare_options.corners,
                  "corners of a shell, at most; 8 … 10000")
      ->check(CLI::Range(8, 10000))
      ->capture_default_str();
  prepare_command
      .add_option("--inflate", prepare_options.inflate,
                  "inflate the shells by this share of the model's diagonal, 0 … 1")
      ->check(within(0.0, 1.0))
      ->capture_default_str();
  prepare_command.add_flag(
      "--exact", prepare_options.exact,
      "shells are the exact convex parts of a closed model of at most 2000 triangles, as many "
      "as it takes; --shells and --concavity do not count");
  prepare_command.add_option("--tets", prepare_options.tets, "tets of the cage, about; 60 … 200000")
      ->check(CLI::Range(60, 200000))
      ->capture_default_str();
  prepare_command
      .add_option(
          "--mode", prepare_options.mode,
          "how the cage is made: lattice; fast (not shrunk to the surface); paper (Delaunay of each shell); "
          "conform (CGAL's Mesh_3: follows the surface, does not enclose it)")
      ->check(CLI::IsMember({"lattice", "fast", "paper", "conform"}))
      ->capture_default_str();
  prepare_command
      .add_option("--scale", prepare_options.scale, "metres a file unit, 1e-9 … 1e9; 0.001 for millimetres")
      ->check(within(1e-9, 1e9))
      ->capture_default_str();
  prepare_command.add_flag("--y-up", prepare_options.y_up, "the model has +Y up; turn it to +Z");
  prepare_command.add_flag(
      "--preview", prepare_options.preview,
      "pictures, also of a body that is up to date: preview-shells.png, preview-cage.png, "
      "preview-cut.png, preview-dihedrals.png");
  prepare_command
      .add_option(
          "--export", prepare_options.exports,
          "files for other programs, also of a body that is up to date; any of vtu (ParaView: cage.vtu, "
          "surface.vtu), node (TetGen: cage.node, cage.ele), interp (Vega FEM: cage.veg, surface.interp, "
          "surface.obj), vtk (Drake, Bullet: cage.vtk), inp (Abaqus: cage.inp), urdf, sdf, mjcf (one OBJ a "
          "shell in hulls, mass.json, and body.urdf, body.sdf, or MuJoCo's body.xml and flex.xml), usd "
          "(body.usda: the cage as a soft TetMesh), usd-omni (the same by the names of Omni Physics), sofa "
          "(body.scn)")
      ->type_name("FORMAT[,FORMAT…]")
      ->delimiter(',')
      ->check(CLI::IsMember(detail::export_formats))
      ->allow_extra_args(false);
  prepare_command
      .add_option("--density", prepare_options.density_kg_m3, "kg/m³, of the masses of --export; 1e-6 … 1e6")
      ->check(within(1e-6, 1e6))
      ->capture_default_str();
  prepare_command.add_flag("--picture", prepare_options.picture,
                           "a small one: picture.png; many models have it always");
  prepare_command
      .add_option("--only", prepare_options.only,
                  "make shells alone, or the cage alone with its certificate, and nothing else")
      ->check(CLI::IsMember({"shells", "cage"}));
  prepare_command
      .add_option("--format", format,
                  "of a model on stdin: the ending that its file would have, as glb; OBJ, OFF, PLY and STL "
                  "mostly need none")
      ->check(CLI::Validator(
          [](const std::string& ending) {
            const bool plain =
                !ending.empty() && ending.size() <= 10 &&
                std::all_of(ending.begin(), ending.end(), [](unsigned char c) { return std::isalnum(c); });
            return plain ? "" : "is no ending of a file; write for example stl";
          },
          "ENDING"));
  prepare_command
      .add_option("--label", prepare_options.label,
                  "of a label map (NIfTI or NRRD): which label, by its number or the name that the file has")
      ->type_name("LABEL");
  prepare_command
      .add_option(
          "--label-gap", prepare_options.label_gap,
          "between surfaces of labels that share a boundary, share of the shortest voxel edge, 0 … 0.6")
      ->check(within(0.0, 0.6))
      ->capture_default_str();
  prepare_command
      .add_option("--label-smoothing", prepare_options.label_rounds,
                  "rounds in which a label's surface is smoothed, 0 … 1000")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  prepare_command
      .add_option("--least-island", prepare_options.min_island,
                  "voxels; pieces of a label that have fewer are left out, 0 … 1e9")
      ->check(within(0.0, 1e9))
      ->capture_default_str();
  add_store(prepare_command, prepare_options.store, "none, or of many models store in -o");
  std::vector<CLI::Option*> of_many{
      prepare_command
          .add_option("--jobs", batch_options.jobs,
                      "of many models: so many at once, 0 … 256; 0: as many as --threads. Results do not "
                      "depend on it")
          ->check(CLI::Range(0, 256))
          ->capture_default_str(),
      prepare_command
          .add_option(
              "--time-limit", batch_options.time_limit_s,
              "of many models: CPU time that each may take, 1 s … 30 days: 30, 30s, 5min or 1h; by the "
              "clock five times that")
          ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}},
                                            CLI::AsNumberWithUnit::DEFAULT, "s|min|h"))
          ->check(within(1, 30 * 86400.0))
          ->capture_default_str(),
      prepare_command
          .add_option(
              "--memory-limit", batch_options.memory_mb,
              "of many models: memory that each may take, 100 MB … 1 PB: 4000, 4000MB or 4GB; default: "
              "three quarters of the machine's, shared by the jobs")
          ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"MB", 1}, {"GB", 1000}},
                                            CLI::AsNumberWithUnit::DEFAULT, "MB|GB"))
          ->check(within(100, 1e9)),
      prepare_command.add_flag("--retry-failed", batch_options.retry_failed,
                               "of many models: try those again, too, that failed before and are the same")};
  add_global(prepare_command, global), add_threads(prepare_command, global),
      add_progress(prepare_command, global);
  prepare_command.callback([&] {
    chosen = [&] {
      const std::vector<std::string>& models = batch_options.models;
      if (models.size() > 1 || detail::is_of_many(models.front())) {
        if (!format.empty())
          throw InputError("--format is of a model on stdin; leave it out, files are named by their endings");
        return cli::prepare_many(batch_options);
      }
      for (const CLI::Option* option : of_many)
        if (option->count() > 0)
          throw InputError(
              fmt::format("{} is of many models, and {} is one; leave it out, or name a folder, a "
                          "list or more models",
                          option->get_name(), models.front()));
      prepare_options.model = models.front();
      return cli::prepare(prepare_options, format);
    };
  });

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
  render_command.add_option("DIR", render_options.folder, "work folder with a plan; with --still a scene")
      ->required();
  add_render(render_command, render_options);
  render_command
      .add_option("--set", render_options.sets,
                  "edit how it is filmed: film.KEY=VALUE, camera.KEY=VALUE, bodies.NAME.color=… (also "
                  "opacity, look, roughness, metallic, deformation)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  bool still = false;
  detail::StillOptions still_options;
  CLI::Option* const still_flag = render_command.add_flag(
      "--still", still, "paint the start of a scene, a file or a name, before any plan: one PNG");
  bool watch = false;
  CLI::Option* const watch_flag =
      render_command
          .add_flag("--watch", watch,
                    "of --still: paint it anew whenever the scene, or a model of it, is edited, until Ctrl-C")
          ->needs(still_flag);
  render_command
      .add_option("-o,--out", still_options.out, "of --still: the picture; default: the scene's name.png")
      ->type_name("FILE.png")
      ->needs(still_flag);
  render_command
      .add_option("--data", still_options.scene.data,
                  "of --still: a folder in which model files of the scene are looked for first")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->allow_extra_args(false)
      ->needs(still_flag);
  render_command.add_flag("--resume", render_options.resume,
                          "keep frames that already show what they should");
  add_global(render_command, global), add_threads(render_command, global),
      add_progress(render_command, global);
  watch_flag->excludes(render_command.get_option("--json"));
  for (const char* of_a_film : {"--frames", "--chunk", "--passes", "--bits", "--as", "--video", "--resume"})
    still_flag->excludes(of_a_film);
  render_command.callback([&] {
    chosen = [&] {
      if (!still) return cli::render(render_options);
      still_options.scene.scene = render_options.folder.string();
      still_options.scene.sets = render_options.sets;
      still_options.camera = render_options.camera, still_options.size = render_options.size;
      return watch ? cli::watch_still(still_options) : cli::render_still(still_options);
    };
  });

  detail::ExportOptions export_options;
  CLI::App& export_command =
      *program.add_subcommand("export", "path → files for viewers, Blender, USD programs and ParaView");
  export_command.add_option("DIR", export_options.folder, "work folder with a plan")->required();
  export_command
      .add_option(
          "--format", export_options.formats,
          "any of gltf (motion.glb), pc2 (pc2/: OBJ and point caches for Blender), usd (motion.usda), "
          "vtu (vtu/: cages and surfaces for ParaView)")
      ->required()
      ->type_name("FORMAT[,FORMAT…]")
      ->delimiter(',')
      ->check(CLI::IsMember(detail::motion_formats))
      ->allow_extra_args(false);
  export_command
      .add_option("-o,--out", export_options.out, "folder for them; default: export in the work folder")
      ->type_name("DIR");
  export_command
      .add_option("--frames", export_options.frames,
                  "frames to export: 0-300:2; beyond the last is left out with a warning; default: all")
      ->check(no_empty_list());
  add_global(export_command, global);
  export_command.callback([&] { chosen = [&] { return cli::export_motion(export_options); }; });

  CLI::App& run_command =
      *program.add_subcommand("run", "all of it: prepare, plan, render; what is up to date is skipped");
  add_scene(run_command, plan_options.scene), add_plan(run_command, plan_options),
      add_shortcut(run_command, plan_options), add_render(run_command, render_options);
  add_global(run_command, global), add_threads(run_command, global), add_progress(run_command, global);
  run_command.callback([&] { chosen = [&] { return cli::run(plan_options, render_options); }; });

  CLI::App& bench_command = *program.add_subcommand(
      "bench", "many runs: scenes × seeds × presets → a record a run, a table; what is done is skipped");
  add_bench(bench_command, bench_options);
  add_global(bench_command, global), add_threads(bench_command, global), add_progress(bench_command, global);
  bench_command.callback([&] { chosen = [&] { return cli::bench(bench_options); }; });

  CLI::App& verify_command =
      *program.add_subcommand("verify", "replays the plan bit for bit, checks every promise, prints a table");
  verify_command.add_option("DIR", verify_options.folder, "work folder, or the output folder of prepare")
      ->required();
  add_global(verify_command, global), add_threads(verify_command, global);
  verify_command
      .add_option(
          "--observables", verify_options.observables,
          "also write, for each frame of the path: of each body volume, strain, energies and contact force, "
          "the strongest contact and the deepest penetration")
      ->type_name("FILE.csv");
  verify_command
      .add_option(
          "--scene", verify_options.scene.scene,
          "the scene that the plan must be of, to the letter, with these --set; its models are looked "
          "for beside it and in --data, and must be found")
      ->type_name("SCENE");
  add_edits(verify_command, verify_options.scene.sets, verify_options.scene.data);
  verify_command.add_flag("--remake", verify_options.remake,
                          "make the convex shells of large bodies (over 20,000 triangles) again, too, and "
                          "compare; else they are only checked against what shells must be");
  verify_command.callback([&] { chosen = [&] { return cli::verify(verify_options); }; });

  std::optional<fs::path> page;
  CLI::App& report_command = *program.add_subcommand(
      "report", "one HTML page with the motion to play, plots, promises, tree, scene and timings");
  report_command.add_option("DIR", folder, "work folder with a plan")->required();
  report_command.add_option("-o,--out", page, "the page; default: report.html in the work folder")
      ->type_name("FILE.html");
  add_global(report_command, global), add_threads(report_command, global);
  report_command.callback([&] { chosen = [&] { return cli::report(folder, page); }; });

  detail::RobustOptions robust_options;
  CLI::App& robust_command = *program.add_subcommand(
      "robust", "replays the plan with other materials and forces, and reports how often it still works");
  robust_command.add_option("DIR", robust_options.folder, "work folder with a plan")->required();
  robust_command
      .add_option("-n,--perturbations", robust_options.perturbations,
                  "replays, 1 … 10000, in at most four worlds of other materials")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  robust_command.add_option("--seed", robust_options.seed, "seed of the perturbations, 0 … 2^53")
      ->check(within(0.0, 0x1p53))
      ->capture_default_str();
  robust_command
      .add_option("--materials", robust_options.material_share,
                  "Young's modulus, density and friction of each body change by up to this share, 0 … 0.9")
      ->check(within(0.0, 0.9))
      ->capture_default_str();
  robust_command
      .add_option("--forces", robust_options.force_share,
                  "each control's force changes by up to this share, 0 … 0.9")
      ->check(within(0.0, 0.9))
      ->capture_default_str();
  robust_command
      .add_option("--turn", robust_options.force_deg, "and is turned by up to so many degrees, 0 … 90")
      ->check(within(0.0, 90.0))
      ->capture_default_str();
  robust_command.add_flag("--follow", robust_options.follow,
                          "also follow the plan's path by feedback in the same worlds under the same errors");
  add_global(robust_command, global), add_threads(robust_command, global);
  robust_command.callback([&] { chosen = [&] { return cli::robust(robust_options); }; });

  detail::RefineOptions refine_options;
  CLI::App& refine_command =
      *program.add_subcommand("refine", "carries a plan to finer cages of the same bodies");
  refine_command.add_option("DIR", refine_options.folder, "work folder with a plan that reaches the goal")
      ->required();
  refine_command.add_option("-o,--out", refine_options.out, "another work folder, for the finer bodies")
      ->required()
      ->type_name("DIR");
  refine_command
      .add_option(
          "--tets-factor", refine_options.tets_factor,
          "tets of each cage, about, as a multiple of the coarse one's; 0.1 … 1000; 1: only --set counts")
      ->check(within(0.1, 1000.0))
      ->capture_default_str();
  add_edits(refine_command, refine_options.sets, refine_options.data);
  add_store(refine_command, refine_options.store, "none");
  add_limits(refine_command, refine_options);
  add_global(refine_command, global), add_threads(refine_command, global);
  refine_command.callback([&] { chosen = [&] { return cli::refine(refine_options); }; });

  CLI::App& info_command = *program.add_subcommand("info", "what is in a file or folder");
  info_command
      .add_option("PATH", folder,
                  "a work folder, a prepared body, a model, a plan, a cage, a binding, a scene")
      ->required();
  add_global(info_command, global);
  info_command.callback([&] { chosen = [&] { return info(folder); }; });

  detail::NewSceneOptions new_options;
  CLI::App& scene_command = *program.add_subcommand("scene", "makes scene files, and checks them");
  scene_command.require_subcommand(1);
  CLI::App& new_command = *scene_command.add_subcommand(
      "new", "a scene to begin with, from models in one frame, a scan or an atlas");
  new_command
      .add_option("--from", new_options.from,
                  "folder of models, as heart.obj, lung_left.obj, skin.obj; or a label map (NIfTI, NRRD); or "
                  "BodyParts3D's folder with its tables")
      ->required()
      ->type_name("DIR|FILE")
      ->check(CLI::ExistingPath);
  new_command
      .add_option("--labels", new_options.labels,
                  "names of the label map's labels: a JSON file, {\"5\": \"liver\"} or {\"liver\": 5}")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  new_command.add_option("-o,--out", new_options.out, "scene file to write")->required()->type_name("FILE");
  new_command.add_option("--robot", new_options.robot, "the model that is to move")
      ->required()
      ->type_name("NAME");
  const auto names = [&](const char* flag, std::vector<std::string>& list, const char* meaning) {
    new_command.add_option(flag, list, meaning)
        ->type_name("NAME[,NAME…]")
        ->delimiter(',')
        ->allow_extra_args(false);
  };
  names("--only", new_options.only, "take these models alone (of an atlas: names or FMA ids); default: all");
  names("--see-through", new_options.see_through,
        "only seen, and seen through, besides those called skin, body, ribcage");
  names("--rigid", new_options.rigid,
        "bones, besides those called spine, rib, skull, vertebra, femur, … (docs/imaging.md)");
  new_command.add_option("--scale", new_options.scale, "metres a file unit, 1e-9 … 1e9")
      ->check(within(1e-9, 1e9))
      ->capture_default_str();
  new_command
      .add_option("--shrink", new_options.shrink,
                  "largest share of its true size that an organ may have, 0.3 … 1; as much less as it takes "
                  "to part them")
      ->check(within(0.3, 1.0))
      ->capture_default_str();
  new_command
      .add_option("--goal", new_options.goal,
                  "where the robot goes, past all that lies that way: front, back, left, right (the body's), "
                  "up, down")
      ->check(CLI::IsMember({"front", "back", "left", "right", "up", "down"}))
      ->capture_default_str();
  new_command
      .add_option("--tets", new_options.tets, "of each soft cage, about; 60 … 20000; more fit more closely")
      ->check(CLI::Range(60, 20000))
      ->capture_default_str();
  for (const auto& [flag, axis, meaning] :
       {std::tuple("--up", &new_options.up, "the models' axis that points up"),
        {"--front", &new_options.front, "and to the front"}})
    new_command.add_option(flag, *axis, meaning)
        ->check(CLI::IsMember({"+x", "-x", "+y", "-y", "+z", "-z"}))
        ->capture_default_str();
  add_global(new_command, global);
  new_command.callback([&] { chosen = [&] { return cli::new_scene(new_options); }; });

  detail::ScenePrepareOptions scene_prepare_options;
  CLI::App& scene_prepare_command = *scene_command.add_subcommand(
      "prepare", "the bodies of a scene in its work folder, as plan and run would make them first");
  add_scene(scene_prepare_command, scene_prepare_options.scene);
  scene_prepare_command
      .add_option("-o,--out", scene_prepare_options.out, "work folder; it is made where it is missing")
      ->required()
      ->type_name("DIR");
  scene_prepare_command
      .add_option("--body", scene_prepare_options.bodies,
                  "these alone, as one of several machines that share the folder; default: all, and scenery")
      ->type_name("NAME[,NAME…]")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_global(scene_prepare_command, global), add_threads(scene_prepare_command, global);
  scene_prepare_command.callback([&] { chosen = [&] { return cli::prepare_scene(scene_prepare_options); }; });

  detail::SceneCheckOptions check_options;
  CLI::App& check_command = *scene_command.add_subcommand(
      "check", "loads a scene and its models, and says what can be said before it is planned");
  add_scene(check_command, check_options.scene);
  check_command.add_option("--preset", check_options.preset, "as of limber plan; default: the scene's")
      ->check(CLI::IsMember({"paper", "fast"}));
  check_command
      .add_option("--work", check_options.work,
                  "also prepare the bodies in this work folder (limber plan -o DIR finds them there), build "
                  "their world, and try a search of at most 64 iterations and 10 s")
      ->type_name("DIR");
  check_command.add_option("-o,--still", check_options.still, "paint the start into this file")
      ->type_name("FILE.png");
  check_command.add_option("--camera", check_options.camera, "of the still, one of the scene's cameras")
      ->capture_default_str();
  check_command
      .add_option("--size", check_options.size,
                  "pixels of the still, 16x16 … 8192x8192; default: the scene's")
      ->type_name("WxH");
  add_global(check_command, global), add_threads(check_command, global);
  check_command.callback([&] { chosen = [&] { return cli::check_scene(check_options); }; });

  CLI::App& scenes_command = *program.add_subcommand("scenes", "the scenes that come with limber");
  add_global(scenes_command, global);
  scenes_command.callback([&] { chosen = [] { return list_scenes(); }; });

  CLI::App& completion_command =
      *program.add_subcommand("completion", "a script by which a shell completes limber's words");
  std::string shell;
  completion_command.add_option("SHELL", shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember(shells_completed));
  add_global(completion_command, global);
  completion_command.callback([&] {
    chosen = [&] {
      const std::string script = completion_of(program, shell);
      return Outcome{exit_done, {{"script", script}}, script};
    };
  });

  CLI::App& man_command = *program.add_subcommand("man", "a page of the manual, for man -l -");
  std::vector<std::string> command_words;
  fs::path pages;
  man_command.add_option("COMMAND", command_words, "as plan, or scene new; none: of limber itself");
  man_command.add_option("-o,--out", pages, "write all pages into this folder")->type_name("DIR");
  add_global(man_command, global);
  man_command.callback([&] {
    chosen = [&] { return pages.empty() ? manual(program, command_words) : write_manual(program, pages); };
  });

  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool wrong = error.get_exit_code() != int(CLI::ExitCodes::Success);
    const std::string meant = wrong ? misspelt(program, argc, argv) : "";
    if (meant.empty())
      program.exit(error);
    else
      fmt::print(stderr, "limber: {}\n", meant);
    if (!wrong) return exit_done;
    const bool json = std::any_of(argv, argv + argc, [](std::string_view word) { return word == "--json"; });
    if (json)
      fmt::print(
          "{}\n",
          text_of(Json{{"error", meant.empty() ? error.what() : meant}, {"exit_code", exit_bad_input}}, 2));
    return exit_bad_input;
  }

  log::set_up(global.quiet ? -1 : global.verbose ? 1 : 0);
  if (global.quiet) set_progress_enabled(false);
  set_thread_count(global.threads);
  try {
    events::set_up(global.progress);
    const Outcome outcome = chosen();
    events::tell({{"event", "end"}, {"exit_code", outcome.exit_code}});
    print(outcome, global.json);
    return outcome.exit_code;
  } catch (const InputError& error) {
    return report_failure(exit_bad_input, error.what(), global.json);
  } catch (const DiskError& error) {
    return report_failure(exit_disk, error.what(), global.json);
  } catch (const Interrupted& stop) {
    return report_failure(exit_signal + stop.signal_number, stop.what(), global.json);
  } catch (const fs::filesystem_error& error) {  // where it may not even be asked what is there
    return report_failure(exit_disk, fmt::format("{}: {}", error.path1().string(), error.code().message()),
                          global.json);
  } catch (const std::bad_alloc&) {
    return report_failure(exit_bad_input, detail::not_enough_memory, global.json);
  } catch (const std::exception& error) {
    return report_failure(exit_defect, fmt::format("this is a defect of limber: {}", error.what()),
                          global.json);
  }
}

}  // namespace limber::cli
