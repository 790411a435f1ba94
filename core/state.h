// What a planner hands to dynamics and gets back. Values: copy them into a tree node, hash them, save them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"

namespace limber {

// All that is needed to go on, and nothing else. Nodes of all moving bodies, body after body.
struct State {
  std::int64_t step = 0;          // time = step × World::dt_s
  std::vector<float> positions;   // (3N) x y z a node, metres
  std::vector<float> velocities;  // (3N) metres a second

  bool operator==(const State&) const = default;
};
std::uint64_t hash_of(const State&);

// The paper's three ways to push the robot (Rodriguez, Lien, Amato 2006, section IV), and none.
enum class Manipulation : std::int32_t {
  none = 0,
  body = 1,           // force_n on the whole robot
  control_point = 2,  // the same force density, only on the nodes within radius_m of `node`
  interpolation = 3,  // every node towards its place in the goal shape: the rest shape with its centre of
                      // mass at target_m
  hold = 4            // ours: the centre of mass to target_m, every node slowed; any turn and shape will do
};

// One manipulation held for `steps` time steps. A force F in newtons is a force on the whole robot: node i
// gets F m_i / m. (Then a finer cage of the same body is pushed alike; the paper's equal force a vertex is
// the same for equal masses.)
struct Control {
  Manipulation manipulation = Manipulation::none;
  Vec3f force_n = Vec3f::Zero();   // body, control_point
  std::int32_t node = -1;          // control_point: a node of the robot, counted from the robot's first
  float radius_m = 0;              // control_point: distance from that node's place in the rest shape
  Vec3f target_m = Vec3f::Zero();  // interpolation, hold: centre of mass of the goal shape
  float max_force_n = 0;           // interpolation, hold: no node gets more than its mass share of this
  std::int32_t steps = 0;
  // control_point: another of the same radius, pushed at the same time, as by a second carrier; node −1:
  // none.
  std::int32_t second_node = -1;
  Vec3f second_force_n = Vec3f::Zero();
  // ≥ 0, whatever the manipulation: blows the robot up (fem/script.h, PressureSpec).
  float pressure_pa = 0;

  bool operator==(const Control&) const = default;
};
// The largest force, in newtons, that this control may exert: |force_n|, that of the stronger carrier, or
// max_force_n.
float largest_force(const Control&);

}  // namespace limber
