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
  const auto make = [] {
    Tree tree;
    tree.add({0, {0, 0, 0}, {0, 0, 0}}, -1, Control{}, -1, Vec3f(0, 0, 0));
    Control control;
    control.manipulation = Manipulation::body;
    control.force_n = Vec3f(1, 2, 3);
    control.steps = 4;
    tree.add({4, {1, 0, 0}, {2, 0, 0}}, 0, control, 0, Vec3f(1, 0, 0));
    return tree;
  };
  const std::uint64_t hash = hash_of(make());
  EXPECT_EQ(hash_of(make()), hash);
  const std::vector<std::function<void(Tree&)>> changes = {
      [](Tree& t) { t.states[1].step = 5; },
      [](Tree& t) { t.states[1].positions[2] = 1e-30f; },
      [](Tree& t) { t.states[1].velocities[0] = 3; },
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

TEST(Tree, PathLeadsFromTheStart) {
  Tree tree;
  const State s{0, {0, 0, 0}, {0, 0, 0}};
  for (const int parent : {-1, 0, 0, 1, 3, 2}) tree.add(s, parent, Control{}, 0, Vec3f::Zero());
  EXPECT_EQ(path_to(tree, 4), (std::vector<int>{0, 1, 3, 4}));
  EXPECT_EQ(path_to(tree, 0), (std::vector<int>{0}));
}

}  // namespace
}  // namespace limber::plan
