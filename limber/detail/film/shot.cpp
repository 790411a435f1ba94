// How a shot comes about: from a scene's film, a plan and its bodies, everything that no frame can know by
// itself.
//
// All of it is found once, before the first frame is painted: which moment each frame shows (shot_time.cpp),
// the camera's path (shot_camera.cpp), where words and insets stand (shot_places.cpp), names
// (shot_labels.cpp), pushes, touches, arrows and panes (shot_forces.cpp), and ranges of colours and depths
// (shot_passes.cpp). After that a shot never changes, and a frame is a function of its number: any worker
// paints any frame, in any order, and gets the same picture. The hash by which a frame is known is made in
// shot_hash.cpp; the painting is in painter.cpp. Method: docs/rendering.md.
#include "limber/detail/film/shot.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "fem/observe.h"
#include "limber/detail/film/look.h"
#include "limber/detail/world/goal_terms.h"
#include "render/film.h"
#include "render/image_file.h"

namespace limber::detail {

namespace {

constexpr int max_edges_of_tree = 4000;

// From over the photographer's left shoulder, so that what faces the camera is lit, and shadows fall to the
// right and away.
Vec3 toward_key_light(const render::Camera& camera) {
  constexpr double to_the_left_deg = 40, height = 1.3;  // height: over the horizontal distance
  const Vec3 view = camera.eye - camera.target;
  const Vec3 level(view.x(), view.y(), 0);
  if (level.norm() < 1e-3 * view.norm()) return Vec3(-0.5, -0.6, 1);  // looking straight down
  return Eigen::AngleAxisd(-to_the_left_deg * EIGEN_PI / 180, Vec3::UnitZ()) * level.normalized() +
         Vec3(0, 0, height);
}

}  // namespace

void require_letters(const scenes::FilmSpec& film) {
  const auto require = [](const char* key, const std::string& text) {
    if (const std::string missing = render::letters_missing(text); !missing.empty())
      throw InputError(fmt::format(
          "{}: limber's font has no letters for {} (it has Latin, Greek and Cyrillic)", key, missing));
  };
  require("film.caption", film.caption);
  for (const scenes::LabelSpec& label : film.labels) require("film.labels", label.text);
  for (const auto& [key, card] :
       {std::pair("film.title", &film.title), std::pair("film.end_card", &film.end_card)})
    if (*card) require(key, fmt::format("{}", fmt::join((*card)->lines, " ")));
}

// The order matters: the moments need the touches, the camera that follows a body needs the moments, the
// light stands by the first camera, and words keep clear of the inset, which is placed before them. Lines
// that show the whole motion (way, tree) and decoded images are kept for all workers.
Shot::Shot(const scenes::Scene& scene, const std::string& camera, const plan::Plan& plan,
           const fem::World& world, const std::vector<PreparedBody>& bodies,
           const std::vector<SurfaceMesh>& scenery, std::pair<int, int> size_px, const Output& output)
    : scene_(scene), plan_(plan), world_(world), bodies_(bodies), scenery_(scenery), output_(output) {
  check();
  std::vector<std::string> names;
  for (const scenes::CameraSpec& candidate : scene.cameras) {
    names.push_back(candidate.name);
    if (candidate.name == camera) camera_ = &candidate;
  }
  if (!camera_)
    throw InputError(fmt::format("camera {}: the scene has no such camera; there are: {}", camera,
                                 fmt::join(names, ", ")));
  const int views = scene.film.side_by_side ? 2 : 1;
  look_.width = size_px.first / views, look_.height = size_px.second;
  set_light(look_, scene.film);
  double ground_m = scene.bounds_m.lower.z();
  for (const SurfaceMesh& mesh : scenery)
    ground_m = std::min(ground_m, bounding_box(mesh.positions).lower.z());
  look_.ground_height_m = scene.film.ground_m.value_or(ground_m);
  look_.transparent_background = scene.film.transparent;
  find_controls();
  const bool panes = scene.film.panes && world.walls;
  if (scene.film.pace == scenes::Pace::contact || panes || !output.passes.empty()) find_touches();
  lay_out_time();
  look_.stage = box_of_motion();
  for (const SurfaceMesh& mesh : scenery) look_.stage.include(bounding_box(mesh.positions));
  for (const scenes::LigamentSpec& ligament : scene.ligaments)
    look_.stage.include(ligament.from_m), look_.stage.include(ligament.to_m);
  lay_out_camera(double(look_.width) / look_.height);
  look_.toward_key = toward_key_light(path_.front().camera);
  if (!output.passes.empty()) measure_depths();
  if (scene.film.color_by != scenes::ColorBy::body) measure_colors();
  if (scene.film.forces) measure_forces();
  if (panes) find_panes();
  if (scene.film.path) {
    const std::vector<State>& frames_shown = plan.trajectory.frames;
    way_m_.resize(2 * std::max<Eigen::Index>(0, Eigen::Index(frames_shown.size()) - 1), 3);
    for (Eigen::Index row = 0; row < way_m_.rows(); ++row)
      way_m_.row(row) = robot_place_m(scene, world, frames_shown[std::size_t((row + 1) / 2)]).transpose();
  }
  if (scene.film.tree) find_tree();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    images_.emplace_back();
    for (const ImageFile& image : bodies[b].appearance.images)
      if (shows_own_colors(b))
        images_[b].push_back(
            std::make_shared<const render::Image8>(render::decoded_image(image.bytes, image.name)));
  }
  if (scene.film.inset && scene.film.inset->camera != camera) place_inset();
  place_words();
  place_names();
  look_hash_ = hash_of_look();
}

// What cannot be drawn together, with the edits that help: words, insets, outlines and two views are put
// together from 8-bit pictures with a background.
void Shot::check() const {
  const scenes::FilmSpec& film = scene_.film;
  const bool wants_scalar = std::count(output_.passes.begin(), output_.passes.end(), "scalar") > 0;
  if (wants_scalar && film.color_by == scenes::ColorBy::body)
    throw InputError("--passes scalar: of what? Add for example --set film.color_by=strain");
  if (!output_.passes.empty() && film.side_by_side)
    throw InputError("--passes are of one picture; add --set film.side_by_side=false");
  require_letters(film);
  std::vector<std::string> in_the_way;  // as sets that take them away, where a table cannot be
  if (!film.caption.empty()) in_the_way.emplace_back("--set film.caption=");
  for (const auto& [is_on, key] :
       {std::pair(film.clock, "clock"), std::pair(film.scale_bar, "scale_bar"),
        std::pair(film.side_by_side, "side_by_side"), std::pair(film.outlines, "outlines"),
        std::pair(!film.labels.empty(), "labels")})
    if (is_on) in_the_way.push_back(fmt::format("--set film.{}=false", key));
  for (const auto& [is_on, key] :
       {std::pair(film.inset.has_value(), "inset"), std::pair(film.title.has_value(), "title"),
        std::pair(film.end_card.has_value(), "end_card")})
    if (is_on) in_the_way.push_back(fmt::format("a scene without film.{}", key));
  if ((film.transparent || output_.bits == 16) && !in_the_way.empty())
    throw InputError(fmt::format(
        "{}: words, insets, outlines and side_by_side need 8-bit pictures with a background; ask for {}",
        film.transparent ? "film.transparent" : "--bits 16", fmt::join(in_the_way, " ")));
}

// Not where the film's colors mean something.
bool Shot::shows_own_colors(std::size_t body) const {
  return !bodies_[body].appearance.empty() && scene_.bodies[body].texture &&
         (scene_.film.color_by == scenes::ColorBy::body ||
          world_.bodies[body].kind != fem::BodyKind::deformable);
}

std::vector<render::Plane> Shot::cuts_of(int body) const {
  std::vector<render::Plane> planes;
  for (const scenes::CutSpec& cut : scene_.film.cuts)
    if (std::count(cut.bodies.begin(), cut.bodies.end(), body) > 0) {
      planes.emplace_back();
      planes.back() << -cut.normal, cut.normal.dot(cut.point_m);
    }
  return planes;
}

// The cages' nodes of bodies that move, at every stored state, and all surfaces at rest: bodies that stand
// are no part of a state.
Box Shot::box_of_motion() const {
  Box box;
  for (const State& state : plan_.trajectory.frames)
    for (std::size_t i = 0; i + 2 < state.positions.size(); i += 3)
      box.include(Vec3(state.positions[i], state.positions[i + 1], state.positions[i + 2]));
  for (const PreparedBody& body : bodies_) box.include(bounding_box(body.surface.positions));
  return box;
}

// Edges of the tree between centres of mass, every so many of them where there are more than can be told
// apart.
void Shot::find_tree() {
  if (plan_.left_out)
    throw InputError(
        "film.tree: plan.npz holds the path alone (--keep-tree path), and the film would show the whole "
        "tree; "
        "add --set film.tree=false, or plan anew with --keep-tree all");
  const plan::Tree& tree = plan_.tree;
  const int every = (tree.size() + max_edges_of_tree - 1) / max_edges_of_tree;
  std::vector<Vec3> ends;
  for (int n = 1; n < tree.size(); n += every) {
    ends.push_back(tree.centers[tree.parents[std::size_t(n)]].cast<double>());
    ends.push_back(tree.centers[n].cast<double>());
  }
  tree_m_.resize(Eigen::Index(ends.size()), 3);
  for (std::size_t i = 0; i < ends.size(); ++i) tree_m_.row(Eigen::Index(i)) = ends[i].transpose();
}

}  // namespace limber::detail
