// What the planner may ask of the soft bodies: the adapter from fem::World to plan::System.
#pragma once

#include <mutex>
#include <optional>

#include "fem/cost.h"
#include "fem/world.h"
#include "plan/system.h"

namespace limber::app {

// A goal that a body takes along.
struct MovingGoal {
  int body = -1;                       // index; −1: the goal stays where it is
  std::optional<double> lost_below_m;  // the goal is lost once that body's lowest node is below this height
};

class FemSystem final : public plan::System {
 public:
  explicit FemSystem(const fem::World& world, const MovingGoal& = {});  // the world must outlive it

  State start() const override;
  Vec3 robot_center(const State&) const override;
  double mean_speed(const State&) const override;
  int robot_nodes() const override;
  Box sample_bounds() const override;
  double dt_s() const override;
  std::uint64_t hash() const override;
  bool acceptable(const State&) const override;  // no tet is inverted, and the goal is not lost
  Vec3 goal_shift(const State&) const override;
  int lanes() const override;
  std::unique_ptr<plan::Propagator> make_propagator() const override;
  fem::Cost cost() const;  // of all propagators that have ended

 private:
  class Propagator;
  const fem::World& world_;
  MovingGoal goal_;
  Vec3 goal_body_start_m_;
  std::uint64_t hash_;
  mutable std::mutex mutex_;
  mutable fem::Cost cost_;
};

}  // namespace limber::app
