// The options that several commands have. Ranges are checked here, as the words are parsed: a command never
// sees a value that is out of its range. What depends on more than one word (a frame without --from, options
// of many models for one) is checked where the command is described.
#include "cli/command_options.h"

#include <CLI/CLI.hpp>

#include "core/error.h"

namespace limber::cli {

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

CLI::Validator whole_number() {
  return CLI::Validator(
      [](std::string& text) {
        std::uint64_t value = 0;
        const bool is_whole = CLI::detail::lexical_cast(text, value) && text.front() != '-';
        return is_whole && value <= std::uint64_t(1) << 53
                   ? std::string()
                   : fmt::format("{} is no whole number from 0 to 9007199254740992", text);
      },
      "INT in [0 - 2^53]");
}

CLI::Validator seconds() {
  const CLI::AsNumberWithUnit units(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}},
                                    CLI::AsNumberWithUnit::DEFAULT, "s|min|h");
  return CLI::Validator(
      [units](std::string& text) {
        const std::string given = text;
        try {
          return units(text);
        } catch (const CLI::ValidationError&) {
          return fmt::format("{} is no duration; write 5, 5s, 2min or 1h", given);
        }
      },
      units.get_description());
}

void add_global(CLI::App& command, GlobalOptions& options) {
  command.add_flag("--json", options.json, "print one JSON document on stdout, and nothing else there");
  command.add_flag("-q,--quiet", options.quiet, "only warnings and errors on stderr; no progress bars");
  command.add_flag("-v,--verbose", options.verbose, "more on stderr");
}

void add_label_surfaces(CLI::App& command, double& gap, int& rounds, double& min_island) {
  command
      .add_option(
          "--label-gap", gap,
          "between surfaces of labels that share a boundary, share of the shortest voxel edge, 0 … 0.6")
      ->check(within(0.0, 0.6))
      ->capture_default_str();
  command.add_option("--label-smoothing", rounds, "rounds in which a label's surface is smoothed, 0 … 1000")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  command
      .add_option("--least-island", min_island,
                  "voxels; pieces of a label that have fewer are left out, 0 … 1e9")
      ->check(within(0.0, 1e9))
      ->capture_default_str();
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

CLI::Validator no_empty_name() {
  return {
      [](const std::string& text) { return text.empty() ? "is empty; write a name, or leave --as out" : ""; },
      ""};
}

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

void add_scene(CLI::App& command, SceneSource& options) {
  command
      .add_option("SCENE", options.scene,
                  "a scene file, or the name of a scene that comes with limber (see limber scenes)")
      ->required();
  add_edits(command, options.sets, options.data);
  add_store(command, options.store, "none");
}

template <class Options>
void add_limits(CLI::App& command, Options& options) {
  command
      .add_option("--iterations", options.iterations, "limit of the search, 0 … 1e9; default: the scene's")
      ->check(within(0.0, 1e9));
  command
      .add_option("--time-limit", options.time_limit_s,
                  "wall time of the search: 30, 30s, 5min or 1h; the best so far is kept; default: none")
      ->transform(seconds());
  command
      .add_option("--in-flight", options.in_flight,
                  "expansions computed ahead, 0 … 4096; 0: chosen from threads and lanes. The plan does not "
                  "depend on it")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
}
template void add_limits(CLI::App&, PlanOptions&);
template void add_limits(CLI::App&, BenchOptions&);
template void add_limits(CLI::App&, RefineOptions&);

}  // namespace limber::cli
