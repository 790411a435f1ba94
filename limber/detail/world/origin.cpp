// Whether bodies, scenery and the goal's shape that lie in a work folder are those of the scene, and a body
// by itself that of its model: what limber verify asks. Models are read, or made, and turned again, and the
// meshes compared.
//
// Where the model's file is not here, or holds something else than the body was made from, nothing is said of
// the surface: that proves nothing either way. What the report says of pose, cage and settings is compared in
// every case. docs/verify.md, "Of each body".
#include <algorithm>

#include "core/error.h"
#include "core/hash.h"
#include "core/mesh_files.h"
#include "limber/detail/body/model_content.h"
#include "limber/detail/body/prepare.h"
#include "limber/detail/world/body_source.h"
#include "limber/detail/world/scene_world.h"
#include "scenes/library.h"
#include "scenes/models.h"

namespace limber::detail {

namespace {

// Triangle for triangle, but for the rounding of other machines.
bool same_surface(const SurfaceMesh& a, const SurfaceMesh& b) {
  return a.positions.rows() == b.positions.rows() && a.triangles.rows() == b.triangles.rows() &&
         a.triangles == b.triangles &&
         (a.positions.rows() == 0 || (a.positions - b.positions).rowwise().norm().maxCoeff() <=
                                         1e-9 * bounding_box(a.positions).diagonal());
}

// Coordinates and colours within a millionth, as files keep them with fewer digits; images byte for byte.
bool same_appearance(const Appearance& a, const Appearance& b) {
  const auto near = [](const auto& one, const auto& other) {
    return one.rows() == other.rows() &&
           (one.rows() == 0 || (one - other).cwiseAbs().maxCoeff() <= 1e-6 * (1 + one.cwiseAbs().maxCoeff()));
  };
  return near(a.uv, b.uv) && near(a.colors, b.colors) &&
         a.material_from_triangle == b.material_from_triangle &&
         std::equal(a.materials.begin(), a.materials.end(), b.materials.begin(), b.materials.end(),
                    [&](const SurfaceMaterial& one, const SurfaceMaterial& other) {
                      return one.name == other.name && near(one.color, other.color) &&
                             one.image == other.image && one.normal_image == other.normal_image;
                    }) &&
         std::equal(a.images.begin(), a.images.end(), b.images.begin(), b.images.end(),
                    [](const ImageFile& one, const ImageFile& other) {
                      return one.name == other.name && one.bytes == other.bytes;
                    });
}

std::vector<fs::path> with(std::vector<fs::path> folders, const fs::path& last) {
  folders.push_back(last);
  return folders;
}

}  // namespace

GoalCage goal_cage_of(const scenes::Scene& scene, const std::vector<fs::path>& data,
                      const std::vector<PreparedBody>& bodies) {
  if (!has_goal_cage(scene)) return GoalCage::none_asked;
  const std::optional<fs::path> file = find_goal_cage(scene, data);
  if (!file) return GoalCage::not_here;
  const Points asked = read_msh(*file).positions, &there = bodies[std::size_t(scene.robot)].goal_shape_m;
  return asked.rows() == there.rows() && asked == there ? GoalCage::same : GoalCage::another;
}

Origin origin_of_scenery(const scenes::Scene& scene, const scenes::BodySpec& body,
                         const std::vector<fs::path>& data, const fs::path& work_folder) {
  Origin origin;
  const fs::path mesh = scenery_file(work_folder, body, ".ply");
  const Json json = read_json(scenery_file(work_folder, body, ".json"));
  const auto said = fields_or_nothing<SceneryOrigin>(json);
  if (!said) return origin;
  const auto* file = std::get_if<scenes::FileModel>(&body.model);
  if (!was_found(said->input)) {
    // Only a file is ever not found.
    origin.placed_so = file && file->made.empty() && json == json_of_fields(*said) && !said->hash &&
                       said->input == Json{{"triangles", body.triangles}} && !fs::exists(mesh);
    return origin;
  }
  const std::optional<std::string> source = model_hash_in(said->input);
  if (!source) return origin;
  const Json identity = identity_of_scenery(body, identity_of(body, *source));
  origin.placed_so = said->input == identity && said->hash == hash_of_scenery(mesh, said->input);
  if (file && !scenes::find_model(file->file, with(data, scene.folder))) return origin;
  const BodySource found = source_of_scenery(scene, body, data);
  if (found.identity == said->input)
    origin.same_surface = same_surface(make_scenery(body, found), read_ply(mesh));
  return origin;
}

namespace {

// The words by which limber prepare was told to read a model.
ModelOptions words_of(const FileIdentity& identity, const fs::path& file) {
  ModelOptions words;
  words.model = file;
  words.scale = identity.scale, words.y_up = identity.y_up;
  if (const auto& label = identity.label) {
    words.label = label->name, words.label_gap = label->gap;
    words.label_rounds = label->rounds, words.min_island = label->min_island;
  }
  return words;
}

void compare(const meshing::ImportedModel& model, const PreparedBody& prepared, Origin& origin) {
  origin.same_surface = same_surface(model.surface, prepared.surface);
  const bool shows_own = prepared.report.input.settings.is_whole();
  if (shows_own && (!model.appearance.empty() || !prepared.appearance.empty()))
    origin.appearance = *origin.same_surface && same_appearance(model.appearance, prepared.appearance)
                            ? Appearing::same
                            : Appearing::another;
}

}  // namespace

Origin origin_of_model(const PreparedBody& prepared, const fs::path& file) {
  const BodyInput& said = prepared.report.input;
  Origin origin;
  if (!prepared.appearance.empty()) origin.appearance = Appearing::not_here;
  const std::string file_hash = content_of_model(file).file_hash;
  if (said.model.contains("model"))
    throw InputError(
        fmt::format("{}: the body was made for a scene; name that with --scene, and leave "
                    "--model out",
                    file.string()));
  const auto identity = fields_or_nothing<FileIdentity>(said.model);
  if (!identity || identity->file_hash != file_hash) return origin;
  const BodySource found = source_of(words_of(*identity, file), file);
  origin.placed_so = found.identity == said.model;
  meshing::ImportedModel model = found.load();
  make_model_of_body(model, said.settings);
  compare(model, prepared, origin);
  return origin;
}

// Where the file is not found, the body may have been made from the made model that takes its place: the hash
// tells.
Origin origin_of(const scenes::Scene& scene, const scenes::BodySpec& body, const std::vector<fs::path>& data,
                 const PreparedBody& prepared) {
  const BodyInput& said = prepared.report.input;
  Origin origin;
  if (!prepared.appearance.empty()) origin.appearance = Appearing::not_here;
  const std::optional<std::string> source = model_hash_in(said.model);
  if (!source) return origin;
  origin.placed_so = said.all == input_of(identity_of(body, *source), settings_of(body));
  const auto* file = std::get_if<scenes::FileModel>(&body.model);
  if (file && !scenes::find_model(file->file, with(data, scene.folder))) {
    const std::optional<SurfaceMesh> made = scenes::made_surface(body);
    if (!made || source != hash_of_made(*made, scenes::made_appearance(body, *made))) return origin;
  }
  const BodySource found = source_of(scene, body, data);
  // A file may have changed, or another of its name lie here.
  if (file && model_hash_in(found.identity) != source) return origin;
  meshing::ImportedModel model = found.load();
  make_model_of_body(model, settings_of(body));
  compare(model, prepared, origin);
  origin.made_cage = found.made_cage();
  return origin;
}

}  // namespace limber::detail
