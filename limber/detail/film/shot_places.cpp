// Where words, bars and the inset stand on the picture, for the whole film: where they hide least of the
// bodies.
//
// Bodies are seen as convex hulls of their outermost vertices on the picture, in at most 24 frames that are
// spread over the film. For each corner, places on a grid of the box that is to stand there are counted where
// they lie in a hull.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/observe.h"
#include "limber/detail/film/outermost.h"
#include "limber/detail/film/shot.h"
#include "render/film.h"
#include "render/label_places.h"

namespace limber::detail {

namespace {

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

// Whether a point is on the left of every edge.
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

// The motion's time, and by how much the film is slower or quicker than the motion, where that is to be told.
// Of a slow film the time has two digits after the point.
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
    const std::vector<render::Plane> cuts = cuts_of(int(b));
    for (const int frame : render::spread_over(frames(), max_frames)) {
      deform(bodies_[b], part, fem::body_positions(world_, state_at(frame), int(b)), outermost);
      const render::Camera camera = camera_of(frame);
      std::vector<Eigen::Vector2d> seen;
      for (Eigen::Index p = 0; p < outermost.rows(); ++p) {
        const Vec3 place = outermost.row(p);
        if (std::any_of(cuts.begin(), cuts.end(),
                        [&](const auto& cut) { return cut.dot(place.homogeneous()) < 0; }))
          continue;
        const Vec3 pixel = render::pixel_from_world(camera, place, look_.width, look_.height);
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

// The corner where they hide least of the bodies over the film; of equals the first. Boxes are those of the
// longest clock that the film shows. A bar of length is at most a fifth of the width, from nearest too.
void Shot::place_words() {
  const scenes::FilmSpec& film = scene_.film;
  words_.on_dark = look_.ground_srgb.mean() < 0.4;
  if (film.scale_bar) {
    double nearest = 0;
    for (int f = 0; f < frames(); ++f) nearest = std::max(nearest, pixels_a_metre(camera_of(f)));
    scale_m_ = round_length_m(0.2 * look_.width / nearest);
  }
  std::string clock = clock_at(frames() - 1);  // the longest, of equals the last
  for (int f = 0; f < frames(); ++f)
    if (std::string one = clock_at(f); one.size() > clock.size()) clock = std::move(one);
  if (film.caption.empty() && clock.empty()) return;
  const int width = look_.width * (film.side_by_side ? 2 : 1);
  std::array<Eigen::Vector4d, 4> boxes;
  for (std::size_t c = 0; c < boxes.size(); ++c)
    boxes[c] = render::place_of_caption(width, look_.height, film.caption, clock, render::corners[c]);
  std::array<int, 4> hidden = hidden_by(boxes);
  if (inset_) {
    const Eigen::Vector4d inset = place_of_inset(inset_corner_);
    for (std::size_t c = 0; c < hidden.size(); ++c)
      if (render::corners[c] == inset_corner_ || render::overlap(boxes[c], inset))
        hidden[c] = std::numeric_limits<int>::max();
  }
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

// The inset is a shot of its own: the same motion, bodies and look, seen by another camera in a smaller
// picture. It has no inset and no names itself, and no passes.
void Shot::place_inset() {
  const scenes::FilmSpec& film = scene_.film;
  inset_scene_ = std::make_unique<scenes::Scene>(scene_);
  inset_scene_->film.inset.reset();
  inset_scene_->film.labels.clear();
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

}  // namespace limber::detail
