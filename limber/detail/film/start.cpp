#include "limber/detail/film/start.h"

#include <algorithm>
#include <array>
#include <chrono>

#include "core/error.h"
#include "core/progress.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/film/shot.h"
#include "render/png_file.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

// A box of five tets round a surface, a little larger than it.
TetMesh box_round(const Points& positions) {
  constexpr double room = 0.01;  // of its longest edge
  constexpr std::array<std::array<int, 4>, 5> five{
      {{0, 3, 5, 6}, {0, 1, 3, 5}, {0, 2, 3, 6}, {0, 4, 5, 6}, {3, 5, 6, 7}}};
  const Box box = bounding_box(positions);
  const Vec3 reach = Vec3::Constant(room * box.size().maxCoeff());
  const Vec3 lower = box.lower - reach, size = box.size() + 2 * reach;
  TetMesh cage{Points(8, 3), Tets(5, 4)};
  for (int i = 0; i < 8; ++i)
    cage.positions.row(i) = (lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(size)).transpose();
  for (int t = 0; t < 5; ++t) {
    std::array<int, 4> tet = five[std::size_t(t)];
    const auto corner = [&](int k) -> Vec3 { return cage.positions.row(tet[std::size_t(k)]); };
    if (signed_volume(corner(0), corner(1), corner(2), corner(3)) < 0) std::swap(tet[2], tet[3]);
    cage.tets.row(t) << tet[0], tet[1], tet[2], tet[3];
  }
  return cage;
}

// Touches nothing.
ContactShape shape_of_nothing(const TetMesh& cage) {
  ContactShape shape;
  shape.field = {cage.positions.row(0), 1, {2, 2, 2}, 1, std::vector<std::int16_t>(8, 1)};
  shape.samples = {Points(0, 3), Eigen::VectorXi(0), Weights(0, 4), Eigen::VectorXd(0)};
  shape.min_weight = Weights::Constant(cage.tets.rows(), 4, 2);
  return shape;
}

PreparedBody stand_in(const LoadedModel& loaded, scenes::Deformation deformation) {
  PreparedBody body;
  body.surface = loaded.model.surface, body.appearance = loaded.model.appearance;
  body.cage = loaded.made_cage ? *loaded.made_cage : box_round(body.surface.positions);
  body.shell_from_tet.assign(std::size_t(body.cage.tets.rows()), 0);
  body.binding = ffd::bind(body.surface, body.cage);
  body.contact = shape_of_nothing(body.cage);
  body.gradients = node_gradients(body.cage);
  body.deformation = deformation;
  return body;
}

scenes::Scene of_one_moment(scenes::Scene scene) {
  scenes::FilmSpec& film = scene.film;
  film.color_by = scenes::ColorBy::body;
  film.forces = film.path = film.tree = false;
  film.pace = scenes::Pace::steady, film.length_s.reset();
  film.title.reset(), film.end_card.reset();
  return scene;
}

}  // namespace

Start prepared_start(const scenes::Scene& scene, const fs::path& work_folder) {
  Start start{of_one_moment(scene),
              read_bodies(scene, work_folder),
              read_scenery(scene, work_folder),
              {},
              true,
              true};
  start.world = build_world_in(work_folder, {}, scene, start.bodies);
  return start;
}

Start loaded_start(const scenes::Scene& scene, const std::vector<LoadedModel>& models,
                   const std::vector<fs::path>& data) {
  LIMBER_CHECK(models.size() == scene.bodies.size(), models.size(), scene.bodies.size());
  Start start{of_one_moment(scene), {}, {}, {}, false, true};
  scenes::Scene apart = scene;
  apart.walls = false;
  apart.goal.shape.reset();
  apart.forces.clear(), apart.pressures.clear(), apart.ligaments.clear();
  apart.planner.patches_m.clear(), apart.planner.lead = apart.planner.carry = false;
  apart.contact_offset_m = 0;
  for (std::size_t b = 0; b < models.size(); ++b) {
    scenes::BodySpec& body = apart.bodies[b];
    const bool has_cage = models[b].made_cage.has_value();
    if (body.kind == scenes::Kind::deformable && (!has_cage || !body.parts.empty())) start.step_known = false;
    body.contact = scenes::Contact::surface;
    body.self_contact = false;
    body.parts.clear();
    if (!has_cage) body.fixed = {};
    start.bodies.push_back(stand_in(models[b], body.deformation));
  }
  for (const scenes::BodySpec& body : scene.scenery) start.scenery.push_back(load_scenery(scene, body, data));
  start.world = build_world(apart, start.bodies);
  return start;
}

void require_picture_possible(const fs::path& file, const char* what) {
  if (file.extension() != ".png")
    throw InputError(fmt::format("{}: {} is a PNG; write for example {}.png", file.string(), what,
                                 std::string(what).substr(2)));
  if (fs::is_directory(file))
    throw InputError(fmt::format("{}: is a folder; name a file for {}", file.string(), what));
  if (const fs::path folder = file.parent_path(); !folder.empty() && !fs::is_directory(folder))
    throw InputError(fmt::format("{}: there is no folder {}; make it first", file.string(), folder.string()));
}

double write_still(const Start& start, const std::string& camera, std::pair<int, int> size_px,
                   const fs::path& file) {
  plan::Plan plan;  // that never left the start
  plan.trajectory.frames = {fem::start_state(start.world)};
  scenes::Scene scene = start.scene;
  if (!start.prepared) scene.film.cages = scene.film.side_by_side = false;
  Output output;
  output.occlusion = start.prepared;
  const Shot shot(scene, camera, plan, start.world, start.bodies, start.scenery, size_px, output);
  Shot::Painter painter(shot);
  const auto began = std::chrono::steady_clock::now();
  const Picture picture = painter.paint(0);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  std::visit(
      [&](const auto& image) {
        render::write_png(file, image, {{"limber-hash", shot.hash_of(0)}});
      },
      picture.frame);
  return seconds;
}

WrittenStill render_still(const StillOptions& options) {
  const fs::path file = scenes::find_scene(options.scene.scene);
  const scenes::Scene scene = scenes::read_scene_file(file, options.scene.sets);
  const fs::path still = options.out.value_or(scene.name + ".png");
  require_picture_possible(still, "a still");
  const auto size =
      options.size.empty() ? std::pair(scene.film.width_px, scene.film.height_px) : parse_size(options.size);
  std::vector<LoadedModel> models;
  for (const scenes::BodySpec& body : scene.bodies) {
    throw_if_stopped();
    models.push_back(load_model(scene, body, options.scene.data));
  }
  write_still(loaded_start(scene, models, options.scene.data), options.camera, size, still);
  return {still, size};
}

}  // namespace limber::detail
