#include "limber/detail/body/body.h"

#include "core/appearance_file.h"
#include "core/contact_shape_file.h"
#include "core/error.h"
#include "core/events.h"
#include "core/hash.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "core/temporary_files.h"
#include "core/version.h"
#include "ffd/binding_file.h"
#include "limber/detail/body/body_store.h"
#include "limber/detail/body/export.h"
#include "limber/detail/body/preview.h"
#include "limber/detail/body/write_robot.h"

namespace limber::detail {

namespace {

constexpr const char* body_files[] = {"surface.ply", "shells.obj", "cage.msh", "binding.npz", "contact.npz"};

// Images apart.
std::vector<std::string> files_of(const PrepareSettings& s, bool with_appearance) {
  std::vector<std::string> files{"surface.ply"};
  if (s.has_shells()) files.push_back("shells.obj");
  if (s.has_cage()) files.push_back("cage.msh");
  if (s.is_whole()) files.insert(files.end(), {"binding.npz", "contact.npz"});
  if (with_appearance) files.push_back(appearance_file);
  return files;
}

// What each stage of a body cost.
struct Costs {
  Json cpu_s;    // of the stage itself
  Json peak_mb;  // of all stages up to it

  void end_stage(const char* name) {
    const double now = cpu_seconds();
    cpu_s[name] = std::round(1e4 * (now - last_)) / 1e4;
    peak_mb[name] = std::round(peak_memory_mb());
    last_ = now;
  }

 private:
  double last_ = cpu_seconds();
};

}  // namespace

std::optional<BodyReport> up_to_date_report(const fs::path& folder, const Json& input) try {
  BodyReport report = read_body_report(folder);
  if (report.version != version || report.input.all != input) return std::nullopt;
  const auto is_here = [&](const std::string& name) {
    return report.has_file(name, hex(hash_of_file(folder / name)));
  };
  std::size_t found = 0;
  for (const std::string& name : files_of(report.input.settings, report.appearance.has_value())) {
    if (!is_here(name)) return std::nullopt;
    ++found;
  }
  for (const auto& [name, hash] : report.files)
    if (is_name_of_image_file(name)) {
      if (!is_here(name)) return std::nullopt;
      ++found;
    }
  return found == report.files.size() ? std::optional(std::move(report)) : std::nullopt;
} catch (const InputError&) {
  return std::nullopt;
}

void clear_body(const fs::path& folder) {
  std::error_code ignored;
  fs::remove(folder / "report.json",
             ignored);  // what is in the folder counts again when a new report says so
  // These would be of the body before.
  remove_exports(folder);
  for (const char* name : preview_files) fs::remove(folder / name, ignored);
  fs::remove(folder / picture_file, ignored);
  for (const char* name : body_files) fs::remove(folder / name, ignored);
  fs::remove(folder / "stiffness.json", ignored);
  remove_appearance(folder);
}

BodyReport write_body(const WholeBody& body, const BodySource& source, const PrepareSettings& settings,
                      const fs::path& folder) {
  const SurfaceMesh& surface = body.model.surface;
  const meshing::Cage& cage = body.made.cage;
  remove_abandoned(folder);
  clear_body(folder);
  write_ply(folder / "surface.ply", surface);
  std::vector<std::string> files = files_of(settings, false);
  if (settings.has_shells()) write_obj(folder / "shells.obj", body.made.decomposition.shells);
  if (settings.has_cage()) write_msh(folder / "cage.msh", cage.mesh, cage.shell_from_tet);
  if (settings.is_whole()) {
    ffd::write_binding(folder / "binding.npz", body.binding, surface, cage.mesh);
    write_contact_shape(folder / "contact.npz", body.made.contact, surface, cage.mesh);
    const std::vector<std::string> shown = write_appearance(folder, body.model.appearance, surface);
    files.insert(files.end(), shown.begin(), shown.end());
  }
  Json report = report_of(body, source, settings);
  for (const std::string& name : files) report["files"][name] = hex(hash_of_file(folder / name));
  take_costs_out(report);
  write_json(folder / "report.json", report);
  return body_report_of(std::move(report), (folder / "report.json").string());
}

namespace {

// Makes `folder` the body of `like`, whose report this is; nothing where that is changed meanwhile. With it
// goes what its stiffness was found to be.
std::optional<BodyReport> copy_body(const fs::path& like, const BodyReport& report, const std::string& model,
                                    const fs::path& folder) try {
  clear_body(folder);
  for (const auto& [name, hash] : report.files) {
    const std::string bytes = read_file(like / name);
    if (hex(hash_of(std::string_view(bytes))) != hash) return std::nullopt;
    write_file(folder / name, bytes);
  }
  if (const fs::path share = like / "stiffness.json"; fs::exists(share))
    write_file(folder / share.filename(), read_file(share));
  Json told = report.json;
  take_costs_out(told);
  told["model"] = model;
  write_json(folder / "report.json", told);
  return body_report_of(std::move(told), (folder / "report.json").string());
} catch (const InputError&) {
  return std::nullopt;
}

}  // namespace

BodyReport prepare_body(const BodySource& source, const PrepareSettings& settings, const fs::path& folder,
                        const PrepareAid& aid) {
  const BodyStore* const store = aid.store;
  const Json input = input_of(source.identity, settings);
  const std::string key = store ? BodyStore::key_of(source, input) : "";
  const auto tell = [&](bool up_to_date) {
    events::tell({{"event", "body"}, {"folder", folder.string()}, {"up_to_date", up_to_date}});
  };
  if (std::optional<BodyReport> report = up_to_date_report(folder, input)) {
    log::info("{}: up to date", folder.string());
    tell(true);
    if (store) store->keep(key, folder, *report);
    return *std::move(report);
  }
  const bool was_there = fs::exists(folder);
  std::optional<FolderLock> lock;
  if (store && store->has(key)) {
    make_folder(folder);
    lock.emplace(folder, FolderLock::alone);
    if (std::optional<BodyReport> report = store->fetch(key, input, source.model, folder)) {
      log::info("{}: from the store", folder.string());
      tell(true);
      return *std::move(report);
    }
  }
  if (const auto other = aid.like.empty() ? std::nullopt : up_to_date_report(aid.like, input)) {
    make_folder(folder);
    if (!lock) lock.emplace(folder, FolderLock::alone);
    if (std::optional<BodyReport> report = copy_body(aid.like, *other, source.model, folder)) {
      log::info("{}: as in {}", folder.string(), aid.like.string());
      tell(true);
      if (store) store->keep(key, folder, *report);
      return *std::move(report);
    }
  }
  log::info("{}: preparing {}", folder.string(), source.model);
  tell(false);
  if (!lock && fs::is_directory(folder)) lock.emplace(folder, FolderLock::alone);
  Costs costs;  // of the process
  const WholeBody body = make_body(source, settings, [&](const char* stage) { costs.end_stage(stage); });
  make_folder(folder);  // not before: a model that is refused leaves all as it was
  if (!lock) lock.emplace(folder, FolderLock::alone);
  if (!was_there && fs::exists(folder / "report.json")) {
    if (std::optional<BodyReport> report = up_to_date_report(folder, input)) return *std::move(report);
    throw InputError(fmt::format("{}: another limber has made a body there meanwhile; name another with -o",
                                 folder.string()));
  }
  Json told = write_body(body, source, settings, folder).json;
  costs.end_stage("write");
  if (aid.is_alone) {
    told["cpu_seconds"] = costs.cpu_s;
    told["peak_memory_mb_after"] = costs.peak_mb;
    told["peak_memory_mb"] = std::round(peak_memory_mb());
  }
  if (!store) write_json(folder / "report.json", told);
  BodyReport report = body_report_of(std::move(told), (folder / "report.json").string());
  if (store) store->keep(key, folder, report);
  for (const std::string& warning : report.warnings) log::warn("{}: {}", source.model, warning);
  return report;
}

std::vector<std::string> files_of_body(const PrepareSettings& settings, const Appearance& a) {
  std::vector<std::string> names = files_of(settings, !a.empty());
  for (std::size_t i = 0; i < a.images.size(); ++i) names.push_back(name_of_image_file(a, i));
  return names;
}

PreparedBody read_body(const fs::path& folder) {
  PreparedBody body = read_made(folder);
  if (const std::string& only = body.report.input.settings.only; !only.empty())
    throw InputError(fmt::format(
        "{}: is a part of a body, made with --only {}; make the whole with limber prepare, without --only",
        folder.string(), only));
  return body;
}

PreparedBody read_made(const fs::path& folder) {
  PreparedBody body;
  try {
    body.report = read_body_report(folder);
    const PrepareSettings& settings = body.report.input.settings;
    const auto known = [&](const std::string& name) {  // bytes of the file that was reported
      std::string bytes = read_file(folder / name);
      if (!body.report.has_file(name, hex(hash_of(std::string_view(bytes)))))
        throw InputError(
            fmt::format("{}: is not the file that report.json was written for", (folder / name).string()));
      return bytes;
    };
    body.surface = ply_from(known("surface.ply"), folder / "surface.ply");
    if (settings.has_cage()) {
      body.cage = msh_from(known("cage.msh"), folder / "cage.msh", &body.shell_from_tet);
      body.gradients = node_gradients(body.cage);
    }
    if (settings.has_shells()) known("shells.obj");
    if (!settings.is_whole()) return body;
    for (const char* name : {"binding.npz", "contact.npz"}) known(name);
    body.binding = ffd::read_binding(folder / "binding.npz", body.surface, body.cage);
    body.contact = read_contact_shape(folder / "contact.npz", body.surface, body.cage);
    if (body.report.files.contains(appearance_file)) {
      known(appearance_file);
      body.appearance = read_appearance(folder, body.surface);
      for (std::size_t i = 0; i < body.appearance.images.size(); ++i)
        known(name_of_image_file(body.appearance, i));
    }
  } catch (const InputError& error) {
    throw InputError(
        fmt::format("{}; remove {} and make the body anew, by limber prepare or the scene's plan",
                    error.what(), folder.string()));
  }
  return body;
}

void place(PreparedBody& body, const Vec3& place_m) {
  LIMBER_CHECK(body.own_cage_m.rows() == 0, body.own_cage_m.rows());
  const auto move = [&](Points& points) { points.rowwise() += place_m.transpose(); };
  body.filled = filled_share(body);
  body.place_m = place_m;
  body.own_cage_m = body.cage.positions;
  move(body.surface.positions), move(body.cage.positions), move(body.contact.samples.positions_m);
  body.contact.field.lower_m += place_m;
}

double filled_share(const PreparedBody& body) {
  if (body.filled > 0) return body.filled;
  return std::min(1., mass_of(body).of.volume_m3 / volume(body.cage));
}

void deform(const PreparedBody& body, const Points& cage_positions, Points& surface_positions) {
  deform(body, body.binding, cage_positions, surface_positions);
}

void deform(const PreparedBody& body, const ffd::Binding& part, const Points& cage_positions,
            Points& surface_positions) {
  if (body.deformation == scenes::Deformation::phong)
    ffd::deform_phong(part, body.cage, body.gradients, cage_positions, surface_positions);
  else
    ffd::deform(part, body.cage.tets, cage_positions, surface_positions);
}

}  // namespace limber::detail
