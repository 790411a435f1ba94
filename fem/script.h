// What happens by itself: forces between two times, and bodies that go from keyframe to keyframe. A function
// of time alone, and so of State::step. Method: docs/simulation.md.
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh.h"

namespace limber::fem {

struct ForceSpec {
  int body = 0;  // one that is pushed
  double from_s = 0, to_s = 0;
  Vec3 force_n = Vec3::Zero();  // the sum over its nodes, of which each gets its share of their mass
  std::vector<int> nodes = {};  // rows of its cage; empty: all
};
// As it is stepped: from the nearest whole step to the nearest whole step.
struct Force {
  int body;
  std::int64_t first_step, end_step;  // it acts in the steps that begin at [first, end)
  Vec3 force_n;
  std::vector<int> nodes;  // all that get a share, none of them held
  double mass_kg;          // of what the force is shared by; what held nodes get moves nothing
};

// Blows a soft body up: on each face of its cage's surface, as that is now, pressure × area outward, a third
// of it on each corner; where the cage has hollows, on their walls alone, out of the hollow. Over a closed
// surface that is no force and no torque.
struct PressureSpec {
  int body = 0;
  double from_s = 0, to_s = 0;
  double pressure_pa = 0;  // < 0 draws it together
};
struct Pressure {
  int body;
  std::int64_t first_step, end_step;  // as of Force
  double pressure_pa;
};

struct Keyframe {
  double at_s = 0;  // > 0, ascending
  Vec3 position_m = Vec3::Zero();
  Vec3 turn_rad = Vec3::Zero();  // about this axis, by its length, from how the body is at rest
};
// How a body moves that nothing pushes. At time 0 it is where it is at rest; between keyframes position and
// turn_rad change evenly, so about one axis it turns at one speed, as often as the angle says; after the last
// it stands.
struct Track {
  Vec3 pivot_m = Vec3::Zero();  // the place at rest of what is at position_m
  std::vector<Keyframe> keyframes;
};

// A point that is at X at rest is at place_m + turn (X − pivot_m).
struct Pose {
  Eigen::Matrix3d turn;
  Vec3 place_m;
  bool operator==(const Pose&) const = default;
};
// By + − × ÷ and the square root alone: the same bits on every machine.
Pose pose_at(const Track&, double time_s);

}  // namespace limber::fem
