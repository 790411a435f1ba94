// What is asked of a work folder when its motion is there: verify, report, robust, refine, info.
//
// All take the scene that is stored in the folder; verify --scene compares it with one that is trusted, and
// refine writes into another folder. info takes any file or folder that limber knows.
#include <CLI/CLI.hpp>

#include "cli/described_commands.h"

namespace limber::cli {

void DescribedCommands::add_result_commands() {
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
      .add_option("--model", verify_options.model,
                  "of a body: the model that it must be of, read again as it was (scale, axes, label)")
      ->type_name("MODEL")
      ->check(CLI::ExistingFile);
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
  CLI::Option* const film =
      verify_command.add_flag("--film", verify_options.film,
                              "films, too: every frame says what it shows, some are painted again, film and "
                              "contact sheet are made again from the frames");
  verify_command
      .add_option(
          "--repaint", verify_options.repaint,
          "frames of each film that --film paints again, one of each of so many equal parts, 1 … 1000000")
      ->needs(film)
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  verify_command.callback([&] { chosen = [&] { return cli::verify(verify_options); }; });

  CLI::App& report_command = *program.add_subcommand(
      "report", "one HTML page with the motion to play, plots, promises, tree, scene and timings");
  report_command.add_option("DIR", folder, "work folder with a plan")->required();
  report_command.add_option("-o,--out", page, "the page; default: report.html in the work folder")
      ->type_name("FILE.html");
  add_global(report_command, global), add_threads(report_command, global);
  report_command.callback([&] { chosen = [&] { return cli::report(folder, page); }; });

  CLI::App& robust_command = *program.add_subcommand(
      "robust", "replays the plan with other materials and forces, and reports how often it still works");
  robust_command.add_option("DIR", robust_options.folder, "work folder with a plan")->required();
  robust_command.add_option("-n,--perturbations", robust_options.perturbations, "replays, 1 … 10000")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  robust_command.add_option("--seed", robust_options.seed, "seed of the perturbations, 0 … 2^53")
      ->check(whole_number())
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
  robust_command
      .add_option(
          "--replan", robust_options.replan_s,
          "also follow it and look ahead every so many seconds of the motion, 0.01 … 60: where following "
          "would not do, a new plan from the state reached takes its place")
      ->check(within(0.01, 60.0))
      ->type_name("SECONDS");
  robust_command
      .add_option("--worlds", robust_options.worlds, "so many worlds of other materials at most, 1 … 10000")
      ->check(within(1, 10'000))
      ->capture_default_str();
  add_global(robust_command, global), add_threads(robust_command, global);
  robust_command.callback([&] { chosen = [&] { return cli::robust(robust_options); }; });

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
}

}  // namespace limber::cli
