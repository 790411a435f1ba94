// What the planner may ask of the soft bodies: the adapter from fem::World to plan::System.
#pragma once

#include <mutex>

#include "fem/cost.h"
#include "fem/world.h"
#include "plan/system.h"

namespace limber::app {

class FemSystem final : public plan::System {
 public:
  explicit FemSystem(const fem::World& world);  // which must outlive it

  State start() const override;
  Vec3 robot_center(const State&) const override;
  double mean_speed(const State&) const override;
  int robot_nodes() const override;
  Box sample_bounds() const override;
  double dt_s() const override;
  std::uint64_t hash() const override;
  bool acceptable(const State&) const override;  // no tet is inverted
  int lanes() const override;
  std::unique_ptr<plan::Propagator> make_propagator() const override;
  fem::Cost cost() const;  // of all propagators that have ended

 private:
  class Propagator;
  const fem::World& world_;
  std::uint64_t hash_;
  mutable std::mutex mutex_;
  mutable fem::Cost cost_;
};

}  // namespace limber::app
