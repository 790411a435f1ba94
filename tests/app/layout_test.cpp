// Cages that overlap are parted.
#include "app/layout.h"

#include <gtest/gtest.h>

#include "fem/world.h"
#include "scenes/shapes.h"

namespace limber::app {
namespace {

LaidCage cube(const Vec3& center, double edge = 1, bool held = false) {
  LaidCage laid{scenes::make_box_cage(Vec3::Constant(edge), {2, 2, 2}), held};
  laid.cage.positions.rowwise() += center.transpose();
  return laid;
}

double deepest(std::vector<LaidCage> cages, const std::vector<Vec3>& ways) {
  for (std::size_t i = 0; i < cages.size(); ++i) cages[i].cage.positions.rowwise() += ways[i].transpose();
  double depth = 0;
  for (std::size_t i = 0; i < cages.size(); ++i)
    for (std::size_t j = i + 1; j < cages.size(); ++j)
      if (!cages[i].held || !cages[j].held)
        depth = std::max(depth, fem::cage_overlap(cages[i].cage, cages[j].cage).depth_m);
  return depth;
}

// A row, a heap, one in the corner of another, one that is held between two.
std::vector<std::vector<LaidCage>> heaps() {
  return {{cube({0, 0, 0}), cube({0.9, 0.1, 0}), cube({1.7, 0, 0.2})},
          {cube({0, 0, 0}), cube({0.7, 0.6, 0.1}), cube({0.1, 0.7, 0.7}), cube({0.6, 0, 0.8})},
          {cube({0, 0, 0}), cube({0.6, 0.6, 0.6}, 0.5)},
          {cube({-0.8, 0, 0}), cube({0, 0.1, 0}, 1, true), cube({0.8, 0, 0.1})}};
}

TEST(Layout, NoTwoOverlapAfterwards) {
  for (const auto& cages : heaps()) {
    ASSERT_GT(deepest(cages, std::vector<Vec3>(cages.size(), Vec3::Zero())), 0.01);
    const auto ways = ways_apart(cages, 2);
    ASSERT_TRUE(ways);
    EXPECT_EQ(deepest(cages, *ways), 0);
    for (std::size_t i = 0; i < cages.size(); ++i)
      if (cages[i].held) {
        EXPECT_EQ((*ways)[i], Vec3::Zero());
      }
    EXPECT_EQ(ways_apart(cages, 2), ways);
  }
}

// Two cubes 0.1 in one another, face to face, part by 0.1 in all and no farther than a slack.
TEST(Layout, GoesNoFartherThanItMust) {
  const std::vector<LaidCage> cages{cube({0, 0, 0}), cube({0.9, 0, 0})};
  const auto ways = ways_apart(cages, 1);
  ASSERT_TRUE(ways);
  EXPECT_NEAR((*ways)[1].x() - (*ways)[0].x(), 0.1, 0.005);
  EXPECT_LT(std::abs((*ways)[0].y()) + std::abs((*ways)[0].z()), 1e-9);
}

TEST(Layout, WhatIsApartStays) {
  const auto ways = ways_apart({cube({0, 0, 0}), cube({1.1, 0, 0})}, 1);
  ASSERT_TRUE(ways);
  EXPECT_EQ((*ways)[0], Vec3::Zero());
  EXPECT_EQ((*ways)[1], Vec3::Zero());
}

// What is held twice is in one's own way.
TEST(Layout, SaysWhereThereIsNoWay) {
  EXPECT_FALSE(ways_apart({cube({0, 0, 0}), cube({0.5, 0, 0})}, 0.1));
  EXPECT_TRUE(ways_apart({cube({0, 0, 0}, 1, true), cube({0.5, 0, 0}, 1, true)}, 0.1));
}

}  // namespace
}  // namespace limber::app
