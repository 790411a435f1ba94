#include "limber/detail/inspect/file_facts.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/json_lines.h"
#include "core/json_text.h"
#include "core/mesh_files.h"
#include "core/npz.h"
#include "imaging/label_map.h"
#include "limber/detail/authoring/scene_facts.h"
#include "limber/detail/body/body.h"
#include "limber/detail/body/preview.h"
#include "limber/detail/plan/plan_folder.h"
#include "meshing/quality.h"
#include "render/png_file.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

Json info_of_surface(const SurfaceMesh& mesh) {
  const Box box = bounding_box(mesh.positions);
  return {{"vertices", mesh.positions.rows()},
          {"triangles", mesh.triangles.rows()},
          {"area", area(mesh)},
          {"volume", volume(mesh)},
          {"lower", {box.lower.x(), box.lower.y(), box.lower.z()}},
          {"upper", {box.upper.x(), box.upper.y(), box.upper.z()}}};
}

Json info_of_cage(const TetMesh& cage) {
  const meshing::TetQuality quality = meshing::measure_quality(cage);
  return {{"nodes", cage.positions.rows()},
          {"tets", cage.tets.rows()},
          {"tets_without_interior_vertex", tets_without_interior_vertex(cage.tets).size()},
          {"volume", volume(cage)},
          {"min_dihedral_deg", quality.min_dihedral_deg},
          {"max_dihedral_deg", quality.max_dihedral_deg},
          {"hash", hex(hash_of(cage))}};
}

Json info_of_npz(const fs::path& path) {
  const Npz npz = read_npz(path);
  Json json;
  for (const auto& [name, array] : npz.arrays)
    json[name] = fmt::format("{} {}", array.dtype, Json(array.shape).dump());
  for (const auto& [name, text] : npz.texts) json[name] = fmt::format("{} bytes", text.size());
  return json;
}

Json info_of_model(const fs::path& path) {
  const meshing::ImportedModel model = meshing::import_model(path, {});
  Json json = info_of_surface(model.surface);
  json.update(meshing::to_json(model));
  return json;
}

Json info_of_label_map(const fs::path& path) {
  const imaging::LabelMap map = imaging::read_label_map(path);
  std::vector<std::int64_t> voxels(map.labels.size(), 0);
  for (const std::uint16_t row : map.material) ++voxels[row];
  Json json{{"size", map.size}, {"notes", map.notes}, {"labels", Json::array()}};
  for (int d = 0; d < 3; ++d) json["voxel_m"].push_back(map.axes_m.col(d).norm());
  for (std::size_t row = 1; row < map.labels.size(); ++row)
    json["labels"].push_back({{"label", map.labels[row]},
                              {"name", map.names[row]},
                              {"voxels", voxels[row]},
                              {"volume_m3", double(voxels[row]) * map.voxel_volume_m3()}});
  return json;
}

// What a person needs to choose a part by its shell: where it is, how large, which colour in the pictures.
Json info_of_shells(const PreparedBody& body, const std::vector<ConvexShell>& shells) {
  std::vector<int> tets(shells.size(), 0);
  for (std::size_t t = 0; t < body.shell_from_tet.size(); ++t) {
    const int shell = body.shell_from_tet[t];
    if (shell < 0 || shell >= int(shells.size()))
      throw InputError(fmt::format(
          "cage.msh: tet {} is of shell {}, and shells.obj has {}; make the body anew with limber prepare", t,
          shell, shells.size()));
    ++tets[std::size_t(shell)];
  }
  Json list = Json::array();
  for (std::size_t s = 0; s < shells.size(); ++s) {
    const Box box = bounding_box(shells[s].vertices);
    const Vec3 middle = box.center(), size = box.size(), color = 255 * shell_color(s);
    list.push_back({{"shell", s},
                    {"middle_m", {middle.x(), middle.y(), middle.z()}},
                    {"size_m", {size.x(), size.y(), size.z()}},
                    {"volume_m3", volume(SurfaceMesh{shells[s].vertices, shells[s].triangles})},
                    {"tets", tets[s]},
                    {"color", fmt::format("#{:02x}{:02x}{:02x}", int(color.x() + 0.5), int(color.y() + 0.5),
                                          int(color.z() + 0.5))}});
  }
  return list;
}

Json info_of_body(const fs::path& folder) {
  const PreparedBody body = read_made(folder);
  Json json = body.report.json;
  if (body.report.shells) json["shell_list"] = info_of_shells(body, read_obj_shells(folder / "shells.obj"));
  return json;
}

// Of many models that limber prepare made.
Json info_of_many(const fs::path& folder) {
  int done = 0, holding = 0;
  Json failed = Json::object();
  const std::vector<Json> rows = JsonLines(folder / "manifest.jsonl").read();
  for (const Json& row : rows) {
    const auto told = [&](const char* key) { return row.is_object() ? row.value(key, Json()) : Json(); };
    if (!told("name").is_string())
      throw InputError(fmt::format("{}: a line names no model", (folder / "manifest.jsonl").string()));
    if (told("status") == "failed")
      failed[told("name").get<std::string>()] = told("reason");
    else
      ++done, holding += told("certificate_holds") == true;
  }
  return {{"models", rows.size()},
          {"prepared", done},
          {"certificates_that_hold", holding},
          {"failed", failed},
          {"page", (folder / "index.html").string()}};
}

FileFacts as(FileFacts::Kind kind, const Json& facts) { return {kind, text_of(facts, 2)}; }

}  // namespace

FileFacts facts_of_file(const fs::path& path) {
  const auto scene = [](const fs::path& file) { return as(FileFacts::scene, facts_of_scene(file)); };
  if (path.extension() == ".toml") return scene(path);
  if (!fs::exists(path) && path.extension().empty()) return scene(scenes::find_scene(path.string()));
  if (fs::is_directory(path)) {
    if (fs::exists(path / "scene.toml")) return scene(path / "scene.toml");
    if (fs::exists(path / "plan.npz")) return as(FileFacts::other, read_plan_folder(path).summary);
    if (fs::exists(path / "report.json")) return as(FileFacts::body, info_of_body(path));
    if (fs::exists(path / "manifest.jsonl") && fs::is_directory(path / "bodies"))
      return as(FileFacts::other, info_of_many(path));
    throw InputError(fmt::format(
        "{}: holds none of plan.npz, report.json, scene.toml; nothing here is limber's", path.string()));
  }
  const std::string extension = path.extension().string();
  if (extension == ".msh") return as(FileFacts::other, info_of_cage(read_msh(path)));
  if (extension == ".npz") return as(FileFacts::other, info_of_npz(path));
  if (extension == ".json") return as(FileFacts::other, read_json(path));
  if (extension == ".png") {
    const auto png = render::inspect_png(path);
    if (!png) throw InputError(fmt::format("{}: is missing, no PNG, or cut short", path.string()));
    return as(FileFacts::other, {{"width", png->width}, {"height", png->height}, {"texts", png->texts}});
  }
  if (imaging::is_label_map(path)) return as(FileFacts::label_map, info_of_label_map(path));
  return as(FileFacts::other, info_of_model(path));
}

}  // namespace limber::detail
