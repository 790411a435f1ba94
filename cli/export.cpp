#include <fmt/ranges.h>

#include "cli/commands.h"
#include "core/json_fields.h"

namespace limber::cli {

Outcome export_motion(const ExportOptions& options) {
  const ExportedMotion exported = limber::export_motion(options, at_terminal());
  std::string text = fmt::format("{} of {} frames, {} bodies\n", exported.frames.size(),
                                 exported.frames_of_motion, exported.bodies.size());
  for (const auto& [format, written] : exported.formats)
    text += fmt::format("  {:4}  {} ({}{:.2f} MB)\n", format, written.open.string(),
                        written.files > 1 ? fmt::format("{} files, ", written.files) : "",
                        1e-6 * double(written.bytes));
  return {exit_done, json_of_fields(exported), text};
}

Outcome export_body(const BodyExportOptions& options) {
  const ExportedBody exported = limber::export_body(options, at_terminal());
  return {exit_done,
          {{"folder", exported.folder.string()}, {"files", exported.files}},
          fmt::format("{}: {}\n", exported.folder.string(), fmt::join(exported.files, ", "))};
}

}  // namespace limber::cli
