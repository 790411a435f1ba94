#include "plan/refine.h"

#include <gtest/gtest.h>

#include <csignal>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

void expect_solved(const Toy& toy, const Plan& p) {
  ASSERT_TRUE(p.solved());
  const Trajectory replay = simulate(toy, p.trajectory.controls, p.settings.frames_per_second);
  EXPECT_TRUE(replay.end == p.trajectory.end);
  EXPECT_LE((toy.robot_center(replay.end) - p.settings.goal.center_of_mass_m).norm(),
            p.settings.goal.radius_m);
  EXPECT_LT(toy.mean_speed(replay.end), p.settings.settle.mean_speed_m_s);
  for (const Control& c : replay.controls) EXPECT_LE(double(largest_force(c)), p.settings.max_force_n);
}

TEST(Refine, ToTheSameSystemGivesBackTheSamePath) {
  const Toy toy(5, true, true, 1.6f);
  const Plan found = plan(toy, toy_settings());
  RefineReport report;
  const Plan again = refine(toy, toy_settings(), reference_of(toy, found.trajectory), report);
  EXPECT_EQ(report.how, RefineReport::replayed);
  EXPECT_EQ(hash_of(again.trajectory), hash_of(found.trajectory));
  EXPECT_EQ(report.iterations, 0);
  EXPECT_EQ(report.replay_ends, "rests_in_goal");
  EXPECT_EQ(report.replay_largest_error_m, 0);
  EXPECT_NEAR(report.replay_s, double(found.trajectory.end.step) * toy.dt_s(), 1e-9);
}

TEST(Refine, ControlsKeepTheirTimesInOtherSteps) {
  std::vector<Control> controls(50);
  for (int i = 0; i < 50; ++i) controls[std::size_t(i)].steps = 7 + i % 5;
  const double theirs = 0.003;
  for (const double ours : {0.003, 0.0021, 0.0047}) {
    const std::vector<Control> converted = in_steps_of(ours, controls, theirs);
    double their_end = 0, our_end = 0;
    for (std::size_t i = 0; i < controls.size(); ++i) {
      their_end += controls[i].steps * theirs, our_end += converted[i].steps * ours;
      EXPECT_NEAR(our_end, their_end, 0.5001 * ours) << i;
    }
  }
  EXPECT_EQ(in_steps_of(theirs, controls, theirs), controls);
}

// A robot that weighs more and is braked harder: the same pushes end elsewhere, the follower makes up for it.
TEST(Refine, FollowsWhereTheSamePushesLeadElsewhere) {
  const Toy toy(1, true, false, 99);
  const Plan found = plan(toy, toy_settings());
  const Reference reference = reference_of(toy, found.trajectory);
  Toy other(1, true, false, 99);
  other.mass_kg = 2.4f, other.damping_per_s = 0.6f;
  RefineReport report;
  const Plan carried = refine(other, toy_settings(), reference, report);
  EXPECT_EQ(report.how, RefineReport::tracked);
  EXPECT_GT(report.tracked_s, 1);
  EXPECT_LT(report.largest_error_m, 2 * toy_settings().goal.radius_m);
  EXPECT_GT(report.mean_error_m, 0);
  EXPECT_LT(report.mean_error_m, report.largest_error_m);
  EXPECT_NE(report.replay_ends, "rests_in_goal");
  EXPECT_GT(report.replay_largest_error_m, report.largest_error_m);  // feedback is nearer to it than none
  EXPECT_GT(report.replay_largest_error_m, report.replay_mean_error_m);
  expect_solved(other, carried);
  EXPECT_EQ(carried.system_hash, other.hash());
}

// One that cannot be followed is searched from where it was lost, and a search that is cut short and resumed
// ends like one that was not.
TEST(Refine, SearchesFromWhereItWasLost) {
  const Toy toy(1, true, false, 99);
  const Plan found = plan(toy, toy_settings());
  const Reference reference = reference_of(toy, found.trajectory);
  Toy other(1, true, false, 99);
  other.mass_kg = 5, other.damping_per_s = 1;
  const Settings s = toy_settings();
  RefineReport report;
  const Plan carried = refine(other, s, reference, report);
  ASSERT_EQ(report.how, RefineReport::replanned);
  EXPECT_GT(report.iterations, 0);
  expect_solved(other, carried);
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    RefineReport once_more;
    EXPECT_EQ(hash_of(refine(other, s, reference, once_more).tree), hash_of(carried.tree)) << threads;
  }
  set_thread_count(0);

  request_stop(SIGTERM);  // ends it before there is a search to keep
  RefineReport stopped;
  EXPECT_THROW(refine(other, s, reference, stopped), Interrupted);
  request_stop(0);

  Settings few = s;
  few.max_iterations = report.iterations / 2;
  RefineReport cut_report;
  const Plan cut = refine(other, few, reference, cut_report);
  EXPECT_EQ(cut_report.how, RefineReport::failed);
  const Plan resumed = plan(other, carried.settings, cut);
  EXPECT_EQ(hash_of(resumed.tree), hash_of(carried.tree));
  EXPECT_EQ(hash_of(resumed.trajectory), hash_of(carried.trajectory));
}

}  // namespace
}  // namespace limber::plan
