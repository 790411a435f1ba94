#include <fmt/format.h>

#include "app/body.h"
#include "app/commands.h"
#include "app/export.h"
#include "app/preview.h"
#include "core/hash.h"
#include "core/mesh_files.h"

namespace limber::app {

Outcome prepare(const PrepareOptions& options) {
  BodySource source;
  source.model = options.model.string();
  source.file = options.model;
  source.identity = {{"file_hash", hex(hash_of(std::string_view(read_file(options.model))))},
                     {"scale", options.scale},
                     {"y_up", options.y_up}};
  source.load = [&] {
    return meshing::import_model(options.model, {.scale = options.scale, .y_up = options.y_up});
  };
  Json report = prepare_body(source,
                             {.shells = options.shells,
                              .concavity = options.concavity,
                              .inflate = options.inflate,
                              .exact = options.exact,
                              .tets = options.tets,
                              .mode = options.mode},
                             options.out);
  std::string text = summary_of_report(report);
  if (options.exports.empty() && !options.preview) return {exit_done, report, text};

  const PreparedBody body = read_body(options.out);
  std::vector<std::string> written = export_body(body, options.exports, options.density_kg_m3, options.out);
  if (options.preview) {
    write_previews(body, read_obj_shells(options.out / "shells.obj"), options.out);
    written.insert(written.end(), std::begin(preview_files), std::end(preview_files));
  }
  report["also_written"] = written;
  text += fmt::format("  also         {}\n", fmt::join(written, ", "));
  return {exit_done, report, text};
}

}  // namespace limber::app
