#include "limber/detail/body/body.h"

#include "core/appearance_file.h"
#include "core/contact_shape_file.h"
#include "core/error.h"
#include "core/events.h"
#include "core/hash.h"
#include "core/json_shape.h"
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
#include "meshing/quality.h"
#include "meshing/shell_check.h"
#include "meshing/split_edges.h"
#include "render/image_file.h"

namespace limber::detail {

namespace {

constexpr const char* body_files[] = {"surface.ply", "shells.obj", "cage.msh", "binding.npz", "contact.npz"};

bool has_shells(const PrepareSettings& s) { return s.only != "cage" || s.mode == "paper"; }
bool has_cage(const PrepareSettings& s) { return s.only != "shells"; }
bool is_whole(const PrepareSettings& s) { return s.only.empty(); }

// Images apart.
std::vector<std::string> files_of(const PrepareSettings& s, bool with_appearance) {
  std::vector<std::string> files{"surface.ply"};
  if (has_shells(s)) files.push_back("shells.obj");
  if (has_cage(s)) files.push_back("cage.msh");
  if (is_whole(s)) files.insert(files.end(), {"binding.npz", "contact.npz"});
  if (with_appearance) files.push_back(appearance_file);
  return files;
}

Json json_of(const PrepareSettings& s) {
  Json json{{"shells", s.shells}, {"concavity", s.concavity}, {"inflate", s.inflate},
            {"exact", s.exact},   {"tets", s.tets},           {"mode", s.mode}};
  if (!is_whole(s)) json["only"] = s.only;
  if (s.corners != PrepareSettings{}.corners) json["corners"] = s.corners;
  if (s.threshold > 0) json["threshold"] = s.threshold;
  return json;
}

Json json_of(const meshing::Certificate& c) {
  return {{"holds", c.holds()},
          {"vertices", c.vertices},
          {"vertices_outside", c.vertices_outside},
          {"triangles", c.triangles},
          {"triangles_crossing", c.triangles_crossing},
          {"nonmanifold_edges", c.nonmanifold_edges},
          {"nonmanifold_vertices", c.nonmanifold_vertices},
          {"min_dihedral_deg", c.min_dihedral_deg},
          {"max_dihedral_deg", c.max_dihedral_deg},
          {"surface_hash", hex(c.surface_hash)},
          {"cage_hash", hex(c.cage_hash)}};
}

meshing::CageMode mode_of(const std::string& name) {
  if (name == "fast") return meshing::CageMode::fast;
  if (name == "paper") return meshing::CageMode::paper;
  if (name == "conform") return meshing::CageMode::conform;
  LIMBER_CHECK(name == "lattice", name);
  return meshing::CageMode::lattice;
}

std::string hash_of_file(const fs::path& path) { return hex(hash_of(std::string_view(read_file(path)))); }

// Of what others ask of a report; the rest is for people.
const Json& example_of_report() {
  static const Json example{{"version", ""},
                            {"model", ""},
                            {"input", Json::object()},
                            {"mended", {""}},
                            {"warnings", {""}},
                            {"surface", {{"vertices", -1}, {"triangles", -1}}},
                            {"shells",
                             {{"count", -1},
                              {"in_float32", -1},
                              {"stopped_by", ""},
                              {"mean_overshoot", 0.5},
                              {"max_overshoot", 0.5},
                              {"triangles_uncovered", -1}}},
                            {"cage",
                             {{"mode", ""},
                              {"tets", -1},
                              {"nodes", -1},
                              {"volume_ratio", 0.5},
                              {"glued_share", 0.5},
                              {"min_dihedral_deg", 0.5},
                              {"max_dihedral_deg", 0.5},
                              {"median_min_dihedral_deg", 0.5}}},
                            {"certificate",
                             {{"holds", true},
                              {"vertices_outside", -1},
                              {"triangles_crossing", -1},
                              {"nonmanifold_edges", -1},
                              {"nonmanifold_vertices", -1},
                              {"surface_hash", ""},
                              {"cage_hash", ""}}},
                            {"contact",
                             {{"usable", true},
                              {"samples", -1},
                              {"cells", -1},
                              {"memory_mb", 0.5},
                              {"error_p99_m", 0.5},
                              {"error_max_m", 0.5}}},
                            {"cpu_seconds", Json::object()},
                            {"peak_memory_mb", 0.5},
                            {"files", Json::object()}};
  return example;
}

void require_report(const Json& report, const fs::path& file) {
  constexpr const char* remedy = "limber did not write that";
  Json example = example_of_report();
  try {
    const PrepareSettings settings = settings_of_input(report.at("input"));
    if (!has_shells(settings)) example.erase("shells");
    if (!has_cage(settings)) example.erase("cage"), example.erase("certificate");
    if (!is_whole(settings)) example.erase("contact");
  } catch (const Json::exception&) {  // told below
  }
  require_like(report, example, Keys::all, file.string(), remedy);
  require_like(report, {{"shells", {{"vertices_uncovered", -1}}}}, Keys::those_there, file.string(), remedy);
  require_like(report,
               {{"appearance", {{"materials", -1}, {"images", Json::array()}, {"corner_colors", true}}}},
               Keys::those_there, file.string(), remedy);
  for (const auto& [stage, any] : report.at("cpu_seconds").items())
    require_like(report, {{"cpu_seconds", {{stage, 0.5}}}}, Keys::all, file.string(), remedy);
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

Json input_of(const Json& identity, const PrepareSettings& settings) {
  // What nobody chooses counts, too: a limber that has other values makes another body.
  const meshing::ContactShapeSettings c;
  const meshing::CageOptions cage;
  const meshing::SplitSettings split;
  return {{"model", identity},
          {"settings", json_of(settings)},
          {"shells", "in float32"},
          {"cage",
           {{"min_dihedral_deg", cage.min_dihedral_deg},
            {"max_dihedral_deg", cage.max_dihedral_deg},
            {"gap", cage.gap}}},
          {"split", {{"share", split.share}, {"most_new_vertices", split.max_new_vertices}}},
          {"contact",
           {{"cells", c.cells},
            {"most_cells", c.max_cells},
            {"most_nodes", c.max_nodes},
            {"field_error", c.field_error},
            {"missed_depth", c.missed_depth},
            {"least_spacing", c.min_spacing},
            {"most_spacing", c.max_spacing},
            {"most_flat_spacing", c.max_flat_spacing},
            {"samples_a_square", c.samples_a_square},
            {"fewest_most_samples", c.fewest_most_samples},
            {"most_samples", c.max_samples}}}};
}

PrepareSettings settings_of_input(const Json& input) {
  const Json& s = input.at("settings");
  const PrepareSettings usual;
  return {.shells = s.at("shells").get<int>(),
          .concavity = s.at("concavity").get<double>(),
          .threshold = s.value("threshold", usual.threshold),
          .inflate = s.at("inflate").get<double>(),
          .exact = s.at("exact").get<bool>(),
          .tets = s.at("tets").get<int>(),
          .mode = s.at("mode").get<std::string>(),
          .corners = s.value("corners", usual.corners),
          .only = s.value("only", "")};
}

bool body_is_up_to_date(const fs::path& folder, const Json& input) {
  try {
    const Json report = read_json(folder / "report.json");
    require_report(report, folder / "report.json");
    if (report.at("version") != version || report.at("input") != input) return false;
    const Json& files = report.at("files");
    std::size_t found = 0;
    for (const std::string& name : files_of(settings_of_input(input), report.contains("appearance"))) {
      if (files.at(name) != hash_of_file(folder / name)) return false;
      ++found;
    }
    for (const auto& [name, hash] : files.items())
      if (is_name_of_image_file(name)) {
        if (hash != hash_of_file(folder / name)) return false;
        ++found;
      }
    return found == files.size();
  } catch (const InputError&) {
    return false;
  } catch (const Json::exception&) {
    return false;
  }
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

void take_costs_out(Json& report) {
  report["cpu_seconds"] = report["peak_memory_mb_after"] = Json::object();
  report["peak_memory_mb"] = 0;
}

namespace {

bool is_grey(const render::Image8& image) {
  for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3)
    if (image.rgb[i] != image.rgb[i + 1] || image.rgb[i] != image.rgb[i + 2]) return false;
  return true;
}

}  // namespace

void look_into_images(Appearance& appearance, std::vector<std::string>& warnings) {
  std::int64_t pixels = 0;
  std::vector<bool> gone(appearance.images.size(), false);
  for (int i = 0; i < int(appearance.images.size()); ++i) {
    const ImageFile& file = appearance.images[std::size_t(i)];
    try {
      const render::Image8 image = render::decoded_image(file.bytes, file.name);
      if (pixels + std::int64_t(image.width) * image.height > render::max_image_pixels)
        throw InputError(fmt::format("\"{}\": the images of the model have more than {} pixels together",
                                     file.name, render::max_image_pixels));
      pixels += std::int64_t(image.width) * image.height;
      bool has_heights = false;
      for (SurfaceMaterial& material : appearance.materials)
        if (material.normal_image == i && is_grey(image)) material.normal_image = -1, has_heights = true;
      if (has_heights)
        warnings.push_back(
            fmt::format("image \"{}\" has heights, not normals: its relief is left out", file.name));
    } catch (const InputError& error) {
      warnings.push_back(fmt::format("image {}; what shows it is plain", error.what()));
      gone[std::size_t(i)] = true;
    }
  }
  appearance.drop_images(gone);
  appearance.drop_unused();
}

void make_model_of_body(meshing::ImportedModel& model, const PrepareSettings& settings) {
  look_into_images(model.appearance, model.warnings);
  if (settings.tets > 0) {
    const Eigen::Index own_vertices = model.surface.positions.rows();
    CornerMap corners;
    model.surface =
        meshing::split_long_edges(model.surface, meshing::longest_edge(model.surface, settings.tets), {},
                                  model.appearance.empty() ? nullptr : &corners);
    model.appearance = carried(model.appearance, corners);
    if (const Eigen::Index more = model.surface.positions.rows() - own_vertices; more > 0)
      model.mended.push_back(
          fmt::format("cut long edges at {} places, so that its {} triangles bend as the cage does", more,
                      model.surface.triangles.rows()));
  }
  round_to_floats(model.appearance);
}

double concavity_of(const SurfaceMesh& surface, const PrepareSettings& settings) {
  if (settings.threshold == 0) return settings.concavity;
  const Box box = bounding_box(surface.positions);
  return 0.5 * settings.threshold * (box.upper - box.lower).maxCoeff() / box.diagonal();
}

meshing::Decomposition make_shells(const SurfaceMesh& surface, const PrepareSettings& settings) {
  return meshing::decompose(surface, {.max_shells = settings.shells,
                                      .max_concavity = concavity_of(surface, settings),
                                      .max_vertices = settings.corners,
                                      .inflation = settings.inflate,
                                      .exact = settings.exact});
}

meshing::Cage make_cage(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells,
                        const PrepareSettings& settings, std::optional<TetMesh> made_cage) {
  if (!made_cage)
    return meshing::build_cage(surface, shells, {.mode = mode_of(settings.mode), .tets = settings.tets});
  meshing::Cage cage;
  cage.mesh = std::move(*made_cage);
  cage.shell_from_tet.assign(std::size_t(cage.mesh.tets.rows()), 0);
  return cage;
}

Json facts_of_making(const MadeBody& made, const PrepareSettings& settings) {
  const meshing::Decomposition& d = made.decomposition;
  const bool in_cells = settings.tets == 0;
  Json facts;
  facts["shells"] = {{"stopped_by", d.stopped_by},
                     {"inflation", settings.inflate},
                     {"sum_of_volumes_m3", d.sum_of_hull_volumes},
                     {"mean_overshoot", d.mean_overshoot},
                     {"max_overshoot", d.max_overshoot},
                     {"vertices_uncovered", d.vertices_uncovered},
                     {"triangles_uncovered", d.triangles_uncovered},
                     {"neighbours", d.neighbours}};
  facts["cage"] = {{"mode", in_cells ? "cells" : settings.mode},
                   {"volume_ratio", made.cage.volume_ratio},
                   {"glued_share", made.cage.glued_share}};
  facts["contact"] = {{"cells", made.contact_report.cells},
                      {"characteristic_m", made.contact_report.characteristic_m},
                      {"open_share", made.contact_report.open_share}};
  return facts;
}

WholeBody make_body(const BodySource& source, const PrepareSettings& settings,
                    const std::function<void(const char*)>& end_stage) {
  Progress progress("prepare", 7);
  progress.update(0, "import");
  WholeBody body;
  body.model = source.load();
  SurfaceMesh& surface = body.model.surface;
  validate(surface, source.model);
  make_model_of_body(body.model, settings);
  end_stage("import");
  throw_if_stopped();

  MadeBody& made = body.made;
  if (has_shells(settings)) {
    progress.update(1, "decompose");
    made.decomposition = make_shells(surface, settings);
    end_stage("decompose");
    throw_if_stopped();
  }

  if (has_cage(settings)) {
    progress.update(2, "cage");
    made.cage = make_cage(surface, made.decomposition.shells, settings, source.made_cage());
    validate(made.cage.mesh, source.model + ": cage");
    end_stage("cage");
    progress.update(3, "certify");
    throw_if_stopped();

    body.certificate = meshing::certify(surface, made.cage.mesh);
    end_stage("certify");
    throw_if_stopped();
  }

  if (is_whole(settings)) {
    progress.update(4, "bind");
    body.binding = ffd::bind(surface, made.cage.mesh);
    end_stage("bind");
    throw_if_stopped();

    progress.update(5, "contact");
    made.contact = meshing::make_contact_shape(surface, made.cage.mesh, {}, &made.contact_report);
    end_stage("contact");
  }
  return body;
}

Json report_of(const WholeBody& body, const BodySource& source, const PrepareSettings& settings) {
  const meshing::Certificate& certificate = body.certificate;
  std::vector<std::string> warnings = body.model.warnings;
  for (const auto* more : {&body.made.cage.notes, &body.made.contact_report.warnings})
    warnings.insert(warnings.end(), more->begin(), more->end());
  if (certificate.vertices_outside > 0)
    warnings.push_back(fmt::format("{} vertices lie outside the cage", certificate.vertices_outside));
  if (certificate.triangles_crossing > 0)
    warnings.push_back(
        fmt::format("{} triangles cross the boundary of the cage", certificate.triangles_crossing));

  Json report{{"version", version}, {"model", source.model}, {"input", input_of(source.identity, settings)}};
  report.update(meshing::to_json(body.model));
  report["warnings"] = warnings;
  report.update(facts_of_body(body.model.surface, body.made.decomposition.shells, body.made.cage.mesh,
                              body.binding, body.made.contact, certificate));
  if (!body.model.appearance.empty()) report["appearance"] = facts_of_appearance(body.model.appearance);
  const Json making = facts_of_making(body.made, settings);
  for (const auto& [table, figures] : making.items()) report[table].update(figures);
  if (!has_shells(settings)) report.erase("shells");
  if (!has_cage(settings)) report.erase("cage"), report.erase("certificate");
  if (!is_whole(settings)) report.erase("binding"), report.erase("contact"), report.erase("appearance");
  return report;
}

Json write_body(const WholeBody& body, const BodySource& source, const PrepareSettings& settings,
                const fs::path& folder) {
  const SurfaceMesh& surface = body.model.surface;
  const meshing::Cage& cage = body.made.cage;
  remove_abandoned(folder);
  clear_body(folder);
  write_ply(folder / "surface.ply", surface);
  std::vector<std::string> files = files_of(settings, false);
  if (has_shells(settings)) write_obj(folder / "shells.obj", body.made.decomposition.shells);
  if (has_cage(settings)) write_msh(folder / "cage.msh", cage.mesh, cage.shell_from_tet);
  if (is_whole(settings)) {
    ffd::write_binding(folder / "binding.npz", body.binding, surface, cage.mesh);
    write_contact_shape(folder / "contact.npz", body.made.contact, surface, cage.mesh);
    const std::vector<std::string> shown = write_appearance(folder, body.model.appearance, surface);
    files.insert(files.end(), shown.begin(), shown.end());
  }
  Json report = report_of(body, source, settings);
  for (const std::string& name : files) report["files"][name] = hash_of_file(folder / name);
  take_costs_out(report);
  write_json(folder / "report.json", report);
  return report;
}

Json prepare_body(const BodySource& source, const PrepareSettings& settings, const fs::path& folder,
                  const BodyStore* store) {
  const Json input = input_of(source.identity, settings);
  const std::string key = store ? BodyStore::key_of(source, input) : "";
  const auto tell = [&](bool up_to_date) {
    events::tell({{"event", "body"}, {"folder", folder.string()}, {"up_to_date", up_to_date}});
  };
  if (body_is_up_to_date(folder, input)) {
    log::info("{}: up to date", folder.string());
    tell(true);
    if (store) store->keep(key, folder);
    return read_json(folder / "report.json");
  }
  std::optional<FolderLock> lock;
  if (store && store->has(key)) {
    make_folder(folder);
    lock.emplace(folder, FolderLock::alone);
    if (const std::optional<Json> report = store->fetch(key, input, source.model, folder)) {
      log::info("{}: from the store", folder.string());
      tell(true);
      return *report;
    }
  }
  log::info("{}: preparing {}", folder.string(), source.model);
  tell(false);
  if (!lock && fs::is_directory(folder)) lock.emplace(folder, FolderLock::alone);
  Costs costs;
  const WholeBody body = make_body(source, settings, [&](const char* stage) { costs.end_stage(stage); });
  make_folder(folder);  // not before: a model that is refused leaves all as it was
  if (!lock) lock.emplace(folder, FolderLock::alone);
  Json report = write_body(body, source, settings, folder);
  costs.end_stage("write");
  report["cpu_seconds"] = costs.cpu_s;
  report["peak_memory_mb_after"] = costs.peak_mb;
  report["peak_memory_mb"] = std::round(peak_memory_mb());
  if (!store) write_json(folder / "report.json", report);
  if (store) store->keep(key, folder);
  for (const Json& warning : report.at("warnings"))
    log::warn("{}: {}", source.model, warning.get<std::string>());
  return report;
}

Json facts_of_body(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells, const TetMesh& cage,
                   const ffd::Binding& binding, const ContactShape& contact,
                   const meshing::Certificate& certificate) {
  const Box box = bounding_box(surface.positions);
  const meshing::TetQuality quality =
      cage.tets.rows() > 0 ? meshing::measure_quality(cage) : meshing::TetQuality{};
  const meshing::FieldErrors errors =
      contact.samples.area_m2.size() > 0 ? meshing::field_errors(contact) : meshing::FieldErrors{};
  Json facts;
  facts["surface"] = {{"vertices", surface.positions.rows()},
                      {"triangles", surface.triangles.rows()},
                      {"area_m2", area(surface)},
                      {"volume_m3", volume(surface)},
                      {"lower_m", {box.lower.x(), box.lower.y(), box.lower.z()}},
                      {"upper_m", {box.upper.x(), box.upper.y(), box.upper.z()}}};
  facts["shells"] = {{"count", shells.size()},
                     {"in_float32", std::count_if(shells.begin(), shells.end(), meshing::holds_in_float32)}};
  facts["cage"] = {{"tets", cage.tets.rows()},
                   {"nodes", cage.positions.rows()},
                   {"volume_m3", volume(cage)},
                   {"min_dihedral_deg", quality.min_dihedral_deg},
                   {"max_dihedral_deg", quality.max_dihedral_deg},
                   {"median_min_dihedral_deg", quality.median_min_dihedral_deg}};
  facts["certificate"] = json_of(certificate);
  facts["binding"] = {{"vertices_outside", binding.outside},
                      {"max_outside_distance_m", binding.max_outside_distance_m}};
  facts["contact"] = {{"usable", contact.usable},
                      {"samples", contact.samples.tet_from_sample.size()},
                      {"nodes", contact.field.values.size()},
                      {"cell_m", contact.field.cell_m},
                      {"unit_m", contact.field.unit_m},
                      {"error_p99_m", errors.p99_m},
                      {"error_max_m", errors.max_m},
                      {"memory_mb", double(contact.field.values.size() * sizeof(std::int16_t)) / 1e6}};
  return facts;
}

Json facts_of_appearance(const Appearance& a) {
  if (a.empty()) return {};
  Json images = Json::array();
  for (const ImageFile& image : a.images)
    images.push_back({{"name", image.name}, {"bytes", image.bytes.size()}});
  return {
      {"coordinates", a.uv.rows() > 0},
      {"corner_colors", a.colors.rows() > 0},
      {"materials", a.materials.size()},
      {"plain_triangles", std::count(a.material_from_triangle.begin(), a.material_from_triangle.end(), -1)},
      {"images", images}};
}

std::vector<std::string> files_of_body(const Appearance& a) {
  std::vector<std::string> names(std::begin(body_files), std::end(body_files));
  if (a.empty()) return names;
  names.push_back(appearance_file);
  for (std::size_t i = 0; i < a.images.size(); ++i) names.push_back(name_of_image_file(a, i));
  return names;
}

PreparedBody read_body(const fs::path& folder) {
  PreparedBody body;
  try {
    body.report = read_json(folder / "report.json");
    require_report(body.report, folder / "report.json");
    if (const std::string only = settings_of_input(body.report.at("input")).only; !only.empty())
      throw InputError(fmt::format("{}: is a part of a body, made with --only {}", folder.string(), only));
    const auto require_hash = [&](const std::string& name) {
      if (body.report.at("files").at(name) != hash_of_file(folder / name))
        throw InputError(
            fmt::format("{}: is not the file that report.json was written for", (folder / name).string()));
    };
    for (const char* name : body_files) require_hash(name);
    body.surface = read_ply(folder / "surface.ply");
    body.cage = read_msh(folder / "cage.msh", &body.shell_from_tet);
    body.binding = ffd::read_binding(folder / "binding.npz", body.surface, body.cage);
    body.contact = read_contact_shape(folder / "contact.npz", body.surface, body.cage);
    if (body.report.at("files").contains(appearance_file)) {
      require_hash(appearance_file);
      body.appearance = read_appearance(folder, body.surface);
      for (const std::string& name : files_of_body(body.appearance)) require_hash(name);
    }
    body.gradients = node_gradients(body.cage);
  } catch (const InputError& error) {
    throw InputError(fmt::format(
        "{}; make the body anew with limber prepare, or the scene's bodies with limber plan", error.what()));
  } catch (const Json::exception& error) {
    throw InputError(
        fmt::format("{}: is no report of limber's ({}); make the body anew with limber prepare, or the "
                    "scene's bodies with limber plan",
                    (folder / "report.json").string(), error.what()));
  }
  return body;
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
