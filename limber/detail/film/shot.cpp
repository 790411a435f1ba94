#include "limber/detail/film/shot.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/hash.h"
#include "core/threads.h"
#include "core/version.h"
#include "fem/control_forces.h"
#include "fem/observe.h"
#include "limber/detail/film/look.h"
#include "limber/detail/film/node_values.h"
#include "limber/detail/world/seen.h"
#include "render/film.h"
#include "render/image_file.h"

namespace limber::detail {

namespace {

constexpr int generation =
    4;  // of pictures: raised when the same film comes out otherwise, so that it is painted anew
constexpr double longest_arrow = 2;  // times that of the strongest push, which is as long as the robot
constexpr int max_edges_of_tree = 4000;
constexpr double at_rest = 0.003;     // of the robot's size: what moves no farther is not seen to move
constexpr double after_rest_s = 0.5;  // of the film
constexpr double ease_s = 0.5;        // of the film at its usual speed: so long before contact it slows down
constexpr double pane_fade_s = 0.25;  // of the film at its usual speed
constexpr double card_fade_s = 0.5;
constexpr double full_contact = 0.05;  // of the strongest: from there on the robot is in contact

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

// A box that holds this one, however it is turned about its vertical axis.
Box turned_any_way(const Box& box) {
  const Vec3 half = 0.5 * box.size();
  const Vec3 reach(std::hypot(half.x(), half.y()), std::hypot(half.x(), half.y()), half.z());
  return {box.center() - reach, box.center() + reach};
}

// The vertices beyond which none lies in one of many directions, evenly over the sphere: a spiral whose turns
// are a golden angle apart.
std::vector<Eigen::Index> outermost_of(const Points& positions) {
  constexpr int directions = 200;
  std::vector<Eigen::Index> outermost;
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - 2 * (i + 0.5) / directions, r = std::sqrt(1 - z * z),
                 turn = i * std::numbers::pi * (3 - std::sqrt(5));
    Eigen::Index farthest = 0;
    (positions * Vec3(r * std::cos(turn), r * std::sin(turn), z)).maxCoeff(&farthest);
    outermost.push_back(farthest);
  }
  std::sort(outermost.begin(), outermost.end());
  outermost.erase(std::unique(outermost.begin(), outermost.end()), outermost.end());
  return outermost;
}

// The binding of those vertices alone.
ffd::Binding outermost_part(const PreparedBody& body) {
  const std::vector<Eigen::Index> outermost = outermost_of(body.surface.positions);
  return {body.binding.tet_from_vertex(outermost), body.binding.weights(outermost, Eigen::all)};
}

// A convex polygon round points of the plane, counter-clockwise (Andrew's monotone chain, 1979).
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y()); });
  std::vector<Eigen::Vector2d> hull;
  if (points.empty()) return hull;
  for (int side = 0; side < 2; ++side, std::reverse(points.begin(), points.end())) {
    const std::size_t first = hull.size();
    for (const Eigen::Vector2d& p : points) {
      while (hull.size() >= first + 2) {
        const Eigen::Vector2d a = hull.back() - hull[hull.size() - 2], b = p - hull.back();
        if (a.x() * b.y() - a.y() * b.x() > 0) break;
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
  }
  return hull;
}

bool holds(const std::vector<Eigen::Vector2d>& hull, const Eigen::Vector2d& p) {
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d a = hull[(i + 1) % hull.size()] - hull[i], b = p - hull[i];
    if (a.x() * b.y() - a.y() * b.x() < 0) return false;
  }
  return hull.size() > 2;
}

// 1, 2 or 5 times a power of ten, at most this.
double round_length_m(double most_m) {
  const double power = std::pow(10.0, std::floor(std::log10(most_m)));
  return power * (most_m >= 5 * power ? 5 : most_m >= 2 * power ? 2 : 1);
}

}  // namespace

std::string length_words(double length_m) {
  return length_m >= 1      ? fmt::format("{:.6g} m", length_m)
         : length_m >= 0.01 ? fmt::format("{:.6g} cm", 100 * length_m)
                            : fmt::format("{:.6g} mm", 1000 * length_m);
}

void require_letters(const scenes::FilmSpec& film) {
  const auto require = [](const char* key, const std::string& text) {
    if (const std::string missing = render::letters_missing(text); !missing.empty())
      throw InputError(fmt::format(
          "{}: limber's font has no letters for {} (it has Latin, Greek and Cyrillic)", key, missing));
  };
  require("film.caption", film.caption);
  for (const auto& [key, card] :
       {std::pair("film.title", &film.title), std::pair("film.end_card", &film.end_card)})
    if (*card) require(key, fmt::format("{}", fmt::join((*card)->lines, " ")));
}

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
    throw InputError(fmt::format("--camera {}: the scene has no such camera; there are: {}", camera,
                                 fmt::join(names, ", ")));
  const int views = scene.film.side_by_side ? 2 : 1;
  look_.width = size_px.first / views, look_.height = size_px.second;
  set_light(look_, scene.film);
  double ground_m = scene.bounds_m.lower.z();
  for (const SurfaceMesh& mesh : scenery)
    ground_m = std::min(ground_m, bounding_box(mesh.positions).lower.z());
  look_.ground_height_m = ground_m;
  look_.transparent_background = scene.film.transparent;
  find_controls();
  const bool panes = scene.film.panes && world.walls;
  if (scene.film.pace == scenes::Pace::contact || panes || !output.passes.empty()) find_touches();
  lay_out_time();
  look_.stage = box_of_motion();
  for (const SurfaceMesh& mesh : scenery) look_.stage.include(bounding_box(mesh.positions));
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
      way_m_.row(row) =
          fem::center_of_mass_m(world, frames_shown[std::size_t((row + 1) / 2)], world.robot).transpose();
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
  look_hash_ = hash_of_look();
}

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
        std::pair(film.side_by_side, "side_by_side"), std::pair(film.outlines, "outlines")})
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

int Shot::frames() const { return int(moments_.size()); }

double Shot::time_s(int frame) const { return moment_of(frame) / plan_.trajectory.frames_per_second; }

TimeTold Shot::time_told() const {
  const scenes::FilmSpec& film = scene_.film;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Moment& moment : moments_)
    least = std::min(least, moment.pace * film.speed), most = std::max(most, moment.pace * film.speed);
  return {double(frames()) / film.frames_per_second, time_s(frames() - 1),
          double(stored() - 1) / plan_.trajectory.frames_per_second - time_s(frames() - 1), least, most};
}

void Shot::find_controls() {
  int stored_frame = 0;
  std::int64_t step = 0;
  for (const Control& control : plan_.trajectory.controls) {
    pushes_.push_back({stored_frame, control});
    step += control.steps;
    while (stored_frame < stored() && plan_.trajectory.frames[std::size_t(stored_frame)].step < step)
      ++stored_frame;
  }
}

Control Shot::control_at(int stored_frame) const {
  const auto push = std::find_if(pushes_.rbegin(), pushes_.rend(),
                                 [&](const Push& p) { return p.first_stored <= stored_frame; });
  return push != pushes_.rend() ? push->control : Control{};
}

void Shot::find_touches() {
  touches_.resize(std::size_t(stored()));
  parallel_for(stored(), [&](int f) {
    touches_[std::size_t(f)] =
        fem::contact_forces(world_, plan_.trajectory.frames[std::size_t(f)], control_at(f));
  });
}

// How much each is one of contact: 1 from a share of the strongest on.
std::vector<double> Shot::contact_shares() const {
  std::vector<double> forces(touches_.size(), 0);  // on the robot, lengths summed
  for (std::size_t f = 0; f < forces.size(); ++f)
    for (const fem::ContactForce& touch : touches_[f])
      if (touches_robot(touch)) forces[f] += touch.force_n.norm();
  const double strongest = *std::max_element(forces.begin(), forces.end());
  for (double& force : forces) force = strongest > 0 ? std::min(1.0, force / (full_contact * strongest)) : 0;
  return forces;
}

double Shot::shown(const std::vector<double>& of_stored, int frame) const {
  const double moment = moment_of(frame);
  const std::size_t before = std::size_t(moment), after = std::min(before + 1, of_stored.size() - 1);
  return of_stored[before] + (moment - double(before)) * (of_stored[after] - of_stored[before]);
}

// Of what is not held anywhere: what is held at a wall touches it always. The floor is drawn.
void Shot::find_panes() {
  std::map<std::pair<int, Wall>, std::vector<double>> forces;
  double strongest = 0;
  for (std::size_t f = 0; f < touches_.size(); ++f)
    for (const fem::ContactForce& touch : touches_[f]) {
      if (touch.other >= 0) continue;
      const std::vector<bool>& fixed = world_.bodies[std::size_t(touch.body)].fixed;
      if (std::find(fixed.begin(), fixed.end(), true) != fixed.end()) continue;
      const Wall wall = wall_at(world_.bounds_m, touch.place_m);
      if (wall == Wall{2, false} && look_.ground_height_m == world_.bounds_m.lower.z()) continue;
      std::vector<double>& force = forces[{touch.body, wall}];
      force.resize(touches_.size());
      force[f] += touch.force_n.norm();
      strongest = std::max(strongest, force[f]);
    }
  for (const auto& [side, force] : forces) {
    std::vector<bool> touching;
    for (const double newtons : force) touching.push_back(newtons > pressing_share * strongest);
    panes_.push_back(
        {side.first, side.second, faded(touching, int(pane_fade_s * scene_.film.frames_per_second))});
  }
}

void Shot::lay_out_time() {
  const scenes::FilmSpec& film = scene_.film;
  const std::vector<State>& all = plan_.trajectory.frames;
  int last = stored() - 1;
  if (film.end == scenes::FilmEnd::rest) {
    const SurfaceMesh& robot = bodies_[std::size_t(world_.robot)].surface;
    const double tolerance_m = at_rest * bounding_box(robot.positions).size().maxCoeff();
    last = std::min(last, first_at_rest(all, tolerance_m) + int(after_rest_s * film.frames_per_second));
  }
  std::vector<double> contact(std::size_t(last) + 1, 0);
  PaceRange range{1, 1};
  std::optional<double> length;
  if (film.pace == scenes::Pace::contact) {
    const std::vector<double> shares = contact_shares();
    contact.assign(shares.begin(), shares.begin() + last + 1);
    contact = eased(contact, int(ease_s * film.frames_per_second));
    const bool touched = *std::max_element(contact.begin(), contact.end()) > 0;
    if (touched || film.length_s) range = {film.slowest, film.quickest};  // else there is nothing to dwell on
    if (film.length_s) {
      const double usual_s = double(last) / film.frames_per_second, shortest_s = usual_s / film.quickest,
                   longest_s = usual_s / film.slowest;
      if (*film.length_s < shortest_s || *film.length_s > longest_s)
        throw InputError(fmt::format(
            "film.length_s = {:g}: with film.pace_range = [{:g}, {:g}] this motion can take {:.3g} "
            "to {:.3g} s; choose a length among these, or widen film.pace_range",
            *film.length_s, film.slowest, film.quickest, shortest_s, longest_s));
      length = *film.length_s * film.frames_per_second;
    }
  }
  const std::vector<Moment> motion = paced(contact, range, length);
  of_motion_ = int(motion.size());
  const auto frames_of = [&](const std::optional<scenes::CardSpec>& card) {
    return card ? std::max(1, int(std::lround(card->duration_s * film.frames_per_second))) : 0;
  };
  before_ = frames_of(film.title);
  moments_.assign(std::size_t(before_), motion.front());
  moments_.insert(moments_.end(), motion.begin(), motion.end());
  moments_.insert(moments_.end(), std::size_t(frames_of(film.end_card)), motion.back());
}

const scenes::CardSpec* Shot::card_of(int frame) const {
  return frame < before_                ? &*scene_.film.title
         : frame < before_ + of_motion_ ? nullptr
                                        : &*scene_.film.end_card;
}

double Shot::card_share(int frame) const {
  const scenes::CardSpec* card = card_of(frame);
  if (!card) return 0;
  const int away = frame < before_ ? before_ - frame : frame - before_ - of_motion_ + 1;
  const double share = std::min(
      1.0, double(away) / (std::min(card_fade_s, 0.5 * card->duration_s) * scene_.film.frames_per_second));
  return share * share * (3 - 2 * share);
}
// Not where the film's colors mean something.
bool Shot::shows_own_colors(std::size_t body) const {
  return !bodies_[body].appearance.empty() && scene_.bodies[body].texture &&
         (scene_.film.color_by == scenes::ColorBy::body ||
          world_.bodies[body].kind != fem::BodyKind::deformable);
}

Box Shot::box_of_motion() const {
  Box box;
  for (const State& state : plan_.trajectory.frames)
    for (std::size_t i = 0; i + 2 < state.positions.size(); i += 3)
      box.include(Vec3(state.positions[i], state.positions[i + 1], state.positions[i + 2]));
  for (const PreparedBody& body : bodies_) box.include(bounding_box(body.surface.positions));
  return box;
}

Points Shot::outline_of_motion(int subject) const {
  std::vector<Vec3> points;
  const bool cages = scene_.film.cages || scene_.film.side_by_side;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (subject >= 0 && int(b) != subject) continue;
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
  if (scene_.film.bounds_lines && subject < 0) {
    const Points edges = render::edges_of(scene_.bounds_m);
    for (Eigen::Index row = 0; row < edges.rows(); ++row) points.push_back(edges.row(row));
  }
  Points outline(Eigen::Index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) outline.row(Eigen::Index(i)) = points[i].transpose();
  return outline;
}

void Shot::lay_out_camera(double aspect) {
  for (const scenes::Keyframe& key : camera_->keyframes)
    path_.push_back({key.at, {.eye = key.eye_m, .target = key.target_m, .fov_deg = camera_->fov_deg}});
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
  const Points outline = outline_of_motion(camera_->subject);  // a skin is not what the film is about
  if (camera_->turn_deg == 0)
    frame(outline);
  else
    frame(turned_any_way(bounding_box(outline)));
}

render::Camera Shot::camera_of(int frame) const {
  const double share = of_motion_ < 2 ? 0 : double(index_in_motion(frame)) / double(of_motion_ - 1);
  render::Camera camera = render::turned(render::camera_at(path_, share), share * camera_->turn_deg);
  if (followed_m_.rows() > 0) {
    const Vec3 way = (followed_m_.row(frame) - followed_m_.row(0)).transpose();
    camera.eye += way, camera.target += way;
  }
  return camera;
}

std::string Shot::clock_at(int frame) const {
  const scenes::FilmSpec& film = scene_.film;
  if (!film.clock) return {};
  const double speed = film.speed * moments_[std::size_t(frame)].pace;
  std::string words = fmt::format("{:.{}f} s", time_s(frame), film.speed < 0.5 ? 2 : 1);
  // Where the speed changes, its figure goes in steps: one that is read while it runs says nothing.
  const bool steady = film.pace == scenes::Pace::steady;
  const auto told = [&](double times) {
    return steady ? std::round(10 * times) / 10 : times < 2 ? 0.5 * std::round(2 * times) : std::round(times);
  };
  if (speed < 1 && told(1 / speed) > 1) words += fmt::format(" · {:.3g}× slow motion", told(1 / speed));
  if (speed > 1 && told(speed) > 1) words += fmt::format(" · {:.3g}× time lapse", told(speed));
  return words;
}

double Shot::pixels_a_metre(const render::Camera& camera) const {
  return 0.5 * look_.height / std::tan(0.5 * camera.fov_deg * EIGEN_PI / 180) /
         (camera.target - camera.eye).norm();
}

std::array<int, 4> Shot::hidden_by(const std::array<Eigen::Vector4d, 4>& boxes) const {
  constexpr int max_frames = 24, across = 16, down = 4;
  std::array<std::vector<Eigen::Vector2d>, 4> places_of;
  for (std::size_t c = 0; c < boxes.size(); ++c)
    for (int x = 0; x < across; ++x)
      for (int y = 0; y < down; ++y)  // where two views are side by side, in their own one
        places_of[c].emplace_back(
            std::fmod(boxes[c][0] + (boxes[c][2] - boxes[c][0]) * (x + 0.5) / across, look_.width),
            boxes[c][1] + (boxes[c][3] - boxes[c][1]) * (y + 0.5) / down);
  std::array<int, 4> hidden{};
  Points outermost;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const ffd::Binding part = outermost_part(bodies_[b]);
    for (const int frame : render::spread_over(frames(), max_frames)) {
      deform(bodies_[b], part, fem::body_positions(world_, state_at(frame), int(b)), outermost);
      const render::Camera camera = camera_of(frame);
      std::vector<Eigen::Vector2d> seen;
      for (Eigen::Index p = 0; p < outermost.rows(); ++p) {
        const Vec3 pixel = render::pixel_from_world(camera, outermost.row(p), look_.width, look_.height);
        if (pixel.z() > 0) seen.push_back(pixel.head<2>());
      }
      const std::vector<Eigen::Vector2d> hull = convex_hull(std::move(seen));
      for (std::size_t c = 0; c < places_of.size(); ++c)
        hidden[c] += int(std::count_if(places_of[c].begin(), places_of[c].end(),
                                       [&](const Eigen::Vector2d& place) { return holds(hull, place); }));
    }
  }
  return hidden;
}

// The corner where they hide least of the bodies over the film; of equals the first.
void Shot::place_words() {
  const scenes::FilmSpec& film = scene_.film;
  words_.on_dark = look_.ground_srgb.mean() < 0.4;
  if (film.scale_bar) scale_m_ = round_length_m(0.2 * look_.width / pixels_a_metre(camera_of(0)));
  std::string clock = clock_at(frames() - 1);  // the longest, of equals the last
  for (int f = 0; f < frames(); ++f)
    if (std::string one = clock_at(f); one.size() > clock.size()) clock = std::move(one);
  if (film.caption.empty() && clock.empty()) return;
  const int width = look_.width * (film.side_by_side ? 2 : 1);
  std::array<Eigen::Vector4d, 4> boxes;
  for (std::size_t c = 0; c < boxes.size(); ++c)
    boxes[c] = render::place_of_caption(width, look_.height, film.caption, clock, render::corners[c]);
  std::array<int, 4> hidden = hidden_by(boxes);
  for (std::size_t c = 0; c < hidden.size(); ++c)
    if (inset_ && render::corners[c] == inset_corner_) hidden[c] = std::numeric_limits<int>::max();
  words_.corner =
      render::corners[std::size_t(std::min_element(hidden.begin(), hidden.end()) - hidden.begin())];
}

Eigen::Vector4d Shot::place_of_inset(render::Corner corner) const {
  const double margin = look_.width / 40.0, width = inset_->look_.width, height = inset_->look_.height;
  const bool right = corner == render::Corner::bottom_right || corner == render::Corner::top_right,
             bottom = corner == render::Corner::bottom_left || corner == render::Corner::bottom_right;
  const double left = std::round(right ? look_.width - margin - width : margin),
               top = std::round(bottom ? look_.height - margin - height : margin);
  return {left, top, left + width, top + height};
}

void Shot::place_inset() {
  const scenes::FilmSpec& film = scene_.film;
  inset_scene_ = std::make_unique<scenes::Scene>(scene_);
  inset_scene_->film.inset.reset();
  Output output;
  output.occlusion = output_.occlusion;
  const auto side = [&](int whole) { return std::max(16, int(std::lround(film.inset->size * whole))); };
  inset_ = std::make_unique<Shot>(*inset_scene_, film.inset->camera, plan_, world_, bodies_, scenery_,
                                  std::pair(side(look_.width), side(look_.height)), output);
  std::array<Eigen::Vector4d, 4> boxes;
  for (std::size_t c = 0; c < boxes.size(); ++c) boxes[c] = place_of_inset(render::corners[c]);
  const std::array<int, 4> hidden = hidden_by(boxes);
  std::size_t best = 1;
  for (std::size_t c = 0; c < boxes.size(); ++c) {
    const bool right = boxes[c][0] > 0.5 * look_.width - 0.5 * (boxes[c][2] - boxes[c][0]),
               bottom = boxes[c][1] > 0.5 * look_.height - 0.5 * (boxes[c][3] - boxes[c][1]);
    // Bars of colours and of length have their places.
    if ((film.color_by != scenes::ColorBy::body && right) || (film.scale_bar && bottom)) continue;
    if (hidden[c] < hidden[best]) best = c;
  }
  inset_corner_ = render::corners[best];
}

void Shot::measure_depths() {
  near_m_ = std::numeric_limits<double>::infinity(), far_m_ = 0;
  for (int f = 0; f < frames(); ++f) {
    const render::Camera camera = camera_of(f);
    const Vec3 view = (camera.target - camera.eye).normalized();
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner =
          look_.stage.lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(look_.stage.size());
      near_m_ = std::min(near_m_, view.dot(corner - camera.eye));
      far_m_ = std::max(far_m_, view.dot(corner - camera.eye));
    }
  }
  near_m_ = std::max(near_m_, 0.0), far_m_ = std::max(far_m_, near_m_ + 1e-3);
}

Json Shot::key_of_passes() const {
  std::vector<std::string> objects{""};
  for (const auto* bodies : {&scene_.bodies, &scene_.scenery})
    for (const scenes::BodySpec& body : *bodies) objects.push_back(body.name);
  Json key{{"depth_m", {near_m_, far_m_}}, {"objects", objects}};
  if (scene_.film.color_by != scenes::ColorBy::body)
    key["scalar"] = {{"of", caption_of(scene_.film.color_by)}, {"range", {low_, high_}}};
  const auto list = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  for (int f = 0; f < frames(); ++f) {
    key["contacts"].push_back(contacts_in_picture(f));
    const render::Camera camera = camera_of(f);
    key["cameras"].push_back(
        {{"eye_m", list(camera.eye)}, {"target_m", list(camera.target)}, {"fov_deg", camera.fov_deg}});
  }
  key["light"] = {{"toward_key", list(look_.toward_key.normalized())},
                  {"key", list(look_.key_light)},
                  {"key_size_deg", look_.key_size_deg},
                  {"sky", list(look_.sky_light)},
                  {"zenith_srgb", list(look_.background_top_srgb)},
                  {"horizon_srgb", list(look_.background_bottom_srgb)},
                  {"ground_srgb", list(look_.ground_srgb)},
                  {"ground_m", look_.ground_height_m ? Json(*look_.ground_height_m) : Json()}};
  return key;
}

// Of the stored frame that is shown, or was last; none under cards.
Json Shot::contacts_in_picture(int frame) const {
  const render::Camera camera = camera_of(frame);
  Json contacts = Json::array();
  if (card_of(frame)) return contacts;
  for (const fem::ContactForce& touch : touches_[std::size_t(moment_of(frame))]) {
    if (!touches_robot(touch)) continue;
    const Vec3 pixel = render::pixel_from_world(camera, touch.place_m, look_.width, look_.height);
    const int toucher = touch.body == world_.robot ? touch.other : touch.body;
    contacts.push_back({pixel.x(), pixel.y(), pixel.z(), touch.force_n.norm(), toucher + 1});
  }
  return contacts;
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
  double strongest = 0;
  for (const Control& control : plan_.trajectory.controls)
    strongest = std::max(strongest, double(largest_force(control)));
  for (const fem::Force& force : world_.forces) strongest = std::max(strongest, force.force_n.norm());
  if (strongest == 0)  // of a simulation: what the robot weighs
    strongest = world_.bodies[std::size_t(world_.robot)].mass_kg * world_.gravity_m_s2.norm();
  const double robot = bounding_box(bodies_[std::size_t(world_.robot)].surface.positions).diagonal();
  strongest_push_n_ = strongest;
  arrow_m_per_n_ = strongest > 0 ? robot / strongest : 0;
  arrow_radius_m_ = 0.02 * robot;
}

bool Shot::acts(const fem::Force& force, int stored_frame) const {
  const std::vector<State>& all = plan_.trajectory.frames;
  const std::int64_t step = all[std::size_t(stored_frame)].step,
                     next = stored_frame + 1 < stored() ? all[std::size_t(stored_frame) + 1].step : step + 1;
  return force.first_step < next && force.end_step > step;
}

Points Shot::arrows_at(int frame) const {
  const double moment = moment_of(frame);
  const int before = int(moment);
  Points ends = arrows_at_stored(before);
  const double share = moment - before;
  if (share == 0) return ends;
  const Points later = arrows_at_stored(before + 1);
  for (Eigen::Index row = 0; row < ends.rows(); row += 2) {
    const Vec3 from = ends.row(row), to = later.row(row), force = ends.row(row + 1) - ends.row(row),
               force_later = later.row(row + 1) - later.row(row);
    // One that begins or ends grows where it stands.
    const Vec3 foot = force_later.isZero() ? from : force.isZero() ? to : Vec3(from + share * (to - from));
    ends.row(row) = foot.transpose();
    ends.row(row + 1) = (foot + force + share * (force_later - force)).transpose();
  }
  return ends;
}

Points Shot::arrows_at_stored(int frame) const {
  const State& state = plan_.trajectory.frames[std::size_t(frame)];
  const Vec3 robot = fem::center_of_mass_m(world_, state, world_.robot);
  const int bodies = int(world_.bodies.size());
  const Points nodes = fem::body_positions(world_, state, world_.robot);
  // Inside a body nothing would be seen of an arrow: it begins where a line along the force leaves it.
  const auto put = [&](Points& ends, Eigen::Index row, const Points& body, const Vec3& at,
                       const Vec3& force_n) {
    if (force_n.norm() == 0) return;
    const Vec3 along = force_n.normalized();
    const Vec3 from = at + std::max(0.0, (body * along).maxCoeff() - at.dot(along)) * along;
    ends.row(row) = from.transpose();
    const double length =
        std::min(arrow_m_per_n_ * force_n.norm(), longest_arrow * arrow_m_per_n_ * strongest_push_n_);
    ends.row(row + 1) = (from + length * along).transpose();
  };
  Points ends(2 * (1 + bodies + Eigen::Index(world_.forces.size())), 3);
  ends.rowwise() = robot.transpose();
  const Control control = control_at(frame);
  if (control.manipulation != Manipulation::none) {
    const bool at_point = control.manipulation == Manipulation::control_point;
    Vec3 force_n = control.force_n.cast<double>();
    if (control.manipulation == Manipulation::interpolation || control.manipulation == Manipulation::hold)
      for (const Vec3& on_node : fem::control_forces_n(world_, state, control)) force_n += on_node;
    put(ends, 0, nodes, at_point ? Vec3(nodes.row(control.node).transpose()) : robot, force_n);
  }
  // Each at the middle of its contacts, by their forces.
  std::vector<Vec3> force(std::size_t(bodies), Vec3::Zero()), place = force;
  std::vector<double> weight(std::size_t(bodies), 0);
  for (const fem::ContactForce& contact : fem::contact_forces(world_, state, control)) {
    if (contact.body != world_.robot && contact.other != world_.robot) continue;
    const int other = contact.body == world_.robot ? contact.other : contact.body;
    if (other == world_.robot) continue;
    const std::size_t slot = other >= 0 ? std::size_t(other) : std::size_t(world_.robot);
    force[slot] += contact.body == world_.robot ? contact.force_n : Vec3(-contact.force_n);
    place[slot] += contact.force_n.norm() * contact.place_m;
    weight[slot] += contact.force_n.norm();
  }
  for (std::size_t b = 0; b < weight.size(); ++b)
    if (weight[b] > 0) put(ends, 2 + 2 * Eigen::Index(b), nodes, place[b] / weight[b], force[b]);
  for (std::size_t i = 0; i < world_.forces.size(); ++i) {
    const fem::Force& given = world_.forces[i];
    if (!acts(given, frame)) continue;
    const Points body = fem::body_positions(world_, state, given.body);
    const std::vector<double>& mass = world_.bodies[std::size_t(given.body)].node_mass_kg;
    Vec3 sum = Vec3::Zero();
    double all = 0;
    for (const int n : given.nodes)
      sum += mass[std::size_t(n)] * body.row(n).transpose(), all += mass[std::size_t(n)];
    put(ends, 2 * (1 + bodies + Eigen::Index(i)), body, sum / all, given.force_n);
  }
  return ends;
}

void Shot::find_tree() {
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

std::uint64_t Shot::hash_of_look() const {
  const scenes::FilmSpec& film = scene_.film;
  Hasher hasher;
  hasher.text(version).value(generation).value(look_.width).value(look_.height).value(int(film.look));
  if (film.background_srgb) hasher.matrix(*film.background_srgb);
  hasher.matrix(look_.stage.lower).matrix(look_.stage.upper).matrix(scene_.bounds_m.lower);
  hasher.matrix(scene_.bounds_m.upper);
  for (const bool flag : {film.bounds_lines, film.transparent, film.clock, film.cages, film.forces, film.path,
                          film.tree, film.side_by_side, film.scale_bar})
    hasher.value(int(flag));
  if (film.outlines) hasher.text("outlines");
  hasher.text(film.caption).value(int(film.color_by)).value(low_).value(high_).value(film.speed);
  hasher.value(film.frames_per_second).value(frames()).value(output_.bits);
  if (!output_.occlusion) hasher.value(0);
  hasher.value(arrow_m_per_n_).matrix(way_m_).matrix(tree_m_);
  for (const auto& [first_stored, control] : pushes_) {
    if (!film.forces) break;
    hasher.value(first_stored)
        .value(int(control.manipulation))
        .matrix(control.force_n)
        .value(control.node)
        .value(control.radius_m)
        .matrix(control.target_m)
        .value(control.max_force_n);
  }
  for (const fem::Force& force : world_.forces) {
    if (!film.forces) break;
    hasher.value(force.body).value(force.first_step).value(force.end_step).matrix(force.force_n);
    for (const int n : force.nodes) hasher.value(n);
  }
  const auto add_look = [&](const scenes::BodySpec& body) {
    hasher.matrix(body.color_srgb)
        .value(int(body.look))
        .value(body.opacity)
        .value(body.roughness)
        .value(body.metallic);
  };
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    hasher.value(limber::hash_of(bodies_[b].surface)).value(limber::hash_of(bodies_[b].cage));
    hasher.value(int(bodies_[b].deformation));
    add_look(scene_.bodies[b]);
    if (!shows_own_colors(b)) continue;
    const Appearance& a = bodies_[b].appearance;
    hasher.matrix(a.uv).matrix(a.colors);
    for (const int m : a.material_from_triangle) hasher.value(m);
    for (const SurfaceMaterial& m : a.materials) hasher.matrix(m.color).value(m.image).value(m.normal_image);
    for (const ImageFile& image : a.images) hasher.text(image.bytes);
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
      .value(limber::hash_of(state_at(frame)))
      .matrix(camera.eye)
      .matrix(camera.target)
      .matrix(camera.up);
  if (const scenes::CardSpec* card = card_of(frame))
    hasher.value(card_share(frame))
        .text(fmt::format("{}", fmt::join(card->lines, "\n")))
        .value(int(card->plain));
  if (inset_) hasher.text(inset_->hash_of(frame)).value(int(inset_corner_)).value(scene_.film.inset->size);
  for (const PaneOf& pane : panes_)
    if (const double share = shown(pane.shown, frame); share > 0)
      hasher.value(pane.body).value(pane.wall.axis).value(int(pane.wall.upper)).value(share);
  if (scene_.film.pace != scenes::Pace::steady)
    hasher.value(moment_of(frame)).value(moments_[std::size_t(frame)].pace);
  return hex(hasher.value(camera.fov_deg).digest());
}

}  // namespace limber::detail
