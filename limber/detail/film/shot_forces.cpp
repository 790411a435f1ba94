// What acts in a shot: the robot's pushes, what touches what, and how both are shown (arrows, panes).
//
// Forces of contact are worked out anew from the stored states, by the code that steps (fem::contact_forces):
// for the pace, panes and passes once for each stored frame, where one of these asks for them; for arrows
// where a frame shows them. Arrows are proportional to their forces: the strongest push is as long as the
// robot, and no arrow is longer than twice that.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/threads.h"
#include "fem/control_forces.h"
#include "fem/observe.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/world/seen.h"

namespace limber::detail {

namespace {

constexpr double longest_arrow = 2;   // times that of the strongest push, which is as long as the robot
constexpr double pane_fade_s = 0.25;  // of the film at its usual speed

// How far along a line from `at` it leaves a surface for the last time, metres; 0 where it misses it. Seen
// along the line, a triangle is crossed where it lies round the origin.
double last_crossing(const Points& positions, const Triangles& triangles, const Vec3& at, const Vec3& along) {
  const Vec3 u = along.unitOrthogonal(), v = along.cross(u);
  const Points from_line = positions.rowwise() - at.transpose();
  const Eigen::VectorXd x = from_line * u, y = from_line * v, z = from_line * along;
  double last = -std::numeric_limits<double>::infinity();
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const int a = triangles(t, 0), b = triangles(t, 1), c = triangles(t, 2);
    const double of_a = x[b] * y[c] - x[c] * y[b], of_b = x[c] * y[a] - x[a] * y[c],
                 of_c = x[a] * y[b] - x[b] * y[a], all = of_a + of_b + of_c;
    if (all == 0 || of_a * all < 0 || of_b * all < 0 || of_c * all < 0) continue;
    last = std::max(last, (of_a * z[a] + of_b * z[b] + of_c * z[c]) / all);
  }
  return std::isfinite(last) ? last : 0;
}

}  // namespace

// A push holds from the stored frame at which it begins; the controls of a plan follow one another without a
// gap.
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

// Of what is not held anywhere: what is held at a wall touches it always. The floor is drawn, so it needs no
// pane. A body presses a wall where the force is more than a share (`pressing_share`) of the strongest of
// all; the pane comes and goes over a part of a second.
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

void Shot::measure_forces() {
  double strongest = 0;
  for (const Control& control : plan_.trajectory.controls)
    strongest = std::max(strongest, double(largest_force(control)));
  for (const fem::Force& force : world_.forces) strongest = std::max(strongest, force.force_n.norm());
  if (strongest == 0)  // of a simulation: what the robot weighs
    strongest = world_.bodies[std::size_t(world_.robot)].mass_kg *
                world_.bodies[std::size_t(world_.robot)].gravity_m_s2.norm();
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

// Between two stored frames arrows are blended, feet and forces apart.
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

// The push begins at the robot's centre of mass or at its control point; what each body, and last the walls,
// does to the robot at the middle of the contacts, weighed by their forces; forces of the world at the centre
// of mass of the nodes that they fall on. Of interpolation and hold, which draw each node its own way, the
// sum is shown.
Points Shot::arrows_at_stored(int frame) const {
  const State& state = plan_.trajectory.frames[std::size_t(frame)];
  const Vec3 robot = fem::center_of_mass_m(world_, state, world_.robot);
  const int bodies = int(world_.bodies.size());
  const Points nodes = fem::body_positions(world_, state, world_.robot);
  std::map<int, Points> surfaces;  // of bodies that were asked for
  // Inside a body nothing would be seen of an arrow: it begins where a line along the force leaves it.
  const auto put = [&](Points& ends, Eigen::Index row, int body, const Vec3& at, const Vec3& force_n) {
    if (force_n.norm() == 0) return;
    const Vec3 along = force_n.normalized();
    const PreparedBody& prepared = bodies_[std::size_t(body)];
    const auto [surface, is_new] = surfaces.try_emplace(body, prepared.surface.positions);
    if (is_new) deform(prepared, fem::body_positions(world_, state, body), surface->second);
    const Vec3 from = at + last_crossing(surface->second, prepared.surface.triangles, at, along) * along;
    ends.row(row) = from.transpose();
    const double length =
        std::min(arrow_m_per_n_ * force_n.norm(), longest_arrow * arrow_m_per_n_ * strongest_push_n_);
    ends.row(row + 1) = (from + length * along).transpose();
  };
  const Eigen::Index of_second = 2 * (1 + bodies + Eigen::Index(world_.forces.size()));
  Points ends(of_second + 2, 3);
  ends.rowwise() = robot.transpose();
  const Control control = control_at(frame);
  if (control.manipulation != Manipulation::none) {
    const bool at_point = control.manipulation == Manipulation::control_point;
    Vec3 force_n = control.force_n.cast<double>();
    if (control.manipulation == Manipulation::interpolation || control.manipulation == Manipulation::hold)
      for (const Vec3& on_node : fem::control_forces_n(world_, state, control)) force_n += on_node;
    put(ends, 0, world_.robot, at_point ? Vec3(nodes.row(control.node).transpose()) : robot, force_n);
    if (at_point && control.second_node >= 0)
      put(ends, of_second, world_.robot, nodes.row(control.second_node).transpose(),
          control.second_force_n.cast<double>());
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
    if (weight[b] > 0) put(ends, 2 + 2 * Eigen::Index(b), world_.robot, place[b] / weight[b], force[b]);
  for (std::size_t i = 0; i < world_.forces.size(); ++i) {
    const fem::Force& given = world_.forces[i];
    if (!acts(given, frame)) continue;
    const Points body = fem::body_positions(world_, state, given.body);
    const std::vector<double>& mass = world_.bodies[std::size_t(given.body)].node_mass_kg;
    Vec3 sum = Vec3::Zero();
    double all = 0;
    for (const int n : given.nodes)
      sum += mass[std::size_t(n)] * body.row(n).transpose(), all += mass[std::size_t(n)];
    put(ends, 2 * (1 + bodies + Eigen::Index(i)), given.body, sum / all, given.force_n);
  }
  return ends;
}

}  // namespace limber::detail
