// The forces of a step (stepper.cpp), each added to those there are: contact, pushes by controls and by the
// world's forces, limits of stretch, fascia, ligaments, pressures, elastic forces and friction. Formulas and
// where they come from are in docs/dynamics.md; the order is that of Stepper::step, and fixed, since the last
// bits of a sum depend on it.
//
// What always holds: a force on a lane is a function of that lane's state and step alone. Bodies that sleep
// in all lanes are passed over only where their forces would be what they were.
#include "fem/detail/stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

// Interpolation draws each node as a critically damped oscillator of this frequency would: rest within about
// 2 s.
constexpr double goal_frequency = 6;  // rad/s

}  // namespace

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

// Finds the accelerations by the world's forces that act at the lane's step, and the pressures, and when the
// next of them begins or ends. A change wakes the bodies that have forces or pressures: it is no part of
// State that they did not change.
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
  const auto at = [&](int body) { return std::size_t(body * lanes_ + lane); };
  for (std::size_t k = std::size_t(lane); k < pressure_.size(); k += std::size_t(lanes_)) pressure_[k] = 0;
  pressure_[at(world_.robot)] = Real(controls_[std::size_t(lane)].pressure_pa);
  for (const Pressure& pressure : world_.pressures) {
    for (const std::int64_t change : {pressure.first_step, pressure.end_step})
      if (change > step) next = std::min(next, change);
    unchanged_[at(pressure.body)] = 0;
    if (step < pressure.first_step || step >= pressure.end_step) continue;
    pressure_[at(pressure.body)] += Real(float(pressure.pressure_pa));
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

// Of each lane in the order of the ligaments (fem/ligament.h). Where both ends sleep, or are at rest, the
// force is what it was, and needs not fall on anybody.
template <class Real>
void Stepper<Real>::add_ligaments() {
  for (const Ligament& ligament : world_.ligaments)
    for (int lane = 0; lane < lanes_; ++lane) {
      const auto at_rest = [&](const Ligament::End& end) {
        return end.body < 0 || asleep_[std::size_t(end.body * lanes_ + lane)] > 0;
      };
      if (!contact_[lane] || (at_rest(ligament.ends[0]) && at_rest(ligament.ends[1]))) continue;
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

// On each face of the cage's surface p A n, a third on each of its corners: with the edges e and f from one
// of them A n = e × f / 2.
template <class Real>
void Stepper<Real>::add_pressures() {
  for (std::size_t b = 0; b < world_.bodies.size(); ++b) {
    const Body& body = world_.bodies[b];
    for (int lane = 0; lane < lanes_; ++lane) {
      const std::size_t k = b * std::size_t(lanes_) + std::size_t(lane);
      if (pressure_[k] == 0 || !contact_[lane] || asleep_[k] > 0) continue;
      const LaneView<Real> all = view(lane);
      const Real sixth = pressure_[k] / 6;
      for (Eigen::Index t = 0; t < body.blown.rows(); ++t) {
        int node[3];
        Real e[2][3];
        for (int i = 0; i < 3; ++i) node[i] = body.first_node + body.blown(t, i);
        for (int i = 0; i < 2; ++i)
          for (int c = 0; c < 3; ++c)
            e[i][c] = all.x[all.state.at(node[i + 1], c)] - all.x[all.state.at(node[0], c)];
        for (int c = 0; c < 3; ++c) {
          const int y = (c + 1) % 3, z = (c + 2) % 3;
          const Real force = sixth * (e[0][y] * e[1][z] - e[0][z] * e[1][y]);
          for (const int n : node) all.f[all.force.at(n, c)] += force;
        }
      }
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
  find_pushes(), add_stretch_limits(), add_fascia(), add_ligaments(), add_pressures(), add_elastic_forces(),
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

// What stepper.cpp calls.
template void Stepper<float>::pull_towards_goal(int);
template void Stepper<float>::follow_forces(int);
template void Stepper<float>::add_contact_forces();
template bool Stepper<float>::is_clear(int);
template void Stepper<float>::add_stretch_limits();
template void Stepper<float>::add_fascia();
template void Stepper<float>::add_ligaments();
template void Stepper<float>::add_pressures();
template void Stepper<float>::find_pushes();
template std::vector<Vec3> Stepper<float>::pushes_m_s2(int);
template void Stepper<float>::add_elastic_forces();
template void Stepper<float>::add_friction(std::vector<ContactRecord<float>>*);
template std::vector<ContactRecord<float>> Stepper<float>::contact_records(int);
template const float* Stepper<float>::pushes_on(std::size_t);
template void Stepper<double>::pull_towards_goal(int);
template void Stepper<double>::follow_forces(int);
template void Stepper<double>::add_contact_forces();
template bool Stepper<double>::is_clear(int);
template void Stepper<double>::add_stretch_limits();
template void Stepper<double>::add_fascia();
template void Stepper<double>::add_ligaments();
template void Stepper<double>::add_pressures();
template void Stepper<double>::find_pushes();
template std::vector<Vec3> Stepper<double>::pushes_m_s2(int);
template void Stepper<double>::add_elastic_forces();
template void Stepper<double>::add_friction(std::vector<ContactRecord<double>>*);
template std::vector<ContactRecord<double>> Stepper<double>::contact_records(int);
template const double* Stepper<double>::pushes_on(std::size_t);

}  // namespace limber::fem::detail
