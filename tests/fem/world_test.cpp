// What build_world refuses, and what it says.
#include "fem/world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "fem/observe.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using ::testing::HasSubstr;

std::string complaint(const WorldSpec& spec) {
  try {
    build_world(spec);
  } catch (const InputError& error) {
    return error.what();
  }
  return "taken";
}

TEST(World, EveryComplaintNamesBodyAndElement) {
  const auto spoiled = [](const std::function<void(WorldSpec&)>& spoil) {
    WorldSpec spec = testing::barriers();
    spoil(spec);
    return complaint(spec);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(spoiled([](WorldSpec&) {}), "taken");
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies.clear(); }), HasSubstr("no body"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.robot = 3; }), HasSubstr("robot"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].kind = BodyKind::immovable; }),
              HasSubstr("no node that can move"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bounds_m.upper.x() = -1; }), HasSubstr("bounds_m"));
  EXPECT_THAT(spoiled([&](WorldSpec& s) { s.gravity_m_s2.x() = nan; }), HasSubstr("gravity_m_s2"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.max_dt_s = -1; }), HasSubstr("max_dt_s"));
  EXPECT_THAT(spoiled([&](WorldSpec& s) { s.bodies[1].cage.positions(7, 1) = nan; }),
              AllOf(HasSubstr("floor_plate"), HasSubstr("7")));
  EXPECT_THAT(
      spoiled([](WorldSpec& s) { std::swap(s.bodies[1].cage.tets(9, 0), s.bodies[1].cage.tets(9, 1)); }),
      AllOf(HasSubstr("floor_plate"), HasSubstr("tet 9")));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].cage.tets.row(1) = s.bodies[0].cage.tets.row(0); }),
              HasSubstr("robot"));
  EXPECT_THAT(spoiled([](WorldSpec& s) {
                auto& p = s.bodies[0].cage.positions;
                p.conservativeResize(p.rows() + 1, 3);
                p.bottomRows(1).setZero();
              }),
              HasSubstr("node 64 belongs to no tet"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[2].fixed_nodes.push_back(4711); }),
              AllOf(HasSubstr("ceiling_plate"), HasSubstr("4711")));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].material.youngs_modulus_pa = 0; }),
              HasSubstr("youngs_modulus_pa"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].material.poisson_ratio = 0.2; }),
              HasSubstr("0.25 to 0.495"));
  EXPECT_THAT(spoiled([&](WorldSpec& s) { s.bodies[0].material.density_kg_m3 = nan; }),
              HasSubstr("density_kg_m3"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].material.mass_damping_per_s = -1; }),
              HasSubstr("mass_damping_per_s"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].material.fascia_hz = 31; }), HasSubstr("fascia_hz"));
  EXPECT_THAT(spoiled([&](WorldSpec& s) { s.bodies[0].material.fascia_damping_ratio = nan; }),
              HasSubstr("fascia_damping_ratio"));
  EXPECT_THAT(spoiled([&](WorldSpec& s) { s.bodies[0].gravity_m_s2 = Vec3(0, nan, 0); }),
              HasSubstr("gravity_m_s2"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].material.damping_ratio = 2; }),
              HasSubstr("damping_ratio"));
  EXPECT_THAT(spoiled([](WorldSpec& s) { s.bodies[0].material.friction = -1; }), HasSubstr("friction"));
  EXPECT_THAT(spoiled([](WorldSpec& s) {
                s.bodies[0].cage = testing::cube({0.2, 1.5, 1.5}, 1, 3);
              }),
              AllOf(HasSubstr("robot"), HasSubstr("outside the bounds")));
  EXPECT_THAT(spoiled([](WorldSpec& s) {
                s.bodies[0].cage = testing::cube({3.0, 1.5, 1.5}, 1, 3);
              }),
              AllOf(HasSubstr("robot and floor_plate overlap"), HasSubstr("deep")));
  EXPECT_THAT(spoiled([](WorldSpec& s) {
                s.bodies[0].cage.positions.col(0).array() += 1e7;
                s.bounds_m.upper.x() = 1e8;
              }),
              HasSubstr("float32"));
}

// Two bars that cross without a vertex of either in the other.
TEST(World, SeesAnOverlapOfEdgesAlone) {
  WorldSpec spec;
  spec.bounds_m = {Vec3::Constant(-5), Vec3::Constant(5)};
  spec.bodies = {
      {"bar", testing::grid({-2, -0.1, -0.1}, {4, 0.2, 0.2}, 2, 1, 1), {}, {}, BodyKind::deformable},
      {"rod", testing::grid({0.3, -2, -0.05}, {0.2, 4, 0.2}, 1, 1, 1), {}, {}, BodyKind::deformable}};
  EXPECT_THAT(complaint(spec), HasSubstr("bar and rod overlap"));
}

// Mass, volume and the place of static bodies behind the moving ones.
TEST(World, StaticBodiesComeLastAndAreNoPartOfState) {
  WorldSpec spec = testing::barriers();
  spec.bodies[1].kind = BodyKind::immovable;
  const World world = build_world(spec);
  EXPECT_EQ(world.bodies[0].first_node, 0);
  EXPECT_EQ(world.bodies[2].first_node, world.bodies[0].node_count());
  EXPECT_EQ(world.bodies[1].first_node, world.moving_nodes);
  EXPECT_EQ(rest_state(world).positions.size(), std::size_t(3 * world.moving_nodes));
  EXPECT_NEAR(world.bodies[0].mass_kg, 100, 1e-4);
  EXPECT_NEAR(volume_m3(world, rest_state(world), 2), 0.35 * 3 * 2.2, 1e-5);
  EXPECT_LT((center_of_mass_m(world, rest_state(world), 0) - Vec3(1, 1.5, 1.5)).norm(), 1e-6);
}

}  // namespace
}  // namespace limber::fem
