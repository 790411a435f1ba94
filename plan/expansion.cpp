#include "plan/expansion.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace limber::plan {

namespace {

// Float rounding of a vector of exactly the largest force could exceed it.
constexpr double just_below_one = 1 - 1e-6;

Manipulation choose(const ManipulationWeights& w, bool towards_goal, double u) {
  const double pick = u * (w.body + w.control_point + (towards_goal ? w.interpolation : 0));
  if (pick < w.body) return Manipulation::body;
  if (!towards_goal || pick < w.body + w.control_point) return Manipulation::control_point;
  return Manipulation::interpolation;
}

}  // namespace

int steps_of(double duration_s, double dt_s) { return std::max(1, int(std::lround(duration_s / dt_s))); }

// The order of the draws is part of the result: a new one goes to the end.
Draw draw(const Settings& s, const System& system, std::int64_t iteration) {
  Rng rng(s.seed, std::uint64_t(iteration));
  const Box bounds = system.sample_bounds();
  Draw d;
  d.towards_goal = rng.uniform() < s.goal_bias;
  for (int axis = 0; axis < 3; ++axis) d.point[axis] = rng.uniform(bounds.lower[axis], bounds.upper[axis]);
  if (d.towards_goal) d.point = s.goal.center_of_mass_m;
  d.manipulation = choose(s.weights, d.towards_goal, rng.uniform());
  d.force_n = s.max_force_n * rng.uniform(s.min_force_share, s.max_force_share);
  d.robot_node = rng.below(system.robot_nodes());
  d.steps = steps_of(rng.uniform(s.min_duration_s, s.max_duration_s), system.dt_s());
  return d;
}

Control control_of(const Draw& d, const Settings& s, const Vec3& center, const Vec3& goal_shift) {
  Control control;
  control.manipulation = d.manipulation;
  control.steps = d.steps;
  if (d.manipulation == Manipulation::interpolation) {
    control.target_m = (s.goal.center_of_mass_m + goal_shift).cast<float>();
    control.max_force_n = float(d.force_n * just_below_one);
    return control;
  }
  const Vec3 point = d.towards_goal ? Vec3(d.point + goal_shift) : d.point;
  const Vec3 way = point - center;
  const double length = way.norm();
  if (length > 0) control.force_n = (way * (d.force_n * just_below_one / length)).cast<float>();
  if (d.manipulation == Manipulation::control_point) {
    control.node = d.robot_node;
    control.radius_m = float(s.control_point_radius_m);
  }
  return control;
}

Control settle_control(const Settings& s, int steps) {
  Control control;
  control.manipulation = Manipulation::interpolation;
  control.target_m = s.goal.center_of_mass_m.cast<float>();
  control.max_force_n = float(s.max_force_n * s.settle.max_force_share * just_below_one);
  control.steps = steps;
  return control;
}

}  // namespace limber::plan
