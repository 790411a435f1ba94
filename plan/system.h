// What a planner may ask of dynamics. It deals in numbers and never names a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "core/state.h"
#include "plan/windings.h"

namespace limber::plan {

// One control applied to one state.
struct Rollout {
  const State* from = nullptr;  // never &to
  Control control;
  State to;         // out; its step is from->step + control.steps
  bool ok = false;  // out; false: the dynamics diverged, and `to` means nothing
  // Out, of the state that was shown last, or of `to`: no two surfaces are deeper in one another than a state
  // may have them. A part of System::acceptable that only who steps knows at little cost.
  bool clear = true;
};

// What a rollout shows on its way.
struct Observation {
  int steps = 0;                                        // since it began
  Vec3 center = Vec3::Zero(), velocity = Vec3::Zero();  // as System::robot_center, robot_velocity
  Vec3 goal_shift = Vec3::Zero();                       // as System::goal_shift
  Windings windings = {};                               // as System::windings
  bool lost = false;  // the goal cannot be reached any more, and the state is not acceptable
};

// Hands rollouts to whoever has a lane free.
class RolloutSource {
 public:
  virtual ~RolloutSource() = default;
  virtual int at_once() const = 0;  // so many it may give before one is done
  virtual Rollout* next() = 0;      // nullptr: none now; it stays good until done()
  // Asked every look_every steps of a rollout that has not diverged; false ends it there, and its
  // control.steps are those it took. Must be a function of the rollout and what was seen of it.
  virtual bool goes_on(const Rollout&, const Observation&) { return true; }
  // The same of whole states: the first step later than `step` (both as State::step) whose state is shown.
  virtual std::int64_t next_shown(std::int64_t) const { return std::numeric_limits<std::int64_t>::max(); }
  virtual bool goes_on(const Rollout&, const State&) { return true; }
  virtual void done(Rollout&) = 0;
  // Asked every few steps; once it is false all that is under way is to be given back, as diverged.
  virtual bool wanted() { return true; }
};

// Scratch memory of one thread; its System must outlive it.
class Propagator {
 public:
  virtual ~Propagator() = default;
  // Fills `to` and `ok` of each; lengths may differ, one alone is common. A result depends on (from, control)
  // alone, not on its neighbours in the span, and 40 steps followed by 60 of the same control give the bits
  // of 100.
  virtual void propagate(std::span<Rollout>) = 0;
  // The same for all that the supply gives, until it has none and all are done; a lane is filled again as
  // soon as its rollout ends. look_every > 0.
  virtual void run(RolloutSource&, int look_every) = 0;
};

// Of a node of the robot: metres, metres a second.
struct NodePlace {
  Vec3 place = Vec3::Zero(), velocity = Vec3::Zero();
};

// Two carriers have hold of the robot, each at a node, and push it both at once, each by a force of its own.
struct Carriers {
  std::array<int, 2> nodes{};
  std::array<Vec3, 2> goals;     // where those nodes are in the goal's shape, less its centre of mass; metres
  Vec3 weight_n = Vec3::Zero();  // of the robot
};

// A coarse picture of what stands where at the start, for guidance.
struct Workspace {
  enum Cell : std::uint8_t { open, soft, rigid };
  Box box;
  double cell_m = 0;
  Eigen::Vector3i cells = Eigen::Vector3i::Zero();
  std::vector<Cell> what;        // [(z · ny + y) · nx + x]; the robot itself leaves no trace
  bool walls = true;             // the box is closed
  double robot_radius_m = 0;     // of the largest ball round the robot's centre of mass that it holds
  std::vector<Hole> holes = {};  // of which the goal says what hangs in them; see System::windings
};

// What a path is judged by beside its time and its forces.
struct Measures {
  double strain_energy_j = 0;  // elastic energy of all bodies
  double volume_change = 0;    // the largest |V − V₀|/V₀ of a body that moves
};

// All members may be called from several threads at once.
class System {
 public:
  virtual ~System() = default;
  virtual State start() const = 0;
  // Where the robot is taken to be, metres: its centre of mass, or that of a part which leads it; and how
  // fast that moves, metres a second.
  virtual Vec3 robot_center(const State&) const = 0;
  virtual Vec3 robot_velocity(const State&) const = 0;
  virtual double robot_mass_kg() const = 0;
  virtual double robot_drag_per_s() const { return 0; }  // what slows it, by so much of its velocity
  virtual double mean_speed(const State&) const = 0;     // of the robot's nodes, metres a second
  virtual int robot_nodes() const = 0;                   // Control::node is below it
  // The node that a control point is at, of one drawn below robot_nodes().
  virtual int control_node(int drawn) const { return drawn; }
  virtual const Carriers* carriers() const {
    return nullptr;
  }  // nullptr: control points are pushed one by one
  virtual NodePlace node_place(const State&, int /*robot_node*/) const {
    return {};
  }                                        // asked of carriers' alone
  virtual Box sample_bounds() const = 0;   // where random points are drawn, metres
  virtual double dt_s() const = 0;         // length of a step
  virtual std::uint64_t hash() const = 0;  // of all that a rollout's result depends on
  // False: no rollout passes through this state at a frame time, and no node is made of it; as where
  // Rollout::clear is false.
  virtual bool acceptable(const State&) const { return true; }
  // One of a path's frames that must not be shown, though the dynamics lead there; frames.size(): none.
  // Asked of whole ways to a goal alone, for it is dear. Throws Interrupted after a stop signal.
  virtual std::size_t first_refused(std::span<const State> frames) const { return frames.size(); }
  virtual std::string why_refused(const State&) const {
    return {};
  }  // of such a frame: "heart and lung overlap"
  // What else than the place of the robot's centre of mass makes it reach the goal: its turn, its shape, …
  virtual bool goal_holds(const State&) const { return true; }
  // How the robot, a strand led by its end, hangs in the workspace's holes: from its tail to robot_center.
  virtual Windings windings(const State&) const { return {}; }
  // How far the goal has moved since the start: it may hang on a body that moves by itself. Metres.
  virtual Vec3 goal_shift(const State&) const { return Vec3::Zero(); }
  // The same dynamics on the leg to the goal with this number (Settings::via, then the last): acceptable and
  // what is named after the goal may answer otherwise.
  virtual const System& on_leg(int) const { return *this; }
  virtual Measures measures(const State&) const { return {}; }
  virtual Vec3 goal_velocity(const State&) const { return Vec3::Zero(); }  // metres a second
  virtual Workspace workspace() const = 0;
  virtual int lanes() const { return 1; }  // rollouts a Propagator likes at once
  virtual std::unique_ptr<Propagator> make_propagator() const = 0;
};

}  // namespace limber::plan
