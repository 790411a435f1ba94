#include "limber/detail/authoring/organs.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/log.h"
#include "core/progress.h"
#include "limber/detail/authoring/layout.h"
#include "meshing/cage.h"
#include "meshing/contact_shape.h"
#include "meshing/import.h"
#include "scenes/anatomy.h"
#include "scenes/models.h"
#include "scenes/scene.h"

namespace limber::detail {

namespace {

constexpr const char* endings[] = {".obj", ".off", ".ply", ".stl", ".glb", ".gltf", ".dae", ".fbx"};

// The largest of these shares of its true size is taken at which the organs come apart within that reach, a
// share of all organs' diagonal.
constexpr double scale_step = 0.05, min_scale = 0.3;
constexpr double reach = 0.03;
constexpr double room = 0.005;  // between two surfaces, as a share of the robot's size: so near they push

// Where a model of the folder is, at its true size.
void to_our_frame(const NewSceneOptions& options, Points& positions) {
  scenes::BodySpec body;
  scenes::FileModel model;
  model.scale = options.scale;
  model.up = scenes::axis_named(options.up), model.front = scenes::axis_named(options.front);
  body.model = model;
  body.pose.anchor = "origin";
  scenes::transform(scenes::world_from_model(body, positions, false), positions);
}

// Throws InputError where a name that was given is none of the folder's.
void check_names(const NewSceneOptions& options, const std::vector<std::string>& names) {
  for (const auto& [flag, list] : {std::pair("--only", &options.only),
                                   {"--see-through", &options.see_through},
                                   {"--rigid", &options.rigid}})
    for (const std::string& wanted : *list)
      if (std::count(names.begin(), names.end(), wanted) == 0)
        throw InputError(fmt::format("{} {}: {} has no such model; there are: {}", flag, wanted,
                                     options.from.string(), fmt::join(names, ", ")));
}

// About a point.
std::shared_ptr<const ContactShape> scaled(const ContactShape& shape, const Vec3& center, double scale) {
  ContactShape copy = shape;
  copy.field.lower_m = center + scale * (shape.field.lower_m - center);
  copy.field.cell_m *= scale, copy.field.unit_m *= scale;
  copy.samples.positions_m =
      ((copy.samples.positions_m.rowwise() - center.transpose()) * scale).rowwise() + center.transpose();
  return std::make_shared<const ContactShape>(std::move(copy));
}

}  // namespace

std::vector<Organ> read_organs(const NewSceneOptions& options) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(options.from))
    if (std::count(std::begin(endings), std::end(endings), entry.path().extension().string()) > 0)
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty())
    throw InputError(fmt::format("{}: holds no model ({})", options.from.string(), fmt::join(endings, ", ")));
  std::vector<std::string> names;
  for (const fs::path& file : files) names.push_back(file.stem().string());
  check_names(options, names);
  std::vector<Organ> organs;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!options.only.empty() && std::count(options.only.begin(), options.only.end(), names[i]) == 0)
      continue;
    throw_if_stopped();
    log::info("reading {}", files[i].string());
    Organ organ;
    organ.name = names[i], organ.file = files[i].filename().string();
    const meshing::ImportedModel model = meshing::import_model(files[i], {.count_self_intersections = false});
    organ.surface = model.surface;
    Points positions = organ.surface.positions;
    to_our_frame(options, positions);
    organ.box = bounding_box(positions);
    const SurfaceMesh placed{positions, organ.surface.triangles};
    organ.volume_m3 = std::abs(volume(placed));
    organ.thickness_m = 2 * organ.volume_m3 / area(placed);
    organ.pieces = int(model.left.components);
    const scenes::PartKind kind = scenes::anatomy_of(organ.name).kind;
    organ.see_through = kind == scenes::PartKind::hull,
    organ.bone = kind == scenes::PartKind::bone || scenes::is_of_ribcage(organ.name);
    for (const auto& [list, flag] :
         {std::pair(&options.see_through, &organ.see_through), {&options.rigid, &organ.bone}})
      if (std::count(list->begin(), list->end(), organ.name) > 0) *flag = true;
    organs.push_back(std::move(organ));
  }
  return organs;
}

void leave_out_doubles(std::vector<Organ>& organs, std::vector<std::string>& notes) {
  const auto same_place = [](const Organ& a, const Organ& b) {
    const double tolerance_m = 0.01 * a.box.diagonal();
    return a.see_through == b.see_through && a.bone == b.bone && (a.see_through || a.bone) &&
           (a.box.lower - b.box.lower).norm() < tolerance_m &&
           (a.box.upper - b.box.upper).norm() < tolerance_m;
  };
  const auto effort = [](const Organ& organ) {
    return std::pair(organ.pieces, organ.surface.triangles.rows());
  };
  for (std::size_t a = 0; a < organs.size(); ++a)
    for (std::size_t b = a + 1; b < organs.size();) {
      if (!same_place(organs[a], organs[b])) {
        ++b;
        continue;
      }
      if (effort(organs[b]) < effort(organs[a])) std::swap(organs[a], organs[b]);
      notes.push_back(fmt::format("{} is left out: it is where {} is", organs[b].name, organs[a].name));
      organs.erase(organs.begin() + std::ptrdiff_t(b));
    }
}

void make_cage(const NewSceneOptions& options, Organ& organ) {
  throw_if_stopped();
  SurfaceMesh surface = organ.surface;
  to_our_frame(options, surface.positions);
  organ.cage = meshing::build_cage(surface, {}, {.tets = organ.bone ? bone_tets : options.tets}).mesh;
  ContactShape shape = meshing::make_contact_shape(surface, organ.cage);
  if (!shape.usable)  // as in a scene: touched at its cage
    shape =
        meshing::make_contact_shape({organ.cage.positions, boundary_triangles(organ.cage.tets)}, organ.cage);
  organ.shape = std::make_shared<const ContactShape>(std::move(shape));
}

TetMesh placed(const Organ& organ, double scale) {
  TetMesh cage = organ.cage;
  const Vec3 center = organ.box.center();
  cage.positions = ((cage.positions.rowwise() - center.transpose()) * scale).rowwise() +
                   (center + organ.way_m).transpose();
  return cage;
}

std::vector<std::size_t> simulated(const std::vector<Organ>& organs) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < organs.size(); ++i)
    if (!organs[i].see_through) indices.push_back(i);
  return indices;
}

namespace {

bool move_apart(std::vector<Organ>& organs, double scale, double room_m, double reach_m) {
  std::vector<LaidBody> bodies;
  for (const std::size_t i : simulated(organs))
    bodies.push_back({scaled(*organs[i].shape, organs[i].box.center(), scale), organs[i].bone});
  std::pair<std::size_t, std::size_t> stuck;
  const auto ways = ways_apart(std::move(bodies), room_m, reach_m, &stuck);
  if (!ways) {
    const std::vector<std::size_t> which = simulated(organs);
    log::info("  {} and {} do not come apart", organs[which[stuck.first]].name,
              organs[which[stuck.second]].name);
    return false;
  }
  std::size_t next = 0;
  for (const std::size_t i : simulated(organs)) organs[i].way_m += (*ways)[next++];
  return true;
}

}  // namespace

double longest(const std::vector<Organ>& organs, const std::string& name) {
  return std::find_if(organs.begin(), organs.end(), [&](const Organ& organ) { return organ.name == name; })
      ->box.size()
      .maxCoeff();
}

double come_apart(const NewSceneOptions& options, std::vector<Organ>& organs) {
  Box all;
  for (const std::size_t i : simulated(organs))
    if (!organs[i].bone) all.include(organs[i].box);
  for (int step = 0;; ++step) {
    const double scale = options.shrink - scale_step * step;
    if (scale < min_scale)
      throw InputError(
          fmt::format("{}: at {:g} of their size the organs still do not come apart; take fewer with "
                      "--only",
                      options.from.string(), scale + scale_step));
    log::info("parting the organs at {:.2f} of their size", scale);
    const double room_m = room * scale * longest(organs, options.robot);
    if (move_apart(organs, scale, room_m, reach * all.diagonal())) return scale;
  }
}

SurfaceMesh placed_surface(const NewSceneOptions& options, const Organ& organ, double scale) {
  SurfaceMesh surface = organ.surface;
  to_our_frame(options, surface.positions);
  const Vec3 center = organ.box.center();
  const double of_true_size = organ.see_through ? 1 : scale;
  surface.positions = ((surface.positions.rowwise() - center.transpose()) * of_true_size).rowwise() +
                      (center + organ.way_m).transpose();
  return surface;
}

}  // namespace limber::detail
