// Names beside what is seen (film.labels).
//
// What is seen where is found in small pictures of numbers of bodies (render/sight.h), at most 48 of them
// over the film, in which the processor lays triangle over triangle: so names stand at the same places on
// every machine, whichever frames it paints. A line ends at the middle of a triangle, which moves with its
// body: of some hundred of them, evenly over the surface, the one that is seen most, farthest within what is
// seen of its body; what lies under words, bars or the inset isn't seen. Where names stand,
// render/label_places.h finds. A name is shown while the end of its line is seen and no line crosses or runs
// through those; else it fades. Where that would be so for much of the time, the film is parted in two acts
// that have places of their own. Method: docs/rendering.md.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/log.h"
#include "core/threads.h"
#include "fem/observe.h"
#include "limber/detail/film/shot.h"
#include "render/cut.h"
#include "render/film.h"
#include "render/label_places.h"
#include "render/sight.h"

namespace limber::detail {

namespace {

constexpr int sight_width = 480, max_sights = 48, max_ends = 400, max_moments = 12;
constexpr double sight_every_s = 0.3, min_act_s = 2, fade_s = 0.3;  // of the film
constexpr double max_hidden = 0.15;                                 // of an act that is not parted
constexpr int min_pixels = 6;         // of a body that is seen, in a small picture
constexpr double deep_enough = 0.03;  // of the picture's height, within what is seen of a body
constexpr double aside_price = 0.5;   // of an end as far as the picture is wide from its name
constexpr double over_others = 0.25;  // what an end on a transparent surface before something opaque is worth
constexpr double widest_words = 0.26;                                     // of the picture
constexpr double letter_share = 1 / 58.0, small_letter_share = 1 / 36.0;  // of its height: words are not less
constexpr double readable_px = 8;  // than readable while they are small

using Vec2 = Eigen::Vector2d;

// Triangles at equal steps of the surface's area.
std::vector<Eigen::Index> spread_over_area(const SurfaceMesh& mesh, int count) {
  const auto area_of = [&](Eigen::Index t) {
    const auto corner = [&](int i) -> Vec3 { return mesh.positions.row(mesh.triangles(t, i)); };
    return (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
  };
  double all = 0, passed = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) all += area_of(t);
  std::vector<Eigen::Index> spread;
  int next = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows() && next < count; ++t) {
    passed += area_of(t);
    if (passed * count < all * (next + 0.5)) continue;
    spread.push_back(t);
    while (next < count && passed * count >= all * (next + 0.5)) ++next;
  }
  return spread;
}

}  // namespace

struct Shot::Labeling {
  struct Named {
    int number;  // of bodies and scenery
    bool transparent;
    double size_m;
    std::vector<Eigen::Index> ends;  // triangles
    std::vector<render::Plane> cuts;
  };
  struct Look {  // at one end
    Vec2 pixel = Vec2::Zero();
    double worth = 0;  // 0: not seen
  };
  struct Sighted {                      // at one moment
    std::vector<std::vector<Look>> at;  // a label, an end
    std::vector<int> pixels;            // a label
    Eigen::Vector4d subject = {0, 0, 0, 0};
  };
  struct Act {
    int first, last;       // sights
    std::vector<int> end;  // a label; −1: none
    std::vector<std::optional<render::LabelPlace>> places;
    double hidden = 0;
  };

  explicit Labeling(const Shot& of)
      : shot(of), scale(double(of.look_.width) / width()), taken(of.places_taken()) {
    const int numbers = int(shot.bodies_.size() + shot.scenery_.size());
    for (int n = 0; n < numbers; ++n)
      solid.push_back(!shot.cuts_of(n).empty() && render::has_inside(mesh_of(n).triangles));
    for (const scenes::LabelSpec& label : shot.scene_.film.labels) {
      const SurfaceMesh& mesh = mesh_of(label.body);
      labels.push_back({label.body, spec_of(label.body).opacity < 1, bounding_box(mesh.positions).diagonal(),
                        spread_over_area(mesh, max_ends), shot.cuts_of(label.body)});
    }
    const double seconds = double(shot.of_motion_) / shot.scene_.film.frames_per_second;
    for (const int f :
         render::spread_over(shot.of_motion_, std::clamp(int(seconds / sight_every_s) + 1, 2, max_sights)))
      frames.push_back(shot.before_ + f);
    sights.resize(frames.size());
    parallel_for(int(frames.size()),
                 [&](int s) { sights[std::size_t(s)] = sighted(frames[std::size_t(s)]); });
  }

  int width() const { return std::min(sight_width, shot.look_.width); }
  int height() const {
    return std::max(1, int(std::lround(shot.look_.height / (double(shot.look_.width) / width()))));
  }
  const SurfaceMesh& mesh_of(int number) const {
    const std::size_t n = std::size_t(number), bodies = shot.bodies_.size();
    return n < bodies ? shot.bodies_[n].surface : shot.scenery_[n - bodies];
  }
  const scenes::BodySpec& spec_of(int number) const {
    const std::size_t n = std::size_t(number), bodies = shot.bodies_.size();
    return n < bodies ? shot.scene_.bodies[n] : shot.scene_.scenery[n - bodies];
  }
  bool moves(int number) const {
    return number < int(shot.bodies_.size()) && shot.world_.bodies[std::size_t(number)].moving;
  }

  // ---- what is seen ----

  void lay(render::Sight& sight, const render::Camera& camera, int number, const Points& positions) const {
    const Triangles& triangles = mesh_of(number).triangles;
    const std::vector<render::Plane> cuts = shot.cuts_of(number);
    render::lay_over(sight, camera, positions, triangles, number, cuts);
    for (std::size_t i = 0; i < cuts.size() && solid[std::size_t(number)]; ++i) {
      std::vector<render::Plane> others = cuts;
      others.erase(others.begin() + std::ptrdiff_t(i));
      const SurfaceMesh cap = render::cap_of(positions, triangles, cuts[i]);
      render::lay_over(sight, camera, cap.positions, cap.triangles, number, others);
    }
  }

  Sighted sighted(int frame) const {
    const State state = shot.state_at(frame);
    const render::Camera camera = shot.camera_of(frame);
    const int numbers = int(solid.size());
    std::vector<Points> moved(static_cast<std::size_t>(numbers));
    for (int n = 0; n < numbers; ++n)
      if (moves(n)) {
        moved[std::size_t(n)].resize(mesh_of(n).positions.rows(), 3);
        deform(shot.bodies_[std::size_t(n)], fem::body_positions(shot.world_, state, n),
               moved[std::size_t(n)]);
      }
    const auto positions_of = [&](int n) -> const Points& {
      return moves(n) ? moved[std::size_t(n)] : mesh_of(n).positions;
    };
    render::Sight opaque(width(), height());
    for (int n = 0; n < numbers; ++n)
      if (spec_of(n).opacity == 1) lay(opaque, camera, n, positions_of(n));
    const std::vector<int> clear_of_opaque = clearances(opaque);
    render::Sight all = opaque;
    for (int n = 0; n < numbers; ++n)
      if (const double opacity = spec_of(n).opacity; opacity > 0 && opacity < 1)
        lay(all, camera, n, positions_of(n));

    Sighted made;
    made.subject = {double(shot.look_.width), double(shot.look_.height), 0, 0};
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x)
        if (all.object[all.at(x, y)] >= 0) {
          made.subject.head<2>() = made.subject.head<2>().cwiseMin(scale * Vec2(x, y));
          made.subject.tail<2>() = made.subject.tail<2>().cwiseMax(scale * Vec2(x + 1, y + 1));
        }
    for (const Named& label : labels) {
      render::Sight own = opaque;
      if (label.transparent && spec_of(label.number).opacity > 0)
        lay(own, camera, label.number, positions_of(label.number));
      const std::vector<int>& clear = label.transparent ? clearances(own) : clear_of_opaque;
      made.pixels.push_back(int(std::count(own.object.begin(), own.object.end(), label.number)));
      std::vector<Look>& looks = made.at.emplace_back();
      for (const Eigen::Index t : label.ends) {
        Look& look = looks.emplace_back();
        const Vec3 place = middle_of(positions_of(label.number), t, mesh_of(label.number).triangles);
        const Vec3 pixel = pixel_from_world(camera, place, width(), height());
        look.pixel = scale * pixel.head<2>();
        if (made.pixels.back() < min_pixels || pixel.z() <= 0 || cut_off(label, place)) continue;
        const int x = int(std::floor(pixel.x())), y = int(std::floor(pixel.y()));
        if (x < 0 || x >= width() || y < 0 || y >= height()) continue;
        const std::size_t at = own.at(x, y);
        const double near_m = 0.02 * label.size_m + 2 * pixel.z() *
                                                        std::tan(0.5 * camera.fov_deg * EIGEN_PI / 180) /
                                                        (0.5 * height());
        if (own.object[at] != label.number || std::abs(own.depth_m[at] - pixel.z()) > near_m) continue;
        if (std::any_of(taken.begin(), taken.end(),
                        [&](const auto& box) { return lies_in(box, look.pixel); }))
          continue;
        look.worth = std::min(1.0, clear[at] / (deep_enough * height()));
        if (label.transparent && opaque.object[at] >= 0) look.worth *= over_others;
      }
    }
    return made;
  }

  static Vec3 middle_of(const Points& positions, Eigen::Index t, const Triangles& triangles) {
    return (positions.row(triangles(t, 0)) + positions.row(triangles(t, 1)) + positions.row(triangles(t, 2)))
               .transpose() /
           3;
  }
  static bool lies_in(const Eigen::Vector4d& box, const Vec2& pixel) {
    return box[0] < pixel.x() && pixel.x() < box[2] && box[1] < pixel.y() && pixel.y() < box[3];
  }
  static bool cut_off(const Named& label, const Vec3& place) {
    return std::any_of(label.cuts.begin(), label.cuts.end(),
                       [&](const render::Plane& plane) { return plane.dot(place.homogeneous()) < 0; });
  }

  // ---- where names stand ----

  bool seen(std::size_t label, int end, int sight) const {
    return end >= 0 && sights[std::size_t(sight)].at[label][std::size_t(end)].worth > 0;
  }
  const Vec2& pixel(std::size_t label, int end, int sight) const {
    return sights[std::size_t(sight)].at[label][std::size_t(end)].pixel;
  }

  bool clear_of_words(const render::LabelPlace& place, const Vec2& end) const {
    return std::none_of(taken.begin(), taken.end(),
                        [&](const auto& box) { return render::runs_through(place, end, box); });
  }

  // What is seen longest and deepest, and of that what is nearest to where the words begin on the side where
  // most of the body is. `words` is the share of the picture's width that they take: a line to what is behind
  // them would run through them, and so from the other side.
  int best_end(std::size_t label, const Act& act, double words) const {
    double x = 0, worth = 0;
    for (int s = act.first; s <= act.last; ++s)
      for (const Look& look : sights[std::size_t(s)].at[label])
        if (look.worth > 0) x += look.worth * look.pixel.x(), worth += look.worth;
    const bool right = worth > 0 && x / worth > 0.5 * shot.look_.width;
    int best = -1;
    double most = 0;
    for (std::size_t e = 0; e < labels[label].ends.size(); ++e) {
      double sum = 0;
      for (int s = act.first; s <= act.last; ++s) {
        const Look& look = sights[std::size_t(s)].at[label][e];
        const double off = std::abs(look.pixel.x() / shot.look_.width - (right ? 1 - words : words));
        if (look.worth > 0) sum += look.worth * (1 - aside_price * std::min(off, 1.0));
      }
      if (sum > most) most = sum, best = int(e);
    }
    return best;
  }

  Act act_of(int first, int last) const {
    Act act{first, last, {}, {}};
    double widest = 0;
    for (std::size_t l = 0; l < labels.size(); ++l)
      widest = std::max(widest, render::width_of_words(shot.scene_.film.labels[l].text, shot.letter_px_));
    const double words = std::min(0.5, 1.0 / 40 + (widest + 2 * shot.letter_px_) / shot.look_.width);
    for (std::size_t l = 0; l < labels.size(); ++l) act.end.push_back(best_end(l, act, words));
    render::LabelRoom room{
        shot.look_.width, shot.look_.height, shot.letter_px_, {double(shot.look_.width), 0, 0, 0}, taken};
    std::vector<render::WantedLabel> wanted;
    for (std::size_t l = 0; l < labels.size(); ++l)
      wanted.push_back({render::width_of_words(shot.scene_.film.labels[l].text, shot.letter_px_), {}});
    for (const int m : render::spread_over(last - first + 1, max_moments)) {
      const Sighted& sight = sights[std::size_t(first + m)];
      room.subject.head<2>() = room.subject.head<2>().cwiseMin(sight.subject.head<2>());
      room.subject.tail<2>() = room.subject.tail<2>().cwiseMax(sight.subject.tail<2>());
      for (std::size_t l = 0; l < labels.size(); ++l)
        wanted[l].ends.push_back(
            seen(l, act.end[l], first + m) ? std::optional(pixel(l, act.end[l], first + m)) : std::nullopt);
    }
    act.places = place_labels(wanted, room);
    int all = 0, hidden = 0;
    for (int s = first; s <= last; ++s)
      for (std::size_t l = 0; l < labels.size(); ++l) {
        if (sights[std::size_t(s)].pixels[l] < min_pixels) continue;
        ++all;
        bool shown = act.places[l] && seen(l, act.end[l], s) &&
                     clear_of_words(*act.places[l], pixel(l, act.end[l], s));
        for (std::size_t o = 0; o < labels.size() && shown; ++o)
          if (o != l && act.places[o] && seen(o, act.end[o], s))
            shown =
                !collide(*act.places[l], pixel(l, act.end[l], s), *act.places[o], pixel(o, act.end[o], s));
        hidden += int(!shown);
      }
    act.hidden = all > 0 ? double(hidden) / all : 0;
    return act;
  }

  // Parted in the middle while too much is hidden and both halves are long enough, and better.
  std::vector<Act> acts_between(int first, int last) const {
    Act whole = act_of(first, last);
    const double seconds =
        double(frames[std::size_t(last)] - frames[std::size_t(first)]) / shot.scene_.film.frames_per_second;
    if (whole.hidden <= max_hidden || seconds < 2 * min_act_s || last - first < 3) return {whole};
    const int middle = (first + last + 1) / 2;
    std::vector<Act> acts = acts_between(first, middle - 1);
    for (Act& act : acts_between(middle, last)) acts.push_back(std::move(act));
    double hidden = 0;
    for (const Act& act : acts) hidden += act.hidden * (act.last - act.first + 1) / (last - first + 1);
    if (hidden > 0.8 * whole.hidden) return {whole};
    return acts;
  }

  // ---- what each frame shows ----

  // Of a label shown in part only: 0 where it is not to be seen, and less than 1 near by.
  std::vector<double> shares_of(std::vector<bool> shown, bool opens, bool closes) const {
    const int count = int(shown.size()), usual = int(fade_s * shot.scene_.film.frames_per_second),
              fade = 6 * usual <= count ? usual : 0;
    // Too short to be read, between two that hide.
    for (int f = 0; f < count;) {
      int end = f;
      while (end < count && shown[std::size_t(end)] == shown[std::size_t(f)]) ++end;
      const bool whole = (f == 0 && !opens) || (end == count && !closes);
      if (shown[std::size_t(f)] && end - f < 3 * fade && !whole)
        std::fill(shown.begin() + f, shown.begin() + end, false);
      f = end;
    }
    std::vector<double> shares(shown.size(), 1);
    int since = opens ? 0 : fade + 1;
    for (int f = 0; f < count; ++f) {
      since = shown[std::size_t(f)] ? since + 1 : 0;
      shares[std::size_t(f)] = std::min(1.0, double(since) / (fade + 1));
    }
    since = closes ? 0 : fade + 1;
    for (int f = count - 1; f >= 0; --f) {
      since = shown[std::size_t(f)] ? since + 1 : 0;
      shares[std::size_t(f)] = std::min(shares[std::size_t(f)], double(since) / (fade + 1));
    }
    return shares;
  }

  void show(const Act& act, std::vector<std::vector<Name>>& names) const {
    const int from = frames[std::size_t(act.first)],
              to = act.last + 1 < int(frames.size()) ? frames[std::size_t(act.last + 1)]
                                                     : shot.before_ + shot.of_motion_;  // beyond
    const std::size_t count = std::size_t(to - from);
    std::vector<std::vector<Vec2>> ends(labels.size(), std::vector<Vec2>(count, Vec2::Zero()));
    std::vector<std::vector<bool>> shown(labels.size(), std::vector<bool>(count, false));
    std::vector<ffd::Binding> parts(labels.size());
    for (std::size_t l = 0; l < labels.size(); ++l) {
      if (!act.places[l] || !moves(labels[l].number)) continue;
      const PreparedBody& body = shot.bodies_[std::size_t(labels[l].number)];
      const Eigen::Vector3i corners = body.surface.triangles.row(end_of(l, act)).transpose();
      parts[l] = {body.binding.tet_from_vertex(corners), body.binding.weights(corners, Eigen::all)};
    }
    parallel_for(int(count), [&](int f) {
      const State state = shot.state_at(from + f);
      const render::Camera camera = shot.camera_of(from + f);
      Points corners;
      for (std::size_t l = 0; l < labels.size(); ++l) {
        if (!act.places[l]) continue;
        const int number = labels[l].number;
        Vec3 place;
        if (moves(number)) {
          deform(shot.bodies_[std::size_t(number)], parts[l], fem::body_positions(shot.world_, state, number),
                 corners);
          place = corners.colwise().mean().transpose();
        } else {
          place = middle_of(mesh_of(number).positions, end_of(l, act), mesh_of(number).triangles);
        }
        ends[l][std::size_t(f)] =
            pixel_from_world(camera, place, shot.look_.width, shot.look_.height).head<2>();
      }
    });
    std::vector<double> importance(labels.size(), 0);
    for (std::size_t l = 0; l < labels.size(); ++l) {
      if (!act.places[l]) continue;
      for (int s = act.first; s <= act.last; ++s) {
        importance[l] += sights[std::size_t(s)].pixels[l];
        const bool last = s == act.last;
        const int until = last ? to : frames[std::size_t(s + 1)];
        if (seen(l, act.end[l], s) && (last || seen(l, act.end[l], s + 1)))
          for (int f = frames[std::size_t(s)]; f < until; ++f) shown[l][std::size_t(f - from)] = true;
      }
    }
    for (std::size_t l = 0; l < labels.size(); ++l)
      for (std::size_t f = 0; f < count; ++f)
        if (shown[l][f] && !clear_of_words(*act.places[l], ends[l][f])) shown[l][f] = false;
    for (std::size_t f = 0; f < count; ++f)
      for (std::size_t l = 0; l < labels.size(); ++l)
        for (std::size_t o = l + 1; o < labels.size(); ++o)
          if (shown[l][f] && shown[o][f] && collide(*act.places[l], ends[l][f], *act.places[o], ends[o][f]))
            shown[importance[l] < importance[o] ? l : o][f] = false;
    const bool opens = act.first > 0, closes = act.last + 1 < int(frames.size());
    for (std::size_t l = 0; l < labels.size(); ++l) {
      if (!act.places[l]) continue;
      const std::vector<double> shares = shares_of(shown[l], opens, closes);
      for (std::size_t f = 0; f < count; ++f)
        if (shares[f] > 0)
          names[std::size_t(from) + f].push_back(
              {shot.scene_.film.labels[l].text, labels[l].number, *act.places[l], ends[l][f], shares[f]});
    }
  }
  Eigen::Index end_of(std::size_t label, const Act& act) const {
    return labels[label].ends[std::size_t(act.end[label])];
  }

  const Shot& shot;
  double scale;  // pixels of the picture over those of a small one
  std::vector<Eigen::Vector4d> taken;
  std::vector<bool> solid;  // of what is cut, a number
  std::vector<Named> labels;
  std::vector<int> frames;  // of the sights
  std::vector<Sighted> sights;
};

// Captions, bars and the inset have their places before names get theirs.
std::vector<Eigen::Vector4d> Shot::places_taken() const {
  const scenes::FilmSpec& film = scene_.film;
  const double width = look_.width, height = look_.height, margin = width / 40;
  std::vector<Eigen::Vector4d> taken;
  std::string clock;
  for (int f = 0; f < frames(); ++f)
    if (std::string one = clock_at(f); one.size() > clock.size()) clock = std::move(one);
  if (!film.caption.empty() || !clock.empty())
    taken.push_back(render::place_of_caption(look_.width, look_.height, film.caption, clock, words_.corner));
  if (inset_) taken.push_back(place_of_inset(inset_corner_));
  if (film.scale_bar) {
    const bool left = words_.corner == render::Corner::bottom_right;
    const double length = 0.22 * width;
    taken.emplace_back(left ? 0 : width - margin - length, height - margin - height / 20,
                       left ? margin + length : width, height);
  }
  if (film.color_by != scenes::ColorBy::body)
    taken.emplace_back(width - margin - height / 6, 0.2 * height, width, 0.78 * height);
  const double room = height / 90;
  for (Eigen::Vector4d& box : taken) box += Eigen::Vector4d(-room, -room, room, room);
  return taken;
}

std::vector<Shot::Name> Shot::names_at(int frame) const {
  return names_.empty() ? std::vector<Name>() : names_[std::size_t(frame)];
}

void Shot::place_names() {
  const std::vector<scenes::LabelSpec>& labels = scene_.film.labels;
  if (labels.empty()) return;
  letter_px_ =
      std::max({1.0, letter_share * look_.height, std::min(readable_px, small_letter_share * look_.height)});
  double widest = 0;
  for (const scenes::LabelSpec& label : labels)
    widest = std::max(widest, render::width_of_words(label.text, letter_px_));
  letter_px_ *= std::min(1.0, widest_words * look_.width / std::max(widest, 1.0));
  names_.resize(std::size_t(frames()));
  const Labeling labeling(*this);
  std::vector<bool> placed(labels.size(), false);
  for (const Labeling::Act& act : labeling.acts_between(0, int(labeling.frames.size()) - 1)) {
    labeling.show(act, names_);
    for (std::size_t l = 0; l < labels.size(); ++l) placed[l] = placed[l] || act.places[l] || act.end[l] < 0;
  }
  for (std::size_t l = 0; l < labels.size(); ++l)
    if (!placed[l]) log::warn("film.labels: there is no room for {}", labels[l].text);
  for (int f = 0; f < frames(); ++f) {  // before and after the motion nothing moves
    const int of_motion = before_ + index_in_motion(f);
    if (of_motion != f) names_[std::size_t(f)] = names_[std::size_t(of_motion)];
  }
}

}  // namespace limber::detail
