#include <fmt/format.h>

#include "app/body.h"
#include "app/commands.h"
#include "app/export.h"
#include "core/hash.h"

namespace limber::app {

Outcome prepare(const PrepareOptions& options) {
  BodySource source;
  source.model = options.model.string();
  source.identity = {{"file_hash", hex(hash_of(std::string_view(read_file(options.model))))},
                     {"scale", options.scale},
                     {"y_up", options.y_up}};
  source.load = [&] {
    return meshing::import_model(options.model, {.scale = options.scale, .y_up = options.y_up});
  };
  Json report = prepare_body(
      source,
      {.shells = options.shells, .concavity = options.concavity, .tets = options.tets, .mode = options.mode},
      options.out);
  std::string text = summary_of_report(report);
  if (!options.exports.empty()) {
    report["exports"] = export_body(read_body(options.out), options.exports, options.out);
    text += fmt::format("  exports      {}\n",
                        fmt::join(report["exports"].get<std::vector<std::string>>(), ", "));
  }
  return {exit_done, report, text};
}

}  // namespace limber::app
