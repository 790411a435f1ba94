#include "app/body.h"
#include "app/commands.h"
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
  const Json report = prepare_body(
      source,
      {.shells = options.shells, .concavity = options.concavity, .tets = options.tets, .mode = options.mode},
      options.out);
  return {exit_done, report, summary_of_report(report)};
}

}  // namespace limber::app
