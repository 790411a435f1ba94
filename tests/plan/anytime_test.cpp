#include "plan/anytime.h"

#include <gtest/gtest.h>

#include <csignal>

#include "core/progress.h"
#include "core/threads.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

Plan solved(const Toy& toy) {
  Plan p = plan(toy, toy_settings());
  p.settings.max_iterations = 6000;
  return p;
}

TEST(Anytime, EachImprovementCostsLessAndTheBestIsKept) {
  const Toy toy(5, true, true, 1.6f);
  for (const CostKind cost : {CostKind::duration, CostKind::effort}) {
    Plan p = solved(toy);
    const AnytimeReport report = improve(toy, p, {.cost = cost});
    ASSERT_GT(report.improvements.size(), 0u) << name_of(cost);
    double last = cost_in(report.first, cost);
    for (const Improvement& i : report.improvements) {
      EXPECT_LT(cost_in(i.costs, cost), last);
      last = cost_in(i.costs, cost);
    }
    EXPECT_EQ(report.iterations, 6000);
    EXPECT_EQ(report.ending, Ending::iterations);
    // An independent replay.
    const Trajectory replay = simulate(toy, p.trajectory.controls, p.settings.frames_per_second);
    EXPECT_TRUE(replay.end == p.trajectory.end);
    EXPECT_NEAR(report.improvements.back().costs.duration_s, double(replay.end.step) * toy.dt_s(), 1e-12);
    EXPECT_LE((toy.robot_center(replay.end) - p.settings.goal.center_of_mass_m).norm(),
              p.settings.goal.radius_m);
    EXPECT_LT(toy.mean_speed(replay.end), p.settings.settle.mean_speed_m_s);
  }
}

TEST(Anytime, SameBytesForAnyThreads) {
  Toy toy(5, true, true, 1.6f);
  Plan one = solved(toy), two = one;
  set_thread_count(1);
  const AnytimeReport first = improve(toy, one, {.shortcut_rounds = 2});
  set_thread_count(2);
  const AnytimeReport second = improve(toy, two, {.shortcut_rounds = 2});
  set_thread_count(0);
  EXPECT_GT(first.improvements.size(), 0u);
  EXPECT_EQ(first.improvements.size(), second.improvements.size());
  EXPECT_EQ(hash_of(one.trajectory), hash_of(two.trajectory));
  EXPECT_EQ(hash_of(one.tree), hash_of(two.tree));
}

TEST(Anytime, ASignalKeepsTheBest) {
  Toy toy(5, true, true, 1.6f);
  Plan p = solved(toy);
  std::atomic<int> left{500};
  toy.before_each_rollout = [&] {
    if (--left == 0) request_stop(SIGINT);
  };
  p.settings.max_iterations = 1000000;
  const AnytimeReport report = improve(toy, p, {});
  request_stop(0);
  EXPECT_EQ(report.ending, Ending::stopped);
  EXPECT_TRUE(p.solved());
  EXPECT_TRUE(simulate(toy, p.trajectory.controls, 30).end == p.trajectory.end);
}

TEST(Anytime, ATimeLimitOfNothingDoesNothing) {
  const Toy toy;
  Plan p = solved(toy);
  p.settings.time_limit_s = 0;
  const std::uint64_t before = hash_of(p.trajectory);
  const AnytimeReport report = improve(toy, p, {});
  EXPECT_EQ(report.ending, Ending::time);
  EXPECT_EQ(report.searches, 0);
  EXPECT_EQ(hash_of(p.trajectory), before);
}

}  // namespace
}  // namespace limber::plan
