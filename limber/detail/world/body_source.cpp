// Models of bodies and scenery: found, or made, and turned as the scene says.
//
// A source knows its identity before anything is loaded, so whoever asks whether a body is up to date reads
// no more than the bytes of the model file. Loading and making are functions in it, called only where the
// body is made anew. A model that is made has no file; its identity has the hash of its mesh, so that a
// limber that makes it otherwise makes the body anew, too.
#include "limber/detail/world/body_source.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "limber/detail/body/model_content.h"
#include "limber/detail/world/scene_world.h"
#include "meshing/simplify.h"
#include "scenes/library.h"
#include "scenes/models.h"

namespace limber::detail {

Json identity_of(const scenes::BodySpec& body, const std::string& model_hash) {
  const auto list = [](const auto& v) { return Json(std::vector<double>(v.data(), v.data() + v.size())); };
  Json model{{"source", model_hash}};
  if (const auto* file = std::get_if<scenes::FileModel>(&body.model))
    model.update({{"scale", file->scale},
                  {"height_m", file->height_m.value_or(0)},
                  {"up", list(file->up)},
                  {"front", list(file->front)}});
  if (const auto* made = std::get_if<scenes::MadeModel>(&body.model)) model["height_m"] = made->height_m;
  return {{"model", model},
          {"cells", {body.cage.cells.x(), body.cage.cells.y(), body.cage.cells.z()}},
          {"cell_m", body.cage.cell_m},
          {"axis", list(body.pose.axis)},
          {"angle_deg", body.pose.angle_deg},
          {"anchor", body.pose.anchor}};
}

Json identity_of_scenery(const scenes::BodySpec& body, Json identity) {
  const Vec3& at = body.pose.position_m;
  identity["position_m"] = {at.x(), at.y(), at.z()};
  identity["triangles"] = body.triangles;
  return identity;
}

namespace {

struct Placed {
  struct Model {
    std::string source;
    template <class Fields>
    void fields(Fields& f) {
      f("source", source);
    }
  };
  Model model;
  template <class Fields>
  void fields(Fields& f) {
    f("model", model);
  }
};

}  // namespace

std::optional<std::string> model_hash_in(const Json& identity) {
  const auto placed = fields_or_nothing<Placed>(identity);
  return placed ? std::optional(placed->model.source) : std::nullopt;
}

std::string hash_of_made(const SurfaceMesh& made, const Appearance& appearance) {
  if (appearance.empty()) return hex(hash_of(made));
  Hasher hasher;
  hasher.value(hash_of(made)).matrix(appearance.uv);
  for (const ImageFile& image : appearance.images) hasher.text(image.bytes);
  return hex(hasher.digest());
}

// Self-intersections of scenery are not counted, for nothing touches it. A made model with an appearance must
// come out of the mending as it went in, for its appearance is by the corners of its triangles.
BodySource source_of(const scenes::Scene& scene, const scenes::BodySpec& body,
                     std::vector<fs::path> folders) {
  folders.push_back(scene.folder);
  BodySource source;
  std::optional<fs::path> path;
  if (const auto* file = std::get_if<scenes::FileModel>(&body.model)) {
    path = scenes::find_model(file->file, folders);
    if (!path && file->made.empty())
      throw InputError(fmt::format("scene {}: body {}: {}", scene.name, body.name,
                                   scenes::how_to_get_model(file->file, folders)));
    if (!path)
      source.warning = fmt::format("body {}: {}. The made model \"{}\" takes its place.", body.name,
                                   scenes::how_to_get_model(file->file, folders), file->made);
  }
  if (path) {
    source.model = path->filename().string();
    const ModelContent content = content_of_model(*path);
    source.identity = identity_of(body, content.file_hash);
    source.content = content.content, source.ending = content.ending;
    source.load = [&body, file = *path] {
      meshing::ImportedModel model =
          meshing::import_model(file, {.count_self_intersections = body.role != scenes::Role::scenery});
      scenes::transform(scenes::own_from_model(body, model.surface.positions, false),
                        model.surface.positions);
      return model;
    };
    return source;
  }
  const SurfaceMesh made = scenes::made_surface(body).value();
  const Appearance appearance = scenes::made_appearance(body, made);
  source.model = fmt::format("made model of body {}", body.name);
  source.identity = identity_of(body, hash_of_made(made, appearance));
  source.load = [&body, made, appearance] {
    meshing::ImportedModel model = meshing::clean(made, {}, "made model");
    LIMBER_CHECK(appearance.empty() || model.surface.triangles == made.triangles, body.name);
    model.appearance = appearance;
    scenes::transform(scenes::own_from_model(body, made.positions, true), model.surface.positions);
    return model;
  };
  source.made_cage = [&body, made] {
    std::optional<TetMesh> cage = scenes::made_cage(body);
    if (cage) scenes::transform(scenes::own_from_model(body, made.positions, true), cage->positions);
    return cage;
  };
  return source;
}

// ---- scenery ----

fs::path scenery_file(const fs::path& work_folder, const scenes::BodySpec& body, const char* extension) {
  return work_folder / "scenery" / (body.name + extension);
}

BodySource source_of_scenery(const scenes::Scene& scene, const scenes::BodySpec& body,
                             const std::vector<fs::path>& data) {
  BodySource source;
  try {
    source = source_of(scene, body, data);
    if (!source.warning.empty()) log::warn("{}", source.warning);
    source.identity = identity_of_scenery(body, std::move(source.identity));
  } catch (const InputError& error) {
    log::warn("{}. It is left out of the pictures.", error.what());
    source.model = "nothing";
    source.identity["triangles"] = body.triangles;
    source.load = [] { return meshing::ImportedModel{}; };
  }
  return source;
}

SurfaceMesh make_scenery(const scenes::BodySpec& body, const BodySource& source) {
  SurfaceMesh surface = source.load().surface;
  surface.positions.rowwise() += body.pose.position_m.transpose();
  if (body.triangles > 0) surface = meshing::simplify(surface, body.triangles);
  return surface;
}

bool was_found(const Json& identity) { return identity.contains("model"); }
std::optional<std::string> hash_of_scenery(const fs::path& mesh, const Json& identity) {
  if (!was_found(identity)) return std::nullopt;
  return hex(hash_of(std::string_view(read_file(mesh))));
}

// ---- what is asked of prepare, and the goal's shape ----

PrepareSettings settings_of(const scenes::BodySpec& body) {
  return {.shells = body.cage.shells, .tets = body.cage.tets, .mode = body.cage.mode, .only = {}};
}

fs::path goal_cage_file(const scenes::Scene& scene, const fs::path& work_folder) {
  return body_folder(work_folder, scene.bodies[std::size_t(scene.robot)]) / "goal.msh";
}

bool has_goal_cage(const scenes::Scene& scene) { return scene.goal.shape && !scene.goal.shape->cage.empty(); }

}  // namespace limber::detail
