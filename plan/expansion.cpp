#include "plan/expansion.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "plan/steering.h"

namespace limber::plan {

namespace {

// What stands in the way makes it take longer than in the open.
constexpr double shortest_stretch = 0.7, stretches = 1.0;

Manipulation choose(const ManipulationWeights& w, bool towards_goal, double u) {
  const double pick = u * (w.body + w.control_point + (towards_goal ? w.interpolation : 0));
  if (pick < w.body) return Manipulation::body;
  if (!towards_goal || pick < w.body + w.control_point) return Manipulation::control_point;
  return Manipulation::interpolation;
}

}  // namespace

int steps_of(double duration_s, double dt_s) { return std::max(1, int(std::lround(duration_s / dt_s))); }

// The order of the draws is part of the result: a new one goes to the end.
Sample draw_sample(const Settings& s, const System& system, std::int64_t iteration) {
  Rng rng(s.seed, std::uint64_t(iteration));
  const Box bounds = system.sample_bounds();
  Sample d;
  d.towards_goal = rng.uniform() < s.goal_bias;
  for (int axis = 0; axis < 3; ++axis) d.point[axis] = rng.uniform(bounds.lower[axis], bounds.upper[axis]);
  if (d.towards_goal) d.point = s.goal.center_of_mass_m;
  d.manipulation = choose(s.weights, d.towards_goal, rng.uniform());
  d.force_n = s.max_force_n * rng.uniform(s.min_force_share, s.max_force_share);
  d.robot_node = system.control_node(rng.below(system.robot_nodes()));
  d.steps = steps_of(rng.uniform(s.min_duration_s, s.max_duration_s), system.dt_s());
  d.guided = rng.uniform() < s.search_options.guidance && !d.towards_goal;
  d.rank = rng.uniform(), d.ahead = rng.uniform(), d.stretch = rng.uniform();
  d.aside = rng.direction();
  d.lift = rng.uniform();
  // Half of the time slack, as it gets farthest.
  const double blown = 2 * rng.uniform() - 1;
  if (!d.towards_goal && blown > 0) d.pressure_pa = blown * s.max_pressure_pa;
  return d;
}

Control steered_control(const Sample& d, const Settings& s, const System& system, const NodeMotion& from,
                        const Vec3& target, const Vec3& target_velocity) {
  const double force = d.force_n * just_below_one;
  const Drive drive{force / system.robot_mass_kg(), system.robot_drag_per_s()};
  Control control;
  control.manipulation = d.manipulation == Manipulation::interpolation ? Manipulation::body : d.manipulation;
  if (control.manipulation == Manipulation::control_point) {
    control.node = d.robot_node;
    control.radius_m = float(s.control_point_radius_m);
  }
  control.steps = d.steps, control.pressure_pa = float(d.pressure_pa);
  const Vec3 way = target - from.center, velocity = from.velocity - target_velocity;
  if (drive.acceleration <= 0 || way.squaredNorm() == 0) return control;
  control.force_n = (force * best_direction(way, velocity, drive)).cast<float>();
  const double lasts = time_to_go(way, velocity, drive) * (shortest_stretch + stretches * d.stretch);
  control.steps = steps_of(std::clamp(lasts, s.min_duration_s, s.max_duration_s), system.dt_s());
  return control;
}

Control carriers_control(const Sample& d, const Settings& s, const System& system, const NodeMotion& from,
                         const std::array<Vec3, 2>& targets, const Vec3& target_velocity) {
  const double most = d.force_n * just_below_one;
  Vec3 lift = -0.5 * d.lift * system.carriers()->weight_n;
  if (lift.norm() > most) lift *= most / lift.norm();
  // However the two point, together they are no more than may be.
  const double force = most - lift.norm();
  const Drive drive{2 * force / system.robot_mass_kg(), system.robot_drag_per_s()};
  Control control;
  control.manipulation = Manipulation::control_point;
  control.node = system.carriers()->nodes[0], control.second_node = system.carriers()->nodes[1];
  control.radius_m = float(s.control_point_radius_m);
  control.steps = d.steps, control.pressure_pa = float(d.pressure_pa);
  double lasts = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Vec3 way = targets[i] - from.carried[i].place,
               velocity = from.carried[i].velocity - target_velocity;
    Vec3f& on_it = i == 0 ? control.force_n : control.second_force_n;
    on_it = lift.cast<float>();
    if (drive.acceleration <= 0 || way.squaredNorm() == 0) continue;
    on_it = (lift + force * best_direction(way, velocity, drive)).cast<float>();
    lasts = std::max(lasts, time_to_go(way, velocity, drive));
  }
  if (s.search_options.steer && lasts > 0)
    control.steps = steps_of(
        std::clamp(lasts * (shortest_stretch + stretches * d.stretch), s.min_duration_s, s.max_duration_s),
        system.dt_s());
  return control;
}

Control control_of(const Sample& d, const Settings& s, const Vec3& center, const Vec3& goal_shift) {
  Control control;
  control.manipulation = d.manipulation;
  control.steps = d.steps, control.pressure_pa = float(d.pressure_pa);
  if (d.manipulation == Manipulation::interpolation) {
    if (s.search_options.hold) control.manipulation = Manipulation::hold;
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

Control goal_control(const Settings& s, int steps) {
  Control control;
  control.manipulation = s.search_options.hold ? Manipulation::hold : Manipulation::interpolation;
  control.target_m = s.goal.center_of_mass_m.cast<float>();
  control.max_force_n = float(s.max_force_n * s.settle.max_force_share * just_below_one);
  control.steps = steps;
  return control;
}

Control settle_control(const Settings& s, int steps) {
  Control control = goal_control(s, steps);
  control.manipulation = s.settle.hold ? Manipulation::hold : Manipulation::interpolation;
  control.pressure_pa = float(s.settle.pressure_pa);
  return control;
}

}  // namespace limber::plan
