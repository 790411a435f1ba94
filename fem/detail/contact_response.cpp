// Contact between cages, last part: the forces of touches and walls, and what friction gets to know of
// them.
//
// A touch of depth d and unit direction n pushes with N = k d − c ṙ·n (penalty.h), and not at all where
// that would pull. ṙ is the velocity of the point against the place of the tet that it is at, both linear
// in their nodes by shares wᵢ, positive for the point and negative for the tet:
//
//     ṙ = Σ wᵢ vᵢ,    1/m_eff = Σ wᵢ²/mᵢ,    k = β m_eff/h²,    c = 2 ζ √(k m_eff);
//     the force on node i is wᵢ N n.
//
// The same shares on both sides keep momentum and angular momentum. h is the automatic step, also where a
// scene steps finer, so that this does not make contact harder. All forces are newtons. Friction is not
// computed here: it is chosen last in the step, when all other forces are known (friction.h), and gets μ N
// and the shares.
//
// A rigid body that moves sets all of itself against a contact and not the node that touches
// (effective_mass.h; docs/dynamics.md, "Rigid bodies"). β is 0.4 for vertices and 0.2 for points of edges,
// of which a vertex has six.
#include <algorithm>

#include "fem/detail/contact.h"
#include "fem/world.h"

namespace limber::fem::detail {

// All contacts of the lane, pair by pair. Two bodies that both sleep are left out: the forces between them
// are what they were, and nothing of them is integrated.
template <class Real>
void Contacts<Real>::add_forces(int lane, const LaneView<Real>& view, Friction<Real>* friction) {
  if (!effective_masses_.empty()) return add_forces_with_rigid(lane, view, friction);
  for (NearPair& pair : near_pairs_.find(lane, view)) {
    const auto [a, b, list] = pair;
    if (view.sleeps(a) && view.sleeps(b)) continue;
    for (const Contact<Real>& contact : find(view, pair)) respond(view, a, b, contact, friction);
  }
  add_wall_forces(view, friction);
}

// The same where rigid bodies are. Each contact gets its share, by depth, of what a rigid body can set
// against pushes. So all touches are found first, their depths are summed for each body (walls among them),
// and only then do they push.
template <class Real>
void Contacts<Real>::add_forces_with_rigid(int lane, const LaneView<Real>& view, Friction<Real>* friction) {
  held_.clear();
  for (EffectiveMass& effective_mass : effective_masses_) effective_mass.depths = 0;
  for (NearPair& pair : near_pairs_.find(lane, view)) {
    const auto [a, b, list] = pair;
    if (view.sleeps(a) && view.sleeps(b)) continue;
    for (const Contact<Real>& contact : find(view, pair)) {
      if (!(contact.depth > 0)) continue;
      held_.push_back({a, b, contact});
      effective_masses_[a].depths += double(contact.depth),
          effective_masses_[b].depths += double(contact.depth);
    }
  }
  for (int body = 0; body < bodies_; ++body) {
    EffectiveMass& effective_mass = effective_masses_[body];
    if (world_.bodies[body].kind != BodyKind::rigid) continue;
    for_each_beyond_wall(view, body,
                         [&](int, int, Real, Real depth) { effective_mass.depths += double(depth); });
    if (effective_mass.depths > 0) effective_mass.measure(view, topology_.bodies[body], tables_.node_mass);
  }
  for (const Held& held : held_) respond(view, held.a, held.b, held.contact, friction);
  add_wall_forces(view, friction);
}

// The force of one touch, from the formulas at the top of this file. side[0] is the body whose point it is,
// side[1] the body whose tet. What is held adds nothing to 1/m_eff; where neither side can move there is no
// force. Friction is told μ N, with the shares of the two sides apart.
template <class Real>
void Contacts<Real>::respond(const LaneView<Real>& view, int a, int b, const Contact<Real>& contact,
                             Friction<Real>* friction) const {
  if (!(contact.depth > 0)) return;
  const Topology::Point& point = topology_.points[contact.point];
  const int* corner = topology_.tets[contact.tet].node;
  const int node[6] = {point.node[0], point.node[1], corner[0], corner[1], corner[2], corner[3]};
  const Real share[6] = {contact.share[0],   contact.share[1],   -contact.weight[0],
                         -contact.weight[1], -contact.weight[2], -contact.weight[3]};
  Real relative[3] = {0, 0, 0}, place[3] = {0, 0, 0};
  for (int i = 0; i < 6; ++i)
    for (int c = 0; c < 3; ++c) {
      relative[c] += share[i] * view.v[view.state.at(node[i], c)];
      if (i < 2) place[c] += share[i] * view.x[view.state.at(node[i], c)];
    }
  const bool of_a = node[0] >= topology_.bodies[a].first_node && node[0] < topology_.bodies[a].last_node;
  const int side[2] = {of_a ? a : b, of_a ? b : a};  // whose point, whose tet
  Real inverse_mass = 0;                             // of what is not rigid
  for (int i = 0; i < 6; ++i)
    if (world_.bodies[side[i >= 2]].kind != BodyKind::rigid)
      inverse_mass += share[i] * share[i] * tables_.inverse_mass[node[i]];
  const bool any_rigid = world_.bodies[a].kind == BodyKind::rigid || world_.bodies[b].kind == BodyKind::rigid;
  if (!any_rigid && !(inverse_mass > 0)) return;
  for (const int body : side)
    if (world_.bodies[body].kind == BodyKind::rigid)
      inverse_mass += Real(effective_masses_[body].inverse_mass(place, contact.direction, contact.depth));
  const Real beta = Real(point.share[1] > 0 ? contact_edge_beta : contact_beta);
  const Real push =
      penalty_push(beta, contact.depth, dot(relative, contact.direction), 1 / inverse_mass, step_);
  if (!(push > 0)) return;
  Real force[3];
  for (int c = 0; c < 3; ++c) force[c] = push * contact.direction[c];
  for (int i = 0; i < 6; ++i)
    if (tables_.inverse_mass[node[i]] > 0)
      for (int c = 0; c < 3; ++c) view.f[view.force.at(node[i], c)] += share[i] * force[c];
  if (records_)
    records_->push_back(
        {side[0], side[1], {place[0], place[1], place[2]}, contact.depth, {force[0], force[1], force[2]}});
  if (!friction) return;
  Share<Real> shares[6];
  for (int i = 0; i < 6; ++i) shares[i] = {node[i], share[i]};
  friction->add(side[0], side[1], place, contact.direction, tables_.pair_friction[a * bodies_ + b] * push,
                {shares, shares + 2}, {shares + 2, shares + 6}, records_ ? int(records_->size()) - 1 : -1);
}

// Calls each(node, axis, normal, depth) for each surface node of a body that is beyond a wall: `normal` is
// +1 or −1, the wall's normal along the axis, and `depth` metres. The body's box tells at once which walls
// cannot be met.
template <class Real>
template <class Each>
void Contacts<Real>::for_each_beyond_wall(const LaneView<Real>& view, int body, const Each& each) const {
  if (!world_.walls || !topology_.bodies[body].pushed) return;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const Real out = side == 0 ? Real(1) : Real(-1);
      const Real wall = Real(side == 0 ? world_.bounds_m.lower[axis] : world_.bounds_m.upper[axis]);
      const Real* reach = side == 0 ? view.lower : view.upper;
      if (!(out * (wall - reach[(3 * body + axis) * view.stride]) > 0)) continue;
      for (int n : topology_.bodies[body].surface_nodes) {
        const Real depth = out * (wall - view.x[view.state.at(n, axis)]);
        if (depth > 0 && tables_.inverse_mass[n] > 0) each(n, axis, out, depth);
      }
    }
}

// Walls push node by node: a node of a soft body with its own mass, one of a rigid body with its share of
// the whole. Friction hears of each node, as body −1 against it.
template <class Real>
void Contacts<Real>::add_wall_forces(const LaneView<Real>& view, Friction<Real>* friction) const {
  for (int body = 0; body < bodies_; ++body) {
    if (view.sleeps(body)) continue;
    const bool rigid = world_.bodies[body].kind == BodyKind::rigid;
    for_each_beyond_wall(view, body, [&](int n, int axis, Real out, Real depth) {
      Real normal[3] = {0, 0, 0}, place[3];
      normal[axis] = out;
      fetch(view, n, place);
      const Real mass =
          rigid ? Real(1 / effective_masses_[body].inverse_mass(place, normal, depth)) : tables_.node_mass[n];
      const Real push =
          penalty_push(Real(contact_beta), depth, out * view.v[view.state.at(n, axis)], mass, step_);
      if (!(push > 0)) return;
      view.f[view.force.at(n, axis)] += out * push;
      if (records_)
        records_->push_back({body,
                             -1,
                             {place[0], place[1], place[2]},
                             depth,
                             {push * normal[0], push * normal[1], push * normal[2]}});
      if (!friction) return;
      const Share<Real> share{n, 1};
      friction->add(body, -1, place, normal, tables_.pair_friction[body * bodies_ + body] * push,
                    {&share, &share + 1}, {}, records_ ? int(records_->size()) - 1 : -1);
    });
  }
}

// What other files call.
template void Contacts<float>::add_forces(int, const LaneView<float>&, Friction<float>*);
template void Contacts<double>::add_forces(int, const LaneView<double>&, Friction<double>*);

}  // namespace limber::fem::detail
