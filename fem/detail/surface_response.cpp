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

// Forces are summed by node in forces_ and added to view.f at the end, of nodes that move: samples share few
// nodes. That last loop also sets loads and forces back to zero for the next call.
template <class Real>
void SurfaceContacts<Real>::add_forces(int lane, const LaneView<Real>& view, Friction<Real>* friction) {
  find(lane, view);
  if (contacts_.empty()) return;
  share_loads(view);
  for (const SurfaceContact<Real>& contact : contacts_) respond(contact, friction);
  for (const int node : loaded_) {
    const bool moves = tables_.inverse_mass[node] > 0;
    for (int c = 0; c < 3; ++c) view.f[view.force.at(node, c)] += moves ? forces_[node].at[c] : Real(0);
    motions_[node].row = forces_[node].row = Row{};
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
  loaded_.clear();
  for (const SurfaceContact<Real>& contact : contacts_) {
    const Real load = load_of(contact);
    for (const Shares<Real>& shares : {shares_of(contact), shares_against(contact)})
      for (const auto [node, weight] : shares) {
        Place& motion = motions_[node];
        const Real before = motion.at[3];
        if (before == 0) {
          const Real* v = view.v + view.state.at(node, 0);
          motion.row = Row{v[0], v[view.state.component], v[2 * view.state.component], 0};
          loaded_.push_back(node);
        }
        motion.at[3] = before + load * std::abs(weight) * reciprocal_mass_[node];
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
  const Shares<Real> shares[2] = {shares_of(contact), shares_against(contact)};
  const auto [all, borne] = surface_.sizes[contact.sample];
  Real all_against = 0, borne_against = 0;
  for (const auto [node, weight] : shares[1]) {
    all_against += std::abs(weight);
    if (tables_.inverse_mass[node] > 0) borne_against += std::abs(weight);
  }
  // A held node counts with its mass. Without it a sample that hangs on held nodes by 99 hundredths would
  // throw the node that has the rest.
  Row relative = {};  // and behind it the loads of a side
  Real loads = 0;     // of what is not rigid
  for (int k = 0; k < 2 && side[k] >= 0; ++k) {
    relative[3] = 0;
    for (const auto [node, weight] : shares[k])
      relative += Row{weight, weight, weight, std::abs(weight)} * motions_[node].row;
    if (!is_rigid(side[k]) && topology_.bodies[side[k]].pushed) loads += relative[3];
  }
  bool any_rigid = false;
  for (const int body : side) any_rigid |= body >= 0 && is_rigid(body);
  if (!any_rigid && !(borne + borne_against > 0)) return;
  Real inverse_mass = loads / load;
  for (const int body : side)
    if (body >= 0 && is_rigid(body))
      inverse_mass += Real(effective_masses_[body].inverse_mass(contact.place, contact.normal, load));
  const Real speed[3] = {relative[0], relative[1], relative[2]};
  const Real push =
      penalty_push(Real(surface_beta), contact.depth, dot(speed, contact.normal), 1 / inverse_mass, step_);
  if (!(push > 0)) return;
  const Real force[3] = {push * contact.normal[0], push * contact.normal[1], push * contact.normal[2]};
  const Row force_row = {force[0], force[1], force[2], 0};
  for (const Shares<Real>& of_side : shares)
    for (const auto [node, weight] : of_side) forces_[node].row += weight * force_row;
  // The part of the force that falls on nodes that never move, on both sides or at a wall, moves nothing.
  const Real share = contact.against < 0 ? borne / all : std::max(borne / all, borne_against / all_against);
  if (records_)
    records_->push_back({contact.body,
                         contact.against,
                         {contact.place[0], contact.place[1], contact.place[2]},
                         contact.depth,
                         {share * force[0], share * force[1], share * force[2]}});
  if (!friction) return;
  const int other = contact.against < 0 ? contact.body : contact.against;
  friction->add(contact.body, contact.against, contact.place, contact.normal,
                tables_.pair_friction[contact.body * bodies_ + other] * push, shares[0], shares[1],
                records_ ? int(records_->size()) - 1 : -1, share);
}

// What other files call.
template void SurfaceContacts<float>::add_forces(int, const LaneView<float>&, Friction<float>*);
template void SurfaceContacts<double>::add_forces(int, const LaneView<double>&, Friction<double>*);

}  // namespace limber::fem::detail
