// The node that is nearest, through trees of nodes, beside a loop over all of them: by every metric, in sets
// that are even, clustered, flat, equal, or full of ties.
#include "plan/nearest.h"

#include <gtest/gtest.h>

#include <functional>

#include "core/random.h"
#include "plan/node_selector.h"

namespace limber::plan {
namespace {

// Two nodes; the first is the robot's centre. It has no dynamics.
struct Dots final : System {
  bool carried = false;
  double drag_per_s = 0;
  Vec3 goal_velocity_m_s = Vec3::Zero();
  Carriers both{{0, 1}, {Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0)}, Vec3::Zero()};

  static Vec3 at(const std::vector<float>& all, int node) {
    return Vec3f(&all[std::size_t(3 * node)]).cast<double>();
  }
  State start() const override { return {0, std::vector<float>(6), std::vector<float>(6)}; }
  Vec3 robot_center(const State& s) const override { return at(s.positions, 0); }
  Vec3 robot_velocity(const State& s) const override { return at(s.velocities, 0); }
  double robot_mass_kg() const override { return 2; }
  double robot_drag_per_s() const override { return drag_per_s; }
  double mean_speed(const State&) const override { return 0; }
  int robot_nodes() const override { return 2; }
  const Carriers* carriers() const override { return carried ? &both : nullptr; }
  NodePlace node_place(const State& s, int node) const override {
    return {at(s.positions, node), at(s.velocities, node)};
  }
  Box sample_bounds() const override { return {Vec3(0, 0, 0), Vec3(4, 3, 2)}; }
  double dt_s() const override { return 0.01; }
  std::uint64_t hash() const override { return 0; }
  Vec3 goal_shift(const State& s) const override { return goal_velocity_m_s * (double(s.step) * dt_s()); }
  Vec3 goal_velocity(const State&) const override { return goal_velocity_m_s; }
  Workspace workspace() const override { return {}; }
  std::unique_ptr<Propagator> make_propagator() const override { return nullptr; }
};

using Numbers = std::vector<float>;
struct Kind {
  const char* name;
  std::function<void(Rng&, int node, Numbers& positions, Numbers& velocities)> fill;
};

void fill_with(Rng& rng, Numbers& all, double from, double to) {
  for (float& x : all) x = float(rng.uniform(from, to));
}

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {"even",
       [](Rng& rng, int, Numbers& x, Numbers& v) { fill_with(rng, x, 0, 3), fill_with(rng, v, -2, 2); }},
      {"at rest", [](Rng& rng, int, Numbers& x, Numbers&) { fill_with(rng, x, 0, 3); }},
      {"ties",
       [](Rng& rng, int, Numbers& x, Numbers& v) {
         for (float& number : x) number = float(rng.below(3));
         for (float& number : v) number = float(rng.below(3) - 1);
       }},
      {"clusters",
       [](Rng& rng, int, Numbers& x, Numbers& v) {
         fill_with(rng, x, 0, 1e-4), fill_with(rng, v, -5, 5);
         const float far = float(rng.below(3));
         for (float& number : x) number += far;
       }},
      {"a line, in order",
       [](Rng& rng, int node, Numbers& x, Numbers& v) {
         x[0] = x[3] = float(node) * 1e-3f;
         fill_with(rng, v, -1, 1);
       }},
      {"a plane", [](Rng& rng, int, Numbers& x, Numbers&) { fill_with(rng, x, 0, 3), x[2] = x[5] = 1; }},
      {"all the same", [](Rng&, int, Numbers& x, Numbers&) { x = {1, 1, 1, 1, 1, 1}; }},
      {"very fast",
       [](Rng& rng, int, Numbers& x, Numbers& v) { fill_with(rng, x, 0, 3), fill_with(rng, v, -1e4, 1e4); }},
      {"a grown tree, by small steps",
       [](Rng& rng, int node, Numbers& x, Numbers& v) {
         fill_with(rng, x, 1, 1 + 1e-3 * node), fill_with(rng, v, -1e-3 * node, 1e-3 * node);
       }},
  };
  return all;
}

int first_of_least(const NodeSelector& selector, const Sample& d, int nodes) {
  int best = 0;
  for (int n = 1; n < nodes; ++n)
    if (selector.cost(d, n) < selector.cost(d, best)) best = n;
  return best;
}

Settings settings_for(Metric metric, double time_weight) {
  Settings s;
  s.max_force_n = 6, s.max_force_share = 1;
  s.goal.center_of_mass_m = Vec3(1, 1, 1), s.goal.radius_m = 0.1;
  s.search_options.metric = metric, s.search_options.time_weight = time_weight;
  return s;
}

struct Case {
  std::string name;
  Dots dots;
  Settings settings;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Vec3& moves : {Vec3(0, 0, 0), Vec3(0.3, 0, -0.1)}) {
    const std::string goal = moves.norm() > 0 ? ", the goal moves" : "";
    Dots dots;
    dots.goal_velocity_m_s = moves;
    all.push_back({"distance" + goal, dots, settings_for(Metric::distance, 0)});
    all.push_back({"time" + goal, dots, settings_for(Metric::time_to_go, 0)});
    all.push_back({"time, weighted" + goal, dots, settings_for(Metric::time_to_go, 0.3)});
    dots.drag_per_s = 1.5;
    all.push_back({"time, slowed" + goal, dots, settings_for(Metric::time_to_go, 0.1)});
    dots.carried = true;
    all.push_back({"two carriers, slowed" + goal, dots, settings_for(Metric::time_to_go, 0.1)});
    dots.drag_per_s = 0;
    all.push_back({"two carriers" + goal, dots, settings_for(Metric::time_to_go, 0)});
  }
  return all;
}

// Points are asked for at nodes, too, where costs are 0 and ties many. Some nodes are refused on the way, and
// with them whole neighbourhoods.
TEST(NodeSelector, ChoosesThroughTreesAsByALoop) {
  for (const Case& c : cases())
    for (const Kind& kind : kinds())
      for (const std::uint64_t seed : {1, 2}) {
        SCOPED_TRACE(fmt::format("{}; {}; seed {}", c.name, kind.name, seed));
        Rng rng(seed, 0);
        NodeSelector selector(c.dots, c.settings, nullptr, 0, 16);
        Tree tree;
        for (int n = 0; n < 300; ++n) {
          State state = c.dots.start();
          state.step = rng.below(300);
          kind.fill(rng, n, state.positions, state.velocities);
          tree.add(state, n - 1, {}, n - 1, c.dots.robot_center(state).cast<float>());
          selector.add(tree, n);
          if (n > 0 && rng.below(5) == 0)
            if (const int node = 1 + rng.below(n); !selector.refused(node)) selector.refuse(node);
          if (n % 11 != 0 && n < 290) continue;
          Sample d;
          d.towards_goal = rng.below(4) == 0;
          d.aside = rng.direction();
          for (int axis = 0; axis < 3; ++axis) d.point[axis] = rng.uniform(-1, 4);
          if (rng.below(3) == 0) d.point = tree.centers[rng.below(n + 1)].cast<double>();
          if (d.towards_goal) d.point = c.settings.goal.center_of_mass_m;
          ASSERT_EQ(selector.choose(d).node, first_of_least(selector, d, n + 1)) << n;
        }
      }
}

// A search goes through the trees of the default size, too.
TEST(NodeSelector, ChoosesByALoopOfThousands) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    Rng rng(5, 0);
    NodeSelector selector(c.dots, c.settings, nullptr, 0);
    Tree tree;
    for (int n = 0; n < 4200; ++n) {
      State state = c.dots.start();
      state.step = rng.below(300);
      kinds()[std::size_t(n % 2)].fill(rng, n, state.positions, state.velocities);
      tree.add(state, n - 1, {}, n - 1, c.dots.robot_center(state).cast<float>());
      selector.add(tree, n);
    }
    for (int k = 0; k < 5; ++k) {
      Sample d;
      d.aside = rng.direction();
      for (int axis = 0; axis < 3; ++axis) d.point[axis] = rng.uniform(-0.5, 3.5);
      ASSERT_EQ(selector.choose(d).node, first_of_least(selector, d, tree.size())) << k;
    }
  }
}

// Where all places are one, no more is asked than where they differ: of equals only an earlier one counts.
TEST(NearestForest, AsksFewAlsoWhereAllAreEqual) {
  NearestForest<ByDistance> forest(64);
  for (int n = 0; n < 1 << 14; ++n) forest.add({n, Vec3f(1, 2, 3)});
  int asked = 0;
  Nearest found{1 << 14, 0};
  forest.search(DistanceQuery{Vec3f(1, 2, 3), [&](int) { return ++asked, 0.0; }}, found);
  EXPECT_EQ(found.node, 0);
  EXPECT_LE(asked, 16);
}

}  // namespace
}  // namespace limber::plan
