// prepare: one model, or many (docs/cli.md, docs/batch.md). Which it is shows only when all words are there,
// so the options of many models are kept in a list: with one model each of them is refused by its name, and
// with many --format is, so that nothing is passed over in silence.
#include <CLI/CLI.hpp>

#include <algorithm>

#include "cli/described_commands.h"
#include "core/error.h"

namespace limber::cli {

void add_body_options(CLI::App& command, ModelOptions& options) {
  command
      .add_option("--shells,--max-convex-hull,--max-hulls", options.shells,
                  "convex shells, at most; 1 … 1000")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      .add_option(
          "--concavity", options.concavity,
          "cut no further below this overshoot, share of the model's diagonal, 0 … 1; 0: only --shells rules")
      ->check(within(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--threshold", options.threshold,
                  "--concavity in CoACD's unit, half of the longest edge of the model's box, 0 … 1")
      ->check(within(0.0, 1.0));
  command
      .add_option("--shell-corners,--max-hull-vertices,--max-ch-vertex", options.max_hull_vertices,
                  "corners of a shell, at most; 8 … 10000")
      ->check(CLI::Range(8, 10000))
      ->capture_default_str();
  command
      .add_option("--inflate", options.inflate,
                  "inflate the shells by this share of the model's diagonal, 0 … 1")
      ->check(within(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("--exact", options.exact,
                   "shells are the exact convex parts of a closed model of at most 2000 triangles, as many "
                   "as it takes; --shells and --concavity do not count");
  command.add_option("--tets", options.tets, "tets of the cage, about; 24 … 200000")
      ->check(CLI::Range(24, 200000))
      ->capture_default_str();
  command
      .add_option(
          "--mode", options.mode,
          "how the cage is made: lattice; fast (not shrunk to the surface); paper (Delaunay of each shell); "
          "conform (CGAL's Mesh_3: follows the surface, does not enclose it)")
      ->check(CLI::IsMember({"lattice", "fast", "paper", "conform"}))
      ->capture_default_str();
  command.add_option("--scale", options.scale, "metres a file unit, 1e-9 … 1e9; 0.001 for millimetres")
      ->check(within(1e-9, 1e9))
      ->capture_default_str();
  command.add_flag("--y-up", options.y_up, "the model has +Y up; turn it to +Z");
  command.add_flag("--preview", options.preview,
                   "pictures, also of a body that is up to date: preview-shells.png, preview-cage.png, "
                   "preview-cut.png, preview-dihedrals.png");
  command
      .add_option(
          "--export", options.exports,
          "files for other programs, also of a body that is up to date; any of vtu (ParaView: cage.vtu, "
          "surface.vtu), node (TetGen: cage.node, cage.ele), interp (Vega FEM: cage.veg, surface.interp, "
          "surface.obj), vtk (Drake, Bullet: cage.vtk), inp (Abaqus: cage.inp), urdf, sdf, mjcf (one OBJ a "
          "shell in hulls, mass.json, and body.urdf, body.sdf, or MuJoCo's body.xml and flex.xml), usd "
          "(body.usda: the cage as a soft TetMesh), usd-omni (the same by the names of Omni Physics), sofa "
          "(body.scn); with -interior behind it of a cage without tets that have all nodes on the boundary")
      ->type_name("FORMAT[,FORMAT…]")
      ->delimiter(',')
      ->check(CLI::IsMember(export_formats))
      ->allow_extra_args(false);
  command.add_option("--density", options.density_kg_m3, "kg/m³, of the masses of --export; 1e-6 … 1e6")
      ->check(within(1e-6, 1e6))
      ->capture_default_str();
  command
      .add_option("--only", options.only,
                  "make shells alone, or the cage alone with its certificate, and nothing else")
      ->check(CLI::IsMember({"shells", "cage"}));
  command
      .add_option("--label", options.label,
                  "of a label map (NIfTI or NRRD): which label, by its number or the name that the file has")
      ->type_name("LABEL");
  add_label_surfaces(command, options.label_gap, options.label_rounds, options.min_island);
}

std::vector<CLI::Option*> add_model_limits(CLI::App& command, BatchOptions& options) {
  return {
      command
          .add_option(
              "--time-limit", options.time_limit_s,
              "of many models: CPU time that each may take, 1 s … 30 days: 30, 30s, 5min or 1h; by the "
              "clock five times that")
          ->transform(seconds())
          ->check(within(1, 30 * 86400.0))
          ->capture_default_str(),
      command
          .add_option(
              "--memory-limit", options.memory_mb,
              "of many models: memory that each may take, 100 MB … 1 PB: 4000, 4000MB or 4GB; default: "
              "three quarters of the machine's, shared by the jobs, on a farm by the cores of the one that "
              "submits")
          ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"MB", 1}, {"GB", 1000}},
                                            CLI::AsNumberWithUnit::DEFAULT, "MB|GB"))
          ->check(within(100, 1e9)),
      command.add_flag("--retry-failed", options.retry_failed,
                       "of many models: try those again, too, that failed before and are the same")};
}

void DescribedCommands::add_prepare_command() {
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
  add_body_options(prepare_command, prepare_options);
  prepare_command.add_flag("--picture", prepare_options.picture,
                           "a small one: picture.png; many models have it always");
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
  add_store(prepare_command, prepare_options.store, "none, or of many models store in -o");
  of_many = add_model_limits(prepare_command, batch_options);
  of_many.push_back(
      prepare_command
          .add_option("--jobs", batch_options.jobs,
                      "of many models: so many at once, 0 … 256; 0: as many as --threads. Results do not "
                      "depend on it")
          ->check(CLI::Range(0, 256))
          ->capture_default_str());
  add_global(prepare_command, global), add_threads(prepare_command, global),
      add_progress(prepare_command, global);
  prepare_command.callback([&] {
    chosen = [&] {
      const std::vector<std::string>& models = batch_options.models;
      if (models.size() > 1 || is_of_many(models.front())) {
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
}

}  // namespace limber::cli
