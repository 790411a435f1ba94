#include "limber/detail/body/prepare.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iterator>

#include "core/error.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "imaging/surface_nets.h"
#include "limber/detail/body/export.h"
#include "limber/detail/body/model_content.h"
#include "limber/detail/body/preview.h"

namespace limber::detail {

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

void require_agreeing(const PrepareOptions& options) {
  if (options.concavity > 0 && options.threshold > 0)
    throw InputError("--concavity and --threshold are one bound in two units; leave one out");
  if (!options.only.empty() && (!options.exports.empty() || options.preview))
    throw InputError(
        "--only makes a part of a body, and --preview and --export show a whole one; leave one out");
  if (options.only == "shells" && options.mode != "lattice")
    throw InputError("--only shells makes no cage; leave --mode out");
  if (options.only == "cage" && options.exact)
    throw InputError("--only cage makes no shells; leave --exact out");
}

PrepareSettings settings_of(const PrepareOptions& options) {
  return {.shells = options.shells,
          .concavity = options.concavity,
          .threshold = options.threshold,
          .inflate = options.inflate,
          .exact = options.exact,
          .tets = options.tets,
          .mode = options.mode,
          .corners = options.corners,
          .only = options.only};
}

namespace {

meshing::ImportedModel import_label(const PrepareOptions& options, const fs::path& file) {
  const imaging::LabelMap map = imaging::read_label_map(file);
  const int row = imaging::row_of_label(map, options.label, file.string());
  const std::string what = fmt::format("{}: label {}", file.string(), map.labels[std::size_t(row)]);
  const imaging::LabelSurface label = imaging::surfaces_of(
      map, {row},
      {.gap = options.label_gap, .rounds = options.label_rounds, .least_island = options.least_island})[0];
  if (label.voxels == 0)
    throw InputError(fmt::format("{}: all of its {} pieces, {} voxels in all, are smaller than {:g} voxels",
                                 what, label.islands_dropped, label.voxels_dropped, options.least_island));
  meshing::ImportedModel model = meshing::clean(label.surface, {.scale = options.scale}, what);
  if (label.islands_dropped > 0)
    model.mended.push_back(fmt::format("left out {} pieces of fewer than {:g} voxels, {} voxels in all",
                                       label.islands_dropped, options.least_island, label.voxels_dropped));
  model.warnings.insert(model.warnings.end(), map.notes.begin(), map.notes.end());
  return model;
}

}  // namespace

BodySource source_of(const PrepareOptions& options, const fs::path& file) {
  BodySource source;
  source.model = options.model.string();
  const ModelContent content = content_of_model(file);
  source.content = content.content, source.ending = content.ending;
  source.identity = {{"file_hash", content.file_hash}, {"scale", options.scale}, {"y_up", options.y_up}};
  source.load = [file, scale = options.scale, y_up = options.y_up] {
    return meshing::import_model(file, {.scale = scale, .y_up = y_up});
  };
  if (!imaging::is_label_map(file)) {
    if (!options.label.empty())
      throw InputError(
          fmt::format("{}: is no NIfTI or NRRD file, so it has no labels; leave --label out", file.string()));
    return source;
  }
  if (options.label.empty())
    throw InputError(
        fmt::format("{}: is a label map; choose what is to be prepared with --label, of those that "
                    "limber info {} lists",
                    file.string(), file.string()));
  if (options.y_up)
    throw InputError(fmt::format("{}: a label map says where up is; leave --y-up out", file.string()));
  source.identity["label"] = {{"name", options.label},
                              {"gap", options.label_gap},
                              {"rounds", options.label_rounds},
                              {"least_island", options.least_island}};
  source.load = [options, file] { return import_label(options, file); };
  return source;
}

Outcome prepare(const PrepareOptions& options) {
  require_agreeing(options);
  std::optional<ModelOnStdin> on_stdin;
  if (options.model == "-")
    on_stdin.emplace(options.format);
  else if (!options.format.empty())
    throw InputError("--format is of a model on stdin; name the model - or leave it out");
  std::optional<BodyStore> store;
  if (!options.store.empty()) store.emplace(options.store);

  const BodySource source = source_of(options, on_stdin ? on_stdin->file() : options.model);
  const PrepareSettings settings = settings_of(options);
  Json report = prepare_body(source, settings, options.out, store ? &*store : nullptr);
  std::string text = summary_of_report(report);
  std::vector<std::string> written;
  if (options.picture) {
    if (!has_picture(options.out)) write_picture(options.out);
    if (store) store->keep(BodyStore::key_of(source, report.at("input")), options.out);
    written.push_back(picture_file);
  }
  if (!options.exports.empty() || options.preview) {
    const PreparedBody body = read_body(options.out);
    const std::vector<std::string> exported =
        export_body(body, options.exports, options.density_kg_m3, options.out);
    written.insert(written.end(), exported.begin(), exported.end());
    if (options.preview) {
      write_previews(body, read_obj_shells(options.out / "shells.obj"), options.out);
      written.insert(written.end(), std::begin(preview_files), std::end(preview_files));
    }
  }
  if (written.empty()) return {exit_done, report, text};
  report["also_written"] = written;
  text += fmt::format("  also         {}\n", fmt::join(written, ", "));
  return {exit_done, report, text};
}

}  // namespace limber::detail
