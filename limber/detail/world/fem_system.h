// What the planner may ask of the soft bodies: the adapter from fem::World to plan::System.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "fem/cost.h"
#include "fem/observe.h"
#include "fem/world.h"
#include "limber/detail/world/seen.h"
#include "plan/system.h"

namespace limber::detail {

// What a goal asks for besides the place of the robot's centre of mass. Bodies by index, −1: none.
struct GoalRules {
  int body = -1;                       // takes the goal along; −1: the goal stays where it is
  std::optional<double> lost_below_m;  // the goal is lost once that body's lowest node is below this height
  std::optional<double> turn_tolerance_deg;  // the robot is turned as fem::World::goal_shape_m is
  std::optional<double> shape_tolerance_m;   // no node is farther from its place in that shape
  std::optional<Vec3> half_turn;             // about this unit axis from there it is as good
  int above = -1, below = -1;                // the whole robot is higher, lower than all of this body
  double volume = 0;                         // > 0: the robot's cage holds so many times what it does at rest
  int clear_of = -1;                         // no contact with this body pushes the robot
  std::map<int, int> through = {};           // so many pieces of the robot are in the hole of this body
  // Where control points are, in world coordinates at the start; empty: at any node. With `lead` the free
  // nodes in the first are where the robot is taken to be, not its centre of mass. Those of all goals are the
  // last's.
  std::vector<Box> patches_m = {};
  bool lead = false;
  bool carry = false;               // the first two are carriers, which push both at once
  std::vector<GoalRules> via = {};  // of the goals before it, likewise; lost_below_m is of the last
};

class FemSystem final : public plan::System {
 public:
  // The world must outlive it. Begins where the world does, or in a state of the caller's.
  explicit FemSystem(const fem::World& world, const GoalRules& = {},
                     std::optional<State> start = std::nullopt);
  // For searches: ways are refused on which surfaces are deeper in one another, or in themselves, or press
  // one another through a wider gap, than SeenLimits has it, where contact is on them, and on which cages go
  // deeper into one another or a wall than largest_cage_penetration_m where it is between those. The bodies
  // must outlive it.
  FemSystem(const fem::World&, const std::vector<PreparedBody>&, const GoalRules&,
            std::optional<State> start = std::nullopt);

  State start() const override;
  Vec3 robot_center(const State&) const override;
  Vec3 robot_velocity(const State&) const override;
  double robot_mass_kg() const override;
  double robot_drag_per_s() const override;
  double mean_speed(const State&) const override;
  int robot_nodes() const override;
  int control_node(int drawn) const override;
  const plan::Carriers* carriers() const override { return carriers_ ? &*carriers_ : nullptr; }
  plan::NodePlace node_place(const State&, int robot_node) const override;
  Box sample_bounds() const override;
  double dt_s() const override;
  std::uint64_t hash() const override;
  // It is sound, nothing is pressed by more than it may be, and the goal is not lost.
  bool acceptable(const State&) const override;
  std::string why_not_acceptable(const State&) const;  // "" where it is
  bool goal_holds(const State&) const override;
  plan::Windings windings(const State&) const override;
  const System& on_leg(int) const override;
  Vec3 goal_shift(const State&) const override;
  plan::Measures measures(const State&) const override;
  Vec3 goal_velocity(const State&) const override;
  plan::Workspace workspace() const override;
  int lanes() const override;
  std::unique_ptr<plan::Propagator> make_propagator() const override;
  fem::Cost cost() const;  // of all propagators that have ended
  std::size_t first_refused(std::span<const State> frames) const override;
  std::string why_refused(const State&) const override;
  const Surfaces* surfaces() const { return surfaces_.get(); }  // nullptr where it was given no bodies

 private:
  class Propagator;
  FemSystem(const fem::World&, const GoalRules&, std::optional<State> start, std::uint64_t hash_of_world);
  const fem::World& world_;
  std::optional<State> given_start_;
  GoalRules goal_;
  std::vector<std::unique_ptr<FemSystem>> via_;
  std::vector<int> patch_nodes_;  // of the robot: of each patch's, the nearest to its middle
  std::vector<int> lead_nodes_;   // of the robot; empty: no patch leads
  std::vector<int> strand_;  // of the robot: from its far end to the patch that leads; empty: nobody asks
  std::vector<plan::Hole> holes_;  // that the goal speaks of, as the world begins
  double lead_mass_kg_ = 0;
  std::optional<plan::Carriers> carriers_;
  const FemSystem* last_ = this;  // on the leg to the last goal: what is lost to it is lost
  void find_patches();
  Vec3 mean_of_lead(const std::vector<float>& of_nodes) const;
  bool loses_goal(const State&) const;     // it is below goal.lost_below_m
  bool bears_contact(const State&) const;  // nothing is pressed by more than its max_contact_load_n
  Vec3 goal_body_start_m_;
  bool limits_contact_;  // some body has such a limit
  std::uint64_t hash_;
  std::shared_ptr<const Surfaces> surfaces_;
  double surface_size_m_ = 0;  // of the robot's
  mutable std::mutex mutex_;
  mutable fem::Cost cost_;
  mutable std::vector<std::unique_ptr<fem::ContactProbe>> probes_;  // that no thread uses now
};

}  // namespace limber::detail
