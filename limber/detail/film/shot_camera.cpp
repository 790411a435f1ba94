// From where a shot is seen. Three kinds of camera: one with keyframes, whose path runs over the shares of
// the motion; one that follows a body's centre of mass, framed for that body; and one that stands where all
// of the motion, or of a subject's, fits the picture. Each may also turn round its target.
#include <algorithm>
#include <cmath>

#include "fem/observe.h"
#include "limber/detail/film/outermost.h"
#include "limber/detail/film/shot.h"

namespace limber::detail {

namespace {

// A box that holds this one, however it is turned about its vertical axis.
Box turned_any_way(const Box& box) {
  const Vec3 half = 0.5 * box.size();
  const Vec3 reach(std::hypot(half.x(), half.y()), std::hypot(half.x(), half.y()), half.z());
  return {box.center() - reach, box.center() + reach};
}

bool looks_along_z(const render::Camera& camera) {
  return std::abs((camera.target - camera.eye).normalized().z()) > 0.999;
}

// Where a key looks straight down (or up), up in the picture is where the key before it looks, or else the
// one after it: a camera that rises over what it looks at does not roll.
void stand_upright(std::vector<render::CameraKey>& path) {
  for (std::size_t k = 0; k < path.size(); ++k) {
    render::Camera& camera = path[k].camera;
    if (!looks_along_z(camera)) continue;
    const double down = camera.eye.z() > camera.target.z() ? 1 : -1;
    camera.up = Vec3::UnitY();
    for (const std::size_t other : {k + 1, k - 1})  // the last that fits
      if (other < path.size() && !looks_along_z(path[other].camera)) {
        const Vec3 view = path[other].camera.target - path[other].camera.eye;
        camera.up = down * Vec3(view.x(), view.y(), 0).normalized();
      }
  }
}

}  // namespace

// The outermost vertices at every stored state, and the cages' nodes and the bounds where they are drawn. A
// body that stands still counts once.
Points Shot::outline_of_motion(const std::vector<int>& subjects) const {
  std::vector<Vec3> points;
  const bool cages = scene_.film.cages || scene_.film.side_by_side;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (!subjects.empty() && std::count(subjects.begin(), subjects.end(), int(b)) == 0) continue;
    const PreparedBody& body = bodies_[b];
    const ffd::Binding part = outermost_part(body);
    Points places;
    for (const State& state : plan_.trajectory.frames) {
      const Points nodes = fem::body_positions(world_, state, int(b));
      deform(body, part, nodes, places);
      for (Eigen::Index i = 0; i < places.rows(); ++i) points.push_back(places.row(i));
      for (Eigen::Index n = 0; cages && n < nodes.rows(); ++n) points.push_back(nodes.row(n));
      if (!world_.bodies[b].moving) break;
    }
  }
  if (scene_.film.bounds_lines && subjects.empty()) {
    const Points edges = render::edges_of(scene_.bounds_m);
    for (Eigen::Index row = 0; row < edges.rows(); ++row) points.push_back(edges.row(row));
  }
  Points outline(Eigen::Index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) outline.row(Eigen::Index(i)) = points[i].transpose();
  return outline;
}

// A camera that turns is framed for a box that holds the outline however it is turned, so that it keeps its
// distance.
void Shot::lay_out_camera(double aspect) {
  for (const scenes::Keyframe& key : camera_->keyframes)
    path_.push_back({key.at, {.eye = key.eye_m, .target = key.target_m, .fov_deg = camera_->fov_deg}});
  stand_upright(path_);
  const auto frame = [&](const auto& shown) {
    if (path_.empty())
      path_.push_back({0, render::frame_automatically(shown, camera_->direction, aspect, camera_->fov_deg,
                                                      camera_->fill)});
  };
  if (camera_->follow >= 0) {
    followed_m_.resize(frames(), 3);
    for (int f = 0; f < frames(); ++f)
      followed_m_.row(f) = fem::center_of_mass_m(world_, state_at(f), camera_->follow).transpose();
    constexpr double room = 0.75;  // about the body, in its own diagonals
    const Vec3 reach = Vec3::Constant(
        room * bounding_box(bodies_[std::size_t(camera_->follow)].surface.positions).diagonal());
    const Vec3 center = followed_m_.row(0).transpose();
    frame(Box{center - reach, center + reach});
  }
  if (!path_.empty()) return;
  const Points outline = outline_of_motion(camera_->subjects);  // a skin is not what the film is about
  if (camera_->turn_deg == 0)
    frame(outline);
  else
    frame(turned_any_way(bounding_box(outline)));
}

// Shares of the way are of the motion, not of the film: while a card is shown the camera stands.
render::Camera Shot::camera_of(int frame) const {
  const double share = of_motion_ < 2 ? 0 : double(index_in_motion(frame)) / double(of_motion_ - 1);
  render::Camera camera = render::turned(render::camera_at(path_, share), share * camera_->turn_deg);
  if (followed_m_.rows() > 0) {
    const Vec3 way = (followed_m_.row(frame) - followed_m_.row(0)).transpose();
    camera.eye += way, camera.target += way;
  }
  return camera;
}

// A picture of height h that sees the angle `fov_deg` from bottom to top shows, at the distance d of what the
// camera looks at, h / (2 d tan(fov / 2)) pixels a metre.
double Shot::pixels_a_metre(const render::Camera& camera) const {
  return 0.5 * look_.height / std::tan(0.5 * camera.fov_deg * EIGEN_PI / 180) /
         (camera.target - camera.eye).norm();
}

}  // namespace limber::detail
