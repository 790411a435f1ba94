#include "plan/control_rollout.h"

#include <gtest/gtest.h>

#include <csignal>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"
#include "plan/search.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

// Pushes of many lengths and directions; the toy's seed 7 decides which.
std::vector<ControlRollout> some_courses(const System& system, const Settings& settings, int count) {
  std::vector<ControlRollout> courses;
  for (int i = 0; i < count; ++i) {
    ControlRollout& c = courses.emplace_back();
    c.from = system.start();
    for (int k = 0; k <= i % 4; ++k)
      c.controls.push_back(control_of(draw_sample(settings, system, 10 * i + k), settings, Vec3(1, 1.5, 1)));
    c.reach_force_n = i % 2 == 0 ? settings.max_force_n : 0;
    c.last_step = 1500;
  }
  return courses;
}

void expect_same(const ControlRollout& a, const ControlRollout& b) {
  EXPECT_EQ(a.result, b.result);
  EXPECT_EQ(a.controls, b.controls);
  EXPECT_TRUE(a.states == b.states);
  EXPECT_TRUE(a.frames == b.frames);
  EXPECT_EQ(limber::hash_of(a.end), limber::hash_of(b.end));
  EXPECT_EQ(a.settle_steps, b.settle_steps);
  EXPECT_EQ(json_of(a.costs), json_of(b.costs));
}

TEST(ControlRollout, OfWhoeverHasNothingToKeepEndsAtASignalAndIsElseTheSame) {
  const Toy toy(5, true, true, 1.1f);
  const Settings s = toy_settings();
  const ControlRolloutOptions kept{
      .settle = ControlRolloutOptions::anywhere, .keep_frames = true, .measure = true};
  ControlRolloutOptions stoppable = kept;
  stoppable.stoppable = true;
  const auto courses = [&](const ControlRolloutOptions& options) {
    std::vector<ControlRollout> all = some_courses(toy, s, 12);
    run(toy, s, all, options);
    return all;
  };
  const std::vector<ControlRollout> whole = courses(kept);
  const auto expect_whole = [&](const std::vector<ControlRollout>& all) {
    for (std::size_t i = 0; i < whole.size(); ++i) expect_same(all[i], whole[i]);
  };
  expect_whole(courses(stoppable));
  {
    const NothingToKeep nothing;
    expect_whole(courses(kept));
  }
  request_stop(SIGTERM);
  EXPECT_THROW(courses(stoppable), Interrupted);
  expect_whole(courses(kept));
  {
    const NothingToKeep nothing;
    EXPECT_THROW(courses(kept), Interrupted);
  }
  expect_whole(courses(kept));
  request_stop(0);
}

TEST(ControlRollout, DoesNotDependOnItsNeighboursLanesOrThreads) {
  Toy toy(5, true, true, 1.1f);
  const Settings s = toy_settings();
  const ControlRolloutOptions options{
      .settle = ControlRolloutOptions::anywhere, .keep_frames = true, .measure = true};
  std::vector<ControlRollout> alone = some_courses(toy, s, 12);
  for (ControlRollout& c : alone) run(toy, s, {&c, 1}, options);
  int results[5] = {};
  for (const ControlRollout& c : alone) ++results[c.result];
  ASSERT_GT(results[ControlRollout::rests_in_goal], 0);
  ASSERT_GT(results[ControlRollout::diverged] + results[ControlRollout::not_acceptable], 0);
  for (const int threads : {1, 2})
    for (const int lanes : {1, 5, 16}) {
      set_thread_count(threads);
      toy.lanes_wanted = lanes;
      std::vector<ControlRollout> together = some_courses(toy, s, 12);
      run(toy, s, together, options);
      for (std::size_t i = 0; i < alone.size(); ++i) expect_same(together[i], alone[i]);
    }
  set_thread_count(0);
}

// A settle that is too short for a step is asked for all the same: who moves does not rest.
TEST(ControlRollout, WhoMovesDoesNotRestHoweverShortTheSettle) {
  const Toy toy(5, false, false, 99);
  Settings s = toy_settings();
  ControlRollout course;
  course.from = toy.start();
  std::fill(course.from.velocities.begin(), course.from.velocities.end(), 1.f);
  s.goal.center_of_mass_m = toy.robot_center(course.from), s.goal.radius_m = 1;
  for (const auto& [duration_s, result] :
       {std::pair(0.0, ControlRollout::rests_in_goal), std::pair(0.001, ControlRollout::ends_elsewhere)}) {
    s.settle.max_duration_s = duration_s;
    run(toy, s, {&course, 1}, {});
    EXPECT_EQ(course.result, result) << duration_s;
  }
}

// Thrown up, it is slow for two hundredths of a second when rest is looked for, and falls. Held by the
// settle's force, it comes to rest g/9 below the goal's middle, where 9/s² of the way draw it up.
TEST(ControlRollout, WhoTurnsBackDoesNotRest) {
  Toy toy;
  toy.damping_per_s = 0, toy.weight_m_s2 = {0, 0, -1};
  Settings s = toy_settings();
  ControlRollout course;
  course.from = toy.start();
  course.from.velocities = {0, 0, 0.1f};
  s.goal.center_of_mass_m = toy.robot_center(course.from), s.goal.radius_m = 0.5;
  s.settle.max_duration_s = 5;
  for (const auto& [share, result] :
       {std::pair(0.0, ControlRollout::ends_elsewhere), std::pair(1.0, ControlRollout::rests_in_goal)}) {
    s.settle.max_force_share = share;
    run(toy, s, {&course, 1}, {});
    EXPECT_EQ(course.result, result) << share << ", after " << course.settle_steps << " steps";
  }
  EXPECT_NEAR(toy.robot_center(course.end).z(), s.goal.center_of_mass_m.z() - 1.0 / 9, 0.02);
}

// What a course says it ran is what gives its end, step by step.
TEST(ControlRollout, ItsControlsAreWhatWasRun) {
  const Toy toy(5, true, false, 99);
  const Settings s = toy_settings();
  std::vector<ControlRollout> courses = some_courses(toy, s, 12);
  run(toy, s, courses, {.settle = ControlRolloutOptions::anywhere, .keep_frames = true});
  int compared = 0;
  for (const ControlRollout& c : courses) {
    if (c.result == ControlRollout::too_costly) continue;  // its last control was cut
    ++compared;
    std::vector<Control> controls = c.controls;
    ASSERT_EQ(c.states.size(), controls.size());
    controls.push_back(settle_control(s, c.settle_steps));
    const Trajectory replay = simulate(toy, controls, s.frames_per_second);
    EXPECT_EQ(limber::hash_of(replay.end), limber::hash_of(c.end));
    EXPECT_TRUE(replay.frames == c.frames);
    EXPECT_NEAR(c.costs.duration_s, double(c.end.step) * 0.01, 1e-12);
    double effort = 0;
    for (const Control& control : controls) effort += double(largest_force(control)) * control.steps * 0.01;
    EXPECT_NEAR(c.costs.effort_n_s, effort, 1e-9 * effort);
  }
  EXPECT_GT(compared, 6);
}

TEST(ControlRollout, MeasuresAreTheLargestOfItsFrames) {
  const Toy toy(5, true, false, 99);
  const Settings s = toy_settings();
  std::vector<ControlRollout> courses = some_courses(toy, s, 6);
  run(toy, s, courses, {.keep_frames = true, .measure = true});
  for (const ControlRollout& c : courses) {
    double energy = 0, change = 0;
    for (const State& frame : c.frames) {
      energy = std::max(energy, toy.measures(frame).strain_energy_j);
      change = std::max(change, toy.measures(frame).volume_change);
    }
    EXPECT_GT(energy, 0);
    EXPECT_EQ(c.costs.strain_energy_j, energy);
    EXPECT_EQ(c.costs.volume_change, change);
  }
}

// The cheapest wins a race for any lanes, and nothing dearer than the bound comes through.
TEST(ControlRollout, ARaceEndsLosersOnly) {
  Toy toy(1, false, false, 99);
  const Settings s = toy_settings();
  std::vector<ControlRollout> free = some_courses(toy, s, 12);
  run(toy, s, free, {});
  const auto winner = [&](const std::vector<ControlRollout>& courses) {
    int best = -1;
    for (int i = 0; i < int(courses.size()); ++i) {
      const ControlRollout& c = courses[std::size_t(i)];
      if (c.result != ControlRollout::rests_in_goal) continue;
      if (best < 0 || c.costs.duration_s < courses[std::size_t(best)].costs.duration_s) best = i;
    }
    return best;
  };
  ASSERT_GE(winner(free), 0);
  const double shortest = free[std::size_t(winner(free))].costs.duration_s;
  for (const int lanes : {1, 16}) {
    toy.lanes_wanted = lanes;
    std::vector<ControlRollout> raced = some_courses(toy, s, 12);
    run(toy, s, raced, {.race = true});
    EXPECT_EQ(winner(raced), winner(free));
    std::vector<ControlRollout> bounded = some_courses(toy, s, 12);
    run(toy, s, bounded, {.most = 0.999 * shortest});
    EXPECT_EQ(winner(bounded), -1);
    for (const ControlRollout& c : bounded) EXPECT_LT(c.costs.duration_s, shortest + 0.05);
  }
}

TEST(ControlRollout, CostsHaveNames) {
  const Costs costs{1, 2, 3, 4};
  EXPECT_EQ(cost_in(costs, cost_kind_from("duration")), 1);
  EXPECT_EQ(cost_in(costs, cost_kind_from("effort")), 2);
  EXPECT_EQ(cost_in(costs, cost_kind_from("strain")), 3);
  EXPECT_EQ(cost_in(costs, cost_kind_from("volume")), 4);
  EXPECT_THROW(cost_kind_from("time"), InputError);
}

}  // namespace
}  // namespace limber::plan
