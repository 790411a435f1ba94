// Which bodies sleep in a step, and which may come to rest in it (docs/dynamics.md, "Rest and sleep").
//
// What always holds: a body is passed over only where a step would not change a bit of it, so a plan with
// sleep is the plan without (test Sleep_slow.ChangesNothing). Who sleeps is found anew each step from what
// the last one did, and is no part of the state.
#include "fem/detail/stepper.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/error.h"
#include "fem/world.h"

namespace limber::fem::detail {

// A body that did not change in the last step, and whose box met only such bodies' boxes then and now, and
// that ligaments tie to none but such, will not change in this one either: every force is what it was. So it
// sleeps, and nothing of it is computed where all lanes sleep. Friction is solved from body to body, so those
// that meet and rub one another sleep and wake together; leader_ joins them (union by the lowest number).
// Lanes without contact are idle, and sleep altogether.
//
// touches_ tells the kernels where a box meets another's or a wall, or a pressure acts: there rest is judged
// by the mean of nodes, too. pushed_asleep_: bodies that sleep in all lanes, but touch one that does not;
// forces that fell on them must be cleared.
template <class Real>
void Stepper<Real>::find_sleepers() {
  const int bodies = int(world_.bodies.size());
  std::fill(all_asleep_.begin(), all_asleep_.end(), true);
  std::fill(pushed_asleep_.begin(), pushed_asleep_.end(), false);
  for (int lane = 0; lane < lanes_; ++lane) {
    const auto at = [&](int body) { return std::size_t(body * lanes_ + lane); };
    for (int b = 0; b < bodies; ++b) {
      asleep_[at(b)] = contact_[lane] ? unchanged_[at(b)] : 1;
      touches_[at(b)] = pressure_[at(b)] != 0;
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
    const auto wake_together = [&](int a, int b) {
      if (unchanged_[at(a)] == 0) asleep_[at(b)] = 0;
      if (unchanged_[at(b)] == 0) asleep_[at(a)] = 0;
      if (world_.bodies[a].pushed() && world_.bodies[b].pushed() && tables_.pair_friction[a * bodies + b] > 0)
        join(a, b);
    };
    if (contact_[lane]) {
      meeting_.clear();
      for (const NearPair& near : surface_contacts_ ? surface_contacts_->near_pairs(lane, view(lane))
                                                    : contacts_->near_pairs(lane, view(lane))) {
        if (near.a == near.b || !meet(near.a, near.b)) continue;
        meeting_.emplace_back(near.a, near.b);
        touches_[at(near.a)] = touches_[at(near.b)] = 1;
      }
      for (const Pairs* pairs : {&met_[lane], &meeting_, &tied_})
        for (const auto& [a, b] : *pairs) wake_together(a, b);
      met_[lane].swap(meeting_);
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
    if (contact_[lane])
      for (const Pairs* pairs : {&met_[lane], &tied_})
        for (const auto& [a, b] : *pairs)
          if (asleep_[at(a)] != asleep_[at(b)]) pushed_asleep_[asleep_[at(a)] > 0 ? a : b] = true;
  }
}

// Whether the body is slow enough to come to rest in some lane; most are not, and take the faster
// kernel.
template <class Real>
bool Stepper<Real>::may_rest(std::size_t body) const {
  for (int lane = 0; lane < lanes_; ++lane)
    if (contact_[lane] && speed2_[body * std::size_t(lanes_) + std::size_t(lane)] <= rest_.max_speed2)
      return true;
  return false;
}

// What stepper.cpp calls.
template void Stepper<float>::find_sleepers();
template bool Stepper<float>::may_rest(std::size_t) const;
template void Stepper<double>::find_sleepers();
template bool Stepper<double>::may_rest(std::size_t) const;

}  // namespace limber::fem::detail
