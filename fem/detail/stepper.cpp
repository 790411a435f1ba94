// One step of a world, over lanes: kick-drift, v = e^(−αh) (v + h (f/m + g + push)), x += h v, with one
// evaluation of forces. The velocity belongs to the middle of a step (docs/dynamics.md, "Integration"). In a
// step come, in this order,
//
//     who sleeps, contact, controls, limits of stretch, fascia, ligaments, elastic forces, friction,
//     integration.
//
// Friction is last, because it is chosen against the velocities with which the step would end. The order is
// fixed, since the last bits of a sum of forces depend on it.
//
// What always holds: a lane's result is a function of its state, control and step number alone. It is the
// same, bit for bit, in any lane, beside any others, with any instruction set, and 100 steps are 40 and
// then 60. Sleep is no exception: a body is passed over only where a step would not change it (test
// Sleep_slow.ChangesNothing). Boxes and ways travelled are derived from the state.
//
// Tried and not kept (docs/dynamics.md): Verlet on positions alone, which is useless in float32; one
// threshold for coming to rest and for leaving it, with which bodies creep; reading the boxes of a lane
// from its state.
#include "fem/detail/stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "core/error.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

// Interpolation draws each node as a critically damped oscillator of this frequency would: rest within about
// 2 s.
constexpr double goal_frequency = 6;  // rad/s

// A control point pushes at least so much of its robot, or a strong push would tear out a single node.
constexpr double min_share = 0.1;

// Mass that is pushed round a control point, kg, by node of the robot; 0: not pushed. That is all within its
// radius and, where that is less than min_share, what is nearest to it at rest. Equal distances go by node
// number. At node −1: all of the robot.
std::vector<double> pushed_masses_kg(const World& world, int node, double radius_m) {
  const Body& robot = world.bodies[world.robot];
  std::vector<double> masses(std::size_t(robot.node_count()), 0);
  std::vector<std::pair<double, int>> free;  // distance from the control point, node
  const bool all = node < 0;
  LIMBER_CHECK(node < robot.node_count(), node);
  for (int n = 0; n < robot.node_count(); ++n)
    if (!robot.fixed[n])
      free.emplace_back(all ? 0 : (robot.cage.positions.row(n) - robot.cage.positions.row(node)).norm(), n);
  std::sort(free.begin(), free.end());
  double pushed = 0;
  for (const auto& [distance, n] : free) {
    if (!all && distance > radius_m && pushed >= min_share * robot.mass_kg) break;
    pushed += masses[std::size_t(n)] = robot.node_mass_kg[n];
  }
  return masses;
}

}  // namespace

// All lanes begin at rest, idle. Limits of rest are squares of speeds or of gains in one step: max_gain2 is
// a gain of rest_speed_m_s within a second, the "of still" within a tenth of a second. Where something
// touches, contact's rounding shakes single nodes: there each may gain a quarter of the rest speed in the
// step, and their mean four times it within a second (docs/dynamics.md, "Rest and sleep").
template <class Real>
Stepper<Real>::Stepper(const World& world, int lanes, Isa isa)
    : world_(world),
      tables_(tables_of<Real>(world)),
      kernels_(kernels<Real>(isa, lanes)),
      lanes_(lanes),
      stretch_limits_(world, kernels_),
      friction_(std::size_t(lanes), Friction<Real>(world)),
      pushes_on_lane_(world.bodies.size()),
      state_layout_(state_layout(lanes)),
      force_layout_(force_layout(lanes)),
      first_velocity_(lanes == 1 ? 4 : world.nodes * state_layout_.node),
      forced_(world.bodies.size()),
      step_(std::size_t(lanes), 0),
      next_change_(std::size_t(lanes), 0),
      controls_(std::size_t(lanes)),
      contact_(std::size_t(lanes), false),
      rest_(),
      speed2_before_(std::size_t(lanes), 0),
      inner_speed2_(std::size_t(lanes), 0) {
  const Real speed2 = Real(world.rest_speed_m_s * world.rest_speed_m_s),
             gain2 = speed2 * Real(world.dt_s * world.dt_s);  // gained within a second
  rest_.max_speed2 = speed2, rest_.max_gain2 = gain2;
  rest_.max_gain2_of_still = 100 * gain2;  // within a tenth of it
  rest_.max_shake2 = speed2 / 16, rest_.max_mean_gain2 = 16 * gain2,
  rest_.max_mean_gain2_of_still = 100 * gain2;
  if (world.touches_on_surfaces())
    surface_contacts_.emplace(world, kernels_, lanes);
  else
    contacts_.emplace(world, kernels_, lanes);
  const std::size_t nodes = std::size_t(world.nodes), bodies = world.bodies.size() * std::size_t(lanes);
  state_.assign(nodes * std::size_t(lanes == 1 ? 8 : 6 * lanes), 0);
  f_.assign(nodes * std::size_t(force_layout_.node), 0);
  push_.assign(std::size_t(3 * world.bodies[world.robot].node_count() * lanes), 0);
  for (const Force& force : world.forces)
    forced_[std::size_t(force.body)].assign(
        std::size_t(3 * world.bodies[std::size_t(force.body)].node_count() * lanes), 0);
  if (!forced_[std::size_t(world.robot)].empty()) all_pushes_.assign(push_.size(), 0);
  lower_.resize(3 * bodies), upper_.resize(3 * bodies);
  for (const Body& body : world.bodies)
    wears_inside_.push_back(body.kind == BodyKind::deformable &&
                            (std::isfinite(body.max_stretch) || body.self_contact || body.phong));
  speed2_.assign(bodies, 0), travel_.assign(bodies, 0), inner_travel_.assign(bodies, 0);
  unchanged_.assign(bodies, 0), asleep_.assign(bodies, 0), stands_.assign(bodies, 0);
  touches_.assign(bodies, 0);
  met_.assign(world.bodies.size() * bodies, false);
  tied_.assign(world.bodies.size() * world.bodies.size(), false);
  for (const Ligament& ligament : world.ligaments)
    if (const auto [one, other] = std::minmax(ligament.ends[0].body, ligament.ends[1].body); one >= 0)
      tied_[std::size_t(one) * world.bodies.size() + std::size_t(other)] = true;
  all_asleep_.assign(world.bodies.size(), false), pushed_asleep_ = all_asleep_;
  leader_.resize(world.bodies.size());
  for (int n = 0; n < world.nodes; ++n)
    for (int c = 0; c < 3; ++c) std::fill_n(&x(0, n, c), lanes, tables_.rest_positions[3 * n + c]);
  const std::vector<Real> still(std::size_t(3 * world.moving_nodes), 0);
  for (int lane = 0; lane < lanes; ++lane)
    load(lane, 0, tables_.rest_positions.data(), still.data(), {}, false);
}

// Puts a state into a lane: places, velocities, boxes and largest speeds, and the accelerations that a
// constant control gives to the robot's nodes, F/m of what it pushes. Ways travelled begin at 0 and lists
// are forgotten, unless the lane goes on from where it is. Bodies that never move are unchanged from the
// start; all others are awake for one step at least. An idle lane's way travelled against the mean is −∞, so
// that nothing in it ever wakes.
template <class Real>
void Stepper<Real>::load(int lane, std::int64_t step, const Real* positions, const Real* velocities,
                         const Control& control, bool contact) {
  const bool forget = !(contact && goes_on_from(lane, positions));
  for (int n = 0; n < world_.moving_nodes; ++n)
    for (int c = 0; c < 3; ++c) {
      x(lane, n, c) = positions[3 * n + c];
      v(lane, n, c) = velocities[3 * n + c];
    }
  for (std::size_t b = 0; b < world_.bodies.size(); ++b) {
    const Topology::Body& body = world_.topology.bodies[b];
    // Boxes come from the state given, not from the lane, whose numbers lie a cache line apart.
    const Real* place = body.moving ? positions : tables_.rest_positions.data();
    constexpr Real huge = std::numeric_limits<Real>::max();
    Real lower[3] = {huge, huge, huge}, upper[3] = {-huge, -huge, -huge};
    for (int n = body.first_node; n < body.last_node; ++n)
      for (int c = 0; c < 3; ++c) {
        lower[c] = std::min(lower[c], place[3 * n + c]);
        upper[c] = std::max(upper[c], place[3 * n + c]);
      }
    for (int c = 0; c < 3; ++c) {
      lower_[(3 * b + c) * lanes_ + lane] = lower[c];
      upper_[(3 * b + c) * lanes_ + lane] = upper[c];
    }
    Real speed2 = 0;
    for (int n = body.first_node; n < body.last_node && body.moving; ++n)
      speed2 = std::max(speed2, v(lane, n, 0) * v(lane, n, 0) + v(lane, n, 1) * v(lane, n, 1) +
                                    v(lane, n, 2) * v(lane, n, 2));
    speed2_[b * lanes_ + lane] = speed2;
    unchanged_[b * lanes_ + lane] = body.moving ? 0 : 1;
  }
  if (forget) {
    surface_contacts_ ? surface_contacts_->forget(lane) : contacts_->forget(lane);
    stretch_limits_.forget(lane);
    for (std::size_t b = 0; b < world_.bodies.size(); ++b) {
      travel_[b * lanes_ + lane] = 0;
      // Of idle lanes nothing wakes.
      inner_travel_[b * lanes_ + lane] = contact ? Real(0) : -std::numeric_limits<Real>::infinity();
    }
  }
  contact_[lane] = contact;
  controls_[lane] = control;
  step_[lane] = next_change_[lane] = step;
  for (Numbers& forced : forced_)
    for (std::size_t k = 0; k < forced.size(); k += std::size_t(lanes_)) forced[k + lane] = 0;

  const Body& robot = world_.bodies[world_.robot];
  for (std::size_t k = lane; k < push_.size(); k += std::size_t(lanes_)) push_[k] = 0;
  const auto push = [&](int node, const Vec3f& force_n) {
    const std::vector<double> pushed = pushed_masses_kg(world_, node, control.radius_m);
    const double mass = node < 0 ? robot.mass_kg : std::accumulate(pushed.begin(), pushed.end(), 0.);
    for (int n = 0; n < robot.node_count(); ++n)
      for (int c = 0; c < 3 && pushed[std::size_t(n)] > 0; ++c)
        push_[(3 * n + c) * lanes_ + lane] += Real(force_n[c]) / Real(mass);
  };
  if (control.manipulation == Manipulation::body) push(-1, control.force_n);
  if (control.manipulation == Manipulation::control_point) {
    LIMBER_CHECK(control.node >= 0, control.node);
    push(control.node, control.force_n);
    if (control.second_node >= 0) push(control.second_node, control.second_force_n);
  }
}

// Whether the lane is where these positions are, so that its lists hold for them, and has not come so far
// that steps would be lost in the rounding of ways travelled: in 10,000 steps a way of 8 skins is off by less
// than the 2 % of the reach that lists keep for it. What can be stopped runs in pieces of 0.05 s, and the
// lists of 30 organs take as long.
template <class Real>
bool Stepper<Real>::goes_on_from(int lane, const Real* positions) const {
  constexpr Real farthest = 8;
  if (!contact_[lane]) return false;
  for (std::size_t b = 0; b < world_.bodies.size(); ++b)
    if (!(travel_[b * lanes_ + lane] + inner_travel_[b * lanes_ + lane] <= farthest * tables_.skin[b]))
      return false;
  for (int n = 0; n < world_.moving_nodes; ++n)
    for (int c = 0; c < 3; ++c)
      if (x(lane, n, c) != positions[3 * n + c]) return false;
  return true;
}

// Place and velocity of a node, whatever the layout of lanes.
template <class Real>
auto Stepper<Real>::node(int lane, int node) const -> Node {
  Node result;
  for (int c = 0; c < 3; ++c) {
    const std::size_t k = std::size_t(state_layout_.at(node, c) + lane);
    result.place[c] = double(state_[k]);
    result.velocity[c] = double(state_[k + std::size_t(first_velocity_)]);
  }
  return result;
}

template <class Real>
void Stepper<Real>::store(int lane, Real* positions, Real* velocities) const {
  for (int n = 0; n < world_.moving_nodes; ++n)
    for (int c = 0; c < 3; ++c) {
      const std::size_t k = std::size_t(state_layout_.at(n, c) + lane);
      positions[3 * n + c] = state_[k];
      velocities[3 * n + c] = state_[std::size_t(first_velocity_) + k];
    }
}

// The arrays of one lane: the same as those of all, from another first number.
template <class Real>
LaneView<Real> Stepper<Real>::view(int lane) {
  return {&state_[lane],  &state_[first_velocity_ + lane],
          &f_[lane],      state_layout_,
          force_layout_,  lanes_,
          &lower_[lane],  &upper_[lane],
          &travel_[lane], &inner_travel_[lane],
          &asleep_[lane]};
}

// Interpolation draws each node to its place in the goal shape as a critically damped oscillator of
// frequency ω would, with w the way that is left,
//
//     a = 2ω (ω/2 w − v),
//
// and no node gets more than its mass share of the force allowed, |a| ≤ F/M. Far away a node goes no faster
// than half of that can stop within the way left: ω/2 becomes √(F/M / |w|). `hold` draws all nodes alike,
// by the way of the centre of mass.
template <class Real>
void Stepper<Real>::pull_towards_goal(int lane) {
  const Control& control = controls_[lane];
  const Body& robot = world_.bodies[world_.robot];
  const Real most = Real(control.max_force_n) / Real(robot.mass_kg);
  const bool hold = control.manipulation == Manipulation::hold;
  Real center[3] = {};
  for (int n = 0; n < robot.node_count() && hold; ++n)
    for (int c = 0; c < 3; ++c)
      center[c] +=
          tables_.node_mass[robot.first_node + n] / Real(robot.mass_kg) * x(lane, robot.first_node + n, c);
  for (int n = 0; n < robot.node_count(); ++n) {
    if (robot.fixed[n]) continue;
    const int node = robot.first_node + n;
    Real way[3], length2 = 0;
    for (int c = 0; c < 3; ++c) {
      const Real target = Real(control.target_m[c]);
      way[c] = hold ? target - center[c] : tables_.goal_from_center[3 * n + c] + target - x(lane, node, c);
      length2 += way[c] * way[c];
    }
    // Far away, no faster than half the force can stop within the way left.
    const Real braking = std::sqrt(most / std::max(std::sqrt(length2), Real(1e-6)));
    const Real rate = std::min(Real(goal_frequency / 2), braking);
    Real pull[3], square = 0;
    for (int c = 0; c < 3; ++c) {
      pull[c] = Real(2 * goal_frequency) * (rate * way[c] - v(lane, node, c));
      square += pull[c] * pull[c];
    }
    const Real scale = square > most * most ? most / std::sqrt(square) : Real(1);
    for (int c = 0; c < 3; ++c) push_[(3 * n + c) * lanes_ + lane] = scale * pull[c];
  }
}

// Every Cost::sampled-th step is timed, and counts for all of them. The pieces are the same in both
// branches.
template <class Real>
void Stepper<Real>::step() {
  for (int lane = 0; lane < lanes_; ++lane)
    if (contact_[lane] && step_[lane] >= next_change_[lane]) follow_forces(lane);
  if (cost_.steps++ % Cost::sampled != Cost::sampled / 2) {
    find_sleepers(), add_contact_forces(), find_pushes(), add_stretch_limits(), add_fascia(), add_ligaments(),
        add_elastic_forces(), add_friction(), integrate();
    return;
  }
  Stopwatch watch;
  const auto spent = [&] { return Cost::sampled * watch.lap_s(); };
  find_sleepers(), add_contact_forces(), cost_.contact_s += spent();
  find_pushes(), cost_.controls_s += spent();
  add_stretch_limits(), add_fascia(), add_ligaments(), add_elastic_forces(), cost_.elastic_s += spent();
  add_friction(), cost_.contact_s += spent();
  integrate(), cost_.integration_s += spent();
}

// Finds the accelerations by the world's forces that act at the lane's step, and when the next of them
// begins or ends. A change wakes the bodies that have forces: it is no part of State that they did not
// change.
template <class Real>
void Stepper<Real>::follow_forces(int lane) {
  const std::int64_t step = step_[lane];
  std::int64_t& next = next_change_[lane] = std::numeric_limits<std::int64_t>::max();
  for (std::size_t b = 0; b < forced_.size(); ++b) {
    if (forced_[b].empty()) continue;
    for (std::size_t k = 0; k < forced_[b].size(); k += std::size_t(lanes_)) forced_[b][k + lane] = 0;
    unchanged_[b * lanes_ + lane] = 0;
  }
  for (const Force& force : world_.forces) {
    for (const std::int64_t change : {force.first_step, force.end_step})
      if (change > step) next = std::min(next, change);
    if (step < force.first_step || step >= force.end_step) continue;
    for (int c = 0; c < 3; ++c) {
      const Real acceleration = Real(float(force.force_n[c])) / Real(force.mass_kg);
      for (const int n : force.nodes)
        forced_[std::size_t(force.body)][(3 * n + c) * lanes_ + lane] += acceleration;
    }
  }
}

// Whether a kinematic body is elsewhere at the end of the step that begins.
template <class Real>
bool Stepper<Real>::goes_on(int lane, int body) const {
  const Track& track = world_.bodies[body].track;
  return !(pose_at(track, double(step_[lane]) * world_.dt_s) ==
           pose_at(track, double(step_[lane] + 1) * world_.dt_s));
}

// A body that did not change in the last step, and whose box met only such bodies' boxes then and now, and
// that ligaments tie to none but such, will not change in this one either: every force is what it was. So it
// sleeps, and nothing of it is computed where all lanes sleep. Friction is solved from body to body, so those
// that meet and rub one another sleep and wake together; leader_ joins them (union by the lowest number).
// Lanes without contact are idle, and sleep altogether.
//
// touches_ tells the kernels where a box meets another's or a wall: there rest is judged by the mean of
// nodes, too. pushed_asleep_: bodies that sleep in all lanes, but touch one that does not; forces that fell
// on them must be cleared.
template <class Real>
void Stepper<Real>::find_sleepers() {
  const int bodies = int(world_.bodies.size());
  std::fill(all_asleep_.begin(), all_asleep_.end(), true);
  std::fill(pushed_asleep_.begin(), pushed_asleep_.end(), false);
  for (int lane = 0; lane < lanes_; ++lane) {
    const auto at = [&](int body) { return std::size_t(body * lanes_ + lane); };
    for (int b = 0; b < bodies; ++b) {
      asleep_[at(b)] = contact_[lane] ? unchanged_[at(b)] : 1;
      touches_[at(b)] = 0;
      for (int c = 0; c < 3 && world_.walls; ++c)
        if (lower_[at(3 * b + c)] < Real(world_.bounds_m.lower[c]) ||
            upper_[at(3 * b + c)] > Real(world_.bounds_m.upper[c]))
          touches_[at(b)] = 1;
    }
    std::iota(leader_.begin(), leader_.end(), 0);
    const auto leader = [&](int body) {
      while (leader_[body] != body) body = leader_[body];
      return body;
    };
    const auto join = [&](int a, int b) {
      const int one = leader(a), two = leader(b);
      leader_[std::max(one, two)] = std::min(one, two);
    };
    const auto meet = [&](int a, int b) {
      const Real near =
          contacts_ ? Real(0) : surface_contacts_->offset(a, b);  // surfaces push before they meet
      for (int c = 0; c < 3; ++c)
        if (lower_[at(3 * a + c)] - near > upper_[at(3 * b + c)] ||
            lower_[at(3 * b + c)] - near > upper_[at(3 * a + c)])
          return false;
      return true;
    };
    for (int a = 0; a < bodies && contact_[lane]; ++a)
      for (int b = a + 1; b < bodies; ++b) {
        const std::size_t pair = at(a * bodies + b);
        const bool touch = meet(a, b), met = met_[pair], now = touch || tied_[std::size_t(a * bodies + b)];
        met_[pair] = now;
        if (touch) touches_[at(a)] = touches_[at(b)] = 1;
        if (!met && !now) continue;
        if (unchanged_[at(a)] == 0) asleep_[at(b)] = 0;
        if (unchanged_[at(b)] == 0) asleep_[at(a)] = 0;
        if (world_.bodies[a].pushed() && world_.bodies[b].pushed() &&
            tables_.pair_friction[a * bodies + b] > 0)
          join(a, b);
      }
    for (int b = 0; b < bodies; ++b)
      if (asleep_[at(b)] == 0) asleep_[at(leader(b))] = 0;
    for (int b = 0; b < bodies; ++b)
      if (asleep_[at(leader(b))] == 0) asleep_[at(b)] = 0;
    for (int b = 0; b < bodies; ++b) {
      if (!world_.bodies[b].moving) asleep_[at(b)] = 1;
      // What it touches sees that a step later.
      if (contact_[lane] && world_.bodies[b].kind == BodyKind::kinematic && goes_on(lane, b))
        asleep_[at(b)] = 0;
      if (asleep_[at(b)] == 0) all_asleep_[b] = false;
    }
    for (int a = 0; a < bodies && contact_[lane]; ++a)
      for (int b = a + 1; b < bodies; ++b)
        if (met_[at(a * bodies + b)] && asleep_[at(a)] != asleep_[at(b)])
          pushed_asleep_[asleep_[at(a)] > 0 ? a : b] = true;
  }
}

// Contact between cages or on fine surfaces, whichever the world has.
template <class Real>
void Stepper<Real>::add_contact_forces() {
  for (int lane = 0; lane < lanes_; ++lane)
    if (contact_[lane])
      friction_[lane].begin(), surface_contacts_
                                   ? surface_contacts_->add_forces(lane, view(lane), &friction_[lane])
                                   : contacts_->add_forces(lane, view(lane), &friction_[lane]);
}

// Whether no fine surface is deeper in another than the world allows. What sleeps is looked at, too:
// whether it sleeps is no part of the state.
template <class Real>
bool Stepper<Real>::is_clear(int lane) {
  if (!surface_contacts_ || !std::isfinite(world_.max_overlap_m)) return true;
  LaneView<Real> all = view(lane);
  all.asleep = nullptr;
  return surface_contacts_->deepest_overlap(lane, all) <= Real(world_.max_overlap_m);
}

// One kernel asks the tets of all lanes; the forces of those that are stretched go lane by lane.
template <class Real>
void Stepper<Real>::add_stretch_limits() {
  stretch_limits_.find(state_.data(), inner_travel_.data(), all_asleep_);
  for (int lane = 0; lane < lanes_; ++lane)
    if (contact_[lane]) stretch_limits_.add_forces(lane, view(lane));
}

// Draws nodes to their places at rest; those of bodies that sleep are there, or where other forces hold them.
template <class Real>
void Stepper<Real>::add_fascia() {
  for (std::size_t b = 0; b < world_.bodies.size(); ++b) {
    const Body& body = world_.bodies[b];
    if (!(body.material.fascia_hz > 0) || !body.pushed() || all_asleep_[b]) continue;
    const double omega = 2 * std::numbers::pi * body.material.fascia_hz;
    const Real stiff = Real(omega * omega), slow = Real(2 * body.material.fascia_damping_ratio * omega);
    for (int lane = 0; lane < lanes_; ++lane) {
      if (!contact_[lane] || asleep_[b * std::size_t(lanes_) + std::size_t(lane)] > 0) continue;
      const LaneView<Real> all = view(lane);
      for (int n = 0; n < body.node_count(); ++n) {
        const int node = body.first_node + n;
        if (body.fixed[std::size_t(n)]) continue;
        const Real mass = tables_.node_mass[std::size_t(node)];
        for (int c = 0; c < 3; ++c) {
          const int at = all.state.at(node, c);
          const Real away = Real(body.cage.positions(n, c)) - all.x[at];
          all.f[all.force.at(node, c)] += mass * (stiff * away - slow * all.v[at]);
        }
      }
    }
  }
}

// Of each lane in the order of the ligaments (fem/ligament.h). Where both ends sleep, or stand, the force is
// what it was, and needs not fall on anybody.
template <class Real>
void Stepper<Real>::add_ligaments() {
  for (const Ligament& ligament : world_.ligaments)
    for (int lane = 0; lane < lanes_; ++lane) {
      const auto stands = [&](const Ligament::End& end) {
        return end.body < 0 || asleep_[std::size_t(end.body * lanes_ + lane)] > 0;
      };
      if (!contact_[lane] || (stands(ligament.ends[0]) && stands(ligament.ends[1]))) continue;
      const LaneView<Real> all = view(lane);
      Real place[2][3], velocity[2][3];
      for (int e = 0; e < 2; ++e) {
        const Ligament::End& end = ligament.ends[std::size_t(e)];
        for (int c = 0; c < 3; ++c) {
          place[e][c] = end.body < 0 ? Real(end.point_m[c]) : Real(0), velocity[e][c] = 0;
          for (std::size_t i = 0; i < end.nodes.size(); ++i) {
            const int at = all.state.at(end.nodes[i], c);
            place[e][c] += Real(end.weights[i]) * all.x[at];
            velocity[e][c] += Real(end.weights[i]) * all.v[at];
          }
        }
      }
      Real along[3], length2 = 0, rate = 0;
      for (int c = 0; c < 3; ++c) along[c] = place[1][c] - place[0][c], length2 += along[c] * along[c];
      const Real length = std::sqrt(length2), longer = length - Real(ligament.rest_length_m);
      if (!(length > 0) || (longer <= 0 && !ligament.pushes)) continue;
      for (int c = 0; c < 3; ++c) along[c] /= length, rate += (velocity[1][c] - velocity[0][c]) * along[c];
      Real tension = Real(ligament.stiffness_n_m) * longer + Real(ligament.damping_n_s_m) * rate;
      if (!ligament.pushes) tension = std::max(tension, Real(0));
      for (int e = 0; e < 2; ++e) {
        const Ligament::End& end = ligament.ends[std::size_t(e)];
        if (end.body < 0 || !world_.bodies[std::size_t(end.body)].pushed()) continue;
        for (std::size_t i = 0; i < end.nodes.size(); ++i)
          for (int c = 0; c < 3; ++c)
            all.f[all.force.at(end.nodes[i], c)] +=
                (e == 0 ? tension : -tension) * Real(end.weights[i]) * along[c];
      }
    }
}

// Pushes that depend on the state; constant ones were set when the lane was loaded.
template <class Real>
void Stepper<Real>::find_pushes() {
  for (int lane = 0; lane < lanes_; ++lane)
    if (const auto manipulation = controls_[lane].manipulation;
        manipulation == Manipulation::interpolation || manipulation == Manipulation::hold)
      pull_towards_goal(lane);
}

// The same as numbers for those who look on, m/s².
template <class Real>
std::vector<Vec3> Stepper<Real>::pushes_m_s2(int lane) {
  find_pushes();
  std::vector<Vec3> pushes;
  for (int n = 0; n < world_.bodies[world_.robot].node_count(); ++n) {
    const auto at = [&](int c) { return double(push_[std::size_t((3 * n + c) * lanes_ + lane)]); };
    pushes.emplace_back(at(0), at(1), at(2));
  }
  return pushes;
}

// Body by body, those that move and are awake in some lane.
template <class Real>
void Stepper<Real>::add_elastic_forces() {
  for (std::size_t b = 0; b < world_.bodies.size(); ++b)
    if (world_.topology.bodies[b].moving && !all_asleep_[b])
      kernels_.elastic(elements_of(tables_.elements, int(b)), state_.data(), &state_[first_velocity_],
                       f_.data());
}

// Friction needs all other forces, pushes among them. pushes_on_lane_ points into the arrays of lane 0 and
// goes on by one number a lane.
template <class Real>
void Stepper<Real>::add_friction(std::vector<ContactRecord<Real>>* records) {
  for (std::size_t b = 0; b < forced_.size(); ++b) pushes_on_lane_[b] = pushes_on(b);
  for (int lane = 0; lane < lanes_; ++lane) {
    if (contact_[lane]) friction_[lane].add_forces(view(lane), pushes_on_lane_, records);
    for (const Real*& pushes : pushes_on_lane_)
      if (pushes) ++pushes;
  }
}

// Runs the forces of a step without its integration, and tells those of contact, walls and friction. One
// lane, which is to be loaded anew afterwards.
template <class Real>
std::vector<ContactRecord<Real>> Stepper<Real>::contact_records(int lane) {
  LIMBER_CHECK(lanes_ == 1 && lane == 0, lanes_, lane);
  std::vector<ContactRecord<Real>> records;
  const auto record_to = [&](std::vector<ContactRecord<Real>>* list) {
    surface_contacts_ ? surface_contacts_->record_to(list) : contacts_->record_to(list);
  };
  follow_forces(lane), find_sleepers();
  record_to(&records), add_contact_forces(), record_to(nullptr);
  find_pushes(), add_stretch_limits(), add_fascia(), add_ligaments(), add_elastic_forces(),
      add_friction(&records);
  std::fill(f_.begin(), f_.end(), Real(0));  // as integration leaves it
  return records;
}

// Accelerations of a body's nodes by controls and forces, as Motion has them; null: none.
template <class Real>
const Real* Stepper<Real>::pushes_on(std::size_t body) {
  const Numbers& forced = forced_[body];
  if (int(body) != world_.robot) return forced.empty() ? nullptr : forced.data();
  if (forced.empty()) return push_.data();
  for (std::size_t k = 0; k < push_.size(); ++k) all_pushes_[k] = push_[k] + forced[k];
  return all_pushes_.data();
}

// Puts the nodes of a kinematic body where its keyframes have them at the end of the step, in awake lanes.
// Velocities are those of the way in the step that follows from the poses, (x(t + h) − x(t))/h, and not
// from rounded places. A body that neither moved nor changed its velocities is unchanged.
template <class Real>
void Stepper<Real>::move_by_keyframes(std::size_t b) {
  const Body& body = world_.bodies[b];
  for (int lane = 0; lane < lanes_; ++lane) {
    const std::size_t at = b * std::size_t(lanes_) + std::size_t(lane);
    if (asleep_[at] > 0) continue;
    const Pose before = pose_at(body.track, double(step_[lane]) * world_.dt_s),
               now = pose_at(body.track, double(step_[lane] + 1) * world_.dt_s);
    const Eigen::Matrix3d turning = (now.turn - before.turn) / world_.dt_s;
    const Vec3 going = (now.place_m - before.place_m) / world_.dt_s;
    constexpr Real huge = std::numeric_limits<Real>::max();
    Real lower[3] = {huge, huge, huge}, upper[3] = {-huge, -huge, -huge}, speed2 = 0;
    bool same = true;
    for (int n = 0; n < body.node_count(); ++n) {
      const int node = body.first_node + n;
      const Vec3 from_pivot = body.cage.positions.row(n).transpose() - body.track.pivot_m;
      const Vec3 place = now.place_m + now.turn * from_pivot, velocity = going + turning * from_pivot;
      Real square = 0;
      for (int c = 0; c < 3; ++c) {
        const Real xn = Real(place[c]), vn = Real(velocity[c]);
        same = same && x(lane, node, c) == xn && v(lane, node, c) == vn;
        x(lane, node, c) = xn, v(lane, node, c) = vn;
        lower[c] = std::min(lower[c], xn), upper[c] = std::max(upper[c], xn);
        square += vn * vn;
      }
      speed2 = std::max(speed2, square);
    }
    for (int c = 0; c < 3; ++c)
      lower_[(3 * b + c) * lanes_ + lane] = lower[c], upper_[(3 * b + c) * lanes_ + lane] = upper[c];
    speed2_[at] = speed2, unchanged_[at] = same;
    travel_[at] += Real(world_.dt_s) * std::sqrt(speed2);
  }
}

// Moves body after body by the kernel of its kind, and keeps the books: who did not change, and how far the
// fastest node has gone, against the mean too where something asks for it. Bodies that sleep in all lanes
// are passed over; in some lanes they are held by the kernel. A soft body that may come to a stand takes
// the kernel that knows of rest, which gives the same bits where nothing rests.
template <class Real>
void Stepper<Real>::integrate() {
  for (std::size_t b = 0; b < world_.bodies.size(); ++b) {
    const Topology::Body& body = world_.topology.bodies[b];
    if (!body.moving) continue;
    const std::size_t first = b * std::size_t(lanes_);
    if (world_.bodies[b].kind == BodyKind::kinematic) {
      move_by_keyframes(b);
      continue;
    }
    if (all_asleep_[b]) {
      if (pushed_asleep_[b])
        std::fill(&f_[force_layout_.at(body.first_node, 0)],
                  &f_[force_layout_.at(body.last_node - 1, 0)] + force_layout_.node, Real(0));
      continue;
    }
    Motion<Real> motion{
        body.first_node, body.last_node, tables_.inverse_mass.data(), Real(world_.dt_s),  {},
        Real(1),         pushes_on(b),   &lower_[3 * first],          &upper_[3 * first], &speed2_[first]};
    for (int c = 0; c < 3; ++c) motion.gravity[c] = Real(world_.bodies[b].gravity_m_s2[c]);
    motion.kept = Real(std::exp(-world_.bodies[b].material.mass_damping_per_s * world_.dt_s));
    Real *const x = state_.data(), *const v = &state_[first_velocity_];
    std::fill_n(&stands_[first], lanes_, Real(0));
    std::copy_n(&speed2_[first], lanes_, speed2_before_.data());
    if (world_.bodies[b].kind == BodyKind::rigid)
      kernels_.move_rigid({motion, world_.rigid_tables[b].body()}, x, v, f_.data());
    else if (may_stand(b)) {
      Rest<Real> rest = rest_;
      rest.asleep = &asleep_[first], rest.touches = &touches_[first], rest.stands = &stands_[first];
      rest.speed2_before = speed2_before_.data();
      kernels_.integrate_resting(motion, rest, x, v, f_.data());
    } else
      kernels_.integrate(motion, x, v, f_.data());
    for (int lane = 0; lane < lanes_; ++lane)
      unchanged_[first + lane] = stands_[first + lane] > 0 && speed2_before_[lane] == 0;
    for (int lane = 0; lane < lanes_; ++lane)
      travel_[first + lane] += motion.dt * std::sqrt(speed2_[first + lane]);
    if (!wears_inside_[b]) continue;
    kernels_.inner_speed2(body.first_node, body.last_node, v, inner_speed2_.data());
    for (int lane = 0; lane < lanes_; ++lane)
      inner_travel_[first + lane] += motion.dt * std::sqrt(inner_speed2_[lane]);
  }
  for (std::int64_t& step : step_) ++step;
}

// Whether the body is slow enough to come to a stand in some lane; most are not, and take the faster
// kernel.
template <class Real>
bool Stepper<Real>::may_stand(std::size_t body) const {
  for (int lane = 0; lane < lanes_; ++lane)
    if (contact_[lane] && speed2_[body * std::size_t(lanes_) + std::size_t(lane)] <= rest_.max_speed2)
      return true;
  return false;
}

template class Stepper<float>;
template class Stepper<double>;

}  // namespace limber::fem::detail
