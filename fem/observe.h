// What a State shows: pure functions of World and State, in double.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fem/world.h"

namespace limber::fem {

// (N × 3) of one body, metres: the rows of its cage. A static body has its rest positions.
Points body_positions(const World&, const State&, int body);
double time_s(const World&, const State&);

double volume_m3(const World&, const State&, int body);  // sum of signed tet volumes
// Largest |V − V0|/V0 of all moving bodies.
double largest_volume_change(const World&, const State&);
// Radius of the largest ball round the centre of mass that the rest shape holds: the fine surface where that
// is given and the centre is in it, else the cage.
double inner_radius_m(const World&, int body);
Vec3 center_of_mass_m(const World&, const State&, int body);
Vec3 center_velocity_m_s(const World&, const State&, int body);  // of the centre of mass
double mean_speed_m_s(const World&, const State&,
                      int body);  // mass-weighted mean of |v|; 0 for a static body

double elastic_energy_j(const World&, const State&);
double elastic_energy_j(const World&, const State&, int body);  // 0 unless it is deformable
double kinetic_energy_j(const World&, const State&);
double kinetic_energy_j(const World&, const State&, int body);

// Of each tet of a body, (T): Green's strain G = (FᵀF − 1)/2, F = E E0⁻¹ from the edges E. `largest` is its
// largest absolute principal value; `von_mises` = √(⅔ G′:G′), G′ its deviator, so that a small stretch e at
// constant volume has von_mises e. (Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element
// Analysis.) `longest` and `shortest` are the largest and least singular value of F: by how much the tet is
// stretched along the direction in which that is most, and least.
struct Strains {
  std::vector<double> largest, von_mises, longest, shortest;
};
Strains strains(const World&, const State&, int body);
std::vector<double> volume_changes(const World&, const State&, int body);  // (T) V/V0 − 1 of each tet

// Of the robot against World::goal_shape_m, their centres of mass laid on one another: the angle of the
// rotation that fits best (Kabsch 1976, weighed by mass), and the largest distance of a node from its place.
// With the unit axis of a half turn the less of that and of the same against that shape, turned so.
double turn_from_goal_shape_deg(const World&, const State&, const std::optional<Vec3>& half_turn = {});
double distance_from_goal_shape_m(const World&, const State&, const std::optional<Vec3>& half_turn = {});

// The hole of a body that is a ring: the plane in which the nodes of its cage lie best, round their middle,
// as far as they are in the mean. What is nearer there cannot be in the ring itself.
struct Hole {
  Vec3 middle_m, normal;
  double radius_m = 0;
};
Hole hole_of(const World&, const State&, int ring);
// How many pieces of the robot are in that hole: of its tets that the hole cuts, those that hang together
// there are one.
int pieces_through(const World&, const State&, int ring);

// Where a ligament's ends are, and what it pulls with; below 0 where it pushes.
struct LigamentPull {
  Vec3 from_m, to_m;
  double tension_n;
};
std::vector<LigamentPull> ligament_pulls(const World&, const State&);  // in their order

int inverted_tets(const World&, const State&);  // of all moving bodies: volume ≤ 0
// What is wrong with a state, of the first body that has anything, and its first tet: one is inverted, or
// stretched by more than its body's max_stretch; or the body's volume has changed by more than its
// max_volume_change.
struct Fault {
  enum Kind { none, inverted, stretched, volume } kind = none;
  int body = -1;
};
Fault fault_of(const World&, const State&);
inline bool is_sound(const World& world, const State& state) {
  return fault_of(world, state).kind == Fault::none;
}

// The deepest point of one body in another, or beyond a wall of the bounds: distance to the nearest surface,
// over vertices and along surface edges to a hundredth of it, measured apart from the contact code. Pairs of
// static bodies do not count.
struct Penetration {
  double depth_m = 0;         // 0: nothing touches
  int body = -1, other = -1;  // other −1: a wall
  Vec3 place_m = Vec3::Zero();
};
Penetration deepest_penetration(const World&, const State&);

// Surface edges that pass through another body with no end inside, over all pairs of bodies one of which
// moves.
int piercing_edges(const World&, const State&);

// The forces of contact, walls and friction in the step that starts here under that control, by the code that
// steps and in its float32: they sum to what moves the bodies. Friction depends on all other forces, and so
// on the control. Ordered by pair, then as contact finds them.
struct ContactForce {
  int body, other;  // whose point is inside whom; other −1: a wall
  Vec3 place_m;     // of the point
  Vec3 force_n;     // on `body`; −force_n on `other`
  double depth_m;
};
std::vector<ContactForce> contact_forces(const World&, const State&, const Control& = {});

// The same with scratch memory that is kept, for whoever asks of many states. Of one thread; the world must
// outlive it.
class ContactProbe {
 public:
  explicit ContactProbe(const World&);
  ~ContactProbe();
  std::vector<ContactForce> forces(const State&, const Control& = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// What presses each body (its number), newtons: the magnitudes of all forces on it, of other bodies and of
// walls, summed, so that forces from opposite sides add up. What it does to itself does not count.
std::vector<double> contact_loads_n(const World&, const std::vector<ContactForce>&);
// No body bears more than its max_contact_load_n.
bool within_contact_loads(const World&, const std::vector<ContactForce>&);

struct PairForce {
  int body, other;  // body < other, or equal: it touches itself; other −1: the walls
  Vec3 force_n;     // on `body`, the sum
  int contacts;
};
std::vector<PairForce> pair_forces(const std::vector<ContactForce>&);  // by (body, other), each pair once

}  // namespace limber::fem
