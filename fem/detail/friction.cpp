// Coulomb friction without memory. At each place of contact, of shares w at nodes and normal force N, an
// impulse p along the surface is looked for with which the place does not slip at the end of the step, u_t
// = 0, or else |p| = μ h N against the slip. u are the velocities with which the step would end by all
// other forces. Places are gone through one after the other (projected Gauss-Seidel, as of Jourdan, Alart
// and Jean 1998):
//
//     p ← p − u_t / Σ (w²/m),  cut to |p| ≤ μ h N,  and u at once changed by it;
//
// twelve times, or until no impulse changes by more than a thousandth of its limit. In later substeps of a
// step they begin as they are, where they take kinetic energy away, and four times do.
//
// What always holds: impulses begin from zero in each step and are found in the fixed order of contacts,
// so State is all there is, and the bits are the same for any lanes and threads. Both sides get an impulse by
// the same shares, so momentum is kept; it never makes the kinetic energy larger. Below its limit nothing
// creeps, above it slides as Coulomb says. Impulses are N s; as forces they are p/h.
//
// Tried and not kept (docs/contact.md, "Friction"): a dashpot that takes half of a slip away in a step,
// with which soft slabs crept by 30 to 120 mm a second. With two sweeps at most a slab creeps by 1.5 mm a
// second, with four by 0.2. With walls rubbed place by place a search in barriers1 took 8.3 s in place of
// 5.6.
#include "fem/detail/friction.h"

#include <algorithm>
#include <cmath>

#include "fem/detail/contact.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

// Places are gone through so often at most, with impulses from zero and from those of the substep before, and
// until no impulse changes by more than this share of its limit.
constexpr int max_sweeps = 12, max_sweeps_going_on = 4;
constexpr float settled = 1e-3f;

// A symmetric matrix, xx xy xz yy yz zz, times a vector.
void times(const double symmetric[6], const double t[3], double out[3]) {  // xx xy xz yy yz zz
  const double* s = symmetric;
  out[0] = s[0] * t[0] + s[1] * t[1] + s[2] * t[2];
  out[1] = s[1] * t[0] + s[3] * t[1] + s[4] * t[2];
  out[2] = s[2] * t[0] + s[4] * t[1] + s[5] * t[2];
}

}  // namespace

template <class Real>
Friction<Real>::Friction(const World& world)
    : world_(world),
      tables_(tables_of<Real>(world)),
      dt_(Real(world.substep_s())),
      slot_of_node_(std::size_t(world.nodes), -1),
      wall_nodes_of_node_(std::size_t(world.nodes), {-1, -1, -1, -1, -1, -1}),
      wall_loads_(6 * world.bodies.size()) {
  for (const Body& body : world.bodies)
    if (body.kind == BodyKind::rigid) spins_.resize(world.bodies.size());
}

template <class Real>
bool Friction<Real>::is_rigid(int body) const {
  return body >= 0 && world_.bodies[std::size_t(body)].kind == BodyKind::rigid;
}

// Forgets the places of the last step; of the large arrays only what was used.
template <class Real>
void Friction<Real>::begin() {
  for (const WallNode& node : wall_nodes_)
    wall_nodes_of_node_[std::size_t(slots_[std::size_t(node.slot)].node)][std::size_t(node.side)] = -1;
  for (const Slot& slot : slots_) slot_of_node_[std::size_t(slot.node)] = -1;
  for (Spin& spin : spins_) spin.met = false;
  slots_.clear(), shares_.clear(), slips_.clear(), limited_ = goes_on_ = false;
  wall_nodes_.clear(), wall_tellings_.clear(), wall_shares_.clear();
}

// The slot of a node. Nodes that take part get slots in the order in which they are met, so that sweeps go
// through few numbers that lie side by side.
template <class Real>
int Friction<Real>::slot_of(int node, int body) {
  int& slot = slot_of_node_[std::size_t(node)];
  if (slot < 0) {
    slot = int(slots_.size());
    slots_.push_back({node, body});
  }
  return slot;
}

// Takes a place in. What a soft body rubs at a wall is borne node by node instead (bear). `gain` is what an
// impulse changes a node's velocity by, w/m, and nothing for a rigid body, whose motion is six numbers
// (Spin); the share of the inverse mass that does not depend on direction, Σ w²/m over soft nodes, is
// summed here once.
template <class Real>
void Friction<Real>::add(int body, int against, const Real place[3], const Real normal[3], Real most,
                         const Shares<Real>& shares, const Shares<Real>& others, int records,
                         Real told_share) {
  if (!(most > 0)) return;
  if (against < 0 && !is_rigid(body)) return bear(body, normal, dt_ * most, shares, records);
  Slip& slip = slips_.emplace_back();
  slip.side[0] = body, slip.side[1] = against;
  std::copy_n(place, 3, slip.place), std::copy_n(normal, 3, slip.normal);
  std::fill_n(slip.impulse, 3, Real(0));
  slip.most = dt_ * most, slip.records = records, slip.told_share = told_share;
  slip.first = int(shares_.size()), slip.inverse_mass = 0;
  const int second_share = slip.first + int(shares.last - shares.first);
  slip.last = second_share + int(others.last - others.first);
  slip.first_soft = is_rigid(body) ? second_share : slip.first;
  slip.last_soft = is_rigid(against) ? second_share : slip.last;
  for (const int side : {0, 1})
    for (const auto [node, weight] : side == 0 ? shares : others) {
      const int of = slip.side[side];
      const Real gain = is_rigid(of) ? Real(0) : weight * tables_.inverse_mass[node];
      shares_.push_back({slot_of(node, of), weight, gain});
      slip.inverse_mass += weight * gain;
    }
  for (const int side : slip.side)
    if (is_rigid(side)) spins_[std::size_t(side)].met = true;
}

// Gives a place of a soft body at a wall to the nodes that move it: node i bears wᵢ of what presses it.
// Hundreds of samples of a flat side press a wall, and all of them hold the few nodes behind; what holds
// these holds the samples. The side of the wall follows from its normal, which is along an axis.
template <class Real>
void Friction<Real>::bear(int body, const Real normal[3], Real most, const Shares<Real>& shares,
                          int records) {
  int axis = 0;
  while (axis < 2 && normal[axis] == 0) ++axis;
  const int side = normal[axis] > 0 ? axis : 3 + axis, first_share = int(wall_shares_.size());
  for (const auto [node, weight] : shares) {
    int& wall_node = wall_nodes_of_node_[std::size_t(node)][std::size_t(side)];
    if (wall_node < 0) {
      if (!(tables_.inverse_mass[node] > 0)) continue;
      wall_node = int(wall_nodes_.size());
      wall_nodes_.push_back({slot_of(node, body), body, side, 0, 0, false, {0, 0, 0}});
    }
    wall_nodes_[std::size_t(wall_node)].load += weight * most;
    if (records >= 0) wall_shares_.push_back({wall_node, weight * most});
  }
  if (records >= 0) wall_tellings_.push_back({records, first_share, int(wall_shares_.size())});
}

// What each node at a wall may exert, μ h Nᵢ with Nᵢ = Σ wᵢ N. Weights of Phong Deformation may be
// negative, and so may Nᵢ: such a node holds nothing, and the others so much less that a wall exerts no
// more than μ times what presses it. Also finds which nodes another wall or a place of contact moves too:
// those take part in the sweeps, the others are solved at once.
template <class Real>
void Friction<Real>::limit_wall_nodes() {
  const auto load_of = [&](const WallNode& node) -> WallLoad& {
    return wall_loads_[std::size_t(6 * node.body + node.side)];
  };
  for (const WallNode& node : wall_nodes_)
    load_of(node).all += node.load, load_of(node).positive += std::max(node.load, Real(0));
  for (const Slip& slip : slips_)
    for (int k = slip.first_soft; k < slip.last_soft; ++k)
      for (const int wall_node : wall_nodes_of(shares_[std::size_t(k)].slot))
        if (wall_node >= 0) wall_nodes_[std::size_t(wall_node)].meets_others = true;
  for (WallNode& node : wall_nodes_) {
    for (const int other : wall_nodes_of(node.slot))
      node.meets_others |= other >= 0 && &wall_nodes_[std::size_t(other)] != &node;
    const WallLoad& of_all = load_of(node);
    node.most = of_all.all > 0 ? std::max(node.load, Real(0)) * (of_all.all / of_all.positive) : Real(0);
  }
  for (const WallNode& node : wall_nodes_) load_of(node) = WallLoad{};
}

// The velocities with which the step would end but for damping by mass, v + h (f/m + g + push), of the nodes
// that take part; what is 0 stays 0 with it. And of
// rigid bodies the same as a velocity of the centre of mass and a spin, from the momentum and the angular
// momentum of their nodes. Held nodes keep the velocity that they have.
template <class Real>
void Friction<Real>::predict(const LaneView<Real>& view, const std::vector<const Real*>& pushes) {
  const auto velocity = [&](int node, int body, int c) {
    Real v = view.v[view.state.at(node, c)];
    const Real inverse_mass = tables_.inverse_mass[node];
    if (!(inverse_mass > 0)) return v;
    const Body& of = world_.bodies[std::size_t(body)];
    Real gain = view.f[view.force.at(node, c)] * inverse_mass + Real(of.gravity_m_s2[c]);
    if (const Real* push = pushes[std::size_t(body)])
      gain += push[(3 * (node - of.first_node) + c) * view.stride];
    return v + dt_ * gain;
  };
  velocities_.resize(slots_.size());
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    const auto [node, body] = slots_[k];
    if (is_rigid(body)) continue;
    velocities_[k].row = Row{velocity(node, body, 0), velocity(node, body, 1), velocity(node, body, 2), 0};
  }
  for (std::size_t b = 0; b < spins_.size(); ++b) {
    Spin& spin = spins_[b];
    if (!spin.met) continue;
    const Topology::Body& body = world_.topology.bodies[b];
    EffectiveMass effective_mass;
    effective_mass.measure(view, body, tables_.node_mass);
    spin.inverse_mass = effective_mass.inverse_mass(), std::copy_n(effective_mass.center(), 3, spin.center);
    std::copy_n(effective_mass.inverse_inertia(), 6, spin.inverse_inertia);
    double momentum[3] = {0, 0, 0}, angular[3] = {0, 0, 0};
    for (int n = body.first_node; n < body.last_node; ++n) {
      double r[3], p[3], l[3];
      for (int c = 0; c < 3; ++c) {
        r[c] = double(view.x[view.state.at(n, c)]) - spin.center[c];
        p[c] = double(tables_.node_mass[n]) * double(velocity(n, int(b), c));
        momentum[c] += p[c];
      }
      cross(r, p, l);
      for (int c = 0; c < 3; ++c) angular[c] += l[c];
    }
    for (int c = 0; c < 3; ++c) spin.velocity[c] = spin.inverse_mass * momentum[c];
    times(spin.inverse_inertia, angular, spin.spin);
  }
}

// u of a place: Σ w u over soft nodes, and ±(u_c + ω × r) of rigid bodies.
template <class Real>
void Friction<Real>::find_relative_velocity(const Slip& slip, Real out[3]) const {
  const SlotShare* const shares = shares_.data();
  const Velocity* const velocities = velocities_.data();
  Row sums[4] = {};  // four, since a sum must wait for the one before
  int k = slip.first_soft;
  for (; k + 4 <= slip.last_soft; k += 4)
    for (int i = 0; i < 4; ++i) sums[i] += shares[k + i].weight * velocities[shares[k + i].slot].row;
  for (; k < slip.last_soft; ++k) sums[0] += shares[k].weight * velocities[shares[k].slot].row;
  Velocity sum;
  sum.row = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  std::copy_n(sum.at, 3, out);
  if (spins_.empty()) return;
  for (const int k : {0, 1}) {
    if (!is_rigid(slip.side[k])) continue;
    const Spin& spin = spins_[std::size_t(slip.side[k])];
    double r[3], turning[3];
    for (int c = 0; c < 3; ++c) r[c] = double(slip.place[c]) - spin.center[c];
    cross(spin.spin, r, turning);
    for (int c = 0; c < 3; ++c) out[c] += Real((k == 0 ? 1 : -1) * (spin.velocity[c] + turning[c]));
  }
}

// How much an impulse of 1 along a unit vector t changes u along it: Σ w²/m of soft nodes, and for a rigid
// body 1/M + (r × t)·J⁻¹(r × t).
template <class Real>
Real Friction<Real>::inverse_mass_along(const Slip& slip, const Real along[3]) const {
  if (spins_.empty()) return slip.inverse_mass;
  double inverse = double(slip.inverse_mass);
  for (const int side : slip.side) {
    if (!is_rigid(side)) continue;
    const Spin& spin = spins_[std::size_t(side)];
    double r[3], way[3], arm[3], turning[3];
    for (int c = 0; c < 3; ++c) r[c] = double(slip.place[c]) - spin.center[c], way[c] = double(along[c]);
    cross(r, way, arm);
    times(spin.inverse_inertia, arm, turning);
    inverse += spin.inverse_mass + dot(arm, turning);
  }
  return Real(inverse);
}

// Changes the velocities of both sides by an impulse.
template <class Real>
void Friction<Real>::apply(const Slip& slip, const Real impulse[3]) {
  const Row push = {impulse[0], impulse[1], impulse[2], 0};
  const SlotShare* const shares = shares_.data();
  Velocity* const velocities = velocities_.data();
  for (int k = slip.first_soft; k < slip.last_soft; ++k)
    velocities[shares[k].slot].row += shares[k].gain * push;
  if (spins_.empty()) return;
  for (const int k : {0, 1}) {
    if (!is_rigid(slip.side[k])) continue;
    Spin& spin = spins_[std::size_t(slip.side[k])];
    double r[3], p[3], arm[3], turning[3];
    for (int c = 0; c < 3; ++c)
      r[c] = double(slip.place[c]) - spin.center[c], p[c] = (k == 0 ? 1 : -1) * double(impulse[c]);
    cross(r, p, arm);
    times(spin.inverse_inertia, arm, turning);
    for (int c = 0; c < 3; ++c) spin.velocity[c] += spin.inverse_mass * p[c], spin.spin[c] += turning[c];
  }
}

// One place in one sweep: the impulse with which it does not slip, those of all others as they are, no
// larger than friction allows. Only slip square to the normal counts. Returns the change over the limit.
template <class Real>
Real Friction<Real>::step_of(Slip& slip) {
  Real slipping[3];
  find_relative_velocity(slip, slipping);
  const Real along_normal = dot(slipping, slip.normal);
  for (int c = 0; c < 3; ++c) slipping[c] -= along_normal * slip.normal[c];
  const Real speed = std::sqrt(dot(slipping, slipping));
  if (!(speed > 0)) return 0;
  Real way[3];
  for (int c = 0; c < 3; ++c) way[c] = slipping[c] / speed;
  const Real inverse_mass = inverse_mass_along(slip, way);
  if (!(inverse_mass > 0)) return 0;
  Real wanted[3];
  for (int c = 0; c < 3; ++c) wanted[c] = slip.impulse[c] - slipping[c] / inverse_mass;
  const Real size = std::sqrt(dot(wanted, wanted));
  const Real scale = size > slip.most ? slip.most / size : Real(1);
  Real change[3];
  for (int c = 0; c < 3; ++c) change[c] = scale * wanted[c] - slip.impulse[c], slip.impulse[c] += change[c];
  apply(slip, change);
  return std::sqrt(dot(change, change)) / slip.most;
}

// The same of a node at a wall, where the inverse mass is 1/m and the normal is an axis.
template <class Real>
Real Friction<Real>::step_of(WallNode& node) {
  if (!(node.most > 0)) return 0;
  Velocity& velocity = velocities_[std::size_t(node.slot)];
  const Real inverse_mass = tables_.inverse_mass[slots_[std::size_t(node.slot)].node];
  Real wanted[3], square = 0;
  for (int c = 0; c < 3; ++c) {
    wanted[c] = c == node.side % 3 ? Real(0) : node.impulse[c] - velocity.at[c] / inverse_mass;
    square += wanted[c] * wanted[c];
  }
  const Real scale = square > node.most * node.most ? node.most / std::sqrt(square) : Real(1);
  Real change2 = 0;
  for (int c = 0; c < 3; ++c) {
    const Real change = scale * wanted[c] - node.impulse[c];
    node.impulse[c] += change, velocity.at[c] += inverse_mass * change, change2 += change * change;
  }
  return std::sqrt(change2) / node.most;
}

// Changes the velocities by all impulses that sweeps find, as they are, and returns the kinetic energy that
// this gives or, below 0, takes: p·u + ½ p·Wp of each in its turn, u before it and W the inverse mass along
// it.
template <class Real>
Real Friction<Real>::energy_by_impulses() {
  Real energy = 0;
  for (const Slip& slip : slips_) {
    const Real square = dot(slip.impulse, slip.impulse);
    if (!(square > 0)) continue;
    const Real size = std::sqrt(square);
    const Real along[3] = {slip.impulse[0] / size, slip.impulse[1] / size, slip.impulse[2] / size};
    Real slipping[3];
    find_relative_velocity(slip, slipping);
    energy += dot(slip.impulse, slipping) + square * inverse_mass_along(slip, along) / 2;
    apply(slip, slip.impulse);
  }
  for (const WallNode& node : wall_nodes_) {
    if (!node.meets_others) continue;  // solved at once
    Velocity& velocity = velocities_[std::size_t(node.slot)];
    const Real inverse_mass = tables_.inverse_mass[slots_[std::size_t(node.slot)].node];
    for (int c = 0; c < 3; ++c) {
      energy += node.impulse[c] * (velocity.at[c] + inverse_mass * node.impulse[c] / 2);
      velocity.at[c] += inverse_mass * node.impulse[c];
    }
  }
  return energy;
}

// Solves, and adds the forces p/h to view.f. First nodes at one wall that nothing else moves, which are
// exact after one step; then sweeps over all others. Those who ask are told each force with its place: that
// of a wall node is dealt back to the samples that it bears, by their shares.
template <class Real>
void Friction<Real>::add_forces(const LaneView<Real>& view, const std::vector<const Real*>& pushes,
                                std::vector<ContactRecord<Real>>* records) {
  if (slips_.empty() && wall_nodes_.empty()) return;
  predict(view, pushes);
  if (!limited_) limit_wall_nodes(), limited_ = true;  // once for all substeps
  if (goes_on_ && energy_by_impulses() > 0) predict(view, pushes), goes_on_ = false;
  if (!goes_on_)
    for (Slip& slip : slips_) std::fill_n(slip.impulse, 3, Real(0));
  for (WallNode& node : wall_nodes_) {
    if (!goes_on_ || !node.meets_others) std::fill_n(node.impulse, 3, Real(0));
    if (!node.meets_others) step_of(node);
  }
  const int sweeps = goes_on_ ? max_sweeps_going_on : max_sweeps;
  goes_on_ = true;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    Real most = 0;
    for (Slip& slip : slips_) most = std::max(most, step_of(slip));
    for (WallNode& node : wall_nodes_)
      if (node.meets_others) most = std::max(most, step_of(node));
    if (!(most > Real(settled))) break;
  }
  for (const WallNode& node : wall_nodes_)
    for (int c = 0; c < 3; ++c)
      view.f[view.force.at(slots_[std::size_t(node.slot)].node, c)] += node.impulse[c] / dt_;
  for (const Slip& slip : slips_) {
    const Real force[3] = {slip.impulse[0] / dt_, slip.impulse[1] / dt_, slip.impulse[2] / dt_};
    for (int k = slip.first; k < slip.last; ++k) {
      const SlotShare& share = shares_[std::size_t(k)];
      const int node = slots_[std::size_t(share.slot)].node;
      if (!(tables_.inverse_mass[node] > 0)) continue;
      for (int c = 0; c < 3; ++c) view.f[view.force.at(node, c)] += share.weight * force[c];
    }
    if (records && slip.records >= 0)
      for (int c = 0; c < 3; ++c)
        (*records)[std::size_t(slip.records)].force[c] += slip.told_share * force[c];
  }
  for (const WallTelling& telling : wall_tellings_)
    for (int k = telling.first; records && k < telling.last; ++k) {
      const auto [wall_node, most] = wall_shares_[std::size_t(k)];
      const WallNode& node = wall_nodes_[std::size_t(wall_node)];
      for (int c = 0; c < 3 && node.load > 0; ++c)
        (*records)[std::size_t(telling.records)].force[c] += most / node.load * node.impulse[c] / dt_;
    }
}

template class Friction<float>;
template class Friction<double>;

}  // namespace limber::fem::detail
