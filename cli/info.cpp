#include "cli/body_report.h"
#include "cli/commands.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/mesh_files.h"
#include "core/npz.h"
#include "imaging/label_map.h"
#include "limber/detail/body/body.h"
#include "limber/detail/body/preview.h"
#include "limber/detail/plan/plan_folder.h"
#include "meshing/quality.h"
#include "render/png_file.h"
#include "scenes/library.h"

namespace limber::cli {

namespace {

Outcome outcome_of(Json json) {
  std::string text;
  for (const auto& [key, value] : json.items())
    text += fmt::format("{:28} {}\n", key, value.is_string() ? value.get<std::string>() : text_of(value));
  return {exit_done, std::move(json), text};
}

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

Outcome info_of_label_map(const fs::path& path) {
  const imaging::LabelMap map = imaging::read_label_map(path);
  std::vector<std::int64_t> voxels(map.labels.size(), 0);
  for (const std::uint16_t row : map.material) ++voxels[row];
  Json json{{"size", map.size}, {"notes", map.notes}, {"labels", Json::array()}};
  for (int d = 0; d < 3; ++d) json["voxel_m"].push_back(map.axes_m.col(d).norm());
  std::string text = fmt::format("{} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm\n", map.size[0],
                                 map.size[1], map.size[2], 1e3 * map.axes_m.col(0).norm(),
                                 1e3 * map.axes_m.col(1).norm(), 1e3 * map.axes_m.col(2).norm());
  for (const std::string& note : map.notes) text += note + "\n";
  text += fmt::format("{:>10}  {:24} {:>12} {:>12}\n", "label", "name", "voxels", "volume, ml");
  for (std::size_t row = 1; row < map.labels.size(); ++row) {
    const double volume_m3 = double(voxels[row]) * map.voxel_volume_m3();
    json["labels"].push_back({{"label", map.labels[row]},
                              {"name", map.names[row]},
                              {"voxels", voxels[row]},
                              {"volume_m3", volume_m3}});
    text += fmt::format("{:10}  {:24} {:12} {:12.2f}\n", map.labels[row], map.names[row], voxels[row],
                        1e6 * volume_m3);
  }
  return {exit_done, json, text};
}

// What a person needs to choose a part by its shell: where it is, how large, which colour in the pictures.
Json info_of_shells(const detail::PreparedBody& body, const std::vector<ConvexShell>& shells) {
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
    const Vec3 middle = box.center(), size = box.size(), color = 255 * detail::shell_color(s);
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

Outcome info_of_body(const fs::path& folder) {
  const detail::PreparedBody body = detail::read_body(folder);
  Json json = body.report;
  json["shell_list"] = info_of_shells(body, read_obj_shells(folder / "shells.obj"));
  std::string text = text_of_report(body.report);
  const auto place = [](const Json& v) {
    return fmt::format("({:8.4g} {:8.4g} {:8.4g})", v[0].get<double>(), v[1].get<double>(),
                       v[2].get<double>());
  };
  text +=
      "  shell        middle, m                     size, m                       tets  in "
      "preview-shells.png\n";
  for (const Json& s : json.at("shell_list"))
    text += fmt::format("  {:5}        {}  {}  {:5}  {}\n", s.at("shell").get<int>(), place(s.at("middle_m")),
                        place(s.at("size_m")), s.at("tets").get<int>(), s.at("color").get<std::string>());
  return {exit_done, json, text};
}

}  // namespace

Outcome info(const fs::path& path) {
  if (path.extension() == ".toml") return detail::info_of_scene(path);
  if (!fs::exists(path) && path.extension().empty())
    return detail::info_of_scene(scenes::find_scene(path.string()));
  if (fs::is_directory(path)) {
    if (fs::exists(path / "scene.toml")) return detail::info_of_scene(path / "scene.toml");
    if (fs::exists(path / "plan.npz")) return outcome_of(detail::read_plan_folder(path).summary);
    if (fs::exists(path / "report.json")) return info_of_body(path);
    throw InputError(fmt::format(
        "{}: holds none of plan.npz, report.json, scene.toml; nothing here is limber's", path.string()));
  }
  const std::string extension = path.extension().string();
  if (extension == ".msh") return outcome_of(info_of_cage(read_msh(path)));
  if (extension == ".npz") return outcome_of(info_of_npz(path));
  if (extension == ".json") return outcome_of(read_json(path));
  if (extension == ".png") {
    const auto png = render::inspect_png(path);
    if (!png) throw InputError(fmt::format("{}: is missing, no PNG, or cut short", path.string()));
    return outcome_of({{"width", png->width}, {"height", png->height}, {"texts", png->texts}});
  }
  if (imaging::is_label_map(path)) return info_of_label_map(path);
  return outcome_of(info_of_model(path));
}

Outcome list_scenes() {
  Json json = Json::array();
  std::string text;
  for (const scenes::KnownScene& known : scenes::known_scenes()) {
    const scenes::Scene scene = scenes::read_scene_file(known.file);
    json.push_back({{"name", known.name}, {"file", known.file.string()}, {"description", scene.description}});
    text += fmt::format("{:20} {}\n", known.name, scene.description);
  }
  return {exit_done, json, text};
}

}  // namespace limber::cli
