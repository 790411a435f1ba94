// Several goals in a row: each leg is a search of its own, from the state in which the one before ended.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>

#include "core/error.h"
#include "core/npz.h"
#include "core/progress.h"
#include "core/threads.h"
#include "plan/anytime.h"
#include "plan/plan_file.h"
#include "tests/core/temporary_folder.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::sequential_tree;
using testing::Toy;
using testing::toy_settings;

// Up along the near side of the wall, through its gap, and to the far corner.
Settings three_legs(bool rest) {
  Settings s = toy_settings();
  s.via = {{{Vec3(3, 4, 1), 0.5}, rest}, {{Vec3(7, 3, 1), 0.5}, rest}};
  s.max_iterations = 4000;
  s.settle.max_duration_s = 10;  // whoever gets there comes to rest
  return s;
}

Settings lagged(Settings s) {
  s.min_force_share = 0.8, s.max_duration_s = 3;
  s.search_options = {.lag = 5,
                      .metric = Metric::time_to_go,
                      .guidance = 0.6,
                      .soft_price = 20,
                      .learn_prices = true,
                      .steer = true,
                      .look_s = 0.1,
                      .stop_in_goal = true,
                      .end_hopeless = true};
  return s;
}

bool in_goal(const Toy& toy, const Goal& goal, const State& state) {
  return (toy.robot_center(state) - goal.center_of_mass_m).norm() <= goal.radius_m;
}

// The path goes through the roots in their order, each in its via's goal and, where it must, at rest.
void expect_visits_in_order(const Toy& toy, const Plan& p) {
  ASSERT_EQ(p.legs.size(), p.settings.via.size() + 1);
  const std::vector<int> path = path_to(p.tree, p.goal_node);
  auto at = path.begin();
  for (std::size_t leg = 1; leg < p.legs.size(); ++leg) {
    at = std::find(at, path.end(), p.legs[leg].root);
    ASSERT_NE(at, path.end()) << leg;
    const State state = p.tree.states[std::size_t(p.legs[leg].root)];
    const Via& via = p.settings.via[leg - 1];
    EXPECT_TRUE(in_goal(toy, via.goal, state)) << leg;
    EXPECT_TRUE(!via.rest || toy.mean_speed(state) < p.settings.settle.mean_speed_m_s) << leg;
  }
  // Step by step, the controls lead to the end.
  State state = toy.start();
  for (const Control& c : p.trajectory.controls)
    for (int n = 0; n < c.steps; ++n) ASSERT_TRUE(toy.step(c, state));
  EXPECT_EQ(state, p.trajectory.end);
  EXPECT_TRUE(in_goal(toy, p.settings.goal, state));
  EXPECT_LT(toy.mean_speed(state), p.settings.settle.mean_speed_m_s);
}

TEST(Legs, EachIsTheSequentialTreeFromWhereTheOneBeforeEnded) {
  for (const bool wall : {false, true})
    for (const bool rest : {false, true}) {
      Toy toy(wall ? 5 : 1, wall, wall, wall ? 1.6f : 99);
      const Settings s = three_legs(rest);
      const Plan p = plan(toy, s);
      ASSERT_TRUE(p.solved()) << explain(p);
      ASSERT_EQ(p.legs.size(), 3u);
      for (int leg = 0; leg < 3; ++leg) {
        const int root = p.legs[std::size_t(leg)].root;
        toy.begins_at = p.tree.states[std::size_t(root)];
        const Tree alone =
            sequential_tree(toy, settings_of_leg(s, leg), p.legs[std::size_t(leg)].first_iteration);
        ASSERT_LE(root + alone.size(), p.tree.size());
        for (int i = 1; i < alone.size(); ++i) {
          const auto here = std::size_t(root + i), there = std::size_t(i);
          ASSERT_EQ(p.tree.states[here], alone.states[there]) << leg << ' ' << i;
          ASSERT_EQ(p.tree.controls[here], alone.controls[there]);
          ASSERT_EQ(p.tree.parents[here] - root, alone.parents[there]);
          ASSERT_EQ(p.tree.iterations[here], alone.iterations[there]);
        }
        const int goal = root + alone.size() - 1;
        if (leg == 2)
          EXPECT_EQ(p.goal_node, goal);
        else if (rest)  // the settle is a node of its own
          EXPECT_EQ(p.tree.parents[std::size_t(p.legs[std::size_t(leg) + 1].root)], goal);
        else
          EXPECT_EQ(p.legs[std::size_t(leg) + 1].root, goal);
      }
      toy.begins_at.reset();
      expect_visits_in_order(toy, p);
    }
}

TEST(Legs, SameBytesForAnyNumberInFlightThreadsAndLanes) {
  for (const bool lag : {false, true}) {
    Toy toy(5, true, true, 1.6f);
    Settings s = lag ? lagged(three_legs(true)) : three_legs(true);
    s.in_flight = 1;
    const Plan one = plan(toy, s);
    ASSERT_TRUE(one.solved()) << explain(one);
    expect_visits_in_order(toy, one);
    for (const int threads : {1, 2})
      for (const int lanes : {1, 16}) {
        set_thread_count(threads);
        toy.jitter = threads > 1, toy.lanes_wanted = lanes;
        s.in_flight = lanes == 1 ? 7 : 0;
        const Plan many = plan(toy, s);
        set_thread_count(0);
        EXPECT_EQ(hash_of(many.tree), hash_of(one.tree)) << lag << threads << lanes;
        EXPECT_EQ(hash_of(many.trajectory), hash_of(one.trajectory)) << lag << threads << lanes;
        EXPECT_EQ(many.statistics.iterations, one.statistics.iterations);
      }
  }
}

// Cut in every leg, and where one ends and the next begins; each time through a file.
TEST(Legs, InterruptedAndResumedEqualsUninterrupted) {
  const TemporaryFolder folder;
  const fs::path file = folder / "plan.npz";
  for (const bool lag : {false, true})
    for (const bool rest : {false, true}) {
      Toy toy(5, true, true, 1.6f);
      toy.lanes_wanted = 4;
      const Settings s = lag ? lagged(three_legs(rest)) : three_legs(rest);
      const Plan whole = plan(toy, s);
      ASSERT_TRUE(whole.solved()) << explain(whole);
      std::vector<std::int64_t> cuts{1, whole.statistics.iterations - 1};
      for (std::size_t leg = 1; leg < 3; ++leg)
        for (const int by : {-1, 0, 1, 4}) cuts.push_back(whole.legs[leg].first_iteration + by);
      for (const std::int64_t cut : cuts) {
        Settings until = s;
        until.max_iterations = std::clamp(cut, std::int64_t(0), whole.statistics.iterations);
        write_plan(file, plan(toy, until), {});
        const Plan resumed = plan(toy, s, read_plan(file).plan);
        EXPECT_EQ(hash_of(resumed.tree), hash_of(whole.tree)) << lag << rest << ' ' << cut;
        EXPECT_EQ(hash_of(resumed.trajectory), hash_of(whole.trajectory)) << lag << rest << ' ' << cut;
        EXPECT_EQ(resumed.statistics.iterations, whole.statistics.iterations) << lag << rest << ' ' << cut;
        EXPECT_EQ(resumed.statistics.rollout_steps, whole.statistics.rollout_steps);
        ASSERT_EQ(resumed.legs.size(), 3u);
        for (std::size_t leg = 0; leg < 3; ++leg) EXPECT_EQ(resumed.legs[leg].root, whole.legs[leg].root);
      }
    }
}

TEST(Legs, ASignalInTheSecondLegKeepsTheFirst) {
  const Toy toy(1, true, false, 99);
  const Settings s = three_legs(true);
  const Plan whole = plan(toy, s);
  ASSERT_TRUE(whole.solved());
  const Plan stopped = plan(toy, s, std::nullopt, [&](const SearchProgress& m) {
    if (m.leg == 1 && m.statistics.iterations == whole.legs[1].first_iteration + 10) request_stop(SIGINT);
  });
  request_stop(0);
  EXPECT_EQ(stopped.ending, Ending::stopped);
  EXPECT_EQ(stopped.leg(), 1);
  EXPECT_EQ(hash_of(plan(toy, s, stopped).tree), hash_of(whole.tree));
}

// The second goal lies in what no node may enter: the first is reached, and the explanation says so.
TEST(Legs, TheLegThatFailsIsNamedAndThePathEndsInIt) {
  const Toy toy(1, false, false, 1.3f);
  Settings s = toy_settings();
  s.via = {{{Vec3(3, 4, 1), 0.5}, true}, {{Vec3(7, 3, 1.9), 0.3}, true}};
  s.max_iterations = 400;
  const Plan p = plan(toy, s);
  EXPECT_FALSE(p.solved());
  ASSERT_EQ(p.leg(), 1);
  const std::string why = explain(p);
  EXPECT_NE(why.find("1 of 3 goals are reached"), std::string::npos) << why;
  EXPECT_NE(why.find("no node reached via 2 of 2"), std::string::npos) << why;
  EXPECT_EQ(limber::hash_of(p.trajectory.end), limber::hash_of(p.tree.states[std::size_t(p.best_node)]));
  const std::vector<int> path = path_to(p.tree, p.best_node);
  EXPECT_EQ(std::count(path.begin(), path.end(), p.legs[1].root), 1);
  // What is nearest is so by the distance from the goal sought, over the nodes of that leg.
  for (int n = p.legs[1].root; n < p.tree.size(); ++n)
    EXPECT_GE((p.tree.centers[n].cast<double>() - s.via[1].goal.center_of_mass_m).norm(),
              p.best_distance_m - 1e-6);
}

TEST(Legs, GoalsThatTheRobotIsInNeedNoIteration) {
  const Toy toy;
  Settings s = toy_settings();
  const Vec3 start(1, 1.5, 1);
  s.via = {{{start, 0.1}, true}, {{start, 0.2}, false}};
  s.goal = {start, 0.3};
  const Plan p = plan(toy, s);
  EXPECT_TRUE(p.solved());
  EXPECT_EQ(p.statistics.iterations, 0);
  EXPECT_EQ(p.tree.size(), 1);
  EXPECT_EQ(p.legs.size(), 3u);
}

TEST(Legs, OtherGoalsOnTheWayAreNotResumedAndNoneIsTheOldFile) {
  const Toy toy;
  Settings s = three_legs(true);
  s.max_iterations = 5;
  const Plan p = plan(toy, s);
  for (const auto& change : std::vector<std::function<void(Settings&)>>{
           [](Settings& t) { t.via.clear(); }, [](Settings& t) { t.via.pop_back(); },
           [](Settings& t) { t.via[1].rest = false; }, [](Settings& t) { t.via[0].goal.radius_m = 0.2; },
           [](Settings& t) { std::swap(t.via[0], t.via[1]); }}) {
    Settings changed = s;
    change(changed);
    EXPECT_THROW(plan(toy, changed, p), InputError);
  }
  s.via[0].goal.radius_m = 0;
  EXPECT_THROW(plan(toy, s), InputError);
  EXPECT_FALSE(json_of(toy_settings()).contains("via")) << "of one goal all is as it was";
}

TEST(Legs, LegsThatContradictTheTreeAreAnInputError) {
  const TemporaryFolder folder;
  const fs::path file = folder / "plan.npz";
  const Plan p = plan(Toy(), three_legs(true));
  ASSERT_TRUE(p.solved());
  write_plan(file, p, {});
  const Npz good = read_npz(file);
  const Json meta = parse_json(good.text("meta.json"), "meta.json");
  const std::vector<int> path = path_to(p.tree, p.goal_node);
  int off_path = 1;
  while (std::count(path.begin(), path.end(), off_path) > 0) ++off_path;
  for (const auto& [spoil, why] : std::vector<std::pair<std::function<void(Json&)>, const char*>>{
           {[](Json& m) { m.erase("legs"); }, "none"},
           {[](Json& m) { m["legs"] = Json::array(); }, "empty"},
           {[](Json& m) { m["legs"].erase(2); }, "solved without the last"},
           {[](Json& m) { m["legs"].push_back(m["legs"][2]); }, "more than goals"},
           {[](Json& m) { std::swap(m["legs"][1], m["legs"][2]); }, "out of order"},
           {[&](Json& m) { m["legs"][1]["root"] = off_path; }, "off the path"},
           {[](Json& m) { m["legs"][1]["root"] = 1000000; }, "no node"},
           {[](Json& m) { m["legs"][2]["first_iteration"] = 1000000; }, "after the end"},
           {[](Json& m) { m["legs"][0]["root"] = m["legs"][1]["root"]; }, "not from the start"},
           {[](Json& m) { m["legs"][1]["root"] = "two"; }, "a word"}}) {
    Json changed = meta;
    spoil(changed);
    Npz bad = good;
    bad.texts["meta.json"] = changed.dump();
    write_npz(file, bad);
    EXPECT_THROW(read_plan(file), InputError) << why;
  }
}

// Shortcuts change the last leg only; improving searches all legs anew.
TEST(Legs, AShorterPathStillVisitsAllGoals) {
  for (const bool rest : {false, true}) {
    const Toy toy(5, true, true, 1.6f);
    Plan p = plan(toy, three_legs(rest));
    ASSERT_TRUE(p.solved());
    const std::vector<int> before = controls_before_legs(p);
    const std::vector<Control> controls = p.trajectory.controls;
    const std::int64_t end = p.trajectory.end.step;
    const ShortcutReport report = shorten(toy, p, {.rounds = 4});
    EXPECT_GT(report.accepted, 0);
    EXPECT_LT(p.trajectory.end.step, end);
    EXPECT_EQ(controls_before_legs(p), before);
    EXPECT_TRUE(
        std::equal(controls.begin(), controls.begin() + before.back(), p.trajectory.controls.begin()));
    expect_visits_in_order(toy, p);

    p.settings.max_iterations = 6000;
    const AnytimeReport improved = improve(toy, p, {});
    EXPECT_GT(improved.improvements.size(), 0u);
    expect_visits_in_order(toy, p);
    const Plan again = plan(toy, p.settings, p);
    EXPECT_EQ(hash_of(again.trajectory), hash_of(p.trajectory)) << "resumed, it is left as it is";
  }
}

}  // namespace
}  // namespace limber::plan
