// What a goal asks for besides the place of the robot.
#include <gtest/gtest.h>

#include <numbers>

#include "core/error.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "limber/detail/world/fem_system.h"
#include "plan/control_rollout.h"
#include "plan/search.h"
#include "scenes/shapes.h"
#include "tests/fem/worlds.h"

namespace limber::detail {
namespace {

using fem::testing::alone;
using fem::testing::grid;

// A brick alone, and a slab half a metre below it.
fem::WorldSpec brick_over_slab() {
  fem::WorldSpec spec =
      alone({"robot", grid({0, 0, 1}, {0.6, 0.4, 0.2}, 3, 2, 1), {}, {}, fem::BodyKind::deformable});
  spec.bodies.push_back({"slab", grid({-1, -1, 0}, {2, 2, 0.5}, 2, 2, 1), {}, {}, fem::BodyKind::immovable});
  return spec;
}

Points turned(const Points& p, const Vec3& axis, double deg) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(deg * std::numbers::pi / 180, axis.normalized()).toRotationMatrix();
  return p * turn.transpose();
}

State with_robot_at(const fem::World& world, const Points& places) {
  State state = fem::rest_state(world);
  for (int n = 0; n < places.rows(); ++n)
    for (int c = 0; c < 3; ++c)
      state.positions[std::size_t(3 * (world.bodies[0].first_node + n) + c)] = float(places(n, c));
  return state;
}

TEST(Goal, TurnAndShapeAreMeasuredFromTheGoalShape) {
  fem::WorldSpec spec = brick_over_slab();
  const Points rest = spec.bodies[0].cage.positions;
  const Vec3 axis(1, 2, -1);
  spec.goal_shape_m = turned(rest, axis, 70);
  const fem::World world = fem::build_world(spec);
  EXPECT_NEAR(fem::turn_from_goal_shape_deg(world, fem::rest_state(world)), 70, 1e-3);
  for (const double deg : {0.0, 40.0, 70.0, 100.0}) {
    Points now = turned(rest, axis, deg);
    now.rowwise() += Eigen::RowVector3d(5, 6, 7);  // its place does not count
    EXPECT_NEAR(fem::turn_from_goal_shape_deg(world, with_robot_at(world, now)), std::abs(70 - deg), 0.05)
        << deg;
    EXPECT_EQ(fem::distance_from_goal_shape_m(world, with_robot_at(world, now)) < 1e-5, deg == 70.0);
  }
  // With a half turn it may be so as well, and nothing else changes.
  const Vec3 half_axis = Vec3(2, -1, 3).normalized();
  const Points half = turned(turned(rest, axis, 70), half_axis, 180);
  GoalRules rules;
  rules.turn_tolerance_deg = 1, rules.shape_tolerance_m = 0.01;
  const FemSystem as_it_is(world, rules);
  rules.half_turn = half_axis;
  const FemSystem also_turned(world, rules);
  EXPECT_NE(as_it_is.hash(), also_turned.hash()) << "another search";
  EXPECT_TRUE(as_it_is.goal_holds(with_robot_at(world, turned(rest, axis, 70))));
  EXPECT_TRUE(also_turned.goal_holds(with_robot_at(world, turned(rest, axis, 70))));
  EXPECT_FALSE(as_it_is.goal_holds(with_robot_at(world, half)));
  EXPECT_TRUE(also_turned.goal_holds(with_robot_at(world, half)));
  EXPECT_FALSE(also_turned.goal_holds(fem::rest_state(world)));
  // A stretch along x by 1.1 moves the ends, 0.3 m from the middle, by 3 cm; it does not turn.
  spec.goal_shape_m = rest;
  const fem::World upright = fem::build_world(spec);
  const State stretched = with_robot_at(upright, rest * Vec3(1.1, 1, 1).asDiagonal());
  EXPECT_NEAR(fem::distance_from_goal_shape_m(upright, stretched), 0.03, 1e-6);
  EXPECT_NEAR(fem::turn_from_goal_shape_deg(upright, stretched), 0, 0.05);
}

TEST(Goal, PredicatesAreAboutAllOfABody) {
  const fem::World world = fem::build_world(brick_over_slab());
  const auto at_height = [&](double z) {
    Points p = world.bodies[0].cage.positions;
    p.col(2).array() += z - 1;
    return with_robot_at(world, p);
  };
  GoalRules above, below, clear;
  above.above = below.below = clear.clear_of = 1;
  const FemSystem is_above(world, above), is_below(world, below), is_clear(world, clear);
  for (const double bottom : {-1.0, -0.21, -0.19, 0.3, 0.49, 0.51, 2.0}) {
    const State state = at_height(bottom);
    EXPECT_EQ(is_above.goal_holds(state), bottom > 0.5) << bottom;
    EXPECT_EQ(is_below.goal_holds(state), bottom < -0.2) << bottom;
  }
  EXPECT_TRUE(is_clear.goal_holds(at_height(0.6)));
  EXPECT_FALSE(is_clear.goal_holds(at_height(0.45)));
  EXPECT_NE(is_above.hash(), is_below.hash()) << "another goal is another search";
}

TEST(Goal, ABalloonIsBlownUpSoFar) {
  const fem::World world = fem::build_world(brick_over_slab());
  GoalRules rules;
  rules.volume = 1.5;
  const FemSystem blown(world, rules), any(world, {});
  for (const double stretch : {1.0, 1.14, 1.15, 1.3}) {
    const State state = with_robot_at(world, stretch * world.bodies[0].cage.positions);
    EXPECT_EQ(blown.goal_holds(state), stretch * stretch * stretch >= 1.5) << stretch;
    EXPECT_TRUE(any.goal_holds(state));
  }
  EXPECT_NE(blown.hash(), any.hash());
}

// A ring of radius 0.5 m in the plane x = 0, and a cord of 4 m beside it, in it, or bent so that it goes
// there and back, through the hole or round it.
TEST(Goal, PiecesInTheHoleOfARingAreCounted) {
  scenes::TubeModel circle{{}, 0.1, 0, 0.05};
  for (int i = 0; i <= 8; ++i) {
    const double angle = std::numbers::pi / 4 * (i % 8);
    circle.path_m.emplace_back(0, 0.5 * std::cos(angle), 0.5 * std::sin(angle));
  }
  fem::WorldSpec spec =
      alone({"robot", grid({-2, 1.5, -0.05}, {4, 0.1, 0.1}, 40, 1, 1), {}, {}, fem::BodyKind::deformable});
  spec.bodies.push_back(
      {"ring", scenes::make_tube_cage(circle, {1, 1, 16}), {}, {}, fem::BodyKind::immovable});
  const fem::World world = fem::build_world(spec);
  const fem::Hole hole = fem::hole_of(world, fem::rest_state(world), 1);
  EXPECT_NEAR(std::abs(hole.normal.x()), 1, 1e-6);
  EXPECT_NEAR(hole.radius_m, 0.5, 0.02);
  const Points rest = world.bodies[0].cage.positions;
  const auto at = [&](double first_y, double second_y, bool bent) {
    Points p = rest;
    for (Eigen::Index n = 0; n < p.rows(); ++n) {
      const double along = rest(n, 0);
      if (bent) p(n, 0) = 1 - std::abs(along);
      p(n, 1) += (bent && along > 0 ? second_y : first_y) - 1.55;
    }
    return with_robot_at(world, p);
  };
  // Led by its end at x = 2; through and back it is a bight, which can be drawn out.
  const int there = hole.normal.x() > 0 ? 1 : -1;
  const std::tuple<State, int, plan::Windings, const char*> cases[] = {
      {at(0.8, 0, false), 0, {}, "beside it"},
      {at(0, 0, false), 1, {there}, "through it"},
      {at(-0.2, 0.2, true), 2, {}, "through it and back"},
      {at(-0.2, 0.8, true), 1, {there}, "through it and back round it"},
      {at(0.8, 0.2, true), 1, {-there}, "round it and back through it"},
      {at(0.8, 1.1, true), 0, {}, "there and back beside it"}};
  for (const auto& [state, pieces, windings, what] : cases) {
    EXPECT_EQ(fem::pieces_through(world, state, 1), pieces) << what;
    GoalRules led;
    led.through = {{1, 1}}, led.lead = true, led.patches_m = {{Vec3(1.85, 1, -1), Vec3(2.1, 2, 1)}};
    EXPECT_EQ(FemSystem(world, led).windings(state), windings) << what;
    for (const int asked : {1, 2}) {
      GoalRules rules;
      rules.through = {{1, asked}};
      EXPECT_EQ(FemSystem(world, rules).goal_holds(state), pieces == asked) << what;
    }
  }
}

// A search whose robot would lean on a plate does not, where the plate may bear little: no node of its tree
// and no frame of its path is a state in which more presses it.
TEST(Goal, NoSearchPressesABodyByMoreThanItMayBear) {
  const auto most_of_plan = [](double max_contact_load_n) {
    fem::WorldSpec spec = fem::testing::barriers();
    spec.bodies[1].max_contact_load_n = max_contact_load_n;
    const fem::World world = fem::build_world(spec);
    const FemSystem system(world);
    plan::Settings s;
    s.goal.center_of_mass_m = Vec3(9, 1.5, 1.5), s.goal.radius_m = 0.4;
    s.seed = 4, s.max_force_n = 200, s.max_iterations = 100, s.goal_bias = 0.5;
    const plan::Plan p = plan::plan(system, s);
    double most = 0;
    const auto look = [&](const State& state) {
      most = std::max(most, fem::contact_loads_n(world, fem::contact_forces(world, state))[1]);
    };
    for (int n = 0; n < p.tree.size(); ++n) look(p.tree.states[std::size_t(n)]);
    for (const State& state : p.trajectory.frames) look(state);
    EXPECT_GT(p.tree.size(), 10);
    return std::pair(most, system.hash());
  };
  const auto [freely, free_hash] = most_of_plan(std::numeric_limits<double>::infinity());
  ASSERT_GT(freely, 40);
  const double limit = 0.8 * freely;
  const auto [gently, gentle_hash] = most_of_plan(limit);
  EXPECT_GT(gently, 0) << "it still touches";
  EXPECT_LE(gently, limit);
  EXPECT_NE(free_hash, gentle_hash) << "another limit is another search";
}

// The whole way: the robot is asked to end turned by a right angle, in a box.
TEST(Goal, TheRobotComesToRestTurnedInTheBox) {
  fem::WorldSpec spec = brick_over_slab();
  spec.goal_shape_m = turned(spec.bodies[0].cage.positions, Vec3::UnitZ(), 90);
  const fem::World world = fem::build_world(spec);
  GoalRules rules;
  rules.turn_tolerance_deg = 5;
  const FemSystem system(world, rules);
  plan::Settings s;
  s.goal.center_of_mass_m = Vec3(1, 0.5, 2), s.goal.radius_m = 1;
  s.goal.box_m = Box{Vec3(0.9, 0.3, 1.8), Vec3(1.2, 0.6, 2.1)};
  s.seed = 3, s.max_force_n = 60, s.max_iterations = 60, s.goal_bias = 0.5, s.settle.max_duration_s = 6;
  s.weights.interpolation = 3;
  const plan::Plan p = plan::plan(system, s);
  ASSERT_TRUE(p.solved()) << plan::explain(p);
  const State& end = p.trajectory.end;
  EXPECT_LE(fem::turn_from_goal_shape_deg(world, end), 5);
  const Vec3 center = system.robot_center(end);
  EXPECT_TRUE((center.array() >= s.goal.box_m->lower.array()).all() &&
              (center.array() <= s.goal.box_m->upper.array()).all());
  EXPECT_LT(system.mean_speed(end), s.settle.mean_speed_m_s);
  s.search_options.hold = s.settle.hold = true;  // held, it never turns
  EXPECT_FALSE(plan::plan(system, s).solved());
}

// Pushed out of all measure, rollouts diverge between looks; the search goes on without them.
TEST(Goal, RolloutsThatDivergeOnTheirWayAreOnlyCounted) {
  const fem::World world = fem::build_world(brick_over_slab());
  const FemSystem system(world);
  plan::Settings s;
  s.goal.center_of_mass_m = Vec3(1, 0.5, 2), s.goal.radius_m = 1e-9;
  s.max_force_n = 1e12, s.max_iterations = 40;
  s.search_options = {.lag = 3,
                      .guidance = 0.7,
                      .soft_price = 10,
                      .look_s = 0.02,
                      .stop_in_goal = true,
                      .end_hopeless = true};
  const plan::Plan p = plan::plan(system, s);
  EXPECT_FALSE(p.solved());
  EXPECT_GT(p.statistics.diverged, 10);
}

// A robot that arrives turned rests as it is where the settle holds it; interpolation turns it upright.
TEST(Goal, TheSettleHoldsARobotInWhateverTurnItIs) {
  const fem::World world = fem::build_world(brick_over_slab());
  const FemSystem system(world);
  const Vec3 middle(0.3, 0.2, 1.1);
  Points p = world.bodies[0].cage.positions.rowwise() - middle.transpose();
  p = turned(p, Vec3::UnitX(), 60).rowwise() + middle.transpose();
  plan::ControlRollout arriving;
  arriving.from = with_robot_at(world, p);
  const fem::Body& robot = world.bodies[0];
  for (int n = 0; n < robot.node_count(); ++n)
    arriving.from.velocities[std::size_t(3 * (robot.first_node + n))] = 0.1f;
  plan::Settings s;
  s.goal.center_of_mass_m = middle, s.goal.radius_m = 0.1, s.max_force_n = 20, s.settle.max_duration_s = 8;
  for (const bool hold : {true, false}) {
    s.settle.hold = hold;
    plan::ControlRollout course = arriving;
    plan::run(system, s, {&course, 1}, {.ask_acceptable = false});
    EXPECT_EQ(course.result, plan::ControlRollout::rests_in_goal) << hold;
    EXPECT_NEAR(fem::turn_from_goal_shape_deg(world, course.end), hold ? 60 : 0, 5) << hold;
  }
}

// A rod that is pushed at its ends alone and led by one of them: that end goes to the goal, wherever the
// middle of the rod is, and no other node is pushed.
TEST(Goal, APatchThatLeadsIsWhatGoesToTheGoal) {
  const fem::World world = fem::build_world(
      alone({"robot", grid({-1, -0.1, -0.1}, {2, 0.2, 0.2}, 10, 1, 1), {}, {}, fem::BodyKind::deformable}));
  GoalRules rules;
  rules.patches_m = {Box{Vec3(0.95, -1, -1), Vec3(1.05, 1, 1)}, Box{Vec3(-1.05, -1, -1), Vec3(-0.95, 1, 1)}};
  rules.lead = true;
  const FemSystem system(world, rules);
  EXPECT_LT((system.robot_center(system.start()) - Vec3(1, 0, 0)).norm(), 1e-6);
  plan::Settings s;
  s.goal.center_of_mass_m = Vec3(1.5, 1.5, 0), s.goal.radius_m = 0.3;
  s.seed = 2, s.max_force_n = 20, s.max_iterations = 400, s.settle.max_duration_s = 0;
  s.weights = {.body = 0, .control_point = 1, .interpolation = 0};
  const plan::Plan p = plan::plan(system, s);
  ASSERT_TRUE(p.solved()) << plan::explain(p);
  const State& end = p.trajectory.end;
  const Points rest = world.bodies[0].cage.positions, now = fem::body_positions(world, end, 0);
  Vec3 tip = Vec3::Zero();
  int tips = 0;
  double weight = 0;
  for (int n = 0; n < rest.rows(); ++n)
    if (rest(n, 0) > 0.99) {
      const double mass = world.bodies[0].node_mass_kg[std::size_t(n)];
      tip += mass * now.row(n).transpose(), weight += mass, ++tips;
    }
  EXPECT_EQ(tips, 4);
  EXPECT_LE((tip / weight - s.goal.center_of_mass_m).norm(), 0.3);
  EXPECT_GT((fem::center_of_mass_m(world, end, 0) - s.goal.center_of_mass_m).norm(), 0.5);
  int pushes = 0;
  for (const Control& control : p.tree.controls)
    if (control.manipulation == Manipulation::control_point) {
      ++pushes;
      EXPECT_GT(std::abs(rest(control.node, 0)), 0.99) << control.node;
    }
  EXPECT_GT(pushes, 5);
  rules.lead = false;
  EXPECT_NE(FemSystem(world, rules).hash(), system.hash());
}

// A rod in the hands of two carriers, one at each end, is turned to where its ends are to be: each push has
// both hands in it, and neither is stronger than may be.
TEST(Goal, TwoCarriersTurnARod) {
  fem::WorldSpec spec =
      alone({"robot", grid({-1, -0.1, -0.1}, {2, 0.2, 0.2}, 10, 1, 1), {}, {}, fem::BodyKind::deformable});
  const Points rest = spec.bodies[0].cage.positions;
  spec.goal_shape_m = rest;
  spec.goal_shape_m.col(0) = -rest.col(1), spec.goal_shape_m.col(1) = rest.col(0);
  const fem::World world = fem::build_world(spec);
  GoalRules rules;
  rules.patches_m = {Box{Vec3(-1.05, -1, -1), Vec3(-0.95, 1, 1)}, Box{Vec3(0.95, -1, -1), Vec3(1.05, 1, 1)}};
  rules.carry = true, rules.turn_tolerance_deg = 30;
  const FemSystem system(world, rules);
  ASSERT_NE(system.carriers(), nullptr);
  for (const int i : {0, 1}) {
    const plan::NodePlace at = system.node_place(system.start(), system.carriers()->nodes[std::size_t(i)]);
    EXPECT_NEAR(at.place.x(), i == 0 ? -1 : 1, 1e-6);
    EXPECT_NEAR(system.carriers()->goals[std::size_t(i)].y(), i == 0 ? -1 : 1, 1e-6);
  }
  plan::Settings s;
  s.goal.center_of_mass_m = Vec3(0.5, 0.5, 0), s.goal.radius_m = 0.3;
  s.seed = 1, s.max_force_n = 20, s.max_iterations = 1000, s.settle.max_duration_s = 0;
  s.goal_bias = 0.3;
  s.weights = {.body = 0, .control_point = 1, .interpolation = 0};
  s.search_options.metric = plan::Metric::time_to_go, s.search_options.steer = true;
  const plan::Plan p = plan::plan(system, s);
  ASSERT_TRUE(p.solved()) << plan::explain(p);
  EXPECT_LE(fem::turn_from_goal_shape_deg(world, p.trajectory.end), 30);
  int pushes = 0, differ = 0;
  for (const Control& control : p.tree.controls) {
    if (control.manipulation == Manipulation::none) continue;  // the root's
    ++pushes, differ += (control.force_n - control.second_force_n).norm() > 1;
    EXPECT_EQ(control.node, system.carriers()->nodes[0]);
    EXPECT_EQ(control.second_node, system.carriers()->nodes[1]);
    EXPECT_LE(largest_force(control), 20);
  }
  EXPECT_GT(pushes, 5);
  EXPECT_GT(differ, pushes / 2);
  rules.carry = false;
  EXPECT_NE(FemSystem(world, rules).hash(), system.hash());
}

// Where no rest is asked for, what else the goal asks still counts.
TEST(Goal, WithoutASettleTheGoalIsStillAsked) {
  const fem::World world = fem::build_world(brick_over_slab());
  plan::Settings s;
  s.goal.center_of_mass_m = Vec3(0.3, 0.2, 1.1), s.goal.radius_m = 0.1;  // where it starts
  s.max_iterations = 0, s.settle.max_duration_s = 0;
  GoalRules above, below;
  above.above = 1, below.below = 1;
  EXPECT_TRUE(plan::plan(FemSystem(world, above), s).solved());
  EXPECT_FALSE(plan::plan(FemSystem(world, below), s).solved());
}

// Goals in a row have rules of their own; the dynamics are the same.
TEST(Goal, EachLegAsksWhatItsGoalAsks) {
  const fem::World world = fem::build_world(brick_over_slab());
  GoalRules above, above_then_below;
  above.above = 1;
  above_then_below.via = {above};
  above_then_below.below = 1;
  const FemSystem system(world, above_then_below), last_alone(world, [] {
    GoalRules below;
    below.below = 1;
    return below;
  }());
  Points p = world.bodies[0].cage.positions;
  const State high = with_robot_at(world, p);
  p.col(2).array() -= 1.3;
  const State low = with_robot_at(world, p);
  EXPECT_TRUE(system.on_leg(0).goal_holds(high));
  EXPECT_FALSE(system.on_leg(0).goal_holds(low));
  EXPECT_FALSE(system.on_leg(1).goal_holds(high));
  EXPECT_TRUE(system.on_leg(1).goal_holds(low));
  EXPECT_EQ(&system.on_leg(1), &system);
  EXPECT_NE(system.hash(), last_alone.hash()) << "other goals on the way are another search";
}

// A block falls onto the floor and bounces back: who looks only at the end of a push does not see that the
// goal was lost on the way.
TEST(Goal, ALookSeesThatTheGoalIsLost) {
  fem::WorldSpec spec =
      alone({"robot", grid({0, 0, 3}, {0.6, 0.4, 0.2}, 3, 2, 1), {}, {}, fem::BodyKind::deformable});
  fem::Material springy;
  springy.damping_ratio = 0;
  spec.bodies.push_back(
      {"block", grid({2, 2, 0.5}, {1, 1, 1}, 2, 2, 2), springy, {}, fem::BodyKind::deformable});
  spec.bounds_m = {Vec3(-4, -4, 0), Vec3(8, 8, 8)}, spec.walls = true;
  spec.gravity_m_s2 = Vec3(0, 0, -1);
  const fem::World world = fem::build_world(spec);
  const auto lowest = [&](const State& s) { return fem::body_positions(world, s, 1).col(2).minCoeff(); };

  // Step by step: it lands, and rises again.
  const FemSystem free(world);
  const int piece = plan::steps_of(0.01, free.dt_s());
  State state = free.start();
  const auto propagator = free.make_propagator();
  double least = lowest(state);
  while (lowest(state) < least + 0.1) {
    plan::Rollout rollout{&state, {}, {}, false};
    rollout.control.steps = piece;
    propagator->propagate({&rollout, 1});
    ASSERT_TRUE(rollout.ok);
    ASSERT_LT(rollout.to.step, 5000 * piece) << "it does not bounce";
    const State next = rollout.to;
    state = next;
    least = std::min(least, lowest(state));
  }
  GoalRules rules;
  rules.body = 1, rules.lost_below_m = least + 0.05;
  const FemSystem system(world, rules);
  ASSERT_TRUE(system.acceptable(state)) << "after the bounce";

  plan::Settings s;
  s.goal.center_of_mass_m = Vec3(0.3, 0.2, 7), s.goal.radius_m = 0.01;
  s.max_force_n = 1, s.max_iterations = 3, s.settle.max_duration_s = 0;
  s.min_duration_s = s.max_duration_s = double(state.step) * system.dt_s();
  s.search_options.look_s = 0.02;
  const plan::Plan p = plan::plan(system, s);
  EXPECT_EQ(p.statistics.rejected, 3);
  EXPECT_EQ(p.tree.size(), 1);
  EXPECT_LT(p.statistics.rollout_steps, 3 * state.step)
      << "it goes no further than it can be seen to be lost";
}

TEST(Goal, AShapeOfAnotherCageIsRefused) {
  fem::WorldSpec spec = brick_over_slab();
  spec.goal_shape_m = Points::Zero(3, 3);
  EXPECT_THROW(fem::build_world(spec), InputError);
}

}  // namespace
}  // namespace limber::detail
