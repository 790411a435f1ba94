// [goal], [[via]] and [planner]: what is asked of the robot, and how its motion is searched. Meaning of the
// keys: docs/scene.md, docs/planning.md.
//
// A goal that moves can be entered, not rested in; so there planner.settle_time_s must be 0.
#include <fmt/ranges.h>

#include <algorithm>

#include "scenes/detail/scene_parts.h"
#include "scenes/detail/typed_reads.h"

namespace limber::scenes {

namespace {

Goal::Shape read_goal_shape(const Node& table, const Node& planner) {
  Goal::Shape shape{direction(table, "axis", "goal.shape.axis"),
                    number(table, "angle_deg"),
                    vector(table, "stretch"),
                    text(table, "cage"),
                    maybe_number(table, "turn_tolerance_deg"),
                    maybe_number(table, "tolerance_m"),
                    {}};
  if (!shape.turn_tolerance_deg && !shape.tolerance_m)
    complain(table,
             "goal.shape asks for nothing without a tolerance; write for example turn_tolerance_deg = 10");
  if (const Node* half_turn = table.find("half_turn")) {
    shape.half_turn = direction(table, "half_turn", "goal.shape.half_turn");
    if (number(child(planner, "weights"), "interpolation") > 0 ||
        (number(planner, "settle_time_s") > 0 && number(planner, "settle_force_share") > 0))
      complain(*half_turn,
               "the robot would be drawn into goal.shape, also where it is about to lie turned by half a "
               "turn; write planner.weights.interpolation = 0 and planner.settle_force_share = 0");
  }
  return shape;
}

// What all goals have, those on the way too; `name` is the table's. Of a goal that is a box, radius_m is that
// of the ball round center_of_mass_m that holds it: what can only reckon with a ball has no smaller one.
Goal read_any_goal(const Node& table, const Scene& scene, const std::string& name) {
  const Box& bounds = scene.bounds_m;
  Goal goal;
  goal.center_of_mass_m = vector(table, "center_of_mass_m");
  const std::optional<double> radius = maybe_number(table, "radius_m");
  if (radius.has_value() == (table.find("box_m") != nullptr))
    complain(table,
             fmt::format("the {} needs either radius_m or box_m; write for example radius_m = 0.5", name));
  if (radius) goal.radius_m = *radius;
  if (table.find("box_m")) {
    goal.box_m = box(table, "box_m");
    const Vec3 reach =
        (goal.box_m->upper - goal.center_of_mass_m).cwiseMax(goal.center_of_mass_m - goal.box_m->lower);
    goal.radius_m = reach.norm();
    if ((goal.center_of_mass_m.array() < goal.box_m->lower.array()).any() ||
        (goal.center_of_mass_m.array() > goal.box_m->upper.array()).any())
      complain(child(table, "box_m"),
               fmt::format("{0}.center_of_mass_m is not in {0}.box_m; move one of them", name));
  }
  for (const auto& [key, index] : {std::pair("above", &goal.above),
                                   {"below", &goal.below},
                                   {"clear_of", &goal.clear_of},
                                   {"moves_with", &goal.moves_with}})
    if (const Node* body = table.find(key))
      *index = other_body(*body, scene, fmt::format("{}.{}", name, key));
  if (table.find("through"))
    for (const Node& ring : list(table, "through"))
      ++goal.through[other_body(ring, scene, name + ".through")];
  for (int i = 0; i < 3; ++i)
    if (goal.center_of_mass_m[i] < bounds.lower[i] || goal.center_of_mass_m[i] > bounds.upper[i])
      complain(child(table, "center_of_mass_m"),
               fmt::format(
                   "the {} is outside the bounds: {} = {} is not between {} and {}; move the {} or enlarge "
                   "world.bounds_m",
                   name, "xyz"[i], goal.center_of_mass_m[i], bounds.lower[i], bounds.upper[i], name));
  return goal;
}

// It is blown up while it is held in the goal.
void require_of_balloon(const Node& volume, const Node& planner, const Goal& goal) {
  if (!(number(planner, "max_pressure_pa") > 0))
    complain(volume, "nothing blows the robot up; write planner.max_pressure_pa, or leave goal.volume out");
  if (!(number(planner, "settle_time_s") > 0))
    complain(volume,
             "planner.settle_time_s is 0, so there is no time to blow the robot up; raise it, or leave "
             "goal.volume out");
  if (goal.shape || !flag(planner, "settle_hold"))
    complain(volume,
             "the robot is drawn into its shape in the goal, which it cannot keep when it is blown up; write "
             "planner.settle_hold = true and leave goal.shape out");
}

Goal read_goal(const Node& root, const Scene& scene) {
  const Node& table = child(root, "goal");
  Goal goal = read_any_goal(table, scene, "goal");
  if (const Node* shape = table.find("shape")) goal.shape = read_goal_shape(*shape, child(root, "planner"));
  goal.lost_below_m = maybe_number(table, "lost_below_m");
  goal.volume = maybe_number(table, "volume").value_or(0);
  if (goal.volume > 0) require_of_balloon(child(table, "volume"), child(root, "planner"), goal);
  if (goal.lost_below_m && goal.moves_with < 0)
    complain(child(table, "lost_below_m"), "goal.lost_below_m goes with goal.moves_with only; remove it");
  if (goal.moves_with >= 0 && number(child(root, "planner"), "settle_time_s") > 0)
    complain(child(table, "moves_with"),
             "the robot cannot come to rest in a goal that moves; write planner.settle_time_s = 0");
  return goal;
}

std::vector<Via> read_via(const Node& root, const Scene& scene) {
  std::vector<Via> all;
  for (const Node& table : list(root, "via")) {
    const Via& via = all.emplace_back(Via{read_any_goal(table, scene, "via"), flag(table, "rest")});
    if (!via.rest) continue;
    if (via.goal.moves_with >= 0)
      complain(child(table, "rest"), "the robot cannot come to rest in a via that moves; write rest = false");
    if (number(child(root, "planner"), "settle_time_s") == 0)
      complain(child(table, "rest"),
               "planner.settle_time_s is 0, so the robot has no time to come to rest; raise it, or write "
               "rest = false");
  }
  return all;
}

}  // namespace

// Without a goal nothing is searched, and all that belongs to a search may lack.
void read_goals(const Node& root, Scene& scene, const Complaints& complaints) {
  if (!root.find("goal")) {
    std::vector<std::string> lacks{"[goal]"};
    if (!root.find("planner")) lacks.push_back("[planner]");
    if (scene.bodies[std::size_t(scene.robot)].role != Role::robot)
      lacks.push_back("a body with role = \"robot\"");
    scene.lacks = fmt::format(
        "{}: the scene can only be simulated (limber simulate); to be planned it lacks {}; add {}",
        root.where.text(), fmt::join(lacks, ", "), lacks.size() == 1 ? "it" : "them");
    if (!list(root, "via").empty())
      complaints.during([&] {
        complain(list(root, "via").front(), "[[via]] are goals before [goal], and there is none; add [goal]");
      });
    return;
  }
  if (!root.find("planner")) {
    complaints.during(
        [&] { complain(root, "the scene lacks \"planner\" (how the motion is searched); add [planner]"); });
    return;
  }
  complaints.during([&] { scene.via = read_via(root, scene); });
  complaints.during([&] { scene.goal = read_goal(root, scene); });
  complaints.during([&] {
    const Node& planner = child(root, "planner");
    if (number(planner, "max_pressure_pa") > 0 && scene.bodies[std::size_t(scene.robot)].kind == Kind::rigid)
      complain(child(planner, "max_pressure_pa"),
               "the robot is rigid, which no pressure blows up; make it soft, or leave max_pressure_pa out");
  });
}

// Keys that only have a meaning together are checked together: guidance needs a lag, and what ends a push on
// its way needs looks at it.
namespace {

// What leads is a part; interpolation, holding and coming to rest are of the whole robot's centre of mass.
void require_of_lead(const PlannerSpec& planner, const Node& table) {
  const Node& lead = child(table, "lead");
  if (planner.patches_m.empty())
    complain(
        lead,
        "planner.lead needs a patch that leads; write for example planner.patches_m = [[[0, 0, 0], [1, 1, "
        "1]]]");
  if (planner.weight_interpolation > 0)
    complain(lead,
             "interpolation draws the centre of mass to the goal, and a patch leads; write "
             "planner.weights.interpolation = 0");
  if (planner.settle_time_s > 0)
    complain(lead,
             "the robot is brought to rest by its centre of mass, and a patch leads; write "
             "planner.settle_time_s = 0");
}

void require_of_carry(const PlannerSpec& planner, const Node& table) {
  const Node& carry = child(table, "carry");
  if (planner.patches_m.size() != 2)
    complain(carry,
             fmt::format(
                 "planner.carry needs two patches, and planner.patches_m has {}; write one for each carrier",
                 planner.patches_m.size()));
  if (planner.lead)
    complain(carry, "a patch that leads, and two that carry, exclude one another; leave lead or carry out");
  if (planner.weight_control_point == 0)
    complain(carry, "carriers push at control points, and planner.weights.control_point is 0; make it > 0");
}

}  // namespace

PlannerSpec read_planner(const Node& table) {
  PlannerSpec planner;
  planner.preset = text(table, "preset");
  planner.seed = std::int64_t(number(table, "seed"));
  planner.iterations = integer(table, "iterations");
  planner.goal_bias = number(table, "goal_bias");
  const Node& weights = child(table, "weights");
  planner.weight_body = number(weights, "body");
  planner.weight_control_point = number(weights, "control_point");
  planner.weight_interpolation = number(weights, "interpolation");
  if (!(planner.weight_body + planner.weight_control_point > 0))
    complain(
        weights,
        "planner.weights of body and control_point are both 0, so nothing could drive the robot anywhere but "
        "to the goal; make one of them > 0");
  planner.max_force_n = number(table, "max_force_n");
  planner.max_pressure_pa = number(table, "max_pressure_pa");
  const Eigen::Vector2d share = vector2(table, "force_share"), duration = vector2(table, "duration_s");
  planner.min_force_share = share[0], planner.max_force_share = share[1];
  planner.min_duration_s = duration[0], planner.max_duration_s = duration[1];
  planner.control_point_radius_m = number(table, "control_point_radius_m");
  planner.patches_m = read_boxes(table, "patches_m");
  planner.lead = flag(table, "lead"), planner.carry = flag(table, "carry");
  if (const Node* patches = table.find("patches_m")) planner.patches_where = patches->where.text();
  planner.settle_time_s = number(table, "settle_time_s");
  planner.settle_speed_m_s = number(table, "settle_speed_m_s");
  planner.settle_force_share = number(table, "settle_force_share");
  planner.settle_hold = flag(table, "settle_hold");
  planner.lag = integer(table, "lag");
  planner.metric = text(table, "metric");
  planner.time_weight = number(table, "time_weight");
  planner.guidance = number(table, "guidance");
  planner.soft_price = number(table, "soft_price");
  planner.density_price = number(table, "density_price");
  planner.look_s = number(table, "look_s");
  planner.learn_prices = flag(table, "learn_prices");
  planner.steer = flag(table, "steer");
  planner.stop_in_goal = flag(table, "stop_in_goal");
  planner.hold = flag(table, "hold");
  planner.end_hopeless = flag(table, "end_hopeless");
  if (planner.guidance > 0 && planner.lag == 0)
    complain(child(table, "guidance"),
             "guidance needs planner.lag of at least 1; write lag = 31, or guidance = 0");
  if (planner.look_s == 0 && (planner.stop_in_goal || planner.end_hopeless))
    complain(child(table, planner.stop_in_goal ? "stop_in_goal" : "end_hopeless"),
             "stop_in_goal and end_hopeless need pushes that are looked at; write planner.look_s = 0.1");
  planner.shortcut_rounds = integer(table, "shortcut_rounds");
  if (planner.lead) require_of_lead(planner, table);
  if (planner.carry) require_of_carry(planner, table);
  return planner;
}

}  // namespace limber::scenes
