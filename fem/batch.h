// Rollouts of one World, W side by side. What a rollout gives is a function of (World, State, Control) alone:
// bit for bit the same whatever W, the lane, the neighbours and the instruction set, and 100 steps are 40 and
// then 60.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "core/state.h"
#include "fem/cost.h"
#include "fem/world.h"

namespace limber::fem {

enum class RunStatus { ok, diverged };

struct Outcome {
  RunStatus status = RunStatus::ok;
  std::string reason;  // of a divergence: which body, which node, what it did
};

enum class InstructionSet { automatic, sse2, avx2, avx512 };

// Scratch memory of one thread; `world` must outlive it.
class Batch {
 public:
  // lanes: 1, 4, 8 or 16. Throws InputError when the machine lacks the instruction set.
  explicit Batch(const World& world, int lanes = 16, InstructionSet = InstructionSet::automatic);
  ~Batch();
  Batch(Batch&&) noexcept;
  int lanes() const;
  const World& world() const;

  // The lane will take control.steps steps from here. What it held is gone.
  void load(int lane, const State&, const Control&);
  // Steps all loaded lanes together until the first of them is done, at most `max_steps`; returns the steps
  // taken, 0 when no lane has any left.
  int advance(int max_steps = 1 << 30);
  int steps_left(int lane) const;
  // Of one body as it is now, in a lane that was loaded: centre of mass and its velocity, height of the
  // lowest node.
  struct Motion {
    Vec3 center_m, velocity_m_s;
    double lowest_m;
  };
  Motion motion(int lane, int body) const;
  // As it is now, in a lane that was loaded and has steps left.
  void peek(int lane, State&) const;
  // The lane takes no further steps: as if its control had had only those that it took.
  void stop(int lane);
  // Once steps_left is 0. A diverged lane holds no state to go on from: store() gives the one it was loaded
  // with.
  const Outcome& outcome(int lane) const;
  void store(int lane, State&) const;
  // Of the state that store() or peek() gives: no surface is deeper in another body's than
  // World::max_overlap_m, as contact measures it; between cages always. Not of a lane that diverged, or was
  // told to take no step.
  bool is_clear(int lane);
  Cost cost() const;  // so far

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct Rollout {
  const State* start;  // not owned
  Control control;
  State end;          // out; equals *start when diverged
  Outcome outcome;    // out
  bool clear = true;  // out: Batch::is_clear of its end
};

// Runs all of them, refilling a lane as soon as its rollout ends.
void propagate(Batch&, std::span<Rollout>);
// One rollout in a Batch of one lane, made for the purpose.
Rollout propagate(const World&, const State& start, const Control&);

}  // namespace limber::fem
