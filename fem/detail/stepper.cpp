// One step of a world, over lanes: kick-drift, v = e^(−αh) (v + h (f/m + g + push)), x += h v, with one
// evaluation of forces. The velocity belongs to the middle of a step (docs/dynamics.md, "Integration"). In a
// step come, in this order,
//
//     who sleeps, contact, controls, limits of stretch, fascia, ligaments, pressures, elastic forces,
//     friction, integration.
//
// Friction is last, because it is chosen against the velocities with which the step would end. The order is
// fixed, since the last bits of a sum of forces depend on it.
//
// What always holds: a lane's result is a function of its state, control and step number alone. It is the
// same, bit for bit, in any lane, beside any others, with any instruction set, and 100 steps are 40 and
// then 60. Sleep is no exception: a body is passed over only where a step would not change it (test
// Sleep_slow.ChangesNothing). Boxes and distances travelled are derived from the state.
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
             gain2 = speed2 * Real(world.substep_s() * world.substep_s());  // gained within a second
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
  unchanged_.assign(bodies, 0), asleep_.assign(bodies, 0), at_rest_.assign(bodies, 0);
  touches_.assign(bodies, 0), pressure_.assign(bodies, 0), changes_.assign(bodies, 0);
  met_.resize(std::size_t(lanes));
  for (const Ligament& ligament : world.ligaments)
    if (const auto [one, other] = std::minmax(ligament.ends[0].body, ligament.ends[1].body); one >= 0)
      tied_.emplace_back(one, other);
  all_asleep_.assign(world.bodies.size(), false), pushed_asleep_ = all_asleep_;
  leader_.resize(world.bodies.size());
  for (int n = 0; n < world.nodes; ++n)
    for (int c = 0; c < 3; ++c) std::fill_n(&x(0, n, c), lanes, tables_.rest_positions[3 * n + c]);
  const std::vector<Real> still(std::size_t(3 * world.moving_nodes), 0);
  for (int lane = 0; lane < lanes; ++lane)
    load(lane, 0, tables_.rest_positions.data(), still.data(), {}, false);
}

// Puts a state into a lane: places, velocities, boxes and largest speeds, and the accelerations that a
// constant control gives to the robot's nodes, F/m of what it pushes. Distances travelled begin at 0 and
// lists are forgotten, unless the lane goes on from where it is. Bodies that never move are unchanged from
// the start; all others are awake for one step at least. An idle lane's distance travelled against the mean
// is −∞, so that nothing in it ever wakes.
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
  for (std::size_t k = std::size_t(lane); k < pressure_.size(); k += std::size_t(lanes_)) pressure_[k] = 0;

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
// that steps would be lost in the rounding of distances travelled: in 10,000 steps a distance of 8 skins is
// off by less than the 2 % of the reach that lists keep for it. What can be stopped runs in pieces of 0.05 s,
// and the lists of 30 organs take as long.
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
          &asleep_[lane], &changes_[lane]};
}

// Every Cost::sampled-th step is timed, and counts for all of them. Forces of contact are found once and held
// over the substeps (docs/dynamics.md, "Step").
template <class Real>
void Stepper<Real>::step() {
  for (int lane = 0; lane < lanes_; ++lane)
    if (contact_[lane] && step_[lane] >= next_change_[lane]) follow_forces(lane);
  const bool timed = cost_.steps++ % Cost::sampled == Cost::sampled / 2;
  std::optional<Stopwatch> watch;
  if (timed) watch.emplace();
  const auto spent_on = [&](double& seconds) {
    if (timed) seconds += Cost::sampled * watch->lap_s();
  };
  find_sleepers(), add_contact_forces(), spent_on(cost_.contact_s);
  if (world_.substeps > 1) contact_forces_ = f_;
  for (int substep = 0; substep < world_.substeps; ++substep) {
    if (substep > 0) f_ = contact_forces_;
    find_pushes(), spent_on(cost_.controls_s);
    add_stretch_limits(), add_fascia(), add_ligaments(), add_pressures(), add_elastic_forces(),
        spent_on(cost_.elastic_s);
    add_friction(), spent_on(cost_.contact_s);
    integrate(substep), spent_on(cost_.integration_s);
  }
  for (std::size_t k = 0; k < changes_.size(); ++k) changes_[k] += unchanged_[k] == 0;
  for (std::int64_t& step : step_) ++step;
}

// Whether a kinematic body is elsewhere at the end of the step that begins.
template <class Real>
bool Stepper<Real>::goes_on(int lane, int body) const {
  const Track& track = world_.bodies[body].track;
  return !(pose_at(track, double(step_[lane]) * world_.dt_s) ==
           pose_at(track, double(step_[lane] + 1) * world_.dt_s));
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
// are passed over; in some lanes they are held by the kernel. A soft body that may come to rest takes
// the kernel that knows of rest, which gives the same bits where nothing rests.
template <class Real>
void Stepper<Real>::integrate(int substep) {
  for (std::size_t b = 0; b < world_.bodies.size(); ++b) {
    const Topology::Body& body = world_.topology.bodies[b];
    if (!body.moving) continue;
    const std::size_t first = b * std::size_t(lanes_);
    if (world_.bodies[b].kind == BodyKind::kinematic) {
      if (substep + 1 == world_.substeps) move_by_keyframes(b);
      continue;
    }
    if (all_asleep_[b]) {
      if (pushed_asleep_[b])
        std::fill(&f_[force_layout_.at(body.first_node, 0)],
                  &f_[force_layout_.at(body.last_node - 1, 0)] + force_layout_.node, Real(0));
      continue;
    }
    Motion<Real> motion{body.first_node,
                        body.last_node,
                        tables_.inverse_mass.data(),
                        Real(world_.substep_s()),
                        {},
                        Real(1),
                        pushes_on(b),
                        &lower_[3 * first],
                        &upper_[3 * first],
                        &speed2_[first]};
    for (int c = 0; c < 3; ++c) motion.gravity[c] = Real(world_.bodies[b].gravity_m_s2[c]);
    motion.kept = Real(std::exp(-world_.bodies[b].material.mass_damping_per_s * world_.substep_s()));
    Real *const x = state_.data(), *const v = &state_[first_velocity_];
    std::fill_n(&at_rest_[first], lanes_, Real(0));
    std::copy_n(&speed2_[first], lanes_, speed2_before_.data());
    if (world_.bodies[b].kind == BodyKind::rigid)
      kernels_.move_rigid({motion, world_.rigid_tables[b].body()}, x, v, f_.data());
    else if (may_rest(b)) {
      Rest<Real> rest = rest_;
      rest.asleep = &asleep_[first], rest.touches = &touches_[first], rest.at_rest = &at_rest_[first];
      rest.speed2_before = speed2_before_.data();
      kernels_.integrate_resting(motion, rest, x, v, f_.data());
    } else
      kernels_.integrate(motion, x, v, f_.data());
    for (int lane = 0; lane < lanes_; ++lane)
      unchanged_[first + lane] = at_rest_[first + lane] > 0 && speed2_before_[lane] == 0 &&
                                 (substep == 0 || unchanged_[first + lane] > 0);
    for (int lane = 0; lane < lanes_; ++lane)
      travel_[first + lane] += motion.dt * std::sqrt(speed2_[first + lane]);
    if (!wears_inside_[b]) continue;
    kernels_.inner_speed2(body.first_node, body.last_node, v, inner_speed2_.data());
    for (int lane = 0; lane < lanes_; ++lane)
      inner_travel_[first + lane] += motion.dt * std::sqrt(inner_speed2_[lane]);
  }
}

template class Stepper<float>;
template class Stepper<double>;

}  // namespace limber::fem::detail
