// Contact on fine surfaces, last part: the forces of all touches, walls among them.
//
// A touch of depth d pushes along its normal with N = k d − c ḋ, k = β m/h², β = 0.8, and never pulls
// (penalty.h). Hundreds of samples touch at once and must not be stiffer together than one, so they share
// the masses of the nodes. With a the area of a sample and wᵢ its weights without signs, of both sides,
//
//     1/m = Σᵢ wᵢ Sᵢ / (a d mᵢ),    Sᵢ = Σ a d wᵢ over all touches of the step.
//
// One touch alone has the m of two bodies that meet at one place, n that coincide have an nth each, and a
// sample that comes has no share yet, so nothing jumps.
//
// Why it is stable whatever touches: for K = Σ k c cᵀ, c the signed weights, the largest eigenvalue of M⁻¹K
// is at most max over s of Σₛ' kₛ |cₛ|ᵀM⁻¹|cₛ'| yₛ'/yₛ for any y > 0 (Perron and Frobenius). With y = a d
// that is β/h².
//
// Rigid bodies take part by their shares of a d of the whole body's mass (effective_mass.h). Friction is
// chosen last in the step (friction.h) and gets μ N. Derivation and figures: docs/contact.md, "On the fine
// surface", 5.
#include <algorithm>
#include <cmath>

#include "fem/detail/surface_contact.h"
#include "fem/world.h"

namespace limber::fem::detail {

template <class Real>
bool SurfaceContacts<Real>::is_rigid(int body) const {
  return world_.bodies[body].kind == BodyKind::rigid;
}

// Forces are summed by node in forces_ and added to view.f at the end: samples share few nodes. That last
// loop also sets loads_ and forces_ back to zero for the next call.
template <class Real>
void SurfaceContacts<Real>::add_forces(int lane, const LaneView<Real>& view, Friction<Real>* friction) {
  find(lane, view);
  if (contacts_.empty()) return;
  share_loads(view);
  for (const SurfaceContact<Real>& contact : contacts_) respond(contact, friction);
  for (const SurfaceContact<Real>& contact : contacts_)
    for (int i = contact.first_share; i < contact.last_share; ++i) {
      const int node = shares_[i].node;
      if (loads_[node] == 0) continue;
      for (int c = 0; c < 3; ++c) view.f[view.force.at(node, c)] += forces_[node].at[c];
      loads_[node] = 0, forces_[node].row = Row{};
    }
}

// The load of a touch by which masses are shared: area × depth, m³.
template <class Real>
Real SurfaceContacts<Real>::load_of(const SurfaceContact<Real>& contact) const {
  return surface_.samples[contact.sample].area * contact.depth;
}

// Finds for each node Sᵢ/mᵢ, held nodes too, and its velocity; and for each rigid body the sum of loads of
// all its touches. A touch's share of these is its share of mass.
template <class Real>
void SurfaceContacts<Real>::share_loads(const LaneView<Real>& view) {
  for (EffectiveMass& effective_mass : effective_masses_) effective_mass.depths = 0;
  for (const SurfaceContact<Real>& contact : contacts_) {
    const Real load = load_of(contact);
    for (int i = contact.first_share; i < contact.last_share; ++i) {
      const auto [node, weight] = shares_[i];
      if (loads_[node] == 0) {
        const Real* v = view.v + view.state.at(node, 0);
        velocities_[node].row = Row{v[0], v[view.state.component], v[2 * view.state.component], 0};
      }
      loads_[node] += load * std::abs(weight) * reciprocal_mass_[node];
    }
    if (effective_masses_.empty()) continue;
    effective_masses_[contact.body].depths += double(load);
    if (contact.against >= 0) effective_masses_[contact.against].depths += double(load);
  }
  for (std::size_t body = 0; body < effective_masses_.size(); ++body)
    if (is_rigid(int(body)) && effective_masses_[body].depths > 0)
      effective_masses_[body].measure(view, topology_.bodies[body], tables_.node_mass);
}

// The force of one touch. `relative` is the velocity of the sample against the place that it touches; the
// other side's weights have minus signs already. `all` is what the weights of each side sum to without
// signs, `borne` the part of it that is on nodes that move: a touch is told the force that moving nodes
// bear, no more.
template <class Real>
void SurfaceContacts<Real>::respond(const SurfaceContact<Real>& contact, Friction<Real>* friction) {
  const Real load = load_of(contact);
  const int side[2] = {contact.body, contact.against};
  Place relative;
  relative.row = Row{};
  Real loads = 0;                           // of what is not rigid
  Real borne[2] = {0, 0}, all[2] = {0, 0};  // of the force: by nodes that move
  for (const int k : {0, 1}) {
    const int begin = k == 0 ? contact.first_share : contact.first_against,
              end = k == 0 ? contact.first_against : contact.last_share;
    Real loads_of_side = 0;
    for (int i = begin; i < end; ++i) {
      const auto [node, weight] = shares_[i];
      const Real size = std::abs(weight);
      all[k] += size;
      if (tables_.inverse_mass[node] > 0) borne[k] += size;
      relative.row += weight * velocities_[node].row;
      // A held node counts with its mass. Without it a sample that hangs on held nodes by 99 hundredths
      // would throw the node that has the rest.
      loads_of_side += size * loads_[node];
    }
    if (begin < end && !is_rigid(side[k]) && topology_.bodies[side[k]].pushed) loads += loads_of_side;
  }
  bool any_rigid = false;
  for (const int body : side) any_rigid |= body >= 0 && is_rigid(body);
  if (!any_rigid && !(borne[0] + borne[1] > 0)) return;
  Real inverse_mass = loads / load;
  for (const int body : side)
    if (body >= 0 && is_rigid(body))
      inverse_mass += Real(effective_masses_[body].inverse_mass(contact.place, contact.normal, load));
  const Real push = penalty_push(Real(surface_beta), contact.depth, dot(relative.at, contact.normal),
                                 1 / inverse_mass, step_);
  if (!(push > 0)) return;
  const Real force[3] = {push * contact.normal[0], push * contact.normal[1], push * contact.normal[2]};
  for (int i = contact.first_share; i < contact.last_share; ++i) {
    const auto [node, weight] = shares_[i];
    if (tables_.inverse_mass[node] > 0) forces_[node].row += weight * Row{force[0], force[1], force[2], 0};
  }
  // The part of the force that falls on nodes that never move, on both sides or at a wall, moves nothing.
  const Real share = contact.against < 0 ? borne[0] / all[0] : std::max(borne[0] / all[0], borne[1] / all[1]);
  if (records_)
    records_->push_back({contact.body,
                         contact.against,
                         {contact.place[0], contact.place[1], contact.place[2]},
                         contact.depth,
                         {share * force[0], share * force[1], share * force[2]}});
  if (!friction) return;
  const int other = contact.against < 0 ? contact.body : contact.against;
  const Share* shares = shares_.data();
  friction->add(contact.body, contact.against, contact.place, contact.normal,
                tables_.pair_friction[contact.body * bodies_ + other] * push, shares + contact.first_share,
                shares + contact.first_against, shares + contact.last_share,
                records_ ? int(records_->size()) - 1 : -1, share);
}

// What other files call.
template void SurfaceContacts<float>::add_forces(int, const LaneView<float>&, Friction<float>*);
template void SurfaceContacts<double>::add_forces(int, const LaneView<double>&, Friction<double>*);

}  // namespace limber::fem::detail
