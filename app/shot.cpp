#include "app/shot.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/node_values.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/version.h"
#include "fem/observe.h"
#include "render/annotate.h"
#include "render/arrow.h"
#include "render/color_map.h"

namespace limber::app {

namespace {

const Vec3 push_color(0.93, 0.52, 0.10), contact_color(0.16, 0.42, 0.62);
const render::LineLook cage_lines{.color_srgb = {0.12, 0.14, 0.18}, .width_px = 1.2, .opacity = 0.55};
const render::LineLook way_lines{.color_srgb = {0.85, 0.35, 0.05}, .width_px = 3, .opacity = 0.9};
const render::LineLook tree_lines{.color_srgb = {0.25, 0.28, 0.36}, .width_px = 1, .opacity = 0.45};
constexpr int most_edges_of_tree = 4000;

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

// Each edge of the triangles once, (E × 2).
Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor> edges_of(const Triangles& triangles) {
  std::set<std::pair<int, int>> edges;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i) edges.insert(std::minmax({triangles(t, i), triangles(t, (i + 1) % 3)}));
  Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor> rows(Eigen::Index(edges.size()), 2);
  Eigen::Index row = 0;
  for (const auto& [a, b] : edges) rows.row(row++) << a, b;
  return rows;
}

// A box that holds this one, however it is turned about its vertical axis.
Box turned_any_way(const Box& box) {
  const Vec3 half = 0.5 * box.size();
  const Vec3 reach(std::hypot(half.x(), half.y()), std::hypot(half.x(), half.y()), half.z());
  return {box.center() - reach, box.center() + reach};
}

render::Image8 beside(const render::Image8& left, const render::Image8& right, int width) {
  render::Image8 both{width, left.height, {}};
  both.rgb.resize(std::size_t(3) * width * left.height);
  for (int y = 0; y < left.height; ++y) {
    std::uint8_t* row = &both.rgb[std::size_t(3) * y * width];
    std::copy_n(&left.rgb[std::size_t(3) * y * left.width], 3 * left.width, row);
    std::copy_n(&right.rgb[std::size_t(3) * y * right.width], 3 * right.width, row + 3 * left.width);
  }
  return both;
}

}  // namespace

Shot::Shot(const scenes::Scene& scene, const std::string& camera, const plan::Plan& plan,
           const fem::World& world, const std::vector<PreparedBody>& bodies,
           const std::vector<SurfaceMesh>& scenery, std::pair<int, int> size_px)
    : scene_(scene), plan_(plan), world_(world), bodies_(bodies), scenery_(scenery) {
  std::vector<std::string> names;
  for (const scenes::CameraSpec& candidate : scene.cameras) {
    names.push_back(candidate.name);
    if (candidate.name == camera) camera_ = &candidate;
  }
  if (!camera_)
    throw InputError(fmt::format("--camera {}: the scene has no such camera; there are: {}", camera,
                                 fmt::join(names, ", ")));
  const int views = scene.film.side_by_side ? 2 : 1;
  look_.width = size_px.first / views, look_.height = size_px.second;
  look_.background_top_srgb = look_.background_bottom_srgb = scene.film.background_srgb;
  look_.ground_height_m = scene.bounds_m.lower.z();
  look_.stage = box_of_motion();
  lay_out_camera(double(look_.width) / look_.height);
  look_.toward_key = toward_key_light(path_.front().camera);
  if (scene.film.color_by != scenes::ColorBy::body) measure_colors();
  if (scene.film.forces) measure_forces();
  if (scene.film.path) {
    const std::vector<State>& frames_shown = plan.trajectory.frames;
    way_m_.resize(2 * std::max<Eigen::Index>(0, Eigen::Index(frames_shown.size()) - 1), 3);
    for (Eigen::Index row = 0; row < way_m_.rows(); ++row)
      way_m_.row(row) =
          fem::center_of_mass_m(world, frames_shown[std::size_t((row + 1) / 2)], world.robot).transpose();
  }
  if (scene.film.tree) find_tree();
  look_hash_ = hash_of_look();
}

int Shot::frames() const { return int(plan_.trajectory.frames.size()); }

Box Shot::box_of_motion() const {
  Box box;
  for (const State& state : plan_.trajectory.frames)
    for (std::size_t i = 0; i + 2 < state.positions.size(); i += 3)
      box.include(Vec3(state.positions[i], state.positions[i + 1], state.positions[i + 2]));
  for (const PreparedBody& body : bodies_) box.include(bounding_box(body.surface.positions));
  for (const SurfaceMesh& mesh : scenery_) box.include(bounding_box(mesh.positions));
  return box;
}

void Shot::lay_out_camera(double aspect) {
  Box shown = look_.stage;
  if (scene_.film.bounds_lines) shown.include(scene_.bounds_m);
  if (camera_->follow >= 0) {
    followed_m_.resize(frames(), 3);
    for (int f = 0; f < frames(); ++f)
      followed_m_.row(f) =
          fem::center_of_mass_m(world_, plan_.trajectory.frames[std::size_t(f)], camera_->follow).transpose();
    constexpr double room = 1.25;  // about the body, in its own diagonals
    const Vec3 reach = Vec3::Constant(
        room * bounding_box(bodies_[std::size_t(camera_->follow)].surface.positions).diagonal());
    const Vec3 center = followed_m_.row(0).transpose();
    shown = {center - reach, center + reach};
  }
  for (const scenes::Keyframe& key : camera_->keyframes)
    path_.push_back({key.at, {.eye = key.eye_m, .target = key.target_m, .fov_deg = camera_->fov_deg}});
  if (path_.empty())
    path_.push_back({0, render::frame_automatically(camera_->turn_deg == 0 ? shown : turned_any_way(shown),
                                                    camera_->direction, aspect, camera_->fov_deg)});
}

render::Camera Shot::camera_of(int frame) const {
  const double share = frames() < 2 ? 0 : double(frame) / double(frames() - 1);
  render::Camera camera = render::turned(render::camera_at(path_, share), share * camera_->turn_deg);
  if (followed_m_.rows() > 0) {
    const Vec3 way = (followed_m_.row(frame) - followed_m_.row(0)).transpose();
    camera.eye += way, camera.target += way;
  }
  return camera;
}

void Shot::measure_colors() {
  if (scene_.film.color_range) {
    low_ = (*scene_.film.color_range)[0], high_ = (*scene_.film.color_range)[1];
    return;
  }
  double least = 0, most = 0;
  for (const State& state : plan_.trajectory.frames)
    for (const double value : node_values(world_, state, scene_.film.color_by))
      least = std::min(least, value), most = std::max(most, value);
  const bool both_ways = scene_.film.color_by == scenes::ColorBy::volume;
  high_ = std::max({most, both_ways ? -least : 0.0, 1e-6});
  low_ = both_ways ? -high_ : 0;
}

void Shot::measure_forces() {
  int frame = 0;
  std::int64_t step = 0;
  for (const Control& control : plan_.trajectory.controls) {
    pushes_.push_back({frame, control});
    step += control.steps;
    while (frame < frames() && plan_.trajectory.frames[std::size_t(frame)].step < step) ++frame;
  }
  double strongest = 0;
  for (int f = 0; f < frames(); ++f)
    for (const fem::PairForce& pair :
         fem::pair_forces(fem::contact_forces(world_, plan_.trajectory.frames[std::size_t(f)])))
      strongest = std::max(strongest, pair.force_n.norm());
  for (const Control& control : plan_.trajectory.controls)
    strongest = std::max(strongest, double(control.force_n.norm()));
  const double robot = bounding_box(bodies_[std::size_t(world_.robot)].surface.positions).diagonal();
  arrow_m_per_n_ = strongest > 0 ? robot / strongest : 0;
  arrow_radius_m_ = 0.02 * robot;
}

Points Shot::arrows_at(int frame) const {
  const State& state = plan_.trajectory.frames[std::size_t(frame)];
  const Vec3 robot = fem::center_of_mass_m(world_, state, world_.robot);
  const int bodies = int(world_.bodies.size());
  Points ends(2 * (1 + bodies), 3);  // the push; what each body does to the robot, last the walls
  ends.rowwise() = robot.transpose();
  const auto push =
      std::find_if(pushes_.rbegin(), pushes_.rend(), [&](const Push& p) { return p.first_frame <= frame; });
  if (push != pushes_.rend() && push->control.manipulation != Manipulation::none) {
    Vec3 from = robot;
    if (push->control.manipulation == Manipulation::control_point)
      from = fem::body_positions(world_, state, world_.robot).row(push->control.node).transpose();
    ends.row(0) = from.transpose();
    ends.row(1) = (from + arrow_m_per_n_ * push->control.force_n.cast<double>()).transpose();
  }
  // Each at the middle of its contacts, by their forces.
  std::vector<Vec3> force(std::size_t(bodies), Vec3::Zero()), place = force;
  std::vector<double> weight(std::size_t(bodies), 0);
  for (const fem::ContactForce& contact : fem::contact_forces(world_, state)) {
    if (contact.body != world_.robot && contact.other != world_.robot) continue;
    const int other = contact.body == world_.robot ? contact.other : contact.body;
    if (other == world_.robot) continue;
    const std::size_t slot = other >= 0 ? std::size_t(other) : std::size_t(world_.robot);
    force[slot] += contact.body == world_.robot ? contact.force_n : Vec3(-contact.force_n);
    place[slot] += contact.force_n.norm() * contact.place_m;
    weight[slot] += contact.force_n.norm();
  }
  for (int b = 0; b < bodies; ++b) {
    if (weight[std::size_t(b)] == 0) continue;
    const Vec3 at = place[std::size_t(b)] / weight[std::size_t(b)];
    ends.row(2 + 2 * b) = at.transpose();
    ends.row(3 + 2 * b) = (at + arrow_m_per_n_ * force[std::size_t(b)]).transpose();
  }
  return ends;
}

void Shot::find_tree() {
  const plan::Tree& tree = plan_.tree;
  const int every = (tree.size() + most_edges_of_tree - 1) / most_edges_of_tree;
  std::vector<Vec3> ends;
  for (int n = 1; n < tree.size(); n += every) {
    ends.push_back(tree.centers[tree.parents[std::size_t(n)]].cast<double>());
    ends.push_back(tree.centers[n].cast<double>());
  }
  tree_m_.resize(Eigen::Index(ends.size()), 3);
  for (std::size_t i = 0; i < ends.size(); ++i) tree_m_.row(Eigen::Index(i)) = ends[i].transpose();
}

std::uint64_t Shot::hash_of_look() const {
  const scenes::FilmSpec& film = scene_.film;
  Hasher hasher;
  hasher.text(version).value(look_.width).value(look_.height).matrix(film.background_srgb);
  hasher.matrix(look_.stage.lower).matrix(look_.stage.upper).matrix(scene_.bounds_m.lower);
  hasher.matrix(scene_.bounds_m.upper);
  for (const bool flag : {film.bounds_lines, film.transparent, film.clock, film.cages, film.forces, film.path,
                          film.tree, film.side_by_side})
    hasher.value(int(flag));
  hasher.text(film.caption).value(int(film.color_by)).value(low_).value(high_).value(film.speed);
  hasher.value(film.frames_per_second).value(frames());
  hasher.value(arrow_m_per_n_).matrix(way_m_).matrix(tree_m_);
  const auto add_look = [&](const scenes::BodySpec& body) {
    hasher.matrix(body.color_srgb).value(body.opacity).value(body.roughness).value(body.metallic);
  };
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    hasher.value(limber::hash_of(bodies_[b].surface)).value(limber::hash_of(bodies_[b].cage));
    add_look(scene_.bodies[b]);
  }
  for (std::size_t s = 0; s < scenery_.size(); ++s) {
    hasher.value(limber::hash_of(scenery_[s]));
    add_look(scene_.scenery[s]);
  }
  return hasher.digest();
}

std::string Shot::hash_of(int frame) const {
  const render::Camera camera = camera_of(frame);
  Hasher hasher;
  hasher.value(look_hash_)
      .value(frame)
      .value(limber::hash_of(plan_.trajectory.frames[std::size_t(frame)]))
      .matrix(camera.eye)
      .matrix(camera.target)
      .matrix(camera.up);
  return hex(hasher.value(camera.fov_deg).digest());
}

// One picture, or one half of it: the fine surfaces, or the cages.
struct Shot::Painter::View {
  View(const Shot& from, bool of_cages) : shot(from), cages(of_cages), renderer(from.look_) {
    const scenes::FilmSpec& film = shot.scene_.film;
    for (std::size_t b = 0; b < shot.bodies_.size(); ++b) {
      const PreparedBody& prepared = shot.bodies_[b];
      const scenes::BodySpec& body = shot.scene_.bodies[b];
      render::MeshLook look{.name = body.name,
                            .color_srgb = body.color_srgb,
                            .roughness = body.roughness,
                            .metallic = body.metallic,
                            .opacity = body.opacity};
      if (cages) look.crease_angle_deg = 0;
      meshes.push_back(cages
                           ? renderer.add_mesh(shot.world_.bodies[b].surface, prepared.cage.positions, look)
                           : renderer.add_mesh(prepared.surface.triangles, prepared.surface.positions, look));
      if (!cages)
        rest_normals.push_back(vertex_normals(prepared.surface.positions, prepared.surface.triangles));
      if (cages || film.cages) {
        cage_edges.push_back(edges_of(shot.world_.bodies[b].surface));
        cage_lines_of.push_back(
            renderer.add_lines(ends_of(cage_edges[b], prepared.cage.positions), cage_lines));
      }
    }
    for (std::size_t s = 0; s < shot.scenery_.size(); ++s) {
      const scenes::BodySpec& body = shot.scene_.scenery[s];
      renderer.add_mesh(shot.scenery_[s].triangles, shot.scenery_[s].positions,
                        {.name = body.name,
                         .color_srgb = body.color_srgb,
                         .roughness = body.roughness,
                         .metallic = body.metallic,
                         .opacity = body.opacity});
    }
    if (film.bounds_lines) renderer.add_lines(render::edges_of(shot.scene_.bounds_m), {});
    if (shot.way_m_.rows() > 0) renderer.add_lines(shot.way_m_, way_lines);
    if (shot.tree_m_.rows() > 0) renderer.add_lines(shot.tree_m_, tree_lines);
    if (film.forces)
      for (std::size_t i = 0; i <= shot.bodies_.size(); ++i) {
        const Vec3 nowhere = shot.look_.stage.center();
        arrows.push_back(renderer.add_mesh(
            render::arrow_triangles(), render::arrow(nowhere, nowhere + Vec3::UnitX(), shot.arrow_radius_m_),
            {.name = "arrow", .color_srgb = i == 0 ? push_color : contact_color, .roughness = 0.6}));
      }
  }

  template <class Edges>
  static Points ends_of(const Edges& edges, const Points& positions) {
    Points ends(2 * edges.rows(), 3);
    for (Eigen::Index e = 0; e < edges.rows(); ++e)
      for (int i = 0; i < 2; ++i) ends.row(2 * e + i) = positions.row(edges(e, i));
    return ends;
  }

  // (rows of the mesh × 3) sRGB
  Points colors_of(std::size_t b, const double* of_node) const {
    const scenes::ColorBy by = shot.scene_.film.color_by;
    const auto color = [&](double value) {
      const double share = (value - shot.low_) / (shot.high_ - shot.low_);
      return by == scenes::ColorBy::volume ? render::diverging_srgb(share) : render::sequential_srgb(share);
    };
    const PreparedBody& prepared = shot.bodies_[b];
    Points colors(cages ? prepared.cage.positions.rows() : prepared.surface.positions.rows(), 3);
    for (Eigen::Index v = 0; v < colors.rows(); ++v) {
      double value = 0;
      if (cages)
        value = of_node[v];
      else
        for (int i = 0; i < 4; ++i)
          value += prepared.binding.weights(v, i) *
                   of_node[prepared.cage.tets(prepared.binding.tet_from_vertex[v], i)];
      colors.row(v) = color(value).transpose();
    }
    return colors;
  }

  render::Image8 paint(int frame) {
    const scenes::FilmSpec& film = shot.scene_.film;
    const State& state = shot.plan_.trajectory.frames[std::size_t(frame)];
    std::vector<double> values;
    if (film.color_by != scenes::ColorBy::body) values = node_values(shot.world_, state, film.color_by);
    for (std::size_t b = 0; b < meshes.size(); ++b) {
      const fem::Body& body = shot.world_.bodies[b];
      const PreparedBody& prepared = shot.bodies_[b];
      if (!values.empty() && body.kind == fem::BodyKind::deformable)
        if (false)  // NOTYET
          renderer.set_positions(meshes[b], colors_of(b, &values[std::size_t(body.first_node)]));
      if (!body.moving) continue;
      cage = fem::body_positions(shot.world_, state, int(b));
      if (!cage_lines_of.empty()) renderer.set_lines(cage_lines_of[b], ends_of(cage_edges[b], cage));
      if (cages) {
        renderer.set_positions(meshes[b], cage);
        continue;
      }
      surface.resize(prepared.surface.positions.rows(), 3);
      normals.resize(surface.rows(), 3);
      ffd::deform(prepared.binding, prepared.cage.tets, cage, surface);
      ffd::deform_normals(prepared.binding, prepared.cage, cage, rest_normals[b], normals);
      renderer.set_positions(meshes[b], surface, normals);
    }
    if (!arrows.empty()) {
      const Points ends = shot.arrows_at(frame);
      for (std::size_t i = 0; i < arrows.size(); ++i) {
        const Eigen::Index row = 2 * Eigen::Index(i);
        renderer.set_positions(arrows[i],
                               render::arrow(ends.row(row), ends.row(row + 1), shot.arrow_radius_m_));
      }
    }
    return render::tone_mapped(renderer.draw(shot.camera_of(frame)));
  }

  const Shot& shot;
  bool cages;
  render::Renderer renderer;
  std::vector<int> meshes, cage_lines_of, arrows;
  std::vector<Points> rest_normals;
  std::vector<Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor>> cage_edges;
  Points cage, surface, normals;
};

Shot::Painter::Painter(const Shot& shot) : shot_(shot) {
  views_.push_back(std::make_unique<View>(shot, false));
  if (shot.scene_.film.side_by_side) views_.push_back(std::make_unique<View>(shot, true));
}
Shot::Painter::~Painter() = default;

render::Image8 Shot::Painter::paint(int frame) {
  render::Image8 image = views_[0]->paint(frame);
  if (views_.size() > 1) image = beside(image, views_[1]->paint(frame), 2 * image.width);
  const scenes::FilmSpec& film = shot_.scene_.film;
  if (film.color_by != scenes::ColorBy::body)
    render::draw_color_bar(
        image, {.label = caption_of(film.color_by),
                .low = shot_.low_,
                .high = shot_.high_,
                .color_srgb = film.color_by == scenes::ColorBy::volume ? render::diverging_srgb
                                                                       : render::sequential_srgb});
  std::string clock;
  if (film.clock) {
    clock = fmt::format("{:.2f} s", double(frame) / shot_.plan_.trajectory.frames_per_second);
    if (film.speed != 1) clock += fmt::format("   speed {:g}", film.speed);
    clock += fmt::format("   {}/{}", frame + 1, shot_.frames());
  }
  if (!film.caption.empty() || !clock.empty()) render::draw_caption(image, film.caption, clock);
  return image;
}

}  // namespace limber::app
