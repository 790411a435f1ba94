// Which moment of the motion each frame of a shot shows, and what of the film are cards. Method:
// docs/rendering.md, "Time"; the pacing itself is in film_time.h.
//
// Stored frames are as far apart as frames of a film at its usual speed (film.speed), so a film of steady
// pace shows each of them once. A moment is counted in stored frames and may lie between two.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "limber/detail/film/shot.h"

namespace limber::detail {

namespace {

constexpr double at_rest = 0.003;     // of the robot's size: what moves no farther is not seen to move
constexpr double after_rest_s = 0.5;  // of the film
constexpr double ease_s = 0.5;        // of the film at its usual speed: so long before contact it slows down
constexpr double card_fade_s = 0.5;
constexpr double full_contact = 0.05;  // of the strongest: from there on the robot is in contact

}  // namespace

int Shot::frames() const { return int(moments_.size()); }

double Shot::time_s(int frame) const { return moment_of(frame) / plan_.trajectory.frames_per_second; }

// The speeds that are told are of the motion itself: film.speed times the pace.
FilmTime Shot::time_told() const {
  const scenes::FilmSpec& film = scene_.film;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Moment& moment : moments_)
    least = std::min(least, moment.pace * film.speed), most = std::max(most, moment.pace * film.speed);
  return {double(frames()) / film.frames_per_second, time_s(frames() - 1),
          double(stored() - 1) / plan_.trajectory.frames_per_second - time_s(frames() - 1), least, most};
}

// How much each stored frame is one of contact: in proportion to the forces on the robot (their lengths
// summed), 1 from a share of the motion's strongest on. What the robot does to itself does not count.
std::vector<double> Shot::contact_shares() const {
  std::vector<double> forces(touches_.size(), 0);  // on the robot, lengths summed
  for (std::size_t f = 0; f < forces.size(); ++f)
    for (const fem::ContactForce& touch : touches_[f])
      if (touches_robot(touch)) forces[f] += touch.force_n.norm();
  const double strongest = *std::max_element(forces.begin(), forces.end());
  for (double& force : forces) force = strongest > 0 ? std::min(1.0, force / (full_contact * strongest)) : 0;
  return forces;
}

// Of a figure a stored frame, its value at the moment of a frame of the film: linear in between.
double Shot::shown(const std::vector<double>& of_stored, int frame) const {
  const double moment = moment_of(frame);
  const std::size_t before = std::size_t(moment), after = std::min(before + 1, of_stored.size() - 1);
  return of_stored[before] + (moment - double(before)) * (of_stored[after] - of_stored[before]);
}

// Title, motion, end card. With the pace `contact` the film slows down where something touches the robot; a
// length that is asked for must be one that the range of paces allows. Where nothing ever touches the robot
// the pace is steady, at the speed that the length asks for. While a card is shown the motion stands at its
// first or last moment.
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

// From 1 on the far side of the card to 0 beside the motion, by 3t² − 2t³: no jump in value or speed. A short
// card fades over half of its time.
double Shot::card_share(int frame) const {
  const scenes::CardSpec* card = card_of(frame);
  if (!card) return 0;
  const int away = frame < before_ ? before_ - frame : frame - before_ - of_motion_ + 1;
  const double share = std::min(
      1.0, double(away) / (std::min(card_fade_s, 0.5 * card->duration_s) * scene_.film.frames_per_second));
  return share * share * (3 - 2 * share);
}

}  // namespace limber::detail
