// All commands as the parser knows them: their options, and what each does when it is chosen.
//
// The options of all commands live here while the words are parsed, for the parser writes into them. The
// command that was given sets `chosen`; nothing is done before all words are understood. Commands are added
// in the order in which help and manual list them.
#pragma once

#include <functional>

#include "cli/command_options.h"

namespace limber::cli {

struct DescribedCommands {
  explicit DescribedCommands(CLI::App& app) : program(app) {}
  DescribedCommands(const DescribedCommands&) = delete;  // the parser holds pointers into it
  DescribedCommands& operator=(const DescribedCommands&) = delete;

  void add_all() {
    add_prepare_command();
    add_motion_commands();
    add_farm_commands();
    add_result_commands();
    add_scene_commands();
    add_word_commands();
  }

  CLI::App& program;
  GlobalOptions global;
  std::function<Outcome()> chosen;  // what the command that was given does

 private:
  void add_prepare_command();  // prepare. cli/prepare_command.cpp
  void add_motion_commands();  // plan, simulate, render, export, run, bench. cli/motion_commands.cpp
  void add_farm_commands();    // farm submit, bench, prepare, status, cancel, work. cli/farm_commands.cpp
  void add_result_commands();  // verify, report, robust, refine, info. cli/result_commands.cpp
  void add_scene_commands();   // scene new, prepare, check; scenes. cli/scene_commands.cpp
  void add_word_commands();    // completion, man. cli/word_commands.cpp

  BatchOptions batch_options;
  ModelOptions& prepare_options = batch_options.each;
  std::string format;                 // of a model on stdin
  std::vector<CLI::Option*> of_many;  // options of prepare that one model has no use for
  PlanOptions plan_options;           // plan and run
  SimulateOptions simulate_options;
  FilmOptions film_options;  // render and run
  bool still = false, storyboard = false, watch = false;
  StillOptions still_options;
  ExportOptions export_options;
  double export_density_kg_m3 = BodyExportOptions{}.density_kg_m3;
  BenchOptions bench_options;
  FarmOptions farm_options;
  WorkOptions work_options;
  std::string farm_until = "report";  // submit
  std::string work_until;
  fs::path folder;  // render, report, info, farm status and cancel
  VerifyOptions verify_options;
  std::optional<fs::path> page;
  RobustOptions robust_options;
  RefineOptions refine_options;
  NewSceneOptions new_options;
  ScenePrepareOptions scene_prepare_options;
  SceneCheckOptions check_options;
  std::string shell;
  std::vector<std::string> command_words;
  fs::path pages;
};

}  // namespace limber::cli
