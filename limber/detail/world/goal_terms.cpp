#include "limber/detail/world/goal_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fem/batch.h"
#include "fem/observe.h"
#include "scenes/models.h"

namespace limber::detail {

Vec3 robot_place_m(const scenes::Scene& scene, const fem::World& world, const State& state) {
  if (!scene.planner.lead) return fem::center_of_mass_m(world, state, world.robot);
  const fem::Body& robot = world.bodies[std::size_t(world.robot)];
  const Points now = fem::body_positions(world, state, world.robot);
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (const int n : scenes::nodes_in(scene.planner.patches_m[0], scene.bounds_m, robot.cage.positions)) {
    if (robot.fixed[std::size_t(n)]) continue;
    sum += robot.node_mass_kg[std::size_t(n)] * now.row(n).transpose();
    mass += robot.node_mass_kg[std::size_t(n)];
  }
  return sum / mass;
}

namespace {

GoalTerm place_term(const scenes::Scene& scene, const scenes::Goal& goal, const fem::World& world,
                    const State& state) {
  Vec3 shift = Vec3::Zero();
  if (goal.moves_with >= 0)
    shift = fem::center_of_mass_m(world, state, goal.moves_with) -
            fem::center_of_mass_m(world, fem::start_state(world), goal.moves_with);
  const Vec3 center = robot_place_m(scene, world, state) - shift, aim = goal.center_of_mass_m;
  const std::string what = scene.planner.lead ? "the patch that leads" : "centre of mass";
  const std::string moved = goal.moves_with >= 0 ? ", moved along" : "";
  if (goal.box_m) {
    // How far outside, along the axis on which that is most.
    const double outside =
        std::max((goal.box_m->lower - center).maxCoeff(), (center - goal.box_m->upper).maxCoeff());
    return {what + " in its box" + moved, outside <= 0,
            fmt::format("{:.3f} m {}", std::abs(outside), outside <= 0 ? "inside" : "outside")};
  }
  const double distance = (center - aim).norm();
  return {fmt::format("{} within {:g} m of ({:g} {:g} {:g}){}", what, goal.radius_m, aim.x(), aim.y(),
                      aim.z(), moved),
          distance <= goal.radius_m, fmt::format("{:.3f} m from it", distance)};
}

// All of `higher` over all of `lower`, by their nodes.
GoalTerm over_term(const fem::World& world, const State& state, int higher, int lower, std::string asked) {
  const double air = fem::body_positions(world, state, higher).col(2).minCoeff() -
                     fem::body_positions(world, state, lower).col(2).maxCoeff();
  return {std::move(asked), air > 0,
          fmt::format("{:.3f} m {}", std::abs(air), air > 0 ? "apart" : "too little")};
}

}  // namespace

std::vector<GoalTerm> terms_of(const scenes::Scene& scene, const scenes::Goal& goal, const fem::World& world,
                               const State& state) {
  std::vector<GoalTerm> terms{place_term(scene, goal, world, state)};
  const auto name = [&](int body) { return scene.bodies[std::size_t(body)].name; };
  if (goal.above >= 0)
    terms.push_back(
        over_term(world, state, world.robot, goal.above, "whole robot above " + name(goal.above)));
  if (goal.below >= 0)
    terms.push_back(
        over_term(world, state, goal.below, world.robot, "whole robot below " + name(goal.below)));
  if (goal.clear_of >= 0) {
    int contacts = 0;
    for (const fem::PairForce& pair : fem::pair_forces(fem::contact_forces(world, state)))
      if (std::minmax(pair.body, pair.other) == std::minmax(world.robot, goal.clear_of))
        contacts += pair.contacts;
    terms.push_back(
        {"no contact with " + name(goal.clear_of), contacts == 0, fmt::format("{} contacts", contacts)});
  }
  if (goal.volume > 0) {
    const double now =
        fem::volume_m3(world, state, world.robot) / world.bodies[std::size_t(world.robot)].rest_volume_m3;
    terms.push_back({fmt::format("blown up to {:g} times its volume", goal.volume), now >= goal.volume,
                     fmt::format("{:.3f} times", now)});
  }
  for (const auto& [ring, asked] : goal.through) {
    const int pieces = fem::pieces_through(world, state, ring);
    terms.push_back({fmt::format("{} of the robot's pieces in the hole of {}", asked, name(ring)),
                     pieces == asked, fmt::format("{}", pieces)});
  }
  if (!goal.shape) return terms;
  const auto& half_turn = goal.shape->half_turn;
  const std::string about = half_turn ? fmt::format(" half a turn about ({:g} {:g} {:g})", half_turn->x(),
                                                    half_turn->y(), half_turn->z())
                                      : "";
  const auto add = [&](const std::string& asked, double most, double found, double as_it_is,
                       const std::string& told) {
    terms.push_back({asked + (half_turn ? ", or" + about + " from it" : ""), found <= most,
                     told + (found < as_it_is ? ", by" + about : "")});
  };
  if (goal.shape->turn_tolerance_deg) {
    const double most = *goal.shape->turn_tolerance_deg,
                 turn = fem::turn_from_goal_shape_deg(world, state, half_turn);
    add(fmt::format("turned within {:g} degrees of the shape asked for", most), most, turn,
        fem::turn_from_goal_shape_deg(world, state), fmt::format("{:.2f} degrees", turn));
  }
  if (goal.shape->tolerance_m) {
    const double most = *goal.shape->tolerance_m,
                 off = fem::distance_from_goal_shape_m(world, state, half_turn);
    add(fmt::format("every node within {:g} m of the shape asked for", most), most, off,
        fem::distance_from_goal_shape_m(world, state), fmt::format("{:.4f} m", off));
  }
  return terms;
}

GoalTerm rest_term(const scenes::Scene& scene, const fem::World& world, const State& state) {
  const double most = scene.planner.settle_speed_m_s, speed = fem::mean_speed_m_s(world, state, world.robot);
  return {fmt::format("at rest, slower than {:g} m/s", most), speed < most, fmt::format("{:.4f} m/s", speed)};
}

GoalTerm stay_term(const scenes::Scene& scene, const fem::World& world, const State& state, Control held_by) {
  constexpr double look_s = 0.01;
  constexpr int looks = 5;
  const double most = scene.planner.settle_speed_m_s;
  const std::string asked = fmt::format("at rest for {:g} s more", looks * look_s);
  held_by.steps = std::max(1, int(std::lround(look_s / world.dt_s)));
  fem::Batch batch(world, 1);
  double fastest = 0;
  State now = state;
  for (int look = 0; look < looks; ++look) {
    fem::Rollout on{&now, held_by, {}, {}};
    fem::propagate(batch, {&on, 1});
    if (on.outcome.status == fem::RunStatus::diverged) return {asked, false, "the dynamics diverge"};
    fastest = std::max(fastest, fem::mean_speed_m_s(world, on.end, world.robot));
    now = std::move(on.end);
  }
  return {asked, fastest < most, fmt::format("{:.4f} m/s at most", fastest)};
}

GoalTerm loss_term(const scenes::Scene& scene, const fem::World& world, const State& state) {
  const scenes::Goal& goal = scene.goal;
  if (!goal.lost_below_m) return {"", true, ""};
  const double least = *goal.lost_below_m,
               lowest = fem::body_positions(world, state, goal.moves_with).col(2).minCoeff();
  return {fmt::format("not lost: {} nowhere below {:g} m", scene.bodies[std::size_t(goal.moves_with)].name,
                      least),
          lowest >= least, fmt::format("lowest {:.3f} m", lowest)};
}

}  // namespace limber::detail
