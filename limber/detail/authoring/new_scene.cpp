#include "limber/detail/authoring/new_scene.h"

// A scene to begin with, from a folder of models in one frame: what a producer of scenes edits further.
#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/threads.h"
#include "imaging/label_map.h"
#include "limber/detail/authoring/part_models.h"
#include "limber/detail/authoring/story_text.h"
#include "limber/detail/world/scene_world.h"
#include "meshing/cage.h"
#include "meshing/contact_shape.h"
#include "scenes/models.h"
#include "scenes/scene.h"

namespace limber::detail {

namespace {

// The bodies as limber plan will prepare them, as far as a world asks for them.
std::vector<PreparedBody> bodies_of(const scenes::Scene& scene, const std::vector<Organ>& organs) {
  std::vector<PreparedBody> bodies(scene.bodies.size());
  parallel_for(int(bodies.size()), [&](int i) {
    throw_if_stopped();
    const scenes::BodySpec& body = scene.bodies[std::size_t(i)];
    const auto organ =
        std::find_if(organs.begin(), organs.end(), [&](const Organ& o) { return o.name == body.name; });
    SurfaceMesh surface = organ != organs.end() ? organ->surface : *scenes::made_surface(body);
    const auto to_world = scenes::world_from_model(body, surface.positions, organ == organs.end());
    scenes::transform(to_world, surface.positions);
    PreparedBody& prepared = bodies[std::size_t(i)];
    if (std::optional<TetMesh> cells = scenes::made_cage(body))
      scenes::transform(to_world, cells->positions), prepared.cage = std::move(*cells);
    else
      prepared.cage = meshing::build_cage(surface, {}, {.tets = body.cage.tets}).mesh;
    prepared.contact = meshing::make_contact_shape(surface, prepared.cage);
    prepared.surface = std::move(surface);
  });
  return bodies;
}

// The scene, after a look at what limber plan would say to it.
scenes::Scene laid_out(const NewSceneOptions& options, const std::vector<Organ>& organs, double scale) {
  try {
    scenes::Scene scene = scenes::read_scene(scene_text(organs, options, scale), options.out.string());
    build_world(scene, bodies_of(scene, organs));
    return scene;
  } catch (const InputError& error) {
    throw InputError(
        fmt::format("no scene is made of these ({} is {:.3g} m long with --scale {:g}; is that right?): {}",
                    options.robot, longest(organs, options.robot), options.scale, error.what()));
  }
}

// `where` is how the scene calls the folder: its models' names begin with that.
NewScene scene_of_folder(const NewSceneOptions& options, const std::string& where,
                         std::vector<std::string> notes) {
  std::vector<Organ> organs = read_organs(options);
  std::vector<std::string> candidates;
  for (Organ& organ : organs) {
    if (organ.thickness_m < min_thickness * organ.box.diagonal() && !organ.see_through && !organ.bone) {
      organ.see_through = true;
      notes.push_back(
          fmt::format("{} is only seen: it is a sheet, {:.2g} m thick", organ.name, organ.thickness_m));
    }
    const bool may_be_it = organ_moves(options) ? !organ.see_through && !organ.bone : !organ.see_through;
    if (may_be_it) candidates.push_back(organ.name);
  }
  if (std::count(candidates.begin(), candidates.end(), options.robot) == 0)
    throw InputError(fmt::format("--robot {}: {} has no such {}; there are: {}", options.robot,
                                 options.from.string(),
                                 organ_moves(options) ? "soft body (bones, hulls and sheets are none)"
                                                      : "body (hulls and sheets are none)",
                                 fmt::join(candidates, ", ")));
  const std::string tool = tool_name(options.story);
  if (std::any_of(organs.begin(), organs.end(), [&](const Organ& organ) { return organ.name == tool; }))
    throw InputError(fmt::format("{}: has a model called {}, as limber calls its own; give it another name",
                                 options.from.string(), tool));
  for (Organ& organ : organs) organ.file = where + organ.file;
  if (options.only.empty()) leave_out_doubles(organs, notes);
  log::info("making cages");
  parallel_for(int(organs.size()), [&](int i) {
    if (Organ& organ = organs[std::size_t(i)]; !organ.see_through) make_cage(options, organ);
  });
  const double scale = come_apart(options, organs);
  const scenes::Scene scene = laid_out(options, organs, scale);
  write_file(options.out, scene.text);
  NewScene made{.file = options.out,
                .bodies = scene.bodies.size(),
                .scenery = scene.scenery.size(),
                .scale = scale,
                .moved_m = {},
                .notes = std::move(notes),
                .data = where.empty() ? options.from : fs::path(),
                .plannable = options.story != Story::tour};
  for (const Organ& organ : organs)
    if (const double way = organ.way_m.norm(); way > 0) made.moved_m.emplace_back(organ.name, way);
  return made;
}

// Models are made beside the scene, which is then of those.
NewScene scene_of_parts(NewSceneOptions options) {
  const NewSceneOptions usual;
  if (options.scale != usual.scale || options.up != usual.up || options.front != usual.front)
    throw InputError(
        fmt::format("{}: says itself where up is and how long a unit; leave --scale, --up and --front out",
                    options.from.string()));
  const std::string name = options.out.stem().string() + "_models";
  const fs::path folder = options.out.parent_path() / name;
  PartModels made = make_part_models({options.from,
                                      options.labels,
                                      options.only,
                                      {options.label_gap, options.label_rounds, options.min_island}},
                                     folder);
  options.from = folder, options.only.clear();
  try {
    return scene_of_folder(options, name + "/", std::move(made.notes));
  } catch (...) {
    std::error_code none;
    fs::remove_all(folder, none);
    throw;
  }
}

}  // namespace

NewScene new_scene(const NewSceneOptions& options) {
  if (fs::exists(options.out))
    throw InputError(
        fmt::format("{}: is there already; choose another name, or remove it", options.out.string()));
  if (!options.goal.empty() && !organ_moves(options))
    throw InputError("--goal: in this story the robot does not move; leave it out");
  if (options.up.back() == options.front.back())
    throw InputError(fmt::format("--up {} and --front {} are the same axis; a body's front is across it",
                                 options.up, options.front));
  const bool scan = !fs::is_directory(options.from);
  if (scan && !imaging::is_label_map(options.from))
    throw InputError(fmt::format("{}: is neither a folder of models nor a label map (NIfTI or NRRD)",
                                 options.from.string()));
  if (!scan && !options.labels.empty())
    throw InputError(fmt::format("--labels names the labels of a scan, and {} is a folder; leave it out",
                                 options.from.string()));
  if (scan || is_atlas(options.from)) return scene_of_parts(options);
  return scene_of_folder(options, "", {});
}

}  // namespace limber::detail
