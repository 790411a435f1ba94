#include <fmt/ranges.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cli/body_report.h"
#include "cli/commands.h"
#include "core/error.h"
#include "core/file.h"
#include "core/progress.h"

namespace limber::cli {

namespace {

// What comes on stdin, as a file for as long as this lives.
class ModelOnStdin {
 public:
  explicit ModelOnStdin(const std::string& format)
      : file_((fs::temp_directory_path() / "limber-XXXXXX/stdin").string()) {
    std::string folder = file_.parent_path().string();
    if (!::mkdtemp(folder.data()))
      throw DiskError(fmt::format("{}: a folder in it cannot be made: {}", fs::temp_directory_path().string(),
                                  std::strerror(errno)));
    file_ = fs::path(folder) / (format.empty() ? "stdin" : "stdin." + format);
    FileWriter writer(file_);
    char buffer[1 << 16];
    for (ssize_t got; (got = ::read(STDIN_FILENO, buffer, sizeof buffer)) != 0;) {
      throw_if_stopped();
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) throw InputError(fmt::format("stdin: reading failed: {}", std::strerror(errno)));
      writer.append({buffer, std::size_t(got)});
    }
    if (writer.size() == 0) throw InputError("stdin: holds nothing; give a model's bytes, or name a file");
    writer.commit();
  }
  ~ModelOnStdin() {
    std::error_code ignored;
    fs::remove_all(file_.parent_path(), ignored);
  }
  ModelOnStdin(const ModelOnStdin&) = delete;
  ModelOnStdin& operator=(const ModelOnStdin&) = delete;
  const fs::path& file() const { return file_; }

 private:
  fs::path file_;
};

}  // namespace

Outcome prepare(ModelOptions options, const std::string& format) {
  require_agreeing(options);
  std::optional<ModelOnStdin> on_stdin;
  if (options.model == "-")
    options.bytes = on_stdin.emplace(format).file();
  else if (!format.empty())
    throw InputError("--format is of a model on stdin; name the model - or leave it out");
  const PreparedFolder prepared = prepare_folder(options, at_terminal());
  Json report = parse_json(prepared.report_json, "report");
  std::string text = text_of_report(report);
  if (!prepared.also_written.empty()) {
    report["also_written"] = prepared.also_written;
    text += fmt::format("  also         {}\n", fmt::join(prepared.also_written, ", "));
  }
  return {exit_done, report, text};
}

Outcome prepare_many(const BatchOptions& options) {
  const PreparedMany prepared = prepare_models(options, at_terminal());
  const int failed = prepared.failed + prepared.failed_before, done = prepared.models - failed;
  const Json json{{"models", prepared.models},
                  {"done", done},
                  {"made", prepared.made},
                  {"in_store", prepared.in_store},
                  {"up_to_date", prepared.up_to_date},
                  {"failed", failed},
                  {"failed_before", prepared.failed_before},
                  {"reasons", prepared.reasons},
                  {"manifest", prepared.manifest.string()},
                  {"table", prepared.table.string()},
                  {"page", prepared.page.string()}};
  std::string text;
  for (const BatchModel& model : prepared.not_prepared)
    text += fmt::format("{:8} {}: {}\n", model.reason, model.model.name, model.message);
  text += fmt::format("{} models: {} done ({} made, {} from the store, {} up to date), {} failed",
                      prepared.models, done, prepared.made, prepared.in_store, prepared.up_to_date, failed);
  std::vector<std::string> parts;
  for (const auto& [reason, number] : prepared.reasons) parts.push_back(fmt::format("{} {}", number, reason));
  if (prepared.failed_before > 0)
    parts.push_back(fmt::format("{} as before, --retry-failed tries them again", prepared.failed_before));
  if (!parts.empty()) text += fmt::format(" ({})", fmt::join(parts, ", "));
  text += fmt::format("; {}\n", prepared.page.string());
  return {failed > 0 ? exit_models_failed : exit_done, json, text};
}

Outcome prepare_scene(const ScenePrepareOptions& options) {
  const PreparedScene prepared = prepare_scene_bodies(options, at_terminal());
  Json bodies = Json::array();
  std::string text = fmt::format("{}: {} of {} bodies are prepared\n", options.out.string(),
                                 prepared.bodies.size(), prepared.bodies_of_scene);
  for (const PreparedScene::Body& body : prepared.bodies) {
    bodies.push_back({{"body", body.name},
                      {"folder", body.folder.string()},
                      {"triangles", body.triangles},
                      {"tets", body.tets}});
    text += fmt::format("  {:16} {} triangles, {} tets\n", body.name, body.triangles, body.tets);
  }
  return {exit_done, {{"out", options.out.string()}, {"bodies", bodies}}, text};
}

}  // namespace limber::cli
