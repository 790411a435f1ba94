// Small worlds for the planner: a chain of equal masses in a box with a wall that has a gap. A chain of one
// is a damped double integrator.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/threads.h"
#include "plan/search.h"

namespace limber::plan::testing {

// So many threads, for as long as it lives.
struct Threads {
  explicit Threads(int n) { set_thread_count(n); }
  ~Threads() { set_thread_count(0); }
};

struct Toy final : System {
  int nodes = 1;
  float mass_kg = 2;
  float damping_per_s = 0.5f;
  Vec3f weight_m_s2 = Vec3f::Zero();
  bool wall = false;                // across x = 5, 0.4 thick, open for 2 < y < 4
  bool lava = false;                // a rollout through y < 0.5 diverges
  float unacceptable_above_z = 99;  // no node may be there
  float not_clear_above_z = 99;     // nor there, as propagators tell of what they step
  float refused_above_z = 99;       // no frame of a way to a goal may be there
  Vec3 goal_velocity_m_s = Vec3::Zero();
  std::optional<State> begins_at;  // else at rest at (1, 1.5, 1)
  int lanes_wanted = 1;
  bool jitter = false;                        // threads finish in a scrambled order
  std::function<void()> before_each_rollout;  // called by the propagators
  mutable std::atomic<std::int64_t> rollouts{0};

  Toy() = default;
  Toy(int nodes_, bool wall_, bool lava_, float unacceptable)
      : nodes(nodes_), wall(wall_), lava(lava_), unacceptable_above_z(unacceptable) {}

  State start() const override;
  Vec3 robot_center(const State&) const override;
  Vec3 robot_velocity(const State&) const override;
  double robot_mass_kg() const override { return double(mass_kg); }
  double mean_speed(const State&) const override;
  int robot_nodes() const override { return nodes; }
  Box sample_bounds() const override { return {Vec3(0, 0, 0), Vec3(10, 6, 2)}; }
  double dt_s() const override { return 0.01; }
  std::uint64_t hash() const override;
  bool acceptable(const State&) const override;
  std::size_t first_refused(std::span<const State>) const override;
  std::string why_refused(const State&) const override;
  bool is_clear(const State& s) const { return robot_center(s).z() <= double(not_clear_above_z); }
  Vec3 goal_shift(const State& s) const override { return goal_velocity_m_s * (double(s.step) * dt_s()); }
  Measures measures(
      const State&) const override;  // energy of the springs; largest relative change of one's length
  Vec3 goal_velocity(const State&) const override { return goal_velocity_m_s; }
  Workspace workspace() const override;
  int lanes() const override { return lanes_wanted; }
  std::unique_ptr<Propagator> make_propagator() const override;

  Vec3f rest_place(int node) const { return Vec3f(0, 0, 0.2f * (float(node) - 0.5f * float(nodes - 1))); }
  bool step(const Control&, State&) const;  // false: diverged
};

// Settings under which the toys are solved in some hundred iterations.
Settings toy_settings();

// The whole rollout; whether it stays acceptable at each frame time and at its end.
bool passes(const System&, const Settings&, Propagator&, Rollout&);

// The planner as the paper prints it: one expansion after the other, no speculation. The tree it grows.
Tree sequential_tree(const System&, const Settings&, std::int64_t first_iteration = 0);

}  // namespace limber::plan::testing
