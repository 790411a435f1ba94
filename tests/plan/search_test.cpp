#include "plan/search.h"

#include <gtest/gtest.h>

#include <csignal>
#include <stdexcept>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::sequential_tree;
using testing::Threads;
using testing::Toy;
using testing::toy_settings;

// Each law below is checked on each of these.
void for_each_toy(const std::function<void(Toy&)>& law) {
  {
    SCOPED_TRACE("free point");
    Toy toy(1, false, false, 99);
    law(toy);
  }
  {
    SCOPED_TRACE("point and wall");
    Toy toy(1, true, false, 99);
    law(toy);
  }
  {
    SCOPED_TRACE("chain and wall, lava and a forbidden height");
    Toy toy(5, true, true, 1.6f);
    law(toy);
  }
}

TEST(Search, GrowsTheTreeOfTheSequentialAlgorithm) {
  for_each_toy([](Toy& toy) {
    const std::uint64_t expected = hash_of(sequential_tree(toy, toy_settings()));
    const Plan p = plan(toy, toy_settings());
    EXPECT_TRUE(p.solved());
    EXPECT_EQ(hash_of(p.tree), expected);
  });
}

TEST(Search, SameBytesForAnyNumberInFlightThreadsAndLanes) {
  for_each_toy([](Toy& toy) {
    Settings s = toy_settings();
    s.in_flight = 1;
    const Plan one = plan(toy, s);
    EXPECT_EQ(one.statistics.rollouts_wrong, 0);
    EXPECT_EQ(one.statistics.rollouts, one.statistics.iterations);
    const std::uint64_t tree = hash_of(one.tree), trajectory = hash_of(one.trajectory);
    for (const int threads : {1, 2})
      for (const int in_flight : {0, 1, 2, 7, 32})
        for (const int lanes : {1, 3, 16}) {
          const Threads limited(threads);
          toy.jitter = threads > 1;
          toy.lanes_wanted = lanes;
          s.in_flight = in_flight;
          const Plan many = plan(toy, s);
          ASSERT_EQ(hash_of(many.tree), tree) << threads << ' ' << in_flight << ' ' << lanes;
          ASSERT_EQ(hash_of(many.trajectory), trajectory);
          ASSERT_EQ(many.goal_node, one.goal_node);
          ASSERT_EQ(many.statistics.iterations, one.statistics.iterations);
          ASSERT_EQ(many.statistics.diverged, one.statistics.diverged);
          ASSERT_EQ(many.statistics.rejected, one.statistics.rejected);
          ASSERT_EQ(many.statistics.rollout_steps, one.statistics.rollout_steps);
          // Without wrong guesses to mend this test would prove nothing.
          if (in_flight == 32 && lanes == 16) {
            ASSERT_GT(many.statistics.rollouts_wrong, 0);
          }
        }
  });
}

// The goal flees along the corridor: what reaches it is where it is by then, and far from where it was.
TEST(Search, FollowsAGoalThatMoves) {
  for_each_toy([](Toy& toy) {
    toy.goal_velocity_m_s = Vec3(-0.2, 0.1, 0);
    Settings s = toy_settings();
    s.settle.max_duration_s = 0;
    const std::uint64_t expected = hash_of(sequential_tree(toy, s));
    const Plan p = plan(toy, s);
    ASSERT_TRUE(p.solved());
    EXPECT_EQ(hash_of(p.tree), expected);
    s.in_flight = 7;
    EXPECT_EQ(hash_of(plan(toy, s).tree), expected);
    const State reached = p.tree.states[std::size_t(p.goal_node)];
    const Vec3 gap = toy.robot_center(reached) - toy.goal_shift(reached) - s.goal.center_of_mass_m;
    EXPECT_LE(gap.norm(), s.goal.radius_m);
    EXPECT_NEAR(gap.norm(), p.best_distance_m, 1e-12);
    EXPECT_GT(toy.goal_shift(reached).norm(), s.goal.radius_m);

    Settings cut = s;
    cut.max_iterations = p.statistics.iterations / 2;
    EXPECT_EQ(hash_of(plan(toy, s, plan(toy, cut)).tree), expected) << "resumed";
  });
}

// Towards the goal, a push and an interpolation aim at where it is now.
TEST(Expansion, AimsAtTheGoalWhereItHasMovedTo) {
  const Settings s = toy_settings();
  const Vec3 center(1, 2, 1), shift(0.5, -3, 0.25);
  Sample d;
  d.towards_goal = true;
  d.point = s.goal.center_of_mass_m;
  d.force_n = 1;
  d.manipulation = Manipulation::body;
  const Vec3 way = (s.goal.center_of_mass_m + shift - center).normalized();
  EXPECT_LT((control_of(d, s, center, shift).force_n.cast<double>() - way).norm(), 1e-5);
  d.manipulation = Manipulation::interpolation;
  EXPECT_EQ(control_of(d, s, center, shift).target_m, (s.goal.center_of_mass_m + shift).cast<float>());
  d.towards_goal = false;
  d.manipulation = Manipulation::body;
  EXPECT_EQ(control_of(d, s, center, shift).force_n, control_of(d, s, center).force_n);
}

TEST(Search, SeedsDiffer) {
  const Toy toy;
  Settings s = toy_settings();
  const std::uint64_t seven = hash_of(plan(toy, s).tree);
  s.seed = 8;
  EXPECT_NE(hash_of(plan(toy, s).tree), seven);
}

// Every node is its parent's state under its control; the path ends in the goal.
TEST(Search, TreeAndPathAreWhatTheyClaim) {
  for_each_toy([](Toy& toy) {
    const Settings s = toy_settings();
    const Plan p = plan(toy, s);
    ASSERT_TRUE(p.solved());
    EXPECT_EQ(p.ending, Ending::goal);
    EXPECT_EQ(p.goal_node, p.tree.size() - 1) << "the search goes on after the goal";
    EXPECT_EQ(p.statistics.iterations - p.statistics.diverged - p.statistics.rejected, p.tree.size() - 1);
    for (int i = 1; i < p.tree.size(); ++i) {
      const auto k = std::size_t(i);
      const Control& c = p.tree.controls[k];
      State state = p.tree.states[std::size_t(p.tree.parents[k])];
      for (int n = 0; n < c.steps; ++n) ASSERT_TRUE(toy.step(c, state));
      ASSERT_EQ(state, p.tree.states[k]) << i;
      ASSERT_LE(largest_force(c), s.max_force_n);
      ASSERT_GE(c.steps, 20);
      ASSERT_LE(c.steps, 100);
      const double distance = (toy.robot_center(state) - s.goal.center_of_mass_m).norm();
      ASSERT_GE(distance, p.best_distance_m) << i;
      ASSERT_EQ(distance <= s.goal.radius_m, i == p.goal_node) << i;
      ASSERT_TRUE(toy.acceptable(state));
    }
    EXPECT_EQ(p.statistics.diverged > 0, toy.lava);
    EXPECT_EQ(p.statistics.rejected > 0, toy.unacceptable_above_z < 2);
  });
}

// Not only nodes: a push that rises above the forbidden height and falls back between two nodes is none.
TEST(Search, NoFrameOfAPathIsUnacceptable) {
  Toy toy(5, true, false, 1.15f);
  for (const double fps : {30.0, 13.0}) {
    Settings s = toy_settings();
    s.frames_per_second = fps;
    int solved = 0;
    for (s.seed = 1; s.seed <= 20; ++s.seed) {
      const Plan p = plan(toy, s);
      solved += p.solved();
      EXPECT_GT(p.statistics.rejected, 0);
      for (const State& frame : p.trajectory.frames) ASSERT_TRUE(toy.acceptable(frame)) << s.seed;
    }
    EXPECT_GT(solved, 10);
  }
}

// What a propagator tells of the states it shows counts as what the system says of them: the same plans.
TEST(Search, WhatIsNotClearIsNotAcceptable) {
  const Toy says_so(5, true, false, 1.15f);
  Toy shows_it(5, true, false, 99);
  shows_it.not_clear_above_z = 1.15f;
  Settings s = toy_settings();
  for (s.seed = 1; s.seed <= 5; ++s.seed) {
    const Plan one = plan(says_so, s), other = plan(shows_it, s);
    EXPECT_GT(other.statistics.rejected, 0);
    EXPECT_EQ(one.statistics.rejected, other.statistics.rejected);
    EXPECT_EQ(hash_of(one.tree), hash_of(other.tree));
    EXPECT_EQ(hash_of(one.trajectory), hash_of(other.trajectory));
  }
}

TEST(Search, FirstNodeOfAFreePointHasItsClosedForm) {
  Toy toy;
  toy.damping_per_s = 0;
  Settings s = toy_settings();
  s.max_iterations = 1;
  s.weights = {1, 0, 0};
  const Plan p = plan(toy, s);
  ASSERT_EQ(p.tree.size(), 2);
  const Control& c = p.tree.controls[1];
  // v_n = n h a and x_n = x_0 + h² a n(n+1)/2 for semi-implicit Euler under constant acceleration.
  const double h = toy.dt_s(), n = c.steps;
  const Vec3 a = c.force_n.cast<double>() / double(toy.mass_kg), start(1, 1.5, 1);
  const Vec3 moved = toy.robot_center(p.tree.states[1]) - start;
  EXPECT_LT((moved - h * h * a * n * (n + 1) / 2).norm(), 1e-5);
  EXPECT_NEAR(toy.mean_speed(p.tree.states[1]), n * h * a.norm(), 1e-5);
  const Vec3 way = (draw_sample(s, toy, 0).point - start).normalized();
  EXPECT_LT((c.force_n.cast<double>().normalized() - way).norm(), 1e-6);
}

TEST(Search, WithoutPushingNothingReachesTheGoal) {
  const Toy toy;
  Settings s = toy_settings();
  s.max_force_n = 0;
  s.max_iterations = 200;
  const Plan p = plan(toy, s);
  EXPECT_FALSE(p.solved());
  EXPECT_EQ(p.best_node, 0) << "the first of equals";
  EXPECT_DOUBLE_EQ(p.best_distance_m, 8);
}

TEST(Search, AStartInTheGoalNeedsNoIteration) {
  const Toy toy;
  Settings s = toy_settings();
  s.goal.center_of_mass_m = Vec3(1.1, 1.5, 1);
  const Plan p = plan(toy, s);
  EXPECT_TRUE(p.solved());
  EXPECT_EQ(p.statistics.iterations, 0);
  EXPECT_EQ(p.goal_node, 0);
  EXPECT_EQ(p.trajectory.controls.size(), 0u) << "it rests already";
  EXPECT_EQ(p.trajectory.frames.size(), 1u);
}

TEST(Search, LimitsEndItAndAreNamed) {
  const Toy toy(1, true, true, 99);
  Settings s = toy_settings();
  s.max_iterations = 40;
  const Plan by_count = plan(toy, s);
  EXPECT_FALSE(by_count.solved());
  EXPECT_EQ(by_count.ending, Ending::iterations);
  EXPECT_EQ(by_count.statistics.iterations, 40);
  EXPECT_NE(explain(by_count).find("40 iterations"), std::string::npos) << explain(by_count);
  EXPECT_NE(explain(by_count).find("diverged"), std::string::npos) << explain(by_count);

  s.time_limit_s = 0;
  const Plan by_time = plan(toy, s);
  EXPECT_EQ(by_time.ending, Ending::time);
  EXPECT_EQ(by_time.tree.size(), 1);
  EXPECT_EQ(by_time.trajectory.frames.size(), 1u);
  EXPECT_NE(explain(by_time).find("time limit of 0 s"), std::string::npos) << explain(by_time);

  s.time_limit_s = 1e9;
  s.max_iterations = 0;
  EXPECT_EQ(plan(toy, s).tree.size(), 1);
}

TEST(Search, ASignalKeepsWhatIsFinished) {
  for (const int threads : {1, 2}) {
    const Threads limited(threads);
    Toy toy(1, true, false, 99);
    toy.lanes_wanted = 3;
    std::atomic<int> left{40};
    toy.before_each_rollout = [&] {
      if (--left == 0) request_stop(SIGINT);
    };
    const Plan stopped = plan(toy, toy_settings());
    request_stop(0);
    EXPECT_EQ(stopped.ending, Ending::stopped);
    EXPECT_NE(explain(stopped).find("was stopped"), std::string::npos);
    ASSERT_GT(stopped.statistics.iterations, 0);
    ASSERT_LE(stopped.statistics.iterations, 60);
    EXPECT_EQ(limber::hash_of(stopped.trajectory.end),
              limber::hash_of(stopped.tree.states[std::size_t(stopped.best_node)]));
    // It is a prefix of the whole, and goes on to the whole, also without its path.
    toy.before_each_rollout = nullptr;
    const Plan whole = plan(toy, toy_settings());
    Plan without_path = stopped;
    without_path.trajectory = trajectory_to(toy, toy_settings(), stopped.tree, 0, false);
    for (const Plan& plan_so_far : {stopped, without_path}) {
      const Plan resumed = plan(toy, toy_settings(), plan_so_far);
      EXPECT_EQ(hash_of(resumed.tree), hash_of(whole.tree));
      EXPECT_EQ(hash_of(resumed.trajectory), hash_of(whole.trajectory));
    }
  }
}

TEST(Search, AStopSignalLeavesOutAPathThatTakesLonger) {
  Toy toy(1, true, false, 99);
  Settings s = toy_settings();
  s.max_iterations = 40;
  const Plan p = plan(toy, s);
  ASSERT_GT(p.best_node, 0);
  const std::uint64_t whole = hash_of(p.trajectory);
  const auto path_within = [&](double grace_s) {
    return trajectory_within(grace_s, toy, s, p.tree, p.best_node);
  };
  ASSERT_TRUE(path_within(0));
  EXPECT_EQ(hash_of(*path_within(0)), whole);
  request_stop(SIGINT);
  EXPECT_FALSE(path_within(0));
  ASSERT_TRUE(path_within(1e9));
  EXPECT_EQ(hash_of(*path_within(1e9)), whole);
  request_stop(0);
}

TEST(Search, InterruptedAndResumedEqualsUninterrupted) {
  for_each_toy([](Toy& toy) {
    toy.lanes_wanted = 4;
    Settings s = toy_settings();
    const Plan whole = plan(toy, s);
    std::optional<Plan> parts;
    for (const double share : {0.1, 0.4, 0.9}) {
      s.max_iterations = std::int64_t(share * double(whole.statistics.iterations));
      parts = plan(toy, s, std::move(parts));
      EXPECT_FALSE(parts->solved());
    }
    s.max_iterations = toy_settings().max_iterations;
    parts = plan(toy, s, std::move(parts));
    EXPECT_EQ(hash_of(parts->tree), hash_of(whole.tree));
    EXPECT_EQ(hash_of(parts->trajectory), hash_of(whole.trajectory));
    EXPECT_EQ(parts->statistics.iterations, whole.statistics.iterations);
    EXPECT_EQ(parts->statistics.rollout_steps, whole.statistics.rollout_steps);
    // A solved plan is left as it is.
    const Plan again = plan(toy, s, parts);
    EXPECT_EQ(hash_of(again.tree), hash_of(whole.tree));
    EXPECT_EQ(again.statistics.iterations, whole.statistics.iterations);
  });
}

TEST(Search, AnotherWorldOrSettingIsNotResumed) {
  const Toy toy;
  Settings s = toy_settings();
  s.max_iterations = 5;
  const Plan p = plan(toy, s);
  Toy other;
  other.mass_kg = 3;
  EXPECT_THROW(plan(other, s, p), InputError);
  const std::vector<std::function<void(Settings&)>> changes = {
      [](Settings& t) { t.seed = 9; },
      [](Settings& t) { t.goal.radius_m = 0.3; },
      [](Settings& t) { t.goal_bias = 0.2; },
      [](Settings& t) { t.weights.body = 2; },
      [](Settings& t) { t.max_force_n = 9; },
      [](Settings& t) { t.min_force_share = 0.1; },
      [](Settings& t) { t.max_force_share = 0.9; },
      [](Settings& t) { t.min_duration_s = 0.3; },
      [](Settings& t) { t.max_duration_s = 0.9; },
      [](Settings& t) { t.control_point_radius_m = 0.1; },
      [](Settings& t) { t.frames_per_second = 24; }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Settings changed = s;
    changes[i](changed);
    EXPECT_THROW(plan(toy, changed, p), InputError) << "change " << i;
  }
  s.max_iterations = 6, s.in_flight = 3, s.time_limit_s = 100;
  EXPECT_NO_THROW(plan(toy, s, p));
}

TEST(Search, TroubleInTheDynamicsIsPassedOnAndDoesNotHang) {
  for (const int threads : {1, 2}) {
    const Threads limited(threads);
    Toy toy;
    std::atomic<int> left{20};
    toy.before_each_rollout = [&] {
      if (--left == 0) throw std::runtime_error("the dynamics broke");
    };
    EXPECT_THROW(plan(toy, toy_settings()), std::runtime_error);
  }
}

TEST(Trajectory, FramesAreTheStatesAtTheirTimes) {
  const Toy toy(5, true, true, 1.6f);
  Settings s = toy_settings();
  for (const double fps : {30.0, 24.0, 7.0, 250.0}) {
    s.frames_per_second = fps;
    const Trajectory t = plan(toy, s).trajectory;
    // A second way: step by step, no pieces.
    State state = toy.start();
    std::vector<State> at_step{state};
    for (const Control& c : t.controls)
      for (int n = 0; n < c.steps; ++n) {
        ASSERT_TRUE(toy.step(c, state));
        at_step.push_back(state);
      }
    EXPECT_EQ(t.end, state);
    const double duration_s = double(state.step) * toy.dt_s();
    EXPECT_NEAR(double(t.frames.size()), duration_s * fps, 2);
    for (std::size_t f = 0; f < t.frames.size(); ++f) {
      EXPECT_NEAR(double(t.frames[f].step) * toy.dt_s(), double(f) / fps, 0.5 * toy.dt_s() + 1e-9);
      ASSERT_EQ(t.frames[f], at_step.at(std::size_t(t.frames[f].step)));
    }
    const Trajectory again = simulate(toy, t.controls, fps);
    EXPECT_EQ(again.frames, t.frames);
    EXPECT_EQ(again.end, t.end);
  }
}

TEST(Trajectory, SettlesAtTheGoalWithinItsForce) {
  for_each_toy([](Toy& toy) {
    Settings s = toy_settings();
    s.settle.max_duration_s = 10;
    s.settle.max_force_share = 0.5;
    const Plan p = plan(toy, s);
    const Trajectory& t = p.trajectory;
    ASSERT_GT(t.settle_steps, 0);
    EXPECT_EQ(t.controls.back().manipulation, Manipulation::interpolation);
    EXPECT_EQ(t.controls.back().steps, t.settle_steps);
    EXPECT_EQ(t.controls.size(), path_to(p.tree, p.goal_node).size());  // one less than nodes, and the settle
    EXPECT_LE(largest_force(t.controls.back()), 0.5 * s.max_force_n);
    EXPECT_EQ(hash_of(t), hash_of(trajectory_to(toy, s, p.tree, p.goal_node, true)));
    EXPECT_LT(toy.mean_speed(t.end), 0.02);
    EXPECT_LT((toy.robot_center(t.end) - s.goal.center_of_mass_m).norm(), 0.05);

    s.settle.max_duration_s = 0.52;
    EXPECT_EQ(trajectory_to(toy, s, p.tree, p.goal_node, true).settle_steps, 52);
    s.settle.max_duration_s = 0;
    const Plan none = plan(toy, s);
    EXPECT_EQ(none.trajectory.settle_steps, 0);
    EXPECT_EQ(none.trajectory.end, none.tree.states[std::size_t(none.goal_node)]);
  });
}

// A node in the goal is not enough: the robot must be able to stop there.
TEST(Search, PassesOverNodesInTheGoalThatDoNotComeToRest) {
  Toy toy;
  Settings s = toy_settings();
  s.settle.max_duration_s = 0;
  const Plan arrived = plan(toy, s);
  ASSERT_TRUE(arrived.solved());
  ASSERT_GT(toy.mean_speed(arrived.tree.states[std::size_t(arrived.goal_node)]), s.settle.mean_speed_m_s);

  s.settle.max_duration_s = 0.01;  // one step: nobody stops in it
  s.max_iterations = arrived.statistics.iterations;
  const Plan restless = plan(toy, s);
  EXPECT_FALSE(restless.solved());
  EXPECT_LE(restless.best_distance_m, s.goal.radius_m);
  EXPECT_EQ(hash_of(restless.tree), hash_of(arrived.tree));  // what counts as solved does not shape the tree
  EXPECT_NE(explain(restless).find("did not come to rest"), std::string::npos) << explain(restless);

  s.settle.max_duration_s = 10;
  s.max_iterations = 2000;
  const Plan rested = plan(toy, s);
  ASSERT_TRUE(rested.solved());
  EXPECT_LT(toy.mean_speed(rested.trajectory.end), s.settle.mean_speed_m_s);
}

TEST(Trajectory, HashSeesEveryPart) {
  const Toy toy;
  const Trajectory t = plan(toy, toy_settings()).trajectory;
  const std::vector<std::function<void(Trajectory&)>> changes = {[](Trajectory& c) { c.settle_steps = 0; },
                                                                 [](Trajectory& c) { c.frames_per_second = 1; },
                                                                 [](Trajectory& c) { c.controls[0].steps += 1; },
                                                                 [](Trajectory& c) { c.frames.back().velocities[0] += 1; },
                                                                 [](Trajectory& c) { c.frames.pop_back(); },
                                                                 [](Trajectory& c) { c.end.step += 1; }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Trajectory changed = t;
    changes[i](changed);
    EXPECT_NE(hash_of(changed), hash_of(t)) << "change " << i;
  }
}

}  // namespace
}  // namespace limber::plan
