#include "limber/detail/world/scene_world.h"

#include <numbers>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "core/version.h"
#include "limber/detail/body/body_store.h"
#include "limber/detail/body/model_content.h"
#include "limber/detail/body/write_robot.h"
#include "limber/detail/world/seen.h"
#include "meshing/contact_shape.h"
#include "meshing/convex_hull.h"
#include "meshing/simplify.h"
#include "scenes/library.h"
#include "scenes/models.h"

namespace limber::detail {

namespace {

// Surfaces that near push each other, as a share of the robot's size; a field is off by less than that nearly
// everywhere.
constexpr double usual_contact_offset = 0.005;

// The lines of the scene that shape a body's meshes, as the user's text has them once more: a change of any
// makes them anew.
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
          {"position_m", list(body.pose.position_m)},
          {"axis", list(body.pose.axis)},
          {"angle_deg", body.pose.angle_deg},
          {"anchor", body.pose.anchor}};
}

std::string hash_of_made(const SurfaceMesh& made, const Appearance& appearance) {
  if (appearance.empty()) return hex(hash_of(made));
  Hasher hasher;
  hasher.value(hash_of(made)).matrix(appearance.uv);
  for (const ImageFile& image : appearance.images) hasher.text(image.bytes);
  return hex(hasher.digest());
}

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
      scenes::transform(scenes::world_from_model(body, model.surface.positions, false),
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
    scenes::transform(scenes::world_from_model(body, made.positions, true), model.surface.positions);
    return model;
  };
  source.made_cage = [&body, made] {
    std::optional<TetMesh> cage = scenes::made_cage(body);
    if (cage) scenes::transform(scenes::world_from_model(body, made.positions, true), cage->positions);
    return cage;
  };
  return source;
}

}  // namespace

namespace {

fs::path scenery_file(const fs::path& work_folder, const scenes::BodySpec& body, const char* extension) {
  return work_folder / "scenery" / (body.name + extension);
}

// A model that is not found loads an empty mesh: without scenery a scene is still what it is.
BodySource source_of_scenery(const scenes::Scene& scene, const scenes::BodySpec& body,
                             const std::vector<fs::path>& data) {
  BodySource source;
  try {
    source = source_of(scene, body, data);
    if (!source.warning.empty()) log::warn("{}", source.warning);
  } catch (const InputError& error) {
    log::warn("{}. It is left out of the pictures.", error.what());
    source.model = "nothing";
    source.load = [] { return meshing::ImportedModel{}; };
  }
  source.identity["triangles"] = body.triangles;
  return source;
}

SurfaceMesh make_scenery(const scenes::BodySpec& body, const BodySource& source) {
  SurfaceMesh surface = source.load().surface;
  if (body.triangles > 0) surface = meshing::simplify(surface, body.triangles);
  return surface;
}

// Of a scenery's NAME.json: whether its model was found.
bool was_found(const Json& said) {
  return !said.is_object() || !said.contains("input") || said.at("input").contains("model");
}
Json hash_of_scenery(const fs::path& mesh, const Json& said) {
  return was_found(said) ? Json(hex(hash_of(std::string_view(read_file(mesh))))) : Json();
}

// NAME.ply, and beside it NAME.json, which says where it comes from. Of a model that was not found there is
// no mesh, and the hash is null.
void prepare_scenery(const scenes::Scene& scene, const scenes::BodySpec& body,
                     const std::vector<fs::path>& data, const fs::path& work_folder) {
  const BodySource source = source_of_scenery(scene, body, data);
  const fs::path mesh = scenery_file(work_folder, body, ".ply"),
                 origin = scenery_file(work_folder, body, ".json");
  try {
    const Json made = read_json(origin);
    if (made.at("version") == version && made.at("input") == source.identity &&
        made.at("hash") == hash_of_scenery(mesh, made))
      return;
  } catch (const InputError&) {
  } catch (const Json::exception&) {
  }
  log::info("{}: reading {}", mesh.string(), source.model);
  make_folder(mesh.parent_path());
  const Json input = {{"version", version}, {"input", source.identity}};
  if (was_found(input))
    write_ply(mesh, make_scenery(body, source));
  else
    fs::remove(mesh);
  Json told = input;
  told["hash"] = hash_of_scenery(mesh, input);
  write_json(origin, told);
}

}  // namespace

fs::path body_folder(const fs::path& work_folder, const scenes::BodySpec& body) {
  return work_folder / "bodies" / body.name;
}

namespace {

PrepareSettings settings_of(const scenes::BodySpec& body) {
  return {.shells = body.cage.shells, .tets = body.cage.tets, .mode = body.cage.mode, .only = {}};
}

fs::path goal_cage_file(const scenes::Scene& scene, const fs::path& work_folder) {
  return body_folder(work_folder, scene.bodies[std::size_t(scene.robot)]) / "goal.msh";
}

bool has_goal_cage(const scenes::Scene& scene) { return scene.goal.shape && !scene.goal.shape->cage.empty(); }

// A copy of goal.shape.cage lies in the robot's folder: a scene that is read from a plan knows no folder.
void keep_goal_cage(const scenes::Scene& scene, std::vector<fs::path> folders, const fs::path& work_folder) {
  const fs::path copy = goal_cage_file(scene, work_folder);
  if (!has_goal_cage(scene)) {
    fs::remove(copy);
    return;
  }
  const std::optional<fs::path> file = find_goal_cage(scene, std::move(folders));
  if (!file && fs::exists(copy)) return;
  write_msh(copy, read_msh(file.value_or(scene.folder / scene.goal.shape->cage)));
}

}  // namespace

std::optional<fs::path> find_goal_cage(const scenes::Scene& scene, std::vector<fs::path> folders) {
  folders.push_back(scene.folder);
  for (const fs::path& folder : folders)
    if (const fs::path file = folder / scene.goal.shape->cage; fs::exists(file)) return file;
  return std::nullopt;
}

Json prepare_body_of(const scenes::Scene& scene, const scenes::BodySpec& body,
                     const std::vector<fs::path>& data, const fs::path& work_folder, BodyStore* store) {
  throw_if_stopped();
  const BodySource source = source_of(scene, body, data);
  if (!source.warning.empty()) log::warn("{}", source.warning);
  return prepare_body(source, settings_of(body), body_folder(work_folder, body), store);
}

void prepare_beside(const scenes::Scene& scene, const std::vector<fs::path>& data,
                    const fs::path& work_folder) {
  keep_goal_cage(scene, data, work_folder);
  for (const scenes::BodySpec& body : scene.scenery) {
    throw_if_stopped();
    prepare_scenery(scene, body, data, work_folder);
  }
}

std::vector<PreparedBody> prepare_bodies(const scenes::Scene& scene, const std::vector<fs::path>& data,
                                         const fs::path& work_folder, const fs::path& store_folder) {
  std::optional<BodyStore> store;
  if (!store_folder.empty()) store.emplace(store_folder);
  for (const scenes::BodySpec& body : scene.bodies)
    prepare_body_of(scene, body, data, work_folder, store ? &*store : nullptr);
  prepare_beside(scene, data, work_folder);
  return read_bodies(scene, work_folder);
}

LoadedModel load_model(const scenes::Scene& scene, const scenes::BodySpec& body,
                       const std::vector<fs::path>& data) {
  const BodySource source = source_of(scene, body, data);
  if (!source.warning.empty()) log::warn("{}", source.warning);
  meshing::ImportedModel model = source.load();
  look_into_images(model.appearance, model.warnings);
  return {source.model, std::move(model), source.made_cage()};
}

SurfaceMesh load_scenery(const scenes::Scene& scene, const scenes::BodySpec& body,
                         const std::vector<fs::path>& data) {
  return make_scenery(body, source_of_scenery(scene, body, data));
}

Json identity_of(const scenes::Scene& scene, const scenes::BodySpec& body,
                 const std::vector<fs::path>& data) {
  return input_of(source_of(scene, body, data).identity, settings_of(body));
}

namespace {

// Triangle for triangle, but for the rounding of other machines.
bool same_surface(const SurfaceMesh& a, const SurfaceMesh& b) {
  return a.positions.rows() == b.positions.rows() && a.triangles.rows() == b.triangles.rows() &&
         a.triangles == b.triangles &&
         (a.positions.rows() == 0 || (a.positions - b.positions).rowwise().norm().maxCoeff() <=
                                         1e-9 * bounding_box(a.positions).diagonal());
}

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
  const Json said = read_json(scenery_file(work_folder, body, ".json"));
  if (!was_found(said)) {
    // Only a file is ever not found.
    const auto* file = std::get_if<scenes::FileModel>(&body.model);
    origin.placed_so = file && file->made.empty() &&
                       said == Json{{"version", said.value("version", "")},
                                    {"input", {{"triangles", body.triangles}}},
                                    {"hash", Json()}} &&
                       !fs::exists(mesh);
    return origin;
  }
  try {
    Json identity = identity_of(body, said.at("input").at("model").at("source").get<std::string>());
    identity["triangles"] = body.triangles;
    origin.placed_so = said.at("input") == identity && said.at("hash") == hash_of_scenery(mesh, said);
    if (const auto* file = std::get_if<scenes::FileModel>(&body.model);
        file && !scenes::find_model(file->file, with(data, scene.folder)))
      return origin;
    const BodySource found = source_of_scenery(scene, body, data);
    if (found.identity == said.at("input"))
      origin.same_surface = same_surface(make_scenery(body, found), read_ply(mesh));
  } catch (const Json::exception&) {
    origin.placed_so = false;
  }
  return origin;
}

Origin origin_of(const scenes::Scene& scene, const scenes::BodySpec& body, const std::vector<fs::path>& data,
                 const PreparedBody& prepared) {
  const Json& said = prepared.report.at("input");
  Origin origin;
  if (!prepared.appearance.empty()) origin.appearance = Appearing::not_here;
  try {
    const std::string source = said.at("model").at("model").at("source").get<std::string>();
    origin.placed_so = said == input_of(identity_of(body, source), settings_of(body));
    const auto* file = std::get_if<scenes::FileModel>(&body.model);
    if (file && !scenes::find_model(file->file, with(data, scene.folder))) {
      const std::optional<SurfaceMesh> made = scenes::made_surface(body);
      if (!made || source != hash_of_made(*made, scenes::made_appearance(body, *made))) return origin;
    }
    const BodySource found = source_of(scene, body, data);
    // A file may have changed, or another of its name lie here.
    if (file && found.identity.at("model").at("source") != source) return origin;
    meshing::ImportedModel model = found.load();
    make_model_of_body(model, settings_of(body));
    origin.same_surface = same_surface(model.surface, prepared.surface);
    if (!model.appearance.empty() || !prepared.appearance.empty())
      origin.appearance = *origin.same_surface && same_appearance(model.appearance, prepared.appearance)
                              ? Appearing::same
                              : Appearing::another;
    origin.made_cage = found.made_cage();
  } catch (const Json::exception&) {
    origin.placed_so = false;
  }
  return origin;
}

std::vector<SurfaceMesh> read_scenery(const scenes::Scene& scene, const fs::path& work_folder) {
  std::vector<SurfaceMesh> meshes;
  for (const scenes::BodySpec& body : scene.scenery) {
    const fs::path file = scenery_file(work_folder, body, ".ply");
    try {
      const Json said = read_json(scenery_file(work_folder, body, ".json"));
      meshes.push_back(was_found(said) ? read_ply(file) : SurfaceMesh{});
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}; make it anew with limber plan", error.what()));
    }
  }
  return meshes;
}

std::vector<PreparedBody> read_bodies(const scenes::Scene& scene, const fs::path& work_folder) {
  std::vector<PreparedBody> bodies;
  for (const scenes::BodySpec& body : scene.bodies) {
    bodies.push_back(read_body(body_folder(work_folder, body)));
    bodies.back().deformation = body.deformation;
  }
  if (has_goal_cage(scene))
    bodies[std::size_t(scene.robot)].goal_shape_m = read_msh(goal_cage_file(scene, work_folder)).positions;
  return bodies;
}

namespace {

fem::BodyKind kind_of(const scenes::BodySpec& body) {
  if (body.kind == scenes::Kind::deformable) return fem::BodyKind::deformable;
  return body.role == scenes::Role::obstacle ? fem::BodyKind::immovable : fem::BodyKind::rigid;
}

void set_script(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared, fem::WorldSpec& spec) {
  for (const scenes::MotionSpec& motion : scene.motions) {
    fem::BodySpec& body = spec.bodies[std::size_t(motion.body)];
    body.kind = fem::BodyKind::kinematic;
    body.track.pivot_m = scene.bodies[std::size_t(motion.body)].pose.position_m;
    for (const scenes::MotionSpec::Keyframe& k : motion.keyframes)
      body.track.keyframes.push_back({k.at_s, k.position_m, k.angle_deg * std::numbers::pi / 180 * k.axis});
  }
  for (const scenes::ForceSpec& force : scene.forces) {
    fem::ForceSpec& made =
        spec.forces.emplace_back(fem::ForceSpec{force.body, force.from_s, force.to_s, force.force_n});
    if (!force.box_m) continue;
    const std::string& name = scene.bodies[std::size_t(force.body)].name;
    made.nodes =
        scenes::nodes_in(*force.box_m, scene.bounds_m, prepared[std::size_t(force.body)].cage.positions);
    if (made.nodes.empty())
      throw InputError(
          fmt::format("{}: no node of the cage of {} is in the box of this force; enlarge or move it",
                      force.where, name));
    const std::vector<int>& held = spec.bodies[std::size_t(force.body)].fixed_nodes;
    if (std::includes(held.begin(), held.end(), made.nodes.begin(), made.nodes.end()))
      throw InputError(
          fmt::format("{}: all nodes of {} in the box of this force are held, so it moves nothing; "
                      "move the box, or hold fewer",
                      force.where, name));
  }
}

// The cage weighs what the model does, as far as that has an inside.
double share_of_the_cage(const PreparedBody& prepared) {
  return std::min(1., mass_of(prepared).of.volume_m3 / volume(prepared.cage));
}

// What the parts of a body say, tet by tet.
void set_parts(const scenes::BodySpec& body, const PreparedBody& prepared, double share, fem::BodySpec& out) {
  if (body.parts.empty()) return;
  const Tets& tets = prepared.cage.tets;
  const int shells = prepared.report.at("shells").at("count").get<int>();
  out.youngs_modulus_from_tet_pa.assign(std::size_t(tets.rows()), body.material.youngs_modulus_pa);
  out.density_from_tet_kg_m3.assign(std::size_t(tets.rows()), out.material.density_kg_m3);
  for (const scenes::PartSpec& part : body.parts) {
    if (part.shell && *part.shell >= shells)
      throw InputError(
          fmt::format("{}: bodies.{}.parts: there is no shell {}; the body has {}, numbered from 0 (limber "
                      "info on its folder "
                      "shows them)",
                      part.where, body.name, *part.shell, shells));
    int chosen = 0;
    for (int t = 0; t < tets.rows(); ++t) {
      Vec3 middle = Vec3::Zero();
      for (int i = 0; i < 4; ++i) middle += prepared.cage.positions.row(tets(t, i)).transpose() / 4;
      const bool in_box = (middle.array() >= part.box_m.lower.array()).all() &&
                          (middle.array() <= part.box_m.upper.array()).all();
      if (part.shell ? prepared.shell_from_tet[std::size_t(t)] != *part.shell : !in_box) continue;
      ++chosen;
      if (part.youngs_modulus_pa) out.youngs_modulus_from_tet_pa[std::size_t(t)] = *part.youngs_modulus_pa;
      if (part.density_kg_m3) out.density_from_tet_kg_m3[std::size_t(t)] = share * *part.density_kg_m3;
    }
    if (chosen == 0)
      throw InputError(
          fmt::format("{}: bodies.{}.parts: {}; {}", part.where, body.name,
                      part.shell ? fmt::format("no tet of the cage has its middle in shell {}", *part.shell)
                                 : std::string("no tet of the cage has its middle in that box"),
                      part.shell ? "ask for more tets, fewer shells, or give a box_m"
                                 : "enlarge or move it, or ask for more tets"));
  }
}

}  // namespace

GoalRules goal_rules_of(const scenes::Scene& scene) {
  const auto rules_of = [](const scenes::Goal& goal) {
    GoalRules rules;
    rules.body = goal.moves_with, rules.lost_below_m = goal.lost_below_m;
    if (goal.shape)
      rules.turn_tolerance_deg = goal.shape->turn_tolerance_deg,
      rules.shape_tolerance_m = goal.shape->tolerance_m;
    rules.above = goal.above, rules.below = goal.below, rules.clear_of = goal.clear_of;
    return rules;
  };
  GoalRules rules = rules_of(scene.goal);
  for (const scenes::Via& via : scene.via) rules.via.push_back(rules_of(via.goal));
  return rules;
}

namespace {

Points goal_shape(const scenes::Scene& scene, const PreparedBody& robot) {
  const scenes::Goal::Shape& shape = *scene.goal.shape;
  const Points& rest = robot.cage.positions;
  if (has_goal_cage(scene)) {
    if (robot.goal_shape_m.rows() != rest.rows())
      throw InputError(
          fmt::format("{}: goal.shape.cage has {} nodes, the robot's cage {}; deform the cage.msh of its "
                      "folder in bodies/",
                      shape.cage, robot.goal_shape_m.rows(), rest.rows()));
    return robot.goal_shape_m;
  }
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(shape.angle_deg * std::numbers::pi / 180, shape.axis).toRotationMatrix();
  return rest * (turn * shape.stretch.asDiagonal()).transpose();
}

}  // namespace

namespace {

// Of a body that is touched at its cage among others that are not: the cage is its surface.
ContactShape shape_of_cage(const TetMesh& cage) {
  return meshing::make_contact_shape({cage.positions, boundary_triangles(cage.tets)}, cage);
}

double hull_volume(const Points& positions) {
  const ConvexShell hull = meshing::convex_hull(positions);
  return volume(SurfaceMesh{hull.vertices, hull.triangles});
}

// The farthest along evenly many directions.
Points some_extreme_points(const Points& positions) {
  constexpr int along_an_edge = 6;  // of a cube, through whose surface the directions go
  std::set<Eigen::Index> rows;
  for (int i = -along_an_edge; i <= along_an_edge; ++i)
    for (int j = -along_an_edge; j <= along_an_edge; ++j)
      for (int axis = 0; axis < 3; ++axis) {
        Vec3 direction;
        direction[axis] = along_an_edge, direction[(axis + 1) % 3] = i, direction[(axis + 2) % 3] = j;
        const Eigen::VectorXd heights = positions * direction;
        Eigen::Index least, most;
        heights.minCoeff(&least), heights.maxCoeff(&most);
        rows.insert({least, most});
      }
  return positions(std::vector<Eigen::Index>(rows.begin(), rows.end()), Eigen::all);
}

// Whether parts of a surface can meet without folding it flat: it is far from convex. The hull of some points
// is within that of all, and says so at once of most models.
bool can_reach_itself(const PreparedBody& body) {
  constexpr double convex = 0.9;  // of its hull
  const double filled = std::abs(volume(body.surface));
  return filled < convex * hull_volume(some_extreme_points(body.surface.positions)) ||
         filled < convex * hull_volume(body.surface.positions);
}

// Contact at the fine surfaces, unless all bodies are touched at their cages.
void set_contact(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared,
                 fem::WorldSpec& spec) {
  const bool all_cages = all_touched_at_cages(scene);
  for (std::size_t b = 0; b < prepared.size(); ++b) {
    throw_if_stopped();
    const scenes::BodySpec& body = scene.bodies[b];
    const bool on_surface = body.contact == scenes::Contact::surface && prepared[b].contact.usable;
    spec.bodies[b].phong = !all_cages && body.deformation == scenes::Deformation::phong;
    if (!all_cages)
      spec.bodies[b].shape = std::make_shared<const ContactShape>(
          on_surface ? prepared[b].contact : shape_of_cage(prepared[b].cage));
    spec.bodies[b].self_contact =
        body.self_contact ? *body.self_contact : on_surface && can_reach_itself(prepared[b]);
  }
  const Box robot = bounding_box(prepared[std::size_t(scene.robot)].surface.positions);
  spec.contact_offset_m = contact_offset_m(scene, robot);
  // What is promised of what is seen, less what fields may be off by.
  if (!all_cages)
    spec.max_overlap_m =
        (SeenLimits{}.overlap - meshing::ContactShapeSettings{}.field_error) * robot.size().maxCoeff();
}

}  // namespace

double contact_offset_m(const scenes::Scene& scene, const Box& robot) {
  return scene.contact_offset_m.value_or(usual_contact_offset * robot.size().maxCoeff());
}

bool all_touched_at_cages(const scenes::Scene& scene) {
  return std::all_of(scene.bodies.begin(), scene.bodies.end(),
                     [](const scenes::BodySpec& body) { return body.contact == scenes::Contact::cage; });
}

fem::World build_world(const scenes::Scene& scene, const std::vector<PreparedBody>& prepared,
                       const std::vector<float>& start_positions) {
  fem::WorldSpec spec;
  for (std::size_t b = 0; b < prepared.size(); ++b) {
    const scenes::BodySpec& body = scene.bodies[b];
    fem::BodySpec fem_body;
    fem_body.name = body.name;
    fem_body.cage = prepared[b].cage;
    const double share = share_of_the_cage(prepared[b]);
    fem_body.material = {.model = body.material.model == "springs" ? fem::MaterialModel::springs
                                                                   : fem::MaterialModel::neo_hookean,
                         .youngs_modulus_pa = body.material.youngs_modulus_pa,
                         .poisson_ratio = body.material.poisson_ratio,
                         .density_kg_m3 = share * body.material.density_kg_m3,
                         .damping_ratio = body.material.damping_ratio,
                         .friction = body.material.friction,
                         .mesh_independent = body.material.mesh_independent};
    fem_body.fixed_nodes = scenes::fixed_nodes(body, scene.bounds_m, prepared[b].cage.positions);
    fem_body.kind = kind_of(body);
    fem_body.velocity_m_s = body.velocity_m_s, fem_body.angular_velocity_rad_s = body.angular_velocity_rad_s;
    fem_body.max_volume_change = body.max_volume_change;
    if (body.max_stretch && *body.max_stretch < scenes::any_stretch) fem_body.max_stretch = *body.max_stretch;
    set_parts(body, prepared[b], share, fem_body);
    spec.bodies.push_back(std::move(fem_body));
  }
  set_script(scene, prepared, spec);
  set_contact(scene, prepared, spec);
  spec.robot = scene.robot;
  spec.bounds_m = scene.bounds_m;
  spec.walls = scene.walls;
  spec.gravity_m_s2 = scene.gravity_m_s2;
  spec.rest_speed_m_s = scene.rest_speed_m_s;
  if (scene.goal.shape) spec.goal_shape_m = goal_shape(scene, prepared[std::size_t(scene.robot)]);
  spec.max_dt_s = scene.max_dt_s.value_or(0);
  spec.part_overlaps = scene.part_overlaps;
  spec.start_positions = start_positions;
  try {
    return fem::build_world(spec);
  } catch (const InputError& error) {
    for (const scenes::BodySpec& body : scene.bodies)  // the first that is named has the place
      if (fmt::format(" {} ", error.what()).find(fmt::format(" {} ", body.name)) != std::string::npos ||
          std::string_view(error.what()).find(fmt::format("body {}:", body.name)) != std::string_view::npos)
        throw InputError(fmt::format("{}: {}", body.where, error.what()));
    throw InputError(fmt::format("scene {}: {}", scene.name, error.what()));
  }
}

}  // namespace limber::detail
