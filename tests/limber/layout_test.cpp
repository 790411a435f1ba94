// Surfaces that overlap are parted.
#include "limber/detail/authoring/layout.h"

#include <gtest/gtest.h>

#include <map>

#include "meshing/contact_shape.h"
#include "scenes/shapes.h"

namespace limber::detail {
namespace {

// Its shape is made once a size, and moved.
LaidBody cube(const Vec3& center, double edge = 1, bool held = false) {
  static std::map<double, ContactShape> made;
  if (!made.contains(edge)) {
    const TetMesh cage = scenes::make_box_cage(Vec3::Constant(edge), {2, 2, 2});
    made[edge] = meshing::make_contact_shape({cage.positions, boundary_triangles(cage.tets)}, cage,
                                             {.cells = 48, .max_cells = 48});
  }
  ContactShape shape = made[edge];
  shape.field.lower_m += center, shape.samples.positions_m.rowwise() += center.transpose();
  return {std::make_shared<const ContactShape>(std::move(shape)), held};
}

double deepest(const std::vector<LaidBody>& bodies, const std::vector<Vec3>& ways) {
  double depth = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    for (std::size_t j = i + 1; j < bodies.size(); ++j)
      if (!bodies[i].held || !bodies[j].held)
        depth = std::max(depth, nearness(*bodies[i].shape, ways[i], *bodies[j].shape, ways[j], 0).depth_m);
  return depth;
}

// A row, a heap, one in the corner of another, one that is held between two.
std::vector<std::vector<LaidBody>> heaps() {
  return {{cube({0, 0, 0}), cube({0.9, 0.1, 0}), cube({1.7, 0, 0.2})},
          {cube({0, 0, 0}), cube({0.7, 0.6, 0.1}), cube({0.1, 0.7, 0.7}), cube({0.6, 0, 0.8})},
          {cube({0, 0, 0}), cube({0.6, 0.6, 0.6}, 0.5)},
          {cube({-0.8, 0, 0}), cube({0, 0.1, 0}, 1, true), cube({0.8, 0, 0.1})}};
}

TEST(Layout, NoTwoOverlapAfterwards) {
  for (const auto& bodies : heaps()) {
    ASSERT_GT(deepest(bodies, std::vector<Vec3>(bodies.size(), Vec3::Zero())), 0.01);
    const auto ways = ways_apart(bodies, 0, 2);
    ASSERT_TRUE(ways);
    EXPECT_EQ(deepest(bodies, *ways), 0);
    for (std::size_t i = 0; i < bodies.size(); ++i)
      if (bodies[i].held) {
        EXPECT_EQ((*ways)[i], Vec3::Zero());
      }
    EXPECT_EQ(ways_apart(bodies, 0, 2), ways);
  }
}

// Two cubes 0.1 in one another, face to face, part by 0.1 in all and no farther than a slack.
TEST(Layout, GoesNoFartherThanItMust) {
  const std::vector<LaidBody> bodies{cube({0, 0, 0}), cube({0.9, 0, 0})};
  const auto ways = ways_apart(bodies, 0, 1);
  ASSERT_TRUE(ways);
  EXPECT_NEAR((*ways)[1].x() - (*ways)[0].x(), 0.1, 0.01);
  EXPECT_LT(std::abs((*ways)[0].y()) + std::abs((*ways)[0].z()), 0.01);
}

// Two cubes that are 0.015 in one another go on to the room that is asked for; with a gap of their own they
// keep it, also when a third comes between others.
TEST(Layout, LeavesTheRoomThatIsAskedForOrThatThereWas) {
  const auto ways = ways_apart({cube({0, 0, 0}), cube({0.985, 0, 0})}, 0.012, 1);
  ASSERT_TRUE(ways);
  EXPECT_NEAR((*ways)[1].x() - (*ways)[0].x(), 0.027, 0.004);
  const auto stay = ways_apart({cube({0, 0, 0}), cube({1.006, 0, 0})}, 0.012, 1);
  ASSERT_TRUE(stay);
  EXPECT_EQ((*stay)[0], Vec3::Zero());
  EXPECT_EQ((*stay)[1], Vec3::Zero());
  // The middle one of three has 0.006 of room on both sides, and nowhere to go: the fourth gives way.
  const auto four = ways_apart(
      {cube({0, 0, 0}, 1, true), cube({1.006, 0, 0}), cube({2.012, 0, 0}, 1, true), cube({1.006, 0.9, 0})},
      0.012, 1);
  ASSERT_TRUE(four);
  EXPECT_NEAR((*four)[1].x(), 0, 0.004);
}

TEST(Layout, WhatIsApartStays) {
  const auto ways = ways_apart({cube({0, 0, 0}), cube({1.1, 0, 0})}, 0.05, 1);
  ASSERT_TRUE(ways);
  EXPECT_EQ((*ways)[0], Vec3::Zero());
  EXPECT_EQ((*ways)[1], Vec3::Zero());
}

// What is held twice is in one's own way.
TEST(Layout, SaysWhereThereIsNoWay) {
  EXPECT_FALSE(ways_apart({cube({0, 0, 0}), cube({0.5, 0, 0})}, 0, 0.1));
  EXPECT_TRUE(ways_apart({cube({0, 0, 0}, 1, true), cube({0.5, 0, 0}, 1, true)}, 0, 0.1));
}

}  // namespace
}  // namespace limber::detail
