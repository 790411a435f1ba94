#include "plan/follow.h"

#include <gtest/gtest.h>

#include "core/hash.h"
#include "core/threads.h"
#include "plan/replan.h"
#include "plan/search.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

ControlRollout followed(const Toy& toy, const Settings& s, const Follower& follower) {
  ControlRollout course;
  course.from = toy.start();
  course.next = [&](const State& state) -> std::optional<Control> {
    if (follower.is_over(state)) return std::nullopt;
    return follower.next(state);
  };
  run(toy, s, {&course, 1},
      {.settle = ControlRolloutOptions::anywhere, .keep_frames = true, .ask_acceptable = false});
  return course;
}

TEST(Follow, ThePlanInItsOwnSystemIsThePlanBitForBit) {
  for (const int nodes : {1, 5}) {
    SCOPED_TRACE(nodes);
    const Toy toy(nodes, true, false, 99);
    const Settings s = toy_settings();
    const Plan found = plan(toy, s);
    ASSERT_TRUE(found.solved());
    const Follower follower(toy, s, guide_of(toy, s, found.trajectory));
    const ControlRollout course = followed(toy, s, follower);
    EXPECT_EQ(course.result, ControlRollout::rests_in_goal);
    EXPECT_TRUE(course.frames == found.trajectory.frames);
    EXPECT_EQ(limber::hash_of(course.end), limber::hash_of(found.trajectory.end));
    EXPECT_GT(course.controls.size(), found.trajectory.controls.size());
  }
}

// A mass that is pushed for a second, and back for another: x = a h² n² after 2 n steps of h, if nothing
// brakes it. A heavier one gets m / m' as far. The follower, of mass m and response w, is wrong by no more
// than what holds against the missing force: m w² e = F (m' / m − 1), twice that where F changes sign.
struct ThereAndBack {
  static constexpr int n = 100;
  static constexpr double force_n = 4, h = 0.01;
  Toy toy = Toy(1, false, false, 99);
  Settings settings = toy_settings();
  Trajectory path;
  double way_m = 0;

  explicit ThereAndBack(Manipulation manipulation = Manipulation::body) {
    toy.damping_per_s = 0;
    way_m = force_n / double(toy.mass_kg) * h * h * n * n;
    settings.goal = {toy.robot_center(toy.start()) + Vec3(way_m, 0, 0), 0.02};
    settings.settle.max_duration_s = 0;
    for (const float sign : {1.f, -1.f}) {
      Control control;
      control.manipulation = manipulation;
      if (manipulation == Manipulation::control_point) control.node = 0, control.radius_m = 0.1f;
      control.force_n = Vec3f(sign * float(force_n), 0, 0), control.steps = n;
      path.controls.push_back(control);
    }
  }
};

TEST(Follow, GetsThereWhereTheSameControlsMissByTheFormula) {
  for (const Manipulation manipulation : {Manipulation::body, Manipulation::control_point})
    for (const double more : {-0.1, 0.1}) {
      SCOPED_TRACE(more);
      const ThereAndBack was(manipulation);
      const Guide guide = guide_of(was.toy, was.settings, was.path);
      EXPECT_NEAR(guide.centers.back().x() - guide.centers.front().x(), was.way_m, 1e-5);
      Toy other(1, false, false, 99);
      other.damping_per_s = 0, other.mass_kg *= 1 + float(more);

      ControlRollout blind;
      blind.from = other.start();
      blind.controls = guide.pieces;
      run(other, was.settings, {&blind, 1}, {});
      const double missed = was.way_m * (1 - 1 / (1 + more));
      EXPECT_NEAR(was.settings.goal.center_of_mass_m.x() - other.robot_center(blind.end).x(), missed, 1e-5);
      EXPECT_EQ(blind.result, ControlRollout::ends_elsewhere);

      const Follower follower(other, was.settings, guide);
      const ControlRollout seeing = followed(other, was.settings, follower);
      EXPECT_EQ(seeing.result, ControlRollout::rests_in_goal);
      const double holds_m =
          was.force_n * std::abs(more) / (was.toy.robot_mass_kg() * std::pow(guide.response_rad_s, 2));
      double farthest = 0;
      for (std::size_t i = 0; i + 1 < guide.centers.size(); ++i)
        farthest = std::max(farthest, (other.robot_center(seeing.states[i]) - guide.centers[i + 1]).norm());
      EXPECT_LT(farthest, 2 * holds_m);
      EXPECT_GT(farthest, 0.1 * holds_m);
      for (const Control& control : seeing.controls) EXPECT_EQ(control.manipulation, manipulation);
    }
}

TEST(Follow, NeverAsksForMoreThanTheLargestForce) {
  const Toy toy(5, true, false, 99);
  const Settings s = toy_settings();
  const Plan found = plan(toy, s);
  Toy other(5, true, false, 99);
  other.mass_kg = 2 * toy.mass_kg, other.damping_per_s = 1;
  const Follower follower(other, s, guide_of(toy, s, found.trajectory));
  double largest = 0;
  for (const Control& control : followed(other, s, follower).controls)
    largest = std::max(largest, double(largest_force(control)));
  EXPECT_LE(largest, s.max_force_n);
  EXPECT_GT(largest, 0.99 * s.max_force_n);
}

// A course depends on itself alone, whoever runs beside it.
TEST(Follow, IsTheSameForAnyNumberOfLanesAndThreads) {
  const Toy toy(5, true, false, 99);
  const Settings s = toy_settings();
  const Guide guide = guide_of(toy, s, plan(toy, s).trajectory);
  Toy other(5, true, false, 99);
  other.mass_kg = 2.1f;
  const Follower follower(other, s, guide);
  std::uint64_t first = 0;
  for (const int threads : {1, 2})
    for (const int lanes : {1, 3, 16}) {
      set_thread_count(threads);
      other.lanes_wanted = lanes;
      std::vector<ControlRollout> courses(7);
      for (std::size_t i = 0; i < courses.size(); ++i) {
        courses[i].from = other.start();
        courses[i].next = [&follower, i](const State& state) -> std::optional<Control> {
          if (follower.is_over(state)) return std::nullopt;
          Control control = follower.next(state);
          control.force_n *= 1 - 0.02f * float(i);
          return control;
        };
      }
      run(other, s, courses, {.settle = ControlRolloutOptions::anywhere, .ask_acceptable = false});
      Hasher hasher;
      for (const ControlRollout& course : courses) hasher.value(limber::hash_of(course.end));
      if (first == 0) first = hasher.digest();
      EXPECT_EQ(hasher.digest(), first) << threads << " " << lanes;
    }
  set_thread_count(0);
}

// Where nothing is to be followed any more the robot is drawn to the goal, but not for ever.
TEST(Follow, IsOverInTheGoalOrWhenItIsTooLate) {
  const ThereAndBack was;
  const Guide guide = guide_of(was.toy, was.settings, was.path);
  const Follower follower(was.toy, was.settings, guide);
  State state = was.toy.start();
  EXPECT_FALSE(follower.is_over(state));
  state.step = 2 * was.n;
  EXPECT_FALSE(follower.is_over(state));
  EXPECT_EQ(follower.next(state).target_m, was.settings.goal.center_of_mass_m.cast<float>().eval());
  state.step += 1000;
  EXPECT_TRUE(follower.is_over(state));
  ControlRollout there;
  there.from = was.toy.start();
  there.controls = guide.pieces;
  run(was.toy, was.settings, {&there, 1}, {});
  EXPECT_TRUE(follower.is_over(there.end));
}

Replanner::From from_here(const Toy& toy) {
  return [&toy](const State& state) {
    auto begun = std::make_unique<Toy>(toy.nodes, toy.wall, toy.lava, toy.unacceptable_above_z);
    begun->mass_kg = toy.mass_kg, begun->damping_per_s = toy.damping_per_s;
    begun->begins_at = state;
    return begun;
  };
}

// One course in `acting`, whose planner takes it for `known`.
ControlRollout replanned(const Toy& acting, const Settings& s, Replanner& replanner) {
  ControlRollout course;
  course.from = acting.start();
  course.next = [&](const State& state) { return replanner.next(state); };
  run(acting, s, {&course, 1},
      {.settle = ControlRolloutOptions::anywhere, .keep_frames = true, .ask_acceptable = false});
  return course;
}

TEST(Replan, WhereAllGoesAsPlannedItIsThePlan) {
  const Toy toy(5, true, false, 99);
  const Settings s = toy_settings();
  const Plan found = plan(toy, s);
  Replanner replanner(from_here(toy), from_here(toy), toy.start(), s, guide_of(toy, s, found.trajectory), {});
  const ControlRollout course = replanned(toy, s, replanner);
  EXPECT_EQ(course.result, ControlRollout::rests_in_goal);
  EXPECT_TRUE(course.frames == found.trajectory.frames);
  EXPECT_EQ(replanner.searches(), 0);
  EXPECT_GT(replanner.looks(), 3);
}

// Eight times as heavy as known and more damped, and a wall with a gap between start and goal: followed, it
// is late and is caught at the wall; who looks ahead plans anew.
TEST(Replan, GetsThereWhereFollowingIsCaught) {
  const Toy toy(1, true, false, 99);
  const Settings s = toy_settings();
  int followed_there = 0, replanned_there = 0, searches = 0;
  for (int seed = 1; seed <= 5; ++seed) {
    Settings seeded = s;
    seeded.seed = std::uint64_t(seed);
    const Plan found = plan(toy, seeded);
    ASSERT_TRUE(found.solved()) << seed;
    const Guide guide = guide_of(toy, seeded, found.trajectory);
    Toy other(1, true, false, 99);
    other.mass_kg = 8 * toy.mass_kg, other.damping_per_s = 1;
    followed_there +=
        followed(other, seeded, Follower(other, seeded, guide)).result == ControlRollout::rests_in_goal;
    Replanner replanner(from_here(toy), from_here(other), other.start(), seeded, guide, {.searches = 30});
    const ControlRollout course = replanned(other, seeded, replanner);
    replanned_there += course.result == ControlRollout::rests_in_goal;
    searches += replanner.searches();
    for (const Control& control : course.controls) EXPECT_LE(largest_force(control), s.max_force_n);
  }
  EXPECT_LT(followed_there, 3);
  EXPECT_EQ(replanned_there, 5);
  EXPECT_GT(searches, 0);
}

}  // namespace
}  // namespace limber::plan
