// Coulomb friction that holds without memory: chosen last in a step, when all other forces are known, so that
// what touches does not slip in the velocities that the step ends with, as far as μ times the normal force
// allows. Bodies rub one another place by place, and a soft body a wall node by node: hundreds of samples of
// a flat side press a wall, and all of them hold its few nodes still. One lane; method and figures:
// docs/contact.md, "Friction".
#pragma once

#include <array>
#include <vector>

#include "fem/detail/effective_mass.h"
#include "fem/detail/lane_view.h"
#include "fem/detail/penalty.h"
#include "fem/detail/tables.h"

namespace limber::fem {
struct World;
}

namespace limber::fem::detail {

template <class Real>
class Friction {
 public:
  explicit Friction(const World&);
  // What touches in the step that begins; nothing yet.
  void begin();
  // Some place of `body` presses one of `against`, or a wall (−1), whose normal is along an axis: `most` is μ
  // times the normal force, in newtons. Shares: those of the first place, and minus those of the other.
  // `records` is where among what is told the force is to be added, times `told_share`; −1: nowhere.
  void add(int body, int against, const Real place[3], const Real normal[3], Real most,
           const Shares<Real>& shares, const Shares<Real>& others, int records = -1, Real told_share = 1);
  // When view.f holds all other forces: adds those of friction, and to what was told; in each substep again,
  // of the same touches. `pushes` [body] as of Motion, at the lane, or null.
  void add_forces(const LaneView<Real>& view, const std::vector<const Real*>& pushes,
                  std::vector<ContactRecord<Real>>* records);

 private:
  // x y z and nothing: added and scaled at once.
  typedef Real Row __attribute__((vector_size(4 * sizeof(Real)), may_alias));
  // A node, in the order in which they were met, and its velocity at the end of the step, as far as forces
  // are known.
  struct Slot {
    int node, body;
  };
  struct Velocity {
    union {
      Row row;
      Real at[4];
    };
  };
  struct SlotShare {
    int slot;
    Real weight, gain;  // weight over the node's mass; 0 where it never moves, or is of a rigid body
  };
  struct Slip {
    int side[2];                // body, against; −1: a wall
    int first, last;            // of shares_
    int first_soft, last_soft;  // of those the ones that are not of rigid bodies
    Real place[3], normal[3], most;
    Real inverse_mass;  // of what is not rigid
    Real impulse[3];    // on `body`, square to the normal
    int records;
    Real told_share;
  };
  // A node of a soft body and one of the walls, 0 … 2 the lower ones, 3 … 5 the upper.
  struct WallNode {
    int slot, body, side;
    Real load, most;    // μ h N: its shares of what presses the wall; and what of that it may exert
    bool meets_others;  // another wall or body, too
    Real impulse[3];
  };
  // Where the friction of a place at a wall is to be added: its shares, from `first` on, to what wall nodes
  // bear.
  struct WallTelling {
    int records, first, last;
  };
  struct WallShare {
    int wall_node;
    Real most;
  };
  struct WallLoad {
    Real all = 0, positive = 0;
  };
  // A rigid body's motion about its centre of mass.
  struct Spin {
    bool met = false;
    double center[3], velocity[3], spin[3], inverse_mass, inverse_inertia[6];
  };

  bool is_rigid(int body) const;
  int slot_of(int node, int body);
  const std::array<int, 6>& wall_nodes_of(int slot) const {
    return wall_nodes_of_node_[std::size_t(slots_[std::size_t(slot)].node)];
  }
  void bear(int body, const Real normal[3], Real most, const Shares<Real>&, int records);
  void limit_wall_nodes();
  Real step_of(WallNode&);
  Real energy_by_impulses();
  void predict(const LaneView<Real>& view, const std::vector<const Real*>& pushes);
  Real step_of(Slip&);  // the impulse's change over the most it may be
  void find_relative_velocity(const Slip&, Real out[3]) const;
  Real inverse_mass_along(const Slip&, const Real along[3]) const;
  void apply(const Slip&, const Real impulse[3]);

  const World& world_;
  const Tables<Real>& tables_;
  Real dt_;
  std::vector<int> slot_of_node_;  // −1: none
  std::vector<Slot> slots_;
  std::vector<Velocity> velocities_;  // a slot
  std::vector<SlotShare> shares_;
  std::vector<Slip> slips_;
  std::vector<std::array<int, 6>> wall_nodes_of_node_;  // by side; −1: none
  std::vector<WallNode> wall_nodes_;
  bool limited_ = false;              // `most` of wall nodes is known
  bool goes_on_ = false;              // impulses are those of the substep before
  std::vector<WallLoad> wall_loads_;  // [6 body + side]; empty between steps
  std::vector<WallTelling> wall_tellings_;
  std::vector<WallShare> wall_shares_;
  std::vector<Spin> spins_;  // a body; empty without rigid ones
};

extern template class Friction<float>;
extern template class Friction<double>;

}  // namespace limber::fem::detail
