// Bodies whose fine surfaces overlap where they start are parted (docs/contact.md, "Overlap at the start").
#include <gtest/gtest.h>

#include <csignal>

#include "core/error.h"
#include "core/progress.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/shapes.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::ball_surface;
using testing::cube;
using testing::shape_of;

constexpr double radius_m = 0.4, offset_m = 0.005;

// Balls in a row, each that deep in the one before; their cages are cubes of edge 1.
WorldSpec row_of_balls(int count, double depth_m) {
  WorldSpec spec;
  for (int i = 0; i < count; ++i) {
    const Vec3 center(i * (2 * radius_m - depth_m), 0, 0);
    BodySpec body{std::string(1, char('a' + i)), cube(center, 1, 3), {}, {}, BodyKind::deformable};
    body.shape = shape_of(body.cage, ball_surface(center, radius_m), 0.02, 0.03);
    spec.bodies.push_back(std::move(body));
  }
  spec.robot = count - 1;
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false;
  spec.contact_offset_m = offset_m;
  return spec;
}

double x_of(const World& world, const State& state, int body) {
  return center_of_mass_m(world, state, body).x();
}

// What a spec is refused with.
std::string refusal(const WorldSpec& spec) {
  try {
    build_world(spec);
  } catch (const InputError& error) {
    return error.what();
  }
  return "it is not refused";
}

// The laws of every parting without anything fixed: the centre of mass of all stays, nothing moves, volumes
// are kept, balls are as far apart as their radii and the offset say.
void expect_laws(const WorldSpec& spec, const World& world) {
  const State start = start_state(world);
  EXPECT_EQ(start.step, 0);
  EXPECT_EQ(kinetic_energy_j(world, start), 0);
  EXPECT_TRUE(is_sound(world, start));
  EXPECT_LT(largest_volume_change(world, start), 1e-3);
  Vec3 moved = Vec3::Zero();
  double mass = 0;
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    moved += world.bodies[b].mass_kg *
             (center_of_mass_m(world, start, b) - center_of_mass_m(world, rest_state(world), b));
    mass += world.bodies[b].mass_kg;
  }
  EXPECT_LT(moved.norm() / mass, 1e-5);
  ASSERT_EQ(world.parting.pairs.size(), spec.bodies.size() - 1);
  for (const Parting::Pair& pair : world.parting.pairs) {
    EXPECT_EQ(pair.other, pair.body + 1);
    EXPECT_GT(pair.gap_m, 0.8 * offset_m);
    EXPECT_LE(pair.gap_m, offset_m);
    const double apart_m = x_of(world, start, pair.other) - x_of(world, start, pair.body);
    EXPECT_NEAR(apart_m, 2 * radius_m + offset_m, 0.2 * offset_m);
  }
  EXPECT_GT(world.parting.steps, 0);
  // It goes on as it is: pushed by no more than holds what is pressed.
  Control coast;
  coast.steps = int(0.5 / world.dt_s);
  const State later = propagate(world, start, coast).end;
  double farthest = 0;
  for (std::size_t k = 0; k < start.positions.size(); ++k)
    farthest = std::max(farthest, double(std::abs(later.positions[k] - start.positions[k])));
  EXPECT_LT(farthest, 0.1 * offset_m);
}

TEST(Start, TwoBallsPartEachByHalf) {
  for (const double depth_m : {0.02, 0.1}) {
    SCOPED_TRACE(depth_m);
    const WorldSpec spec = row_of_balls(2, depth_m);
    const World world = build_world(spec);
    expect_laws(spec, world);
    const Parting::Pair& pair = world.parting.pairs[0];
    EXPECT_NEAR(pair.depth_m, depth_m, 0.01 * radius_m);
    const double half_m = (depth_m + offset_m) / 2;
    for (const double moved_m : pair.moved_m) EXPECT_NEAR(moved_m, half_m, 0.05 * half_m + 1e-4);
    for (const double moved_m : world.parting.largest_move_m)
      EXPECT_NEAR(moved_m, half_m, 0.1 * half_m + 2e-4);
  }
}

TEST(Start, OfThreeInARowTheMiddleOneStays) {
  const WorldSpec spec = row_of_balls(3, 0.1);
  const World world = build_world(spec);
  expect_laws(spec, world);
  const State start = start_state(world);
  EXPECT_NEAR(x_of(world, start, 1), 0.7, 1e-3);
  EXPECT_NEAR(x_of(world, start, 0), -0.105, 2e-3);
  EXPECT_NEAR(x_of(world, start, 2), 1.505, 2e-3);
}

TEST(Start, ARigidBallKeepsItsShape) {
  WorldSpec spec = row_of_balls(2, 0.1);
  spec.bodies[0].kind = BodyKind::rigid;
  const World world = build_world(spec);
  expect_laws(spec, world);
  const Points rest = world.bodies[0].cage.positions, now = body_positions(world, start_state(world), 0);
  for (int n = 1; n < rest.rows(); ++n)
    EXPECT_NEAR((now.row(n) - now.row(0)).norm(), (rest.row(n) - rest.row(0)).norm(), 1e-5);
}

TEST(Start, WhatIsFixedStaysAndTheOtherGoesAllTheWay) {
  WorldSpec spec = row_of_balls(2, 0.1);
  spec.bodies[0].kind = BodyKind::immovable;
  const World world = build_world(spec);
  const State start = start_state(world);
  EXPECT_EQ(body_positions(world, start, 0), world.bodies[0].cage.positions);
  EXPECT_EQ(world.parting.largest_move_m[0], 0);
  EXPECT_NEAR(x_of(world, start, 1), 2 * radius_m + offset_m, 0.2 * offset_m);
  EXPECT_EQ(world.parting.pairs.at(0).moved_m[0], 0);

  // Half of a soft ball is held: it gives way with the rest.
  spec = row_of_balls(2, 0.1);
  for (int n = 0; n < spec.bodies[0].cage.positions.rows(); ++n)
    if (spec.bodies[0].cage.positions(n, 0) < -0.1) spec.bodies[0].fixed_nodes.push_back(n);
  const World held = build_world(spec);
  const Points rest = held.bodies[0].cage.positions, now = body_positions(held, start_state(held), 0);
  for (const int n : spec.bodies[0].fixed_nodes) EXPECT_EQ(now.row(n), rest.row(n));
  EXPECT_GT(held.parting.pairs.at(0).gap_m, 0.25 * offset_m);
  EXPECT_LT(held.parting.pairs.at(0).moved_m[0], held.parting.pairs.at(0).moved_m[1]);
}

// Offsets are those of all bodies, or gaps; and to know the start is as good as to find it.
TEST(Start, AStartThatIsGivenIsNotSoughtAgain) {
  WorldSpec spec = row_of_balls(2, 0.05);
  const World world = build_world(spec), again = build_world(spec);
  EXPECT_EQ(again.start_positions, world.start_positions);
  spec.start_positions = world.start_positions;
  const World given = build_world(spec);
  EXPECT_EQ(given.start_positions, world.start_positions);
  EXPECT_EQ(given.surfaces64.offset, world.surfaces64.offset);
  EXPECT_EQ(given.surfaces64.offset[1], offset_m);
  EXPECT_EQ(given.parting.pairs.at(0).gap_m, world.parting.pairs.at(0).gap_m);
  EXPECT_EQ(given.parting.steps, 0);
  spec.start_positions.pop_back();
  EXPECT_NE(refusal(spec).find("start_positions hold"), std::string::npos) << refusal(spec);
}

TEST(Start, BodiesThatDoNotOverlapStayWhereTheyAre) {
  for (const double gap_m : {-0.004, 0.003, 0.02}) {
    SCOPED_TRACE(gap_m);
    WorldSpec spec = row_of_balls(2, -gap_m);
    const World world = build_world(spec);
    EXPECT_EQ(start_state(world), rest_state(world));
    EXPECT_TRUE(world.parting.pairs.empty());
    // Each sample's offset is how far it is from the other ball, or the offset of all; of balls that begin in
    // touch it is how far these are apart.
    const auto& tables = world.surfaces64;
    const Vec3 other(2 * radius_m + gap_m, 0, 0);
    double nearest = offset_m;
    for (int s = tables.first_sample_of(0); s < tables.first_sample_of(1); ++s) {
      const auto& sample = tables.samples[std::size_t(s)];
      Vec3 place = Vec3::Zero();
      for (int i = 0; i < 4; ++i)
        place +=
            sample.weight[i] * Eigen::Map<const Vec3>(&world.tables64.rest_positions[3 * sample.node[i]]);
      const double off = (place - other).norm() - radius_m;
      const double apart = gap_m < 0 ? off : gap_m;
      EXPECT_NEAR(tables.offset_of(0, 1, s), std::min(apart, offset_m), 5e-4) << place.transpose();
      nearest = std::min(nearest, tables.offset_of(0, 1, s));
    }
    EXPECT_NEAR(nearest, std::min(gap_m, offset_m), 1e-3);
    EXPECT_TRUE(contact_forces(world, start_state(world)).empty());
    spec.part_overlaps = false;
    EXPECT_EQ(build_world(spec).surfaces64.own_offset, tables.own_offset);
  }
}

TEST(Start, WhatCannotBePartedIsRefused) {
  WorldSpec spec = row_of_balls(2, 0.3);
  const std::string words = refusal(spec), begin = "bodies a and b overlap at the start, ";
  ASSERT_EQ(words.find(begin), 0u) << words;
  EXPECT_NEAR(std::stod(words.substr(begin.size())), 0.3, 0.002) << words;  // balls have facets
  EXPECT_NE(words.find("more than a quarter of"), std::string::npos) << words;
  spec = row_of_balls(2, 0.1);
  spec.part_overlaps = false;
  EXPECT_NE(refusal(spec).find("move them apart"), std::string::npos) << refusal(spec);
  // Both are held wherever they are in one another.
  spec.part_overlaps = true;
  for (BodySpec& body : spec.bodies)
    for (int n = 0; n + 1 < body.cage.positions.rows(); ++n) body.fixed_nodes.push_back(n);
  EXPECT_NE(refusal(spec).find("cannot be parted: after"), std::string::npos) << refusal(spec);
}

TEST(Start, AWishToStopEndsIt) {
  request_stop(SIGTERM);
  EXPECT_THROW(build_world(row_of_balls(2, 0.1)), Interrupted);
  request_stop(0);
}

}  // namespace
}  // namespace limber::fem
