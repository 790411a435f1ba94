// What observables say, against what moves the bodies and against closed forms.
#include "fem/observe.h"
#include "fem/control_forces.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "fem/batch.h"
#include "tests/fem/proofs.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::ball;
using testing::cube;
using testing::prove_at_most;

// x ← A x for all nodes of a body alone in its world.
State deformed(const World& world, const Eigen::Matrix3d& map) {
  State state = rest_state(world);
  for (int n = 0; n < world.moving_nodes; ++n) {
    Eigen::Map<Vec3f> p(&state.positions[3 * n]);
    p = (map * p.cast<double>()).cast<float>();
  }
  return state;
}

// A rotation strains nothing; a stretch s along an axis has principal Green strain (s² − 1)/2, whatever turn
// follows; a small shear γ has von Mises strain γ/√3; a stretch at constant volume its own size.
TEST(Observe, StrainsOfAffineMapsAreThoseOfTheBook) {
  const World world = build_world(alone({"ball", ball({0, 0, 0}, 0.5, 3), {}, {}}));
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.2, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const auto each = [&](const Eigen::Matrix3d& map, const auto& check) {
    const State state = deformed(world, turn * map);
    const Strains s = strains(world, state, 0);
    ASSERT_EQ(int(s.largest.size()), world.bodies[0].cage.tets.rows());
    const std::vector<double> changes = volume_changes(world, state, 0);
    for (std::size_t t = 0; t < s.largest.size(); ++t) {
      check(s.largest[t], s.von_mises[t]);
      EXPECT_NEAR(changes[t], map.determinant() - 1, 1e-5);
    }
  };
  each(Eigen::Matrix3d::Identity(), [](double largest, double von_mises) {
    EXPECT_LT(largest, 2e-6);
    EXPECT_LT(von_mises, 2e-6);
  });
  each(Vec3(1.3, 1, 1).asDiagonal(), [](double largest, double von_mises) {
    EXPECT_NEAR(largest, (1.3 * 1.3 - 1) / 2, 1e-5);
    EXPECT_NEAR(von_mises, 2.0 / 3 * (1.3 * 1.3 - 1) / 2, 1e-5);
  });
  each(Vec3(0.5, 1, 1).asDiagonal(), [](double largest, double) { EXPECT_NEAR(largest, 0.375, 1e-5); });
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(0, 1) = 0.01;
  each(shear, [](double largest, double von_mises) {
    EXPECT_NEAR(von_mises, 0.01 / std::sqrt(3.0), 1e-5);
    EXPECT_NEAR(largest, 0.005, 3e-5);
  });
  const double e = 0.01;
  each(Vec3(1 + e, 1 / std::sqrt(1 + e), 1 / std::sqrt(1 + e)).asDiagonal(),
       [&](double, double von_mises) { EXPECT_NEAR(von_mises, e, 1e-4); });
}

// The singular values of the map itself, in every tet, whatever turn comes before and after.
TEST(Observe, StretchOfAnAffineMapIsItsSingularValues) {
  const World world = build_world(alone({"ball", ball({0, 0, 0}, 0.5, 3), {}, {}}));
  const Eigen::Matrix3d before = Eigen::AngleAxisd(0.7, Vec3(3, -1, 2).normalized()).toRotationMatrix(),
                        after = Eigen::AngleAxisd(1.2, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  for (const Vec3& stretch : {Vec3(1, 1, 1), Vec3(1.7, 1, 0.8), Vec3(0.4, 2.5, 1.1), Vec3(0.05, 0.9, 3)}) {
    const Strains s =
        strains(world, deformed(world, after * Eigen::Matrix3d(stretch.asDiagonal()) * before), 0);
    ASSERT_EQ(int(s.longest.size()), world.bodies[0].cage.tets.rows());
    for (std::size_t t = 0; t < s.longest.size(); ++t) {
      EXPECT_NEAR(s.longest[t], stretch.maxCoeff(), 1e-5);
      EXPECT_NEAR(s.shortest[t], stretch.minCoeff(), 2e-4 * stretch.maxCoeff());
    }
  }
}

// A bar's ridge, along x, goes d deep into the ridge, along y, of a bar turned by `turn` about y: its deepest
// point lies on the other ridge's bisector, d / (√2 cos turn) from both faces, and is not the middle of what
// is inside.
TEST(Observe, ThePenetrationOfAnEdgeIsThatOfItsDeepestPoint) {
  const double quarter = 0.25 * 3.14159265358979, d = 0.1;
  for (const double turn : {0.0, 0.3, -0.5}) {
    const auto turned = [](TetMesh mesh, double angle, const Vec3& axis, const Vec3& shift) {
      const Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
      mesh.positions = (mesh.positions * rotation.transpose()).eval();
      mesh.positions.rowwise() += shift.transpose();
      return mesh;
    };
    WorldSpec spec;
    spec.bounds_m = {Vec3::Constant(-9), Vec3::Constant(9)};
    spec.bodies = {
        {"along x",
         turned(testing::grid({-4, -1, -1}, {8, 1, 1}, 1, 1, 1), quarter, Vec3::UnitX(), {0, 0, -3}),
         {},
         {}},
        {"along y",
         turned(testing::grid({0, -4, 0}, {1, 8, 1}, 1, 1, 1), turn - quarter, Vec3::UnitY(), {0, 0, -d}),
         {},
         {}}};
    const World world = build_world(spec);
    State state = rest_state(world);
    for (int n = 0; n < world.bodies[0].node_count(); ++n) state.positions[std::size_t(3 * n + 2)] += 3;
    const double depth = d / (std::sqrt(2.0) * std::cos(turn));
    EXPECT_NEAR(deepest_penetration(world, state).depth_m, depth, 0.01 * depth) << turn;
  }
}

// Two soft cubes, a rigid one and a static block pressed together in a corner of the room, under gravity.
// A body stretched by 1 + s along an axis has changed by s; mirrored, all its tets are inverted. In the state
// of another body nothing of that shows.
TEST(Observe, AStateIsSoundUpToTheVolumeChangeAskedFor) {
  for (const double most : {0.05, 0.2}) {
    WorldSpec spec = alone({"ball", ball({0, 0, 0}, 0.5, 3), {}, {}});
    spec.bodies[0].max_volume_change = most;
    const World world = build_world(spec);
    for (const double change : {-0.25, -0.19, -0.06, -0.04, 0.0, 0.04, 0.06, 0.19, 0.25}) {
      const State state = deformed(world, Vec3(1, 1 + change, 1).asDiagonal());
      EXPECT_EQ(is_sound(world, state), std::abs(change) < most) << most << ' ' << change;
    }
    EXPECT_FALSE(is_sound(world, deformed(world, Vec3(1, 1, -1).asDiagonal())));
  }
}

// One tet turned inside out is seen, wherever it is and however much room the body has.
TEST(Observe, OneInvertedTetIsNotSound) {
  WorldSpec spec = alone({"ball", ball({0, 0, 0}, 0.5, 3), {}, {}});
  spec.bodies[0].max_volume_change = 1;
  const World world = build_world(spec);
  const auto& cage = world.bodies[0].cage;
  for (int t = 0; t < cage.tets.rows(); t += 7) {
    State state = rest_state(world);
    // A corner is drawn through the face opposite to it, by a thousandth of its height.
    const Vec3 a = cage.positions.row(cage.tets(t, 0)), b = cage.positions.row(cage.tets(t, 1)),
               c = cage.positions.row(cage.tets(t, 2)), d = cage.positions.row(cage.tets(t, 3));
    const Vec3 normal = (b - a).cross(c - a).normalized(), way = normal * normal.dot(a - d);
    Eigen::Map<Vec3f> corner(&state.positions[std::size_t(3 * cage.tets(t, 3))]);
    corner = (d + 0.999 * way).cast<float>();
    const bool before = inverted_tets(world, state) == 0;
    EXPECT_EQ(is_sound(world, state), before) << t;
    corner = (d + 1.001 * way).cast<float>();
    EXPECT_GT(inverted_tets(world, state), 0) << t;
    EXPECT_FALSE(is_sound(world, state)) << t;
  }
}

World pile() {
  Material material;
  material.friction = 0.4;
  WorldSpec spec;
  spec.bodies = {{"left", cube({-0.52, 0, 0.5}, 1, 3), material, {}},
                 {"right", cube({0.52, 0.1, 0.5}, 1, 2), material, {}},
                 {"top", cube({0, 0, 1.33}, 0.6, 2), material, {}, BodyKind::rigid},
                 {"block", cube({1.45, 0, 0.5}, 0.8, 2), material, {}, BodyKind::immovable}};
  spec.bounds_m = {Vec3(-1.03, -2, 0), Vec3(3, 2, 4)};
  spec.gravity_m_s2 = {4, 0.5, -10};
  return build_world(spec);
}

// In one step a body's momentum gains h (contact + walls + gravity): the forces told are those that act, and
// nothing else does.
TEST(Observe, ContactForcesAreWhatMovesTheBodies) {
  const World world = pile();
  Control coast;
  coast.steps = 40;
  State state = rest_state(world);
  int contacts = 0, walls = 0, between_moving = 0;
  for (int look = 0; look < 20; ++look) {
    SCOPED_TRACE(look);
    state = propagate(world, state, coast).end;
    Control one;
    one.steps = 1;
    const State next = propagate(world, state, one).end;
    const std::vector<ContactForce> forces = contact_forces(world, state);
    std::vector<Vec3> sum(world.bodies.size(), Vec3::Zero());
    for (const PairForce& pair : pair_forces(forces)) {
      EXPECT_TRUE(pair.other < 0 || pair.body < pair.other);
      sum[std::size_t(pair.body)] += pair.force_n;
      if (pair.other >= 0) sum[std::size_t(pair.other)] -= pair.force_n;
      contacts += pair.contacts, walls += pair.other<0, between_moving += pair.other> 0 && pair.other < 3;
    }
    for (std::size_t b = 0; b < 3; ++b) {
      const Body& body = world.bodies[b];
      Vec3 gained = Vec3::Zero();
      for (int n = 0; n < body.node_count(); ++n)
        for (int c = 0; c < 3; ++c) {
          const std::size_t k = std::size_t(3 * (body.first_node + n) + c);
          gained[c] += body.node_mass_kg[n] * (double(next.velocities[k]) - double(state.velocities[k]));
        }
      const Vec3 expected = world.dt_s * (sum[b] + body.mass_kg * body.gravity_m_s2);
      EXPECT_LT((gained - expected).norm(), 1e-5 * body.mass_kg) << body.name;  // m/s, of about 1
    }
    for (const ContactForce& f : forces) {
      EXPECT_GT(f.depth_m, 0);
      EXPECT_LT((f.place_m - Vec3(0, 0, 1)).norm(), 4);
    }
  }
  EXPECT_GT(contacts, 100);
  EXPECT_GT(walls, 10);
  EXPECT_GT(between_moving, 10);
}

// A block that rests on a floor and bears another: it is pressed by the other's weight and by both from
// below, though all forces on it sum to its own weight. The balance of forces is the closed form.
TEST(Observe, WhatPressesABodyAddsUpFromBothSides) {
  Material material;
  material.mass_damping_per_s = 2;
  WorldSpec spec;
  spec.bodies = {{"lower", cube({0, 0, 0.5}, 1, 2), material, {}, BodyKind::rigid},
                 {"upper", cube({0, 0, 1.4}, 0.8, 2), material, {}, BodyKind::rigid},
                 {"apart", cube({3, 0, 1}, 0.5, 1), material, {}, BodyKind::immovable}};
  spec.bounds_m = {Vec3(-3, -3, 0), Vec3(4, 3, 4)};
  spec.gravity_m_s2 = {0, 0, -10};
  spec.bodies[0].max_contact_load_n = 2200;
  const World world = build_world(spec);
  Control coast;
  coast.steps = int(6 / world.dt_s);
  const State rest = propagate(world, rest_state(world), coast).end;
  const std::vector<ContactForce> forces = contact_forces(world, rest);
  const std::vector<double> loads = contact_loads_n(world, forces);
  const double lower_n = 1000, upper_n = 512;  // 100 kg/m³
  EXPECT_NEAR(loads[0], lower_n + 2 * upper_n, 10);
  EXPECT_NEAR(loads[1], upper_n, 5);
  EXPECT_EQ(loads[2], 0);
  EXPECT_TRUE(within_contact_loads(world, forces));
  spec.bodies[0].max_contact_load_n = 1900;
  EXPECT_FALSE(within_contact_loads(build_world(spec), forces));
  // A probe keeps nothing from one state to the next.
  ContactProbe probe(world);
  for (const State& state : {rest, rest_state(world), rest}) {
    const std::vector<ContactForce> again = probe.forces(state), alone = contact_forces(world, state);
    ASSERT_EQ(again.size(), alone.size());
    for (std::size_t i = 0; i < again.size(); ++i) {
      EXPECT_EQ(again[i].force_n, alone[i].force_n);
      EXPECT_EQ(again[i].place_m, alone[i].place_m);
    }
  }
}

// So does each kind of control: the robot's momentum gains h times the sum of what it does to the nodes, and
// no node gets more than its share of the most that is allowed.
TEST(Observe, ControlForcesAreWhatMovesTheRobot) {
  const World world = pile();
  const Body& robot = world.bodies[std::size_t(world.robot)];
  Control control;
  control.force_n = {3, -2, 40}, control.node = 5, control.radius_m = 0.6f;
  control.target_m = {-0.4f, 0.5f, 2}, control.max_force_n = 60;
  for (const Manipulation manipulation : {Manipulation::none, Manipulation::body, Manipulation::control_point,
                                          Manipulation::interpolation, Manipulation::hold}) {
    SCOPED_TRACE(int(manipulation));
    control.manipulation = manipulation;
    control.steps = 60;
    const State state = propagate(world, rest_state(world), control).end;
    control.steps = 1;
    const State next = propagate(world, state, control).end;
    Vec3 sum = Vec3::Zero(), gained = Vec3::Zero();
    const std::vector<Vec3> forces = control_forces_n(world, state, control);
    ASSERT_EQ(int(forces.size()), robot.node_count());
    // A control point's force falls on a part of the robot, but on a tenth of its mass at least.
    const double least = manipulation == Manipulation::control_point ? 0.1 : 1;
    for (int n = 0; n < robot.node_count(); ++n) {
      sum += forces[std::size_t(n)];
      EXPECT_LE(forces[std::size_t(n)].norm(),
                1.00001 * largest_force(control) * robot.node_mass_kg[n] / (least * robot.mass_kg));
      for (int c = 0; c < 3; ++c) {
        const std::size_t k = std::size_t(3 * (robot.first_node + n) + c);
        gained[c] += robot.node_mass_kg[n] * (double(next.velocities[k]) - double(state.velocities[k]));
      }
    }
    EXPECT_EQ(sum.norm() > 1, manipulation != Manipulation::none);
    for (const PairForce& pair : pair_forces(contact_forces(world, state, control))) {
      if (pair.body == world.robot) sum += pair.force_n;
      if (pair.other == world.robot) sum -= pair.force_n;
    }
    const Vec3 expected = world.dt_s * (sum + robot.mass_kg * robot.gravity_m_s2);
    EXPECT_LT((gained - expected).norm(), 1e-5 * robot.mass_kg);
  }
}

// Wherever a free robot is pushed, and however few nodes are within the radius, it gains the force times its
// duration.
TEST(Observe, AControlPointGivesTheRobotAllOfItsForce) {
  const World world = build_world(alone({"robot", cube(Vec3::Zero(), 1, 4), {}, {}}));
  const Body& robot = world.bodies[0];
  Control push;
  push.manipulation = Manipulation::control_point;
  push.force_n = {30, -8, 12}, push.steps = 100;
  const double duration_s = push.steps * world.dt_s;
  for (const float radius : {0.01f, 0.3f, 0.6f, 3.f})
    for (const int node : {0, 31, robot.node_count() - 1}) {
      SCOPED_TRACE(fmt::format("radius {}, node {}", radius, node));
      push.radius_m = radius, push.node = node;
      const State end = propagate(world, rest_state(world), push).end;
      Vec3 gained = Vec3::Zero();
      for (int n = 0; n < robot.node_count(); ++n)
        for (int c = 0; c < 3; ++c)
          gained[c] += robot.node_mass_kg[n] * double(end.velocities[std::size_t(3 * n + c)]);
      prove_at_most(4, "momentum gained from a control point's push over F t, − 1",
                    fmt::format("cube of 1 m, radius {:.2g} m, node {}", radius, node),
                    (gained - duration_s * push.force_n.cast<double>()).norm() / gained.norm(), 1e-4);
      double pushed = 0;
      const std::vector<Vec3> forces = control_forces_n(world, rest_state(world), push);
      for (int n = 0; n < robot.node_count(); ++n)
        if (forces[std::size_t(n)].norm() > 0) pushed += robot.node_mass_kg[n];
      EXPECT_GE(pushed, 0.1 * robot.mass_kg);
      EXPECT_EQ(pushed > 0.5 * robot.mass_kg, radius > 1);
    }
}

// Two carriers give the robot both of their forces, and what these are as a couple: a pair of opposite ones
// no momentum, but the turning r × F t.
TEST(Observe, TwoCarriersGiveTheRobotBothForcesAndTheirCouple) {
  const World world = build_world(alone({"robot", grid({-1, -0.1, -0.1}, {2, 0.2, 0.2}, 10, 1, 1), {}, {}}));
  const Body& robot = world.bodies[0];
  const auto at_end = [&](double x) {
    int nearest = 0;
    for (int n = 0; n < robot.node_count(); ++n)
      if (std::abs(robot.cage.positions(n, 0) - x) < std::abs(robot.cage.positions(nearest, 0) - x))
        nearest = n;
    return nearest;
  };
  Control push;
  push.manipulation = Manipulation::control_point;
  push.node = at_end(-1), push.second_node = at_end(1), push.radius_m = 0.35f, push.steps = 50;
  const double duration_s = push.steps * world.dt_s;
  const auto gained = [&](const Vec3f& first, const Vec3f& second) {
    push.force_n = first, push.second_force_n = second;
    const State end = propagate(world, rest_state(world), push).end;
    std::pair<Vec3, Vec3> sums(Vec3::Zero(), Vec3::Zero());  // momentum, turning about the origin
    for (int n = 0; n < robot.node_count(); ++n) {
      const Vec3 velocity = Eigen::Map<const Vec3f>(&end.velocities[std::size_t(3 * n)]).cast<double>();
      const Vec3 place = Eigen::Map<const Vec3f>(&end.positions[std::size_t(3 * n)]).cast<double>();
      sums.first += robot.node_mass_kg[n] * velocity;
      sums.second += robot.node_mass_kg[n] * place.cross(velocity);
    }
    return sums;
  };
  const Vec3f along(3, -2, 1), other(-1, 4, 2), across(0, 2, 0);
  const Vec3 both = duration_s * (along + other).cast<double>();
  EXPECT_LT((gained(along, other).first - both).norm(), 1e-4 * both.norm());
  const auto [momentum, turning] = gained(across, -across);
  double arm = 0, pushed = 0;  // of the middle of what is pushed at one end
  for (int n = 0; n < robot.node_count(); ++n)
    if (robot.cage.positions(n, 0) < -0.7)
      arm -= robot.node_mass_kg[n] * robot.cage.positions(n, 0), pushed += robot.node_mass_kg[n];
  const double couple = 2 * arm / pushed * double(across.y()) * duration_s;
  EXPECT_LT(momentum.norm(), 1e-4 * couple);
  EXPECT_NEAR(turning.z(), -couple, 0.01 * couple) << "the rod has turned a little";
}

// The bodies' energies are those of the world, each that of the body alone.
TEST(Observe, EnergiesOfBodiesSumToTheWorlds) {
  const World world = pile();
  Control coast;
  coast.steps = 300;
  const State state = propagate(world, rest_state(world), coast).end;
  double elastic = 0, kinetic = 0;
  for (int b = 0; b < 4; ++b)
    elastic += elastic_energy_j(world, state, b), kinetic += kinetic_energy_j(world, state, b);
  EXPECT_NEAR(elastic, elastic_energy_j(world, state), 1e-12 * elastic);
  EXPECT_NEAR(kinetic, kinetic_energy_j(world, state), 1e-12 * kinetic);
  EXPECT_GT(elastic_energy_j(world, state, 0), 0);
  EXPECT_EQ(elastic_energy_j(world, state, 2), 0);  // rigid
  EXPECT_EQ(kinetic_energy_j(world, state, 3), 0);  // static

  const World single =
      build_world(alone({"left", cube({-0.52, 0, 0.5}, 1, 3), world.bodies[0].material, {}}));
  State part = rest_state(single);
  const std::size_t first = std::size_t(3 * world.bodies[0].first_node);
  std::copy_n(state.positions.begin() + std::ptrdiff_t(first), part.positions.size(), part.positions.begin());
  EXPECT_NEAR(elastic_energy_j(world, state, 0), elastic_energy_j(single, part), 1e-9 * elastic);
}

}  // namespace
}  // namespace limber::fem
