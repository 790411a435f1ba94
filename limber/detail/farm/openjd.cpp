// The template as openjobdescription.org, 2023-09, has it: a step a stage, a task a worker.
#include <fmt/format.h>

#include "core/json_text.h"
#include "core/process.h"
#include "limber/detail/farm/engines.h"

namespace limber::detail {

namespace {

// A text of JSON is one of YAML.
std::string yaml_text(const std::string& text) { return text_of(Json(text)); }

std::string step(const std::string& name, Stage until, std::size_t workers, const std::string& after,
                 bool is_last) {
  std::string text = fmt::format("  - name: {}\n", name);
  if (!after.empty()) text += fmt::format("    dependencies:\n      - dependsOn: {}\n", after);
  text += fmt::format(
      "    parameterSpace:\n"
      "      taskParameterDefinitions:\n"
      "        - name: Worker\n"
      "          type: INT\n"
      "          range: \"1-{}\"\n"
      "    script:\n"
      "      actions:\n"
      "        onRun:\n"
      "          command: \"{{{{Param.Limber}}}}\"\n"
      "          args: [farm, work, \"{{{{Param.Folder}}}}\", --until, {}, --threads, "
      "\"{{{{Param.Threads}}}}\"{}]\n"
      "          cancelation:\n"
      "            mode: NOTIFY_THEN_TERMINATE\n"
      "            notifyPeriodInSeconds: 60\n",
      workers, name_of(until), is_last ? ", --wait" : "");
  return text;
}

std::string steps_of(const FarmFolder& farm) {
  const FarmOptions& options = farm.spec().options;
  const auto at_most = [&](std::size_t units) { return std::min(units, std::size_t(options.workers)); };
  std::string text, before;
  const auto add = [&](const char* name, Stage until, std::size_t workers) {
    if (until > options.until) return;
    text += step(name, until, workers, before, false);
    before = name;
  };
  if (options.batch) {
    add("Models", Stage::models, at_most(farm.units(Stage::models).size()));
    return text + step("Last", options.until, 1, before, true);
  }
  add("Bodies", Stage::bodies, at_most(farm.units(Stage::bodies).size()));
  if (options.bench) {
    add("Runs", Stage::runs, at_most(farm.units(Stage::runs).size()));
  } else {
    add("Plan", Stage::plan, at_most(farm.units(Stage::search).size()));
    add("Frames", Stage::frames, std::size_t(options.workers));
  }
  return text + step("Last", options.until, 1, before, true);
}

}  // namespace

std::string openjd_template(const FarmFolder& farm) {
  const FarmOptions& options = farm.spec().options;
  return fmt::format(
             "# Written by limber farm submit. Each task is a worker of a folder that all machines see.\n"
             "specificationVersion: jobtemplate-2023-09\n"
             "name: {}\n"
             "parameterDefinitions:\n"
             "  - name: Folder\n"
             "    type: PATH\n"
             "    objectType: DIRECTORY\n"
             "    dataFlow: NONE\n"
             "    default: {}\n"
             "    description: \"the work folder, which all machines see\"\n"
             "  - name: Limber\n"
             "    type: STRING\n"
             "    default: {}\n"
             "    description: \"the program, the same file on all machines\"\n"
             "  - name: Threads\n"
             "    type: INT\n"
             "    default: {}\n"
             "    minValue: 1\n"
             "steps:\n",
             yaml_text(("limber " + farm.work().filename().string()).substr(0, 64)),
             yaml_text(farm.work().string()), yaml_text(program_file().string()), options.threads) +
         steps_of(farm);
}

}  // namespace limber::detail
