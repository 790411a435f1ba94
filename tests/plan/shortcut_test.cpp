#include "plan/shortcut.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>

#include "core/progress.h"
#include "core/threads.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

constexpr CostKind all_costs[] = {CostKind::duration, CostKind::effort, CostKind::strain, CostKind::volume};

Settings settings_of_seed(std::uint64_t seed) {
  Settings s = toy_settings();
  s.seed = seed;
  return s;
}

// A second way to all that a path promises: step by step, with the toy's own step.
void expect_solves(const Toy& toy, const Settings& s, const Trajectory& t) {
  State state = toy.start();
  std::size_t frame = 0;
  const auto look = [&] {
    if (frame < t.frames.size() && t.frames[frame].step == state.step) {
      EXPECT_TRUE(t.frames[frame] == state) << frame;
      EXPECT_TRUE(toy.acceptable(state)) << frame;
      ++frame;
    }
  };
  const auto distance = [&] { return (toy.robot_center(state) - s.goal.center_of_mass_m).norm(); };
  look();
  for (std::size_t c = 0; c < t.controls.size(); ++c) {
    if (c + 1 == t.controls.size() && t.settle_steps > 0) {
      EXPECT_LE(distance(), s.goal.radius_m) << "before the settle";
    }
    EXPECT_LE(double(largest_force(t.controls[c])), s.max_force_n);
    for (int i = 0; i < t.controls[c].steps; ++i) {
      ASSERT_TRUE(toy.step(t.controls[c], state));
      look();
    }
  }
  EXPECT_EQ(frame, t.frames.size());
  EXPECT_TRUE(state == t.end);
  EXPECT_LE(distance(), s.goal.radius_m);
  EXPECT_LT(toy.mean_speed(state), s.settle.mean_speed_m_s);
}

TEST(Shortcut, WhatIsNotClearIsNotAcceptable) {
  const Toy says_so(5, true, true, 1.05f);
  Toy shows_it(5, true, true, 99);
  shows_it.not_clear_above_z = 1.05f;
  const Settings s = settings_of_seed(7);
  const auto shortened = [&](const Toy& toy) {
    Plan p = plan(toy, s);
    EXPECT_GT(shorten(toy, p, {.rounds = 8}).accepted, 0);
    return hash_of(p.trajectory);
  };
  EXPECT_EQ(shortened(says_so), shortened(shows_it));
}

// Nor does one rise where it may not be shown, if the path that it shortens did not.
TEST(Shortcut, GoesNoWayThatIsRefused) {
  Toy free(1, true, false, 99), low(1, true, false, 99);
  low.refused_above_z = 1.1f;
  Settings s = toy_settings();
  s.settle.max_duration_s = 10;
  int bound = 0, accepted = 0;
  for (s.seed = 1; s.seed <= 8; ++s.seed) {
    Plan p = plan(low, s), higher = p;
    if (!p.solved()) continue;
    accepted += shorten(low, p, {.rounds = 4}).accepted;
    shorten(free, higher, {.rounds = 4});
    EXPECT_EQ(low.first_refused(p.trajectory.frames), p.trajectory.frames.size()) << s.seed;
    bound += low.first_refused(higher.trajectory.frames) < higher.trajectory.frames.size();
  }
  EXPECT_GT(accepted, 3);
  EXPECT_GT(bound, 0) << "no shortcut would have gone there";
}

TEST(Shortcut, NeverCostsMoreNorLastsLongerAndSolvesTheQuery) {
  for (const CostKind cost : all_costs) {
    int accepted = 0;
    for (const std::uint64_t seed : {7, 8, 9}) {
      SCOPED_TRACE(fmt::format("{} {}", name_of(cost), seed));
      const Toy toy(5, true, true, 1.05f);
      const Settings s = settings_of_seed(seed);
      Plan p = plan(toy, s);
      ASSERT_TRUE(p.solved());
      double last = std::numeric_limits<double>::infinity(), longest = last;
      ShortcutSettings rounds{.cost = cost};
      for (rounds.rounds = 1; rounds.rounds <= 12; ++rounds.rounds) {
        const ShortcutReport report = shorten(toy, p, rounds);
        rounds.rounds_done = rounds.rounds;
        accepted += report.accepted;
        ASSERT_LE(cost_in(report.after, cost), cost_in(report.before, cost));
        ASSERT_LE(cost_in(report.before, cost), last);
        ASSERT_LE(report.after.duration_s, longest);
        last = cost_in(report.after, cost), longest = report.after.duration_s;
        EXPECT_NEAR(report.after.duration_s, double(p.trajectory.end.step) * toy.dt_s(), 1e-12);
      }
      expect_solves(toy, s, p.trajectory);
    }
    EXPECT_GT(accepted, 5) << name_of(cost);
  }
}

// A point that nothing hinders or slows takes 2 √(m d / F) from rest to rest; nothing beats that, and
// shortcutting comes near it from a path several times as long.
// Where a robot is pushed at points alone, by an instrument's tip or by carriers, nobody else pushes it.
TEST(Shortcut, PushesAsTheSearchMayAlone) {
  const Toy toy(5, false, false, 99);
  Settings s = settings_of_seed(3);
  s.weights = {.body = 0, .control_point = 1, .interpolation = 0};
  s.max_iterations = 4000, s.control_point_radius_m = 2;
  Plan p = plan(toy, s);
  ASSERT_TRUE(p.solved()) << explain(p);
  const double before = double(p.trajectory.end.step);
  shorten(toy, p, {.rounds = 20});
  EXPECT_LT(double(p.trajectory.end.step), before);
  for (std::size_t c = 0; c + (p.trajectory.settle_steps > 0) < p.trajectory.controls.size(); ++c)
    EXPECT_EQ(p.trajectory.controls[c].manipulation, Manipulation::control_point) << c;
}

TEST(Shortcut, OfAFreePointComesNearBangBang) {
  Toy toy(1, false, false, 99);
  toy.damping_per_s = 0;
  const Settings s = toy_settings();
  Plan p = plan(toy, s);
  ASSERT_TRUE(p.solved());
  const double way = 8 - 2 * s.goal.radius_m;  // to the near side, and no less after the settle
  const double bang_bang = 2 * std::sqrt(double(toy.mass_kg) * way / s.max_force_n);
  const ShortcutReport report = shorten(toy, p, {.rounds = 40});
  EXPECT_GT(report.before.duration_s, 2 * bang_bang);
  EXPECT_GT(report.after.duration_s, bang_bang);
  EXPECT_LT(report.after.duration_s, 2 * bang_bang);
  expect_solves(toy, s, p.trajectory);
}

TEST(Shortcut, SameBytesForAnyThreadsAndLanesAndInParts) {
  for (const CostKind cost : all_costs) {
    Toy toy(5, true, true, 1.6f);
    const Plan found = plan(toy, toy_settings());
    Plan whole = found;
    shorten(toy, whole, {.rounds = 6, .cost = cost});
    ASSERT_NE(hash_of(whole.trajectory), hash_of(found.trajectory));
    for (const int threads : {1, 2})
      for (const int lanes : {1, 5, 16}) {
        set_thread_count(threads);
        toy.lanes_wanted = lanes;
        Plan again = found;
        shorten(toy, again, {.rounds = 6, .cost = cost});
        EXPECT_EQ(hash_of(again.trajectory), hash_of(whole.trajectory)) << threads << ' ' << lanes;
        EXPECT_EQ(hash_of(again.tree), hash_of(whole.tree));
      }
    set_thread_count(0);
    Plan parts = found;
    shorten(toy, parts, {.rounds = 2, .cost = cost});
    shorten(toy, parts, {.rounds = 6, .rounds_done = 2, .cost = cost});
    EXPECT_EQ(hash_of(parts.trajectory), hash_of(whole.trajectory));
  }
}

TEST(Shortcut, ASignalKeepsWhatIsShortened) {
  Toy toy(5, true, true, 1.6f);
  Plan p = plan(toy, toy_settings());
  std::atomic<int> left{20000};
  toy.before_each_rollout = [&] {
    if (--left == 0) request_stop(SIGINT);
  };
  const ShortcutReport report = shorten(toy, p, {.rounds = 1000});
  request_stop(0);
  EXPECT_GT(report.settings.rounds_done, 0);
  EXPECT_LT(report.settings.rounds_done, 1000);
  expect_solves(toy, toy_settings(), p.trajectory);
}

// The path becomes a branch of the tree: every node is its parent's state under its control.
TEST(Shortcut, ItsPathIsABranchOfTheTree) {
  const Toy toy(5, true, true, 1.6f);
  Plan p = plan(toy, toy_settings());
  const int searched = p.tree.size();
  shorten(toy, p, {.rounds = 6});
  ASSERT_GT(p.tree.size(), searched);
  EXPECT_EQ(p.goal_node, p.best_node);
  for (int node = searched; node < p.tree.size(); ++node) {
    State state = p.tree.states[std::size_t(p.tree.parents[std::size_t(node)])];
    const Control& c = p.tree.controls[std::size_t(node)];
    for (int i = 0; i < c.steps; ++i) ASSERT_TRUE(toy.step(c, state));
    EXPECT_TRUE(state == p.tree.states[std::size_t(node)]) << node;
    EXPECT_EQ(p.tree.iterations[std::size_t(node)], -1);
  }
  const Vec3 end = toy.robot_center(p.tree.states[std::size_t(p.goal_node)]);
  EXPECT_NEAR((end - p.settings.goal.center_of_mass_m).norm(), p.best_distance_m, 1e-12);
}

TEST(Shortcut, OfAGoalThatMovesReachesItWhereItIs) {
  Toy toy(1, false, false, 99);
  toy.goal_velocity_m_s = Vec3(-0.2, 0.1, 0);
  Settings s = toy_settings();
  s.settle.max_duration_s = 0;
  Plan p = plan(toy, s);
  ASSERT_TRUE(p.solved());
  const ShortcutReport report = shorten(toy, p, {.rounds = 10});
  EXPECT_GT(report.accepted, 0);
  EXPECT_EQ(p.trajectory.settle_steps, 0);
  const State& end = p.trajectory.end;
  EXPECT_LE((toy.robot_center(end) - toy.goal_shift(end) - s.goal.center_of_mass_m).norm(), s.goal.radius_m);
}

}  // namespace
}  // namespace limber::plan
