// What the preset `fast` adds to Algorithm 1: with a lag, guidance, steering and looks the tree is still a
// function of system and settings alone.
#include <gtest/gtest.h>

#include <cmath>

#include "core/threads.h"
#include "plan/node_selector.h"
#include "plan/search.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::passes;
using testing::Threads;
using testing::Toy;
using testing::toy_settings;

Settings fast_settings() {
  Settings s = toy_settings();
  s.min_force_share = 0.8, s.max_duration_s = 3;
  s.search_options = {.lag = 5,
                      .metric = Metric::time_to_go,
                      .guidance = 0.7,
                      .soft_price = 10,
                      .learn_prices = true,
                      .density_price = 0.3,
                      .steer = true,
                      .look_s = 0.1,
                      .stop_in_goal = true,
                      .hold = true,
                      .end_hopeless = true};
  s.settle.max_duration_s = 10, s.settle.hold = true;
  return s;
}

void for_point_and_chain(const std::function<void(Toy&)>& law) {
  Toy point(1, true, false, 99), chain(5, true, true, 1.6f);
  for (Toy* toy : {&point, &chain}) {
    SCOPED_TRACE(toy->nodes);
    law(*toy);
  }
}

// One expansion after the other; each is chosen by a chooser that was told of the nodes of all expansions but
// the lag before it.
Tree lagged_tree(const System& system, const Settings& s, std::int64_t iterations) {
  Tree all;
  const State start = system.start();
  all.add(start, -1, Control{}, -1, system.robot_center(start).cast<float>());
  const Guidance guidance(system.workspace(), s.goal.center_of_mass_m, s.search_options.soft_price);
  const auto propagator = system.make_propagator();
  for (std::int64_t i = 0; i < iterations; ++i) {
    NodeSelector selector(system, s, s.search_options.guidance > 0 ? &guidance : nullptr, 0);
    for (int node = 0; node < all.size(); ++node)
      if (node == 0 || all.iterations[std::size_t(node)] < i - s.search_options.lag) selector.add(all, node);
    const Selection aim = selector.choose(draw_sample(s, system, i));
    const State from = all.states[std::size_t(aim.node)];
    Rollout r{&from, aim.control, {}, false};
    if (passes(system, s, *propagator, r))
      all.add(r.to, aim.node, aim.control, i, system.robot_center(r.to).cast<float>());
  }
  return all;
}

TEST(SearchOptions, ALaggingTreeIsTheSequentialOneOfItsRule) {
  for_point_and_chain([](Toy& toy) {
    for (const int lag : {1, 5, 31}) {
      Settings s = fast_settings();
      s.search_options.lag = lag;
      s.search_options.look_s = 0,
      s.search_options.stop_in_goal = s.search_options.end_hopeless = false;  // rollouts are whole
      s.goal.radius_m = 1e-6;                                                 // never reached
      s.max_iterations = 60;
      EXPECT_EQ(hash_of(plan(toy, s).tree), hash_of(lagged_tree(toy, s, 60))) << lag;
    }
  });
}

// Settings under which some ways to the goal go above what may be shown, and a point that they lead.
constexpr float low = 1.2f;
std::vector<Settings> refusing_settings() {
  Settings paper = toy_settings(), fast = fast_settings();
  paper.settle.max_duration_s = 10;
  paper.max_iterations = fast.max_iterations = 500;
  return {paper, fast};
}

// Of each node, in the order in which they came, found once more by what is simulated: where it ends a way to
// the goal that goes too high, nothing grows from the edge that does so first; where it does not, it is the
// solution.
// Nodes of one state and one place, near the goal, each the child of the one before, and the root far off.
// The k-th of them has the promise T + c (1 + p k), the root T' + c, so those that rank before the root are a
// number that goes with 1/p.
TEST(SearchOptions, WhereManyNodesAreOthersComeFirst) {
  const Toy toy;
  Settings s = fast_settings();
  s.search_options.time_weight = 0;
  constexpr int crowd = 400;
  const auto before_root = [&](double price, bool apart) {
    s.search_options.density_price = price;
    Tree tree;
    const State start = toy.start();
    tree.add(start, -1, Control{}, -1, toy.robot_center(start).cast<float>());
    const Vec3 near = s.goal.center_of_mass_m - Vec3(2 * s.goal.radius_m, 0, 0);
    const double cell_m = 0.5 * toy.workspace().robot_radius_m;
    for (int k = 0; k < crowd; ++k)  // apart: in forty cells one on the other
      tree.add(start, k, Control{}, k,
               (near + (apart ? Vec3(0, 0, cell_m * (k % 40 - 20)) : Vec3(0, 0, 0))).cast<float>());
    const Guidance guidance(toy.workspace(), s.goal.center_of_mass_m, s.search_options.soft_price);
    NodeSelector selector(toy, s, &guidance, 0);
    for (int n = 0; n < tree.size(); ++n) selector.add(tree, n);
    Sample d = draw_sample(s, toy, 0);
    d.guided = true;
    int before = 0;
    for (; before < crowd; ++before) {
      d.rank = std::log(before + 1.5) / std::log(crowd + 2.0);  // the rank `before`
      if (selector.choose(d).node == 0) break;
    }
    return before;
  };
  EXPECT_EQ(before_root(0, false), crowd);
  const int once = before_root(0.1, false);
  EXPECT_GT(once, 20);
  EXPECT_LT(once, crowd / 2);
  EXPECT_NEAR(before_root(0.2, false), once / 2.0, 1);
  EXPECT_NEAR(before_root(0.4, false), once / 4.0, 1);
  EXPECT_EQ(before_root(0.1, true), crowd);  // ten a cell
}

TEST(SearchOptions, NothingGrowsFromARefusedEdge) {
  Toy toy(1, true, false, 99);
  toy.refused_above_z = low;
  for (Settings s : refusing_settings()) {
    SCOPED_TRACE(s.search_options.lag);
    std::int64_t refused = 0, solved = 0;
    for (s.seed = 1; s.seed <= 12; ++s.seed) {
      const Plan p = plan(toy, s);
      std::vector<int> barren;
      for (int n = 1; n < p.tree.size(); ++n) {
        const std::vector<int> path = path_to(p.tree, n);
        for (const int node : barren)
          ASSERT_EQ(std::count(path.begin(), path.end(), node), 0) << "node " << n << ", seed " << s.seed;
        const State state = p.tree.states[std::size_t(n)];
        if (!holds(s.goal, toy.robot_center(state)) || !comes_to_rest(toy, s, state)) continue;
        const Trajectory way = trajectory_to(toy, s, p.tree, n, true);
        const std::size_t first = toy.first_refused(way.frames);
        ASSERT_EQ(first == way.frames.size(), n == p.goal_node);
        if (n == p.goal_node) break;
        const auto edge = std::find_if(path.begin(), path.end() - 1, [&](int node) {
          return p.tree.states[std::size_t(node)].step >= way.frames[first].step;
        });
        barren.push_back(*edge);
      }
      EXPECT_EQ(p.statistics.refused, std::int64_t(barren.size()));
      EXPECT_EQ(explain(p).find("were refused") != std::string::npos, !p.solved() && !barren.empty());
      EXPECT_EQ(p.statistics.last_refusal, barren.empty() ? "" : "it is too high");
      for (int node : path_to(p.tree, p.best_node))
        EXPECT_EQ(std::count(barren.begin(), barren.end(), node), 0) << "the best is of a refused way";
      refused += p.statistics.refused, solved += p.solved();
    }
    EXPECT_GT(refused, 4);
    EXPECT_TRUE(s.search_options.lag > 0 || solved > 6) << solved;
  }
}

TEST(SearchOptions, RefusingGivesTheSameBytesForAnyThreadsAndLanesAndInParts) {
  Toy toy(1, true, false, 99);
  toy.refused_above_z = low;
  for (Settings s : refusing_settings()) {
    SCOPED_TRACE(s.search_options.lag);
    int refusing = 0;
    for (s.seed = 1; s.seed <= 12 && refusing < 2; ++s.seed) {
      const Plan whole = plan(toy, s);
      if (whole.statistics.refused == 0) continue;
      ++refusing;
      const auto same = [&](const Plan& p) {
        EXPECT_EQ(hash_of(p.tree), hash_of(whole.tree)) << s.seed;
        EXPECT_EQ(hash_of(p.trajectory), hash_of(whole.trajectory));
        EXPECT_EQ(p.statistics.refused, whole.statistics.refused);
        EXPECT_EQ(p.statistics.rejected, whole.statistics.rejected);
        EXPECT_EQ(p.best_node, whole.best_node);
        EXPECT_EQ(p.best_distance_m, whole.best_distance_m);
      };
      for (const auto& [threads, lanes] : {std::pair(1, 16), std::pair(2, 3)}) {
        const Threads limited(threads);
        toy.lanes_wanted = lanes;
        same(plan(toy, s));
      }
      toy.lanes_wanted = 1;
      for (std::int64_t cut = 0; cut < whole.statistics.iterations;
           cut += 1 + whole.statistics.iterations / 3) {
        Settings part = s;
        part.max_iterations = cut;
        same(plan(toy, s, plan(toy, part)));
      }
    }
    EXPECT_EQ(refusing, 2);
  }
}

TEST(SearchOptions, SameBytesForAnyThreadsAndLanes) {
  for_point_and_chain([](Toy& toy) {
    const Settings s = fast_settings();
    std::optional<Plan> first;
    for (const int threads : {1, 2})
      for (const int lanes : {1, 3, 16}) {
        const Threads limited(threads);
        toy.jitter = threads > 1 && toy.nodes == 1;
        toy.lanes_wanted = lanes;
        const Plan p = plan(toy, s);
        ASSERT_TRUE(p.solved());
        EXPECT_EQ(p.statistics.rollouts_wrong, 0) << "nothing is computed in vain";
        if (!first) first = p;
        ASSERT_EQ(hash_of(p.tree), hash_of(first->tree)) << threads << ' ' << lanes;
        ASSERT_EQ(hash_of(p.trajectory), hash_of(first->trajectory));
        ASSERT_EQ(p.statistics.rollout_steps, first->statistics.rollout_steps);
      }
  });
}

TEST(SearchOptions, CutAndResumedAnywhereEqualsUninterrupted) {
  for_point_and_chain([](Toy& toy) {
    const Settings s = fast_settings();
    const Plan whole = plan(toy, s);
    for (std::int64_t cut = 0; cut < whole.statistics.iterations;
         cut += 1 + whole.statistics.iterations / 9) {
      Settings part = s;
      part.max_iterations = cut;
      const Plan resumed = plan(toy, s, plan(toy, part));
      ASSERT_EQ(hash_of(resumed.tree), hash_of(whole.tree)) << cut;
      ASSERT_EQ(hash_of(resumed.trajectory), hash_of(whole.trajectory)) << cut;
    }
  });
}

// Seen at its looks, no push but its last state is in the goal; and it is as its stored control says.
TEST(SearchOptions, APushEndsWhereItIsSeenInTheGoal) {
  Toy toy;
  Settings s = fast_settings();
  s.settle.mean_speed_m_s = 1e-9;  // nothing is at rest: many arrive
  s.max_iterations = 120;
  const auto in_goal = [&](const State& state) {
    return (toy.robot_center(state) - s.goal.center_of_mass_m).norm() <= s.goal.radius_m;
  };
  const auto arrivals = [&](const Plan& p) {
    int count = 0;
    for (int node = 1; node < p.tree.size(); ++node) {
      State state = p.tree.states[std::size_t(p.tree.parents[std::size_t(node)])];
      const Control& c = p.tree.controls[std::size_t(node)];
      for (int step = 1; step <= c.steps; ++step) {
        EXPECT_TRUE(toy.step(c, state));
        if (step % 10 == 0 && step < c.steps && in_goal(state)) return -1;
      }
      EXPECT_EQ(state, p.tree.states[std::size_t(node)]);
      count += in_goal(state);
    }
    return count;
  };
  EXPECT_GT(arrivals(plan(toy, s)), 5);
  s.search_options.stop_in_goal = false;
  EXPECT_EQ(arrivals(plan(toy, s)), -1) << "the law makes no difference";
}

// A push into the wall that holds it is given up; without the law it lasts.
TEST(SearchOptions, AHopelessPushIsShorter) {
  Toy toy(1, true, false, 99);
  Settings s = fast_settings();
  s.search_options.guidance = 0, s.goal_bias = 1, s.weights = {1, 0, 0};
  s.search_options.steer = false, s.min_duration_s = s.max_duration_s = 8;
  s.max_iterations = 1;
  const int patient = (s.search_options.end_hopeless = false, plan(toy, s).tree.controls.at(1).steps);
  EXPECT_EQ(patient, 800);
  s.search_options.end_hopeless = true;
  const Plan p = plan(toy, s);
  EXPECT_LT(p.tree.controls.at(1).steps, patient);
  EXPECT_GT(p.tree.controls.at(1).steps, 100);  // it flew to the wall first
  EXPECT_NEAR(p.tree.centers[1].x(), 4.8, 1e-6);
}

// The law whose worth the table of docs/planning-measured.md shows, on a point before a wall with a gap.
TEST(Laws_slow, GuidanceFindsTheGapSooner) {
  Toy toy(1, true, false, 99);
  std::int64_t with = 0, without = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Settings s = fast_settings();
    s.seed = seed;
    with += plan(toy, s).statistics.iterations;
    s.search_options.guidance = 0;
    without += plan(toy, s).statistics.iterations;
  }
  EXPECT_LT(2 * with, without);
}

}  // namespace
}  // namespace limber::plan
