#include "plan/guidance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "plan/steering.h"

namespace limber::plan {
namespace {

Workspace empty_space(int nx, int ny, int nz, double cell_m, double robot_radius_m) {
  Workspace w;
  w.cells = {nx, ny, nz}, w.cell_m = cell_m, w.robot_radius_m = robot_radius_m;
  w.box = {Vec3::Zero(), cell_m * Vec3(nx, ny, nz)};
  w.what.assign(std::size_t(nx * ny * nz), Workspace::open);
  w.walls = false;
  return w;
}

// A wall across the middle of x, `what`, with openings [from, to) in y.
Workspace walled(Workspace::Cell what, const std::vector<std::pair<int, int>>& openings,
                 double robot_radius_m) {
  Workspace w = empty_space(20, 40, 5, 0.25, robot_radius_m);
  for (int z = 0; z < 5; ++z)
    for (int y = 0; y < 40; ++y) {
      bool open = false;
      for (const auto& [from, to] : openings) open = open || (y >= from && y < to);
      if (!open) w.what[std::size_t((z * 40 + y) * 20 + 10)] = what;
    }
  return w;
}

// Where the way enters the wall.
double crossing_y(const Guidance& g, Vec3 from) {
  for (int i = 0; i < 1000 && from.x() < 2.5; ++i) from = g.ahead(from, 0.1);
  return from.y();
}

TEST(Distances, AreThoseToTheNearestCell) {
  Rng rng(11, 0);
  for (const double share : {0.0, 0.002, 0.1, 1.0}) {
    const Eigen::Vector3i n(7, 11, 5);
    std::vector<bool> is(std::size_t(n.prod()));
    for (std::size_t i = 0; i < is.size(); ++i) is[i] = rng.uniform() < share;
    const std::vector<float> d = distance_in_cells(n, is);
    const auto place = [&](int c) { return Vec3(c % 7, c / 7 % 11, c / 77); };
    for (int c = 0; c < n.prod(); ++c) {
      double least = 1e9;
      for (int other = 0; other < n.prod(); ++other)
        if (is[std::size_t(other)]) least = std::min(least, (place(c) - place(other)).norm());
      ASSERT_NEAR(double(d[std::size_t(c)]), least, 1e-5 * least) << share << ' ' << c;
    }
  }
}

// A grid of 26 neighbours makes ways at most 1.128 times too long.
TEST(Guidance, InTheOpenTheWayIsNearlyStraight) {
  const Vec3 goal(8.1, 2.2, 1.3);
  const Guidance g(empty_space(40, 24, 8, 0.25, 0.5), goal, 100);
  Rng rng(12, 0);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(rng.uniform(0, 10), rng.uniform(0, 6), rng.uniform(0, 2));
    const double straight = (p - goal).norm();
    ASSERT_GE(g.to_go(p), straight - 0.5) << i;
    ASSERT_LE(g.to_go(p), 1.128 * straight + 0.5) << i;
    ASSERT_LT((g.ahead(p, 100) - goal).norm(), 1e-12);
    ASSERT_NEAR((g.ahead(p, 0.05) - p).norm(), 0.05, 1e-9) << i;
  }
  EXPECT_EQ(g.price(Vec3(5, 3, 1)), 1);
}

TEST(Guidance, LeadsThroughTheGapOfARigidWall) {
  const Vec3 goal(4.5, 1, 0.6), start(0.5, 1, 0.6);
  const Guidance g(walled(Workspace::rigid, {{30, 36}}, 0.25), goal, 0);
  EXPECT_GT(crossing_y(g, start), 7.5);
  EXPECT_LT(crossing_y(g, start), 9);
  EXPECT_GT(g.to_go(start), 2 * std::hypot(2, 6.5));  // to the gap and back
}

// Through what is soft when squeezing costs nothing; through the wide opening when it is dear; and the price
// is that of docs/planning.md.
TEST(Guidance, SoftAndTightPlacesHaveAPrice) {
  const Vec3 goal(4.5, 3, 0.6), start(0.5, 3, 0.6);
  const std::vector<std::pair<int, int>> narrow_and_wide = {{11, 13}, {24, 36}};
  const auto cross = [&](double price) {
    return crossing_y(Guidance(walled(Workspace::soft, narrow_and_wide, 1), goal, price), start);
  };
  EXPECT_NEAR(cross(0), 3, 0.5);
  EXPECT_GT(cross(100), 6);
  const Guidance g(walled(Workspace::soft, {}, 1), goal, 10);
  // 0.5 m before the wall's face: half of the radius of 1 m is lacking.
  EXPECT_NEAR(g.price(Vec3(2.125, 3, 0.6)), 1 + 10 * std::pow(1 - 0.375, 2), 1e-5);
  EXPECT_NEAR(g.price(Vec3(0.6, 3, 0.6)), 1, 1e-6);
}

// Two rings of radius 1 m behind one another, in the planes x = 2 and x = 3.5, and a strand's tip before
// them.
Workspace two_rings(int in_first, int in_second) {
  Workspace w = empty_space(24, 24, 24, 0.25, 0.25);
  w.holes = {{Vec3(2, 3, 3), Vec3::UnitX(), 1, in_first}, {Vec3(3.5, 3, 3), Vec3::UnitX(), 1, in_second}};
  for (int c = 0; c < w.cells.prod(); ++c) {
    const Vec3 p = 0.25 * Vec3(c % 24 + 0.5, c / 24 % 24 + 0.5, c / 576 + 0.5);
    for (const Hole& ring : w.holes)
      if (std::abs(p.x() - ring.middle_m.x()) < 0.25 &&
          std::abs((p - ring.middle_m).tail<2>().norm() - 1) < 0.2)
        w.what[std::size_t(c)] = Workspace::rigid;
  }
  return w;
}

TEST(Windings, WhatGoesBackIsDrawnOut) {
  const Workspace w = two_rings(0, 0);
  const Vec3 before(1, 3, 3), between(2.75, 3, 3), behind(4.5, 3, 3), aside(2.75, 5.5, 3);
  const auto word = [&](std::initializer_list<Vec3> places) {
    Windings windings;
    for (const Vec3* p = places.begin(); p + 1 < places.end(); ++p) wind(windings, w.holes, p[0], p[1]);
    return windings;
  };
  EXPECT_EQ(word({before, behind}), (Windings{1, 2})) << "in the order in which it passes them";
  EXPECT_EQ(word({behind, before}), (Windings{-2, -1}));
  EXPECT_EQ(word({before, behind, before}), Windings());
  EXPECT_EQ(word({before, behind, aside, between, before}), (Windings{1, 2, -1}));
  EXPECT_EQ(word({before, aside, between, aside}), Windings());
  EXPECT_EQ(word({before, between, aside, Vec3(1, 5.5, 3), before, between}), (Windings{1, 1})) << "a loop";
  EXPECT_TRUE(hangs_as_asked({1, 2, -1}, two_rings(2, 1).holes));
  EXPECT_FALSE(hangs_as_asked({1, 2}, two_rings(2, 1).holes));
}

// However the strand hangs: who follows the way to the goal with its tip comes to the goal, winds as that
// asks, goes through no ring, and goes as far as it was told.
TEST(Guidance, LeadsAStrandThroughTheHolesThatTheGoalAsksFor) {
  const Vec3 goal(1.1, 3.1, 3);
  for (const auto& [first, second] : {std::pair(0, 0), std::pair(0, 1), std::pair(1, 1), std::pair(2, 1)}) {
    const Workspace w = two_rings(first, second);
    const Guidance g(w, goal, 0, {1, 2});
    for (const Windings& hangs : {Windings{}, Windings{1}, Windings{-2}, Windings{1, 2}}) {
      Vec3 at(1, 2.9, 3.1);
      Windings windings = hangs;
      const double told = g.to_go(at, windings);
      EXPECT_LT(told, 100) << "a step into a ring costs more";
      double gone = 0;
      for (int i = 0; i < 1000 && (at - goal).norm() + (hangs_as_asked(windings, w.holes) ? 0 : 9) > 1e-6;
           ++i) {
        const Vec3 next = g.ahead(at, 0.05, windings);
        gone += (next - at).norm();
        wind(windings, w.holes, at, next);
        at = next;
      }
      ASSERT_LT((at - goal).norm(), 1e-6) << first << second;
      EXPECT_TRUE(hangs_as_asked(windings, w.holes)) << first << second;
      EXPECT_LE(gone, told + 0.5);
      EXPECT_GE(gone, 0.3 * told - 0.5);  // rigid neighbours have their price
    }
  }
  const Guidance g(two_rings(1, 0), goal, 0);
  EXPECT_EQ(g.ahead(Vec3(1, 3, 3), 1, {1, 1, 1}), Vec3(1, 3, 3)) << "nobody knows a way";
  EXPECT_GE(g.to_go(Vec3(1, 3, 3), {1, 1, 1}), g.to_go(Vec3(5.5, 3, 3), {1}));
}

TEST(Guidance, WhatIsRaisedIsAvoidedOnceItIsRenewed) {
  const Vec3 goal(4.5, 3, 0.6), start(0.5, 3, 0.6);
  Guidance g(walled(Workspace::rigid, {{10, 14}, {24, 28}}, 0.25), goal, 0);
  EXPECT_NEAR(crossing_y(g, start), 3, 0.6);
  const double before = g.to_go(start);
  for (int y = 10; y < 14; ++y)
    for (int z = 0; z < 5; ++z) g.raise(Vec3(2.625, 0.25 * y, 0.25 * z), 100);
  EXPECT_EQ(g.to_go(start), before);
  g.renew();
  EXPECT_GT(crossing_y(g, start), 5.5);
  EXPECT_GT(g.to_go(start), before);
}

TEST(Steering, KnowsTheClosedForms) {
  EXPECT_NEAR(time_to_go(Vec3(0, 4, 0), Vec3::Zero(), {2}), 2, 1e-9);
  EXPECT_NEAR(time_to_go(Vec3(0, 4, 0), Vec3(0, 3, 0), {2}), 1, 1e-9);   // 3 t + t² = 4
  EXPECT_NEAR(time_to_go(Vec3(0, 4, 0), Vec3(0, -3, 0), {2}), 4, 1e-9);  // t² − 3 t = 4
  EXPECT_EQ(time_to_go(Vec3::Zero(), Vec3(1, 0, 0), {2}), 0);
  EXPECT_EQ(best_direction(Vec3::Zero(), Vec3(0, 0, 0), {2}), Vec3::Zero());
}

TEST(Steering, PushedSoItArrivesInThatTime) {
  Rng rng(13, 0);
  for (int i = 0; i < 500; ++i) {
    const Vec3 way = 5 * rng.uniform() * rng.direction(), v = 3 * rng.uniform() * rng.direction();
    const Drive drive{rng.uniform(0.1, 4), i % 2 ? rng.uniform(0, 8) : 0};
    const double t = time_to_go(way, v, drive);
    // Heun's steps of v' = a u − α v.
    const Vec3 u = best_direction(way, v, drive);
    Vec3 end = Vec3::Zero(), now = v;
    const int steps = 4000;
    const double h = t / steps;
    for (int step = 0; step < steps; ++step) {
      const Vec3 rate = drive.acceleration * u - drive.drag_per_s * now,
                 then = drive.acceleration * u - drive.drag_per_s * (now + h * rate);
      end += h * (now + 0.5 * h * rate);
      now += 0.5 * h * (rate + then);
    }
    ASSERT_LT((end - way).norm(), 1e-5 * (1 + v.norm() * t)) << i;
    ASSERT_GE(t, min_time_to_go(way.norm(), v.norm(), drive) - 1e-9) << i;
    // Thrown straight away, it has one time.
    const Vec3 away = -v.norm() * way.normalized();
    ASSERT_NEAR(min_time_to_go(way.norm(), -v.norm(), drive), time_to_go(way, away, drive), 1e-6) << i;
    // Braked for the time to stop, it stands.
    const double stops = time_to_stop(v.norm(), drive);
    const double slowed = v.norm() * std::exp(-drive.drag_per_s * stops);
    const double braked =
        drive.drag_per_s > 0 ? drive.acceleration * drift_m(drive, stops) : drive.acceleration * stops;
    ASSERT_NEAR(slowed, braked, 1e-9 * (1 + v.norm())) << i;
  }
}

}  // namespace
}  // namespace limber::plan
