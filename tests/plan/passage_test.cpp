// The widest way between what is rigid, beside lengths known by construction.
#include "plan/passage.h"

#include <gtest/gtest.h>

namespace limber::plan {
namespace {

constexpr double cell = 0.1;

// A box 4 × 2 × 2 with a rigid plate across x = 2, one cell thick, with a window of 2 a × 2 b in its middle.
Workspace room(int half_window_y, int half_window_z, Workspace::Cell plate = Workspace::rigid) {
  Workspace space;
  space.box = {Vec3(0, 0, 0), Vec3(4, 2, 2)};
  space.cell_m = cell;
  space.cells = {40, 20, 20};
  space.what.assign(40 * 20 * 20, Workspace::open);
  for (int z = 0; z < 20; ++z)
    for (int y = 0; y < 20; ++y) {
      const bool window =
          std::abs(2 * y + 1 - 20) < 2 * half_window_y && std::abs(2 * z + 1 - 20) < 2 * half_window_z;
      if (!window) space.what[std::size_t((z * 20 + y) * 40 + 20)] = plate;
    }
  return space;
}

const Vec3 from(0.5, 1, 1);
const Goal goal{Vec3(3.5, 1, 1), 0.05};

TEST(Passage, IsAsWideAsTheNarrowestPlaceOfTheWidestWay) {
  for (int half = 1; half <= 5; ++half) {
    SCOPED_TRACE(half);
    // The middle of a cell lies up to half a cell beside the window's axis, in each direction.
    EXPECT_NEAR(widest_passage_m(room(half, half), from, goal), half * cell, 0.5 * cell + 1e-6);
    // A slit is as wide as it is low.
    EXPECT_NEAR(widest_passage_m(room(8, half), from, goal), half * cell, 0.5 * cell + 1e-6);
  }
}

TEST(Passage, IsNegativeOnlyWhereNotEvenAPointPasses) {
  EXPECT_LT(widest_passage_m(room(0, 0), from, goal), 0);
  EXPECT_GT(widest_passage_m(room(1, 1), from, goal), 0);
  EXPECT_GT(widest_passage_m(room(0, 0), from, Goal{Vec3(1.5, 1, 1), 0.05}), 0);  // on this side of the plate
}

TEST(Passage, WhatIsSoftDoesNotForbid) {
  const double free_way = widest_passage_m(room(20, 20), from, goal);
  EXPECT_EQ(widest_passage_m(room(0, 0, Workspace::soft), from, goal), free_way);
  EXPECT_NEAR(free_way, 0.5,
              0.5 * cell + 1e-6);  // the start's and the goal's distance to the walls behind them
  Workspace open = room(20, 20);
  open.walls = false;
  EXPECT_GT(widest_passage_m(open, from, goal), 1e3);
}

// Turned round the long axis, mirrored, or walked backwards: the same way.
TEST(Passage, DoesNotDependOnTheDirection) {
  const double forth = widest_passage_m(room(3, 2), from, goal);
  EXPECT_EQ(widest_passage_m(room(2, 3), from, goal), forth);
  EXPECT_EQ(widest_passage_m(room(3, 2), goal.center_of_mass_m, Goal{from, 0.05}), forth);
}

}  // namespace
}  // namespace limber::plan
