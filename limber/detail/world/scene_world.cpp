// From a scene to prepared bodies in a work folder, and back from the folder.
//
// A body is prepared anew only where something that shapes its meshes has changed: its report holds the
// identity of its source (body_source.h) and its settings, and prepare_body compares. Bodies are made in
// their own frame and moved to their place when they are read, so one that is moved in the scene is not made
// anew, and those that are the same but for their place are made once. Scenery is kept the same way, with a
// small file beside its mesh, but in world coordinates. What becomes of the bodies in the world is in
// build_world.cpp.
#include "limber/detail/world/scene_world.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <set>

#include "core/error.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "core/threads.h"
#include "core/version.h"
#include "limber/detail/body/body_store.h"
#include "limber/detail/world/body_source.h"

namespace limber::detail {

namespace {

// Whether a work folder's scenery is what this source makes, whole.
bool has_scenery(const fs::path& work_folder, const scenes::BodySpec& body, const Json& identity) try {
  const fs::path origin = scenery_file(work_folder, body, ".json");
  const SceneryOrigin made = read_fields<SceneryOrigin>(read_json(origin), origin.string(), "");
  return made.version == version && made.input == identity &&
         made.hash == hash_of_scenery(scenery_file(work_folder, body, ".ply"), identity);
} catch (const InputError&) {
  return false;
}

// NAME.ply, and beside it NAME.json, which says where it comes from. Of a model that was not found there is
// no mesh, and the hash is null. Files that are missing or damaged are made anew, or are those of the work
// folder `like`, where that has the same.
void prepare_scenery(const scenes::BodySpec& body, const BodySource& source, const fs::path& work_folder,
                     const fs::path& like) {
  if (has_scenery(work_folder, body, source.identity)) return;
  const fs::path mesh = scenery_file(work_folder, body, ".ply"),
                 origin = scenery_file(work_folder, body, ".json");
  const bool is_there = !like.empty() && has_scenery(like, body, source.identity);
  log::info("{}: {} {}", mesh.string(), is_there ? "as in" : "reading",
            is_there ? like.string() : source.model);
  make_folder(mesh.parent_path());
  if (!was_found(source.identity))
    fs::remove(mesh);
  else if (is_there)
    write_file(mesh, read_file(scenery_file(like, body, ".ply")));
  else
    write_ply(mesh, make_scenery(body, source));
  write_json(origin,
             json_of_fields(SceneryOrigin{version, source.identity, hash_of_scenery(mesh, source.identity)}));
}

// The copy stays where the file is not found any more: the scene may come from a plan, whose folder has the
// copy alone.
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

// Other programs may number nodes anew when they write a mesh, and its shape would be another. Tets and their
// corners may come in any order, and how many nodes there are is build_world's to say.
void require_same_numbers(const TetMesh& goal, const TetMesh& robot, const std::string& file) {
  const auto nodes_of = [](const TetMesh& mesh, Eigen::Index t) {
    std::array<int, 4> nodes{mesh.tets(t, 0), mesh.tets(t, 1), mesh.tets(t, 2), mesh.tets(t, 3)};
    std::sort(nodes.begin(), nodes.end());
    return nodes;
  };
  if (goal.positions.rows() != robot.positions.rows()) return;
  std::set<std::array<int, 4>> known;
  for (Eigen::Index t = 0; t < robot.tets.rows(); ++t) known.insert(nodes_of(robot, t));
  for (Eigen::Index t = 0; t < goal.tets.rows(); ++t)
    if (!known.contains(nodes_of(goal, t)))
      throw InputError(fmt::format(
          "{}: goal.shape.cage: element {} joins nodes that no tet of the robot's cage joins; its "
          "nodes were numbered anew: deform the cage.msh of its folder in bodies/, and keep its "
          "numbers",
          file, t + 1));
}

}  // namespace

fs::path body_folder(const fs::path& work_folder, const scenes::BodySpec& body) {
  return work_folder / "bodies" / body.name;
}

std::optional<fs::path> find_goal_cage(const scenes::Scene& scene, std::vector<fs::path> folders) {
  folders.push_back(scene.folder);
  for (const fs::path& folder : folders)
    if (const fs::path file = folder / scene.goal.shape->cage; fs::exists(file)) return file;
  return std::nullopt;
}

void prepare_beside(const scenes::Scene& scene, const std::vector<fs::path>& data,
                    const fs::path& work_folder, const fs::path& like) {
  keep_goal_cage(scene, data, work_folder);
  std::vector<BodySource> sources;
  for (const scenes::BodySpec& body : scene.scenery) sources.push_back(source_of_scenery(scene, body, data));
  side_by_side(int(sources.size()), [&](int i) {
    throw_if_stopped();
    const scenes::BodySpec& body = scene.scenery[std::size_t(i)];
    const ProgressOf progress(body.name);
    prepare_scenery(body, sources[std::size_t(i)], work_folder, like);
  });
}

std::vector<BodyReport> prepare_bodies_of(const scenes::Scene& scene, const std::vector<std::size_t>& bodies,
                                          const std::vector<fs::path>& data, const fs::path& work_folder,
                                          const fs::path& store_folder, const fs::path& like) {
  std::optional<BodyStore> store;
  if (!store_folder.empty()) store.emplace(store_folder);
  std::vector<BodySource> sources;
  for (const std::size_t b : bodies) {
    throw_if_stopped();
    sources.push_back(source_of(scene, scene.bodies[b], data));
    if (!sources.back().warning.empty()) log::warn("{}", sources.back().warning);
  }
  const bool is_alone = thread_count() == 1 || bodies.size() == 1;
  std::vector<BodyReport> reports(bodies.size());
  const auto prepare = [&](std::size_t i, const fs::path& same) {
    throw_if_stopped();
    const scenes::BodySpec& body = scene.bodies[bodies[i]];
    const ProgressOf progress(body.name);
    reports[i] = prepare_body(sources[i], settings_of(body), body_folder(work_folder, body),
                              {store ? &*store : nullptr, same, is_alone});
  };
  // The first of those that are the same is made, and the others are copied from it.
  std::vector<std::size_t> firsts, others, first_of(bodies.size());
  std::map<Json, std::size_t> known;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    first_of[i] =
        known.emplace(input_of(sources[i].identity, settings_of(scene.bodies[bodies[i]])), i).first->second;
    (first_of[i] == i ? firsts : others).push_back(i);
  }
  side_by_side(int(firsts.size()), [&](int k) {
    const std::size_t i = firsts[std::size_t(k)];
    prepare(i, like.empty() ? like : body_folder(like, scene.bodies[bodies[i]]));
  });
  side_by_side(int(others.size()), [&](int k) {
    const std::size_t i = others[std::size_t(k)];
    prepare(i, body_folder(work_folder, scene.bodies[bodies[first_of[i]]]));
  });
  return reports;
}

std::vector<PreparedBody> prepare_bodies(const scenes::Scene& scene, const std::vector<fs::path>& data,
                                         const fs::path& work_folder, const fs::path& store,
                                         const fs::path& like) {
  std::vector<std::size_t> all(scene.bodies.size());
  std::iota(all.begin(), all.end(), std::size_t(0));
  prepare_bodies_of(scene, all, data, work_folder, store, like);
  prepare_beside(scene, data, work_folder, like);
  return read_bodies(scene, work_folder);
}

LoadedModel load_model(const scenes::Scene& scene, const scenes::BodySpec& body,
                       const std::vector<fs::path>& data) {
  const BodySource source = source_of(scene, body, data);
  if (!source.warning.empty()) log::warn("{}", source.warning);
  meshing::ImportedModel model = source.load();
  look_into_images(model.appearance, model.warnings);
  std::optional<TetMesh> made_cage = source.made_cage();
  const Vec3& at = body.pose.position_m;
  model.surface.positions.rowwise() += at.transpose();
  if (made_cage) made_cage->positions.rowwise() += at.transpose();
  return {source.model, std::move(model), std::move(made_cage), input_of(source.identity, settings_of(body))};
}

SurfaceMesh load_scenery(const scenes::Scene& scene, const scenes::BodySpec& body,
                         const std::vector<fs::path>& data) {
  return make_scenery(body, source_of_scenery(scene, body, data));
}

Json identity_of(const scenes::Scene& scene, const scenes::BodySpec& body,
                 const std::vector<fs::path>& data) {
  return input_of(source_of(scene, body, data).identity, settings_of(body));
}

std::vector<SurfaceMesh> read_scenery(const scenes::Scene& scene, const fs::path& work_folder) {
  std::vector<SurfaceMesh> meshes;
  for (const scenes::BodySpec& body : scene.scenery) {
    const fs::path file = scenery_file(work_folder, body, ".ply");
    try {
      const auto said = fields_or_nothing<SceneryOrigin>(read_json(scenery_file(work_folder, body, ".json")));
      meshes.push_back(said && !was_found(said->input) ? SurfaceMesh{} : read_ply(file));
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}; make it anew with limber plan", error.what()));
    }
  }
  return meshes;
}

// How the surface follows its cage is the scene's to say, and no part of the body's files.
std::vector<PreparedBody> read_bodies(const scenes::Scene& scene, const fs::path& work_folder) {
  std::vector<PreparedBody> bodies;
  for (const scenes::BodySpec& body : scene.bodies) {
    bodies.push_back(read_body(body_folder(work_folder, body)));
    bodies.back().deformation = body.deformation;
    place(bodies.back(), body.pose.position_m);
  }
  if (has_goal_cage(scene)) {
    PreparedBody& robot = bodies[std::size_t(scene.robot)];
    const TetMesh goal = read_msh(goal_cage_file(scene, work_folder));
    require_same_numbers(goal, robot.cage, scene.goal.shape->cage);
    robot.goal_shape_m = goal.positions;
  }
  return bodies;
}

}  // namespace limber::detail
