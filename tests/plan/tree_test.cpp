#include "plan/tree.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace limber::plan {
namespace {

int nearest_by_hand(const Centers& centers, const Vec3f& p) {
  int best = 0;
  for (int i = 1; i < centers.size(); ++i)
    if (squared_distance(centers[i], p) < squared_distance(centers[best], p)) best = i;
  return best;
}

TEST(Nearest, EqualsTheLoopByHand) {
  Rng rng(11, 0);
  for (const int n : {1, 2, 7, 8, 9, 15, 16, 17, 100, 1001}) {
    Centers centers;
    for (int i = 0; i < n; ++i) centers.push_back(rng.direction().cast<float>());
    for (int k = 0; k < 200; ++k) {
      const Vec3f p = rng.direction().cast<float>();
      ASSERT_EQ(nearest(centers, p), nearest_by_hand(centers, p)) << n;
    }
  }
}

// On a small integer lattice most distances are shared by several centres, exactly.
TEST(Nearest, TheFirstOfEqualsWins) {
  Rng rng(12, 0);
  const auto lattice_point = [&] {
    return Vec3f(float(rng.below(3)), float(rng.below(3)), float(rng.below(3)));
  };
  for (int n = 1; n < 60; ++n) {
    Centers centers;
    for (int i = 0; i < n; ++i) centers.push_back(lattice_point());
    for (int k = 0; k < 50; ++k) {
      const Vec3f p = lattice_point();
      ASSERT_EQ(nearest(centers, p), nearest_by_hand(centers, p)) << n;
    }
  }
}

TEST(Tree, HashSeesEveryField) {
  const auto make_with = [](const State& state) {
    Tree tree;
    tree.add({0, {0, 0, 0}, {0, 0, 0}}, -1, Control{}, -1, Vec3f(0, 0, 0));
    Control control;
    control.manipulation = Manipulation::body;
    control.force_n = Vec3f(1, 2, 3);
    control.steps = 4;
    tree.add(state, 0, control, 0, Vec3f(1, 0, 0));
    return tree;
  };
  const auto make = [&] { return make_with({4, {1, 0, 0}, {2, 0, 0}}); };
  const std::uint64_t hash = hash_of(make());
  EXPECT_EQ(hash_of(make()), hash);
  const std::vector<std::function<void(Tree&)>> changes = {
      [&](Tree& t) {
        t = make_with({5, {1, 0, 0}, {2, 0, 0}});
      },
      [&](Tree& t) {
        t = make_with({4, {1, 0, 1e-30f}, {2, 0, 0}});
      },
      [&](Tree& t) {
        t = make_with({4, {1, 0, 0}, {3, 0, 0}});
      },
      [](Tree& t) { t.parents[1] = 1; },
      [](Tree& t) { t.iterations[1] = 1; },
      [](Tree& t) { t.centers.z[1] = 1; },
      [](Tree& t) { t.controls[1].manipulation = Manipulation::none; },
      [](Tree& t) { t.controls[1].force_n.y() = 0; },
      [](Tree& t) { t.controls[1].node = 0; },
      [](Tree& t) { t.controls[1].radius_m = 1; },
      [](Tree& t) { t.controls[1].target_m.x() = 1; },
      [](Tree& t) { t.controls[1].max_force_n = 1; },
      [](Tree& t) { t.controls[1].steps = 5; }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Tree changed = make();
    changes[i](changed);
    EXPECT_NE(hash_of(changed), hash) << "change " << i;
  }
}

// Two bodies of 1,000 nodes; only the first moves. What comes out has the very bits that went in, also where
// 0 became −0, and the second body is held once.
TEST(States, ShareWhatDidNotChangeAndGiveItBack) {
  Rng rng(13, 0);
  constexpr std::size_t body = 3000;
  std::vector<State> given;
  std::vector<int> parents;
  States states;
  for (int i = 0; i < 200; ++i) {
    const int parent = i == 0 ? -1 : rng.below(i);
    State state = i == 0 ? State{0, std::vector<float>(2 * body + 3), std::vector<float>(2 * body + 3)}
                         : given[std::size_t(parent)];
    state.step = i;
    for (std::size_t k = 0; k < body; ++k) {
      state.positions[k] = float(rng.uniform(-1, 1));
      state.velocities[k] = rng.below(2) == 0 ? 0.0f : -0.0f;
    }
    given.push_back(state);
    parents.push_back(parent);
    states.push_back(state, parent);
  }
  ASSERT_EQ(states.size(), 200);
  for (std::size_t i = 0; i < given.size(); ++i)
    EXPECT_EQ(limber::hash_of(states[i]), limber::hash_of(given[i])) << i;
  const double changed = double(given.size()) * double(2 * body * sizeof(float));
  EXPECT_LT(double(states.bytes()), 1.1 * changed);
  EXPECT_GT(double(states.bytes_unshared()), 2 * changed);
}

TEST(Tree, PathLeadsFromTheStart) {
  Tree tree;
  const State s{0, {0, 0, 0}, {0, 0, 0}};
  for (const int parent : {-1, 0, 0, 1, 3, 2}) tree.add(s, parent, Control{}, 0, Vec3f::Zero());
  EXPECT_EQ(path_to(tree, 4), (std::vector<int>{0, 1, 3, 4}));
  EXPECT_EQ(path_to(tree, 0), (std::vector<int>{0}));
}

}  // namespace
}  // namespace limber::plan
