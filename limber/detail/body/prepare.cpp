#include "limber/detail/body/prepare.h"

#include <fmt/format.h>

#include <iterator>

#include "core/error.h"
#include "core/json_text.h"
#include "core/mesh_files.h"
#include "imaging/surface_nets.h"
#include "limber/detail/body/export.h"
#include "limber/detail/body/model_content.h"
#include "limber/detail/body/preview.h"

namespace limber::detail {

PrepareSettings settings_of(const PrepareOptions& options) {
  return {.shells = options.shells,
          .concavity = options.concavity,
          .threshold = options.threshold,
          .inflate = options.inflate,
          .exact = options.exact,
          .tets = options.tets,
          .mode = options.mode,
          .corners = options.max_hull_vertices,
          .only = {}};
}

PrepareSettings settings_of(const ModelOptions& options) {
  PrepareSettings settings = settings_of(static_cast<const PrepareOptions&>(options));
  settings.only = options.only;
  return settings;
}

namespace {

meshing::ImportedModel import_label(const ModelOptions& options, const fs::path& file) {
  const imaging::LabelMap map = imaging::read_label_map(file);
  const int row = imaging::row_of_label(map, options.label, file.string());
  const std::string what = fmt::format("{}: label {}", file.string(), map.labels[std::size_t(row)]);
  const imaging::LabelSurface label = imaging::surfaces_of(
      map, {row},
      {.gap = options.label_gap, .rounds = options.label_rounds, .min_island = options.min_island})[0];
  if (label.voxels == 0)
    throw InputError(fmt::format("{}: all of its {} pieces, {} voxels in all, are smaller than {:g} voxels",
                                 what, label.islands_dropped, label.voxels_dropped, options.min_island));
  meshing::ImportedModel model = meshing::clean(label.surface, {.scale = options.scale}, what);
  if (label.islands_dropped > 0)
    model.mended.push_back(fmt::format("left out {} pieces of fewer than {:g} voxels, {} voxels in all",
                                       label.islands_dropped, options.min_island, label.voxels_dropped));
  model.warnings.insert(model.warnings.end(), map.notes.begin(), map.notes.end());
  return model;
}

}  // namespace

BodySource source_of(const ModelOptions& options, const fs::path& file) {
  BodySource source;
  source.model = options.model.string();
  const ModelContent content = content_of_model(file);
  source.content = content.content, source.ending = content.ending;
  FileIdentity identity{content.file_hash, options.scale, options.y_up, {}};
  source.identity = json_of_fields(identity);
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
  identity.label = {options.label, options.label_gap, options.label_rounds, options.min_island};
  source.identity = json_of_fields(identity);
  source.load = [options, file] { return import_label(options, file); };
  return source;
}

PreparedFolder prepare(const ModelOptions& options) {
  require_agreeing(options);
  std::optional<BodyStore> store;
  if (!options.store.empty()) store.emplace(options.store);

  const BodySource source = source_of(options, options.bytes.empty() ? options.model : options.bytes);
  const BodyReport report =
      prepare_body(source, settings_of(options), options.out, {.store = store ? &*store : nullptr});
  PreparedFolder prepared{text_of(report.json, 2), {}};
  std::vector<std::string>& written = prepared.also_written;
  if (options.picture) {
    if (!has_picture(options.out)) write_picture(options.out);
    if (store) store->keep(BodyStore::key_of(source, report.input.all), options.out);
    written.push_back(picture_file);
  }
  if (!options.exports.empty() || options.preview) {
    const PreparedBody body = read_body(options.out);
    const std::vector<std::string> exported =
        export_body(body, options.exports, options.density_kg_m3, options.out, options.out);
    written.insert(written.end(), exported.begin(), exported.end());
    if (options.preview) {
      write_previews(body, read_obj_shells(options.out / "shells.obj"), options.out);
      written.insert(written.end(), std::begin(preview_files), std::end(preview_files));
    }
  }
  return prepared;
}

}  // namespace limber::detail
