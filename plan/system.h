// What a planner may ask of dynamics. It deals in numbers and never names a mesh.
#pragma once

#include <memory>
#include <span>

#include "core/mesh.h"
#include "core/state.h"

namespace limber::plan {

// One control applied to one state.
struct Rollout {
  const State* from = nullptr;  // never &to
  Control control;
  State to;         // out; its step is from->step + control.steps
  bool ok = false;  // out; false: the dynamics diverged, and `to` means nothing
};

// Scratch memory of one thread; its System must outlive it.
class Propagator {
 public:
  virtual ~Propagator() = default;
  // Fills `to` and `ok` of each; lengths may differ, one alone is common. A result depends on (from, control)
  // alone, not on its neighbours in the span, and 40 steps followed by 60 of the same control give the bits
  // of 100.
  virtual void propagate(std::span<Rollout>) = 0;
};

// All members may be called from several threads at once.
class System {
 public:
  virtual ~System() = default;
  virtual State start() const = 0;
  virtual Vec3 robot_center(const State&) const = 0;            // centre of mass, metres
  virtual double mean_speed(const State&) const = 0;            // of the robot's nodes, metres a second
  virtual int robot_nodes() const = 0;                          // Control::node is below it
  virtual Box sample_bounds() const = 0;                        // where random points are drawn, metres
  virtual double dt_s() const = 0;                              // length of a step
  virtual std::uint64_t hash() const = 0;                       // of all that a rollout's result depends on
  virtual bool acceptable(const State&) const { return true; }  // false: no node is made of this state
  // How far the goal has moved since the start: it may hang on a body that moves by itself. Metres.
  virtual Vec3 goal_shift(const State&) const { return Vec3::Zero(); }
  virtual int lanes() const { return 1; }  // rollouts a Propagator likes at once
  virtual std::unique_ptr<Propagator> make_propagator() const = 0;
};

}  // namespace limber::plan
