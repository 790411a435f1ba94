// Options that several commands have, each described once: its name, unit, range, default and meaning, as
// help, manual and completion tell them (docs/cli.md). CLI11 itself stays in .cpp files, for it is slow to
// compile; so does add_limits(), which is instantiated for the three kinds of options that have limits.
#pragma once

#include <string>
#include <vector>

#include "cli/commands.h"

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace limber::cli {

// Of the program, whatever the command.
struct GlobalOptions {
  bool json = false, quiet = false, verbose = false;
  std::string progress;
  int threads = 0;
};

// CLI::Range, which takes nan.
CLI::Validator within(double low, double high);
// Up to 2^53, beyond which JSON has not all.
CLI::Validator whole_number();
// A duration with or without its unit, to seconds.
CLI::Validator seconds();
// A variable that a farm's script has not set must not mean all.
CLI::Validator no_empty_list();
CLI::Validator no_empty_name();

void add_global(CLI::App& command, GlobalOptions&);
void add_threads(CLI::App& command, GlobalOptions&);
void add_progress(CLI::App& command, GlobalOptions&);
void add_edits(CLI::App& command, std::vector<std::string>& sets, std::vector<fs::path>& data);
// `otherwise`: what is told of the default.
void add_store(CLI::App& command, fs::path& store, const char* otherwise);
// How surfaces of a label map's labels are made.
void add_label_surfaces(CLI::App& command, double& gap, int& rounds, double& min_island);
// A scene by file or name, its edits, and the store of its bodies.
void add_scene(CLI::App& command, SceneSource&);
// Of one search: PlanOptions, BenchOptions or RefineOptions.
template <class Options>
void add_limits(CLI::App& command, Options&);
// What a body is to be.
void add_body_options(CLI::App& command, ModelOptions&);
// Of each of many models: its time and memory, and whether it is tried again.
std::vector<CLI::Option*> add_model_limits(CLI::App& command, BatchOptions&);
// Runs of a benchmark.
void add_runs(CLI::App& command, BenchOptions&);

}  // namespace limber::cli
