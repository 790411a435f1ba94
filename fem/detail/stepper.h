// Kick-drift over lanes: one step is contact, controls, elastic forces, integration. Float for all work,
// double for the reference; the code is the same.
#pragma once

#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "core/state.h"
#include "fem/cost.h"
#include "fem/detail/contact.h"
#include "fem/detail/friction.h"
#include "fem/detail/kernels.h"
#include "fem/detail/stretch_limits.h"
#include "fem/detail/surface_contact.h"

namespace limber::fem::detail {

// Memory that begins with a cache line: a vector of sixteen lanes is one line, and never parts of two.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::align_val_t line{64};
  LineAllocator() = default;
  template <class U>
  LineAllocator(const LineAllocator<U>&) {}
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), line)); }
  void deallocate(T* p, std::size_t) { ::operator delete(p, line); }
  bool operator==(const LineAllocator&) const { return true; }
};

template <class Real>
class Stepper {
 public:
  Stepper(const World&, int lanes, Isa);
  // At that step of the world's time, 3 × moving_nodes numbers each. A lane without contact (idle) costs
  // nothing but its share of the kernels.
  void load(int lane, std::int64_t step, const Real* positions, const Real* velocities, const Control&,
            bool contact);
  void store(int lane, Real* positions, Real* velocities) const;
  void step();
  struct Node {
    Vec3 place, velocity;
  };
  Node node(int lane, int node) const;
  std::vector<Vec3> pushes_m_s2(
      int lane);            // of each node of the robot, by its control, in the step that begins
  bool is_clear(int lane);  // Batch::is_clear
  // The forces of contact, walls and friction in the step that begins; to be loaded anew after it.
  std::vector<ContactRecord<Real>> contact_records(int lane);
  const Cost& cost() const { return cost_; }

 private:
  LaneView<Real> view(int lane);
  bool goes_on_from(int lane, const Real* positions) const;
  Real& x(int lane, int node, int c) { return state_[state_layout_.at(node, c) + lane]; }
  Real x(int lane, int node, int c) const { return state_[state_layout_.at(node, c) + lane]; }
  Real& v(int lane, int node, int c) { return state_[first_velocity_ + state_layout_.at(node, c) + lane]; }
  void pull_towards_goal(int lane);
  void follow_forces(int lane);
  void find_sleepers();
  bool may_rest(std::size_t body) const;
  void add_contact_forces();
  void find_pushes();
  void add_stretch_limits();
  void add_fascia();
  void add_ligaments();
  void add_pressures();
  void add_elastic_forces();
  void add_friction(std::vector<ContactRecord<Real>>* records = nullptr);
  void integrate(int substep);
  bool goes_on(int lane, int body) const;
  void move_by_keyframes(std::size_t body);
  const Real* pushes_on(std::size_t body);

  const World& world_;
  const Tables<Real>& tables_;
  const Kernels<Real>& kernels_;
  int lanes_;
  // One of the two is there.
  std::optional<Contacts<Real>> contacts_;
  std::optional<SurfaceContacts<Real>> surface_contacts_;
  StretchLimits<Real> stretch_limits_;
  std::vector<Friction<Real>> friction_;     // [lane]
  std::vector<const Real*> pushes_on_lane_;  // [body] as of Motion, at the lane at hand
  Layout state_layout_, force_layout_;
  int first_velocity_;
  using Numbers = std::vector<Real, LineAllocator<Real>>;
  Numbers state_, f_, contact_forces_;  // the last: of the step, as far as it has substeps
  Numbers push_;                        // [robot node][xyz][lane] accelerations, by the controls
  // [body][its node][xyz][lane] The same by the world's forces, nothing for bodies without; and of the
  // robot's both together.
  std::vector<Numbers> forced_;
  Numbers all_pushes_;
  Numbers pressure_;                       // [body][lane] of the world's and the control's that act
  std::vector<std::int64_t> step_;         // [lane] at which its state is
  std::vector<std::int64_t> next_change_;  // [lane] of the forces that act
  Numbers lower_, upper_;                  // [body][xyz][lane]
  Numbers speed2_, travel_;                // [body][lane]
  // [body][lane] of nodes against their mean, of bodies that ask for it.
  Numbers inner_travel_;
  std::vector<bool> wears_inside_;
  // Sleep (docs/dynamics.md), all [body][lane], 0 or 1: is as it was a step ago; takes no part in this step;
  // was at rest in this step.
  Numbers unchanged_, asleep_, at_rest_;
  std::vector<std::uint32_t> changes_;             // [body][lane] steps in which it changed, since load
  Numbers touches_;                                // its box meets another's or a wall
  using Pairs = std::vector<std::pair<int, int>>;  // a < b
  std::vector<Pairs> met_;                         // [lane] whose boxes met a step ago
  Pairs meeting_;                                  // scratch
  Pairs tied_;                                     // by ligaments, always
  std::vector<int> leader_;                        // [body] of those that rub, the first; in the lane at hand
  std::vector<bool> all_asleep_, pushed_asleep_;   // [body] in all lanes; some force fell on it there
  std::vector<Control> controls_;                  // [lane]
  std::vector<bool> contact_;                      // [lane]
  Rest<Real> rest_;
  Numbers speed2_before_, inner_speed2_;  // [lane]
  Cost cost_;
};

extern template class Stepper<float>;
extern template class Stepper<double>;

}  // namespace limber::fem::detail
