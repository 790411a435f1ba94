// The laws of rigid bodies that move (docs/dynamics.md, "Rigid bodies").
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "fem/batch.h"
#include "fem/detail/contact.h"
#include "fem/observe.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::ball;
using testing::cube;
using testing::grid;

BodySpec rigid(TetMesh mesh, Material material = {}) {
  return {"rigid", std::move(mesh), material, {}, BodyKind::rigid};
}

// Three different moments of inertia, no symmetry of the mesh's places in float32.
TetMesh brick(const Vec3& center) {
  TetMesh mesh = grid(Vec3(-0.5, -0.3, -0.1), Vec3(1, 0.6, 0.2), 3, 2, 1);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vec3(1, -2, 3).normalized()).toRotationMatrix();
  mesh.positions = (mesh.positions * turn.transpose()).rowwise() + center.transpose();
  return mesh;
}

Vec3 place(const State& s, int n) { return Eigen::Map<const Vec3f>(&s.positions[3 * n]).cast<double>(); }
Vec3 speed(const State& s, int n) { return Eigen::Map<const Vec3f>(&s.velocities[3 * n]).cast<double>(); }

// Every node of body 0 gets the velocity of a rigid motion.
void set_motion(const World& world, const Vec3& velocity, const Vec3& spin, State& state) {
  const Vec3 center = center_of_mass_m(world, state, 0);
  for (int n = 0; n < world.bodies[0].node_count(); ++n)
    Eigen::Map<Vec3f>(&state.velocities[3 * n]) =
        (velocity + spin.cross(place(state, n) - center)).cast<float>();
}

struct Momenta {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();  // about the origin
};
Momenta momenta(const World& world, const State& s) {
  Momenta sum;
  for (int n = 0; n < world.moving_nodes; ++n) {
    const Vec3 p = world.tables64.node_mass[n] * speed(s, n);
    sum.linear += p, sum.angular += place(s, n).cross(p);
  }
  return sum;
}

// Largest change of a distance between two nodes of body 0, in metres.
double distortion(const World& world, const State& s) {
  double worst = 0;
  const Points& rest = world.bodies[0].cage.positions;
  for (int a = 0; a < rest.rows(); ++a)
    for (int b = 0; b < a; ++b)
      worst =
          std::max(worst, std::abs((place(s, a) - place(s, b)).norm() - (rest.row(a) - rest.row(b)).norm()));
  return worst;
}

State coast(const World& world, const State& state, int steps) {
  Control control;
  control.steps = steps;
  const Rollout rollout = propagate(world, state, control);
  EXPECT_EQ(rollout.outcome.status, RunStatus::ok) << rollout.outcome.reason;
  return rollout.end;
}

TEST(Rigid, FreeFlightKeepsMomentumEnergyAndShape) {
  const World world = build_world(alone(rigid(brick({0.3, -0.2, 0.1}))));
  State state = rest_state(world);
  set_motion(world, {0.3, -0.2, 0.1}, {2, 1, -3}, state);
  const Momenta before = momenta(world, state);
  const double energy = kinetic_energy_j(world, state);
  const State end = coast(world, state, 10'000);
  const Momenta after = momenta(world, end);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-5 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-4 * before.angular.norm());
  EXPECT_NEAR(kinetic_energy_j(world, end) / energy, 1, 1e-4);
  EXPECT_LT((center_of_mass_m(world, end, 0) - center_of_mass_m(world, state, 0) -
             10'000 * world.dt_s * Vec3(0.3, -0.2, 0.1))
                .norm(),
            1e-3);
  EXPECT_EQ(elastic_energy_j(world, end), 0);
  EXPECT_LT(distortion(world, end), 1e-6);
}

// Spun about its middle axis, a body turns over again and again: Euler's equations of its own three moments,
// integrated here in double by Runge and Kutta with a hundredth of the step. `along` is the spin in its own
// axes.
TEST(Rigid, TheMiddleAxisFlipsAsEulersEquationsSay) {
  const World world = build_world(alone(rigid(brick(Vec3::Zero()))));
  const Body& body = world.bodies[0];
  const Vec3 center = center_of_mass_m(world, rest_state(world), 0);
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (int n = 0; n < body.node_count(); ++n) {
    const Vec3 r = body.cage.positions.row(n).transpose() - center;
    inertia += body.node_mass_kg[n] * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  const Vec3 moments = solver.eigenvalues();
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(2) *= -1;  // else the cross product has the other sign
  ASSERT_GT(moments[1] / moments[0], 1.3);
  ASSERT_GT(moments[2] / moments[1], 1.1);

  Vec3 along(0.2, 3, 0.1);  // of the principal axes, by growing moment
  State state = rest_state(world);
  set_motion(world, Vec3::Zero(), axes * along, state);

  const auto rate = [&](const Vec3& w) -> Vec3 {
    return (moments.asDiagonal() * w).cross(w).cwiseQuotient(moments);
  };
  const int steps = 200, parts = 100;
  int flips = 0;
  double side = 1, worst = 0;
  for (int frame = 0; frame < 100; ++frame) {
    state = coast(world, state, steps);
    const double h = world.dt_s / parts;
    for (int i = 0; i < steps * parts; ++i) {
      const Vec3 k1 = rate(along), k2 = rate(along + h / 2 * k1), k3 = rate(along + h / 2 * k2),
                 k4 = rate(along + h * k3);
      along += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    // The body's spin in its own axes: L = R I Ω, R from the nodes.
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero(), rest_spread = spread;
    Vec3 spin = Vec3::Zero();
    for (int n = 0; n < body.node_count(); ++n) {
      const Vec3 r = body.cage.positions.row(n).transpose() - center;
      spread += body.node_mass_kg[n] * place(state, n) * r.transpose();
      rest_spread += body.node_mass_kg[n] * r * r.transpose();
      spin += body.node_mass_kg[n] * place(state, n).cross(speed(state, n));
    }
    const Eigen::Matrix3d turn = spread * rest_spread.inverse();
    const Vec3 own = inertia.inverse() * turn.transpose() * spin;
    const Vec3 measured = axes.transpose() * own;
    worst = std::max(worst, (measured - along).norm());
    if (measured[1] * side < -2) side = -side, ++flips;
  }
  EXPECT_GE(flips, 3);
  EXPECT_LT(worst, 0.01 * 3);
}

// Whatever spin, however long the step: a free body's energy stays between L²/2I of its axes.
TEST(Rigid, AWildSpinStaysFinite) {
  const World world = build_world(alone(rigid(brick(Vec3::Zero()))));
  State state = rest_state(world);
  set_motion(world, Vec3::Zero(), {3000, -2000, 1000}, state);  // radians a step
  const Momenta before = momenta(world, state);
  const double energy = kinetic_energy_j(world, state);
  const State end = coast(world, state, 1000);
  EXPECT_LT((momenta(world, end).angular - before.angular).norm(), 1e-4 * before.angular.norm());
  EXPECT_LT(kinetic_energy_j(world, end), 10 * energy);
  EXPECT_LT(distortion(world, end), 1e-6);
}

// A throw under gravity follows the scheme's own formula, and the body's shape holds over 10⁵ steps to 1e-6
// of its size; far from the origin, to what float32 resolves there.
TEST(Rigid, ShapeHoldsOverAHundredThousandSteps) {
  WorldSpec spec = alone(rigid(brick(Vec3::Zero())));
  spec.gravity_m_s2 = {0, 0, -1e-4};
  const World world = build_world(spec);
  State state = rest_state(world);
  set_motion(world, {0.001, 0, 0}, {0.9, -1.7, 0.4}, state);
  const int steps = 100'000;
  const State end = coast(world, state, steps);
  EXPECT_LT(distortion(world, end), 1e-6 * bounding_box(world.bodies[0].cage.positions).diagonal());
  const double t = steps * world.dt_s, fall = 0.5e-4 * t * (t + world.dt_s);
  const Vec3 gone = center_of_mass_m(world, end, 0) - center_of_mass_m(world, state, 0);
  EXPECT_LT((gone - Vec3(0.001 * t, 0, -fall)).norm(), 0.01 * gone.norm());
}

TEST(Rigid, AtRestNothingMoves) {
  const World world = build_world(alone(rigid(brick({3.1, -7.3, 5.9}))));
  const State state = rest_state(world);
  State end = coast(world, state, 1000);
  end.step = 0;
  EXPECT_EQ(end, state);
}

// A rigid body hits a soft one off its middle.
TEST(Rigid, ACollisionWithASoftBodyKeepsMomentum) {
  Material material;
  material.friction = 0.3;
  WorldSpec spec = alone(rigid(brick({0, 0, 0}), material));
  spec.bodies.push_back({"soft", ball({1.1, 0.2, 0.1}, 0.5, 4), material, {}, BodyKind::deformable});
  const World world = build_world(spec);
  State state = rest_state(world);
  set_motion(world, {2, 0, 0}, {0, 1, 2}, state);
  const Momenta before = momenta(world, state);
  const State end = coast(world, state, int(0.6 / world.dt_s));
  const Momenta after = momenta(world, end);
  EXPECT_GT(center_of_mass_m(world, end, 1).x(), 1.2);  // it was hit
  EXPECT_LT((after.linear - before.linear).norm(), 1e-5 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-5 * before.linear.norm());
  EXPECT_LT(distortion(world, end), 1e-6);
}

// A slope of angle θ holds a rigid box while μ > tan θ and lets it slide, as Coulomb says, while μ < tan θ.
TEST(Rigid, FrictionHoldsAndSlidesOnASlope) {
  const double tangent = 0.4, angle = std::atan(tangent);
  for (const bool on_floor : {true, false})
    for (const double friction : {tangent + 0.01, tangent - 0.01, 0.0}) {
      SCOPED_TRACE(friction);
      Material material;
      material.friction = friction;
      WorldSpec spec;
      // Not where points of the slope lie under its leading edge: these press it from the front.
      spec.bodies = {rigid(grid({0.77, -0.25, 0}, {0.5, 0.5, 0.3}, 2, 2, 1), material)};
      if (!on_floor)
        spec.bodies.push_back(
            {"slope", grid({0, -1, -0.5}, {6, 2, 0.5}, 12, 4, 1), material, {}, BodyKind::immovable});
      spec.bounds_m = {Vec3(-20, -20, on_floor ? 0 : -20), Vec3(20, 20, 20)};
      spec.gravity_m_s2 = 10 * Vec3(std::sin(angle), 0, -std::cos(angle));
      const World world = build_world(spec);
      const State landed = coast(world, rest_state(world), 1000);
      const State end = coast(world, landed, 1000);
      const double mass = world.bodies[0].mass_kg;
      const double before = momenta(world, landed).linear.x() / mass,
                   after = momenta(world, end).linear.x() / mass;
      const double gained = 10 * std::cos(angle) * std::max(0.0, tangent - friction) * 1000 * world.dt_s;
      // Without friction it is at 4 to 7 m/s, and vertices of a body that pass under its leading edge
      // take 1.9 % of that.
      EXPECT_NEAR(after - before, gained, on_floor ? 1e-3 : 0.001 + 0.02 * gained);
      if (friction > tangent) {
        EXPECT_LT(std::abs(after), 1e-4);
      }
    }
}

// Dropped on a corner, a box comes to rest on a face, whose nodes are equally deep there and so have equal
// shares of what it sets against the floor: g h²/2β · M/(mean of 1/(1/M + (r × n)·J⁻¹(r × n))).
TEST(Rigid, ABoxComesToRestOnTheFloor) {
  Material material;
  material.friction = 0.5;
  TetMesh mesh = grid(Vec3(-0.5, -0.4, -0.3), Vec3(1, 0.8, 0.6), 2, 2, 2);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Vec3(1, 2, 0).normalized()).toRotationMatrix();
  const Points flat = mesh.positions;
  mesh.positions = (mesh.positions * turn.transpose()).rowwise() + Eigen::RowVector3d(0, 0, 0.9);
  WorldSpec spec = alone(rigid(mesh, material));
  spec.bounds_m = {Vec3(-5, -5, 0), Vec3(5, 5, 10)};
  spec.walls = true;
  spec.gravity_m_s2 = {0, 0, -10};
  const World world = build_world(spec);
  const State end = coast(world, rest_state(world), 8000);
  EXPECT_LT(mean_speed_m_s(world, end, 0), 1e-4);
  const double mass = world.bodies[0].mass_kg;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 r = flat.row(n);
    inertia +=
        world.tables64.node_mass[n] * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }
  double set_against = 0, depth = 0, count = 0;
  for (int n = 0; n < world.nodes; ++n)
    if (flat(n, 2) < -0.29) {
      const Vec3 lever = Vec3(flat.row(n)).cross(Vec3::UnitZ());
      set_against += 1 / (1 / mass + lever.dot(inertia.inverse() * lever));
      depth -= place(end, n).z();
      ++count;
    }
  const double expected = 10 * world.contact_dt_s * world.contact_dt_s / (2 * detail::contact_beta) * mass /
                          (set_against / count);
  EXPECT_NEAR(depth / count / expected, 1, 0.05);
  EXPECT_LT(distortion(world, end), 1e-6);
}

// Four cubes of different cages, each a little to the side of the one below, stand still on one another:
// stiffness by the nodes' masses is stable in any contact, of rigid bodies with each other too.
TEST(Rigid, AStackStands) {
  Material material;
  material.friction = 0.5;
  WorldSpec spec;
  for (int i = 0; i < 4; ++i)
    spec.bodies.push_back({fmt::format("cube{}", i),
                           cube({0.03 * i, 0.02 * i, 0.5 + 1.001 * i}, 1, 2 + i % 2),
                           material,
                           {},
                           BodyKind::rigid});
  spec.bounds_m = {Vec3(-5, -5, 0), Vec3(5, 5, 10)};
  spec.gravity_m_s2 = {0, 0, -10};
  const World world = build_world(spec);
  const State start = rest_state(world);
  const State end = coast(world, start, 20000);  // it sways by a millimetre and comes to rest
  for (int b = 0; b < 4; ++b) {
    EXPECT_LT(mean_speed_m_s(world, end, b), 1e-3);
    EXPECT_LT((center_of_mass_m(world, end, b) - center_of_mass_m(world, start, b)).norm(), 0.006);
  }
}

// Thrown at a static plate 0.35 m thick: back, never through.
TEST(Rigid, AThrownCubeComesBack) {
  for (const double pace : {1.0, 4.0, 8.0}) {
    SCOPED_TRACE(pace);
    WorldSpec spec = alone(rigid(cube({0, 0, 0}, 1, 3)));
    spec.bodies.push_back(
        {"plate", grid({1, -1.5, -1.1}, {0.35, 3, 2.2}, 2, 6, 4), {}, {}, BodyKind::immovable});
    const World world = build_world(spec);
    State state = rest_state(world);
    set_motion(world, {pace, 0, 0}, {0, 0, 0}, state);
    double deepest = 0;
    for (int i = 0; i < 60; ++i) {
      state = coast(world, state, int(0.05 / pace / world.dt_s));
      deepest = std::max(deepest, deepest_penetration(world, state).depth_m);
    }
    EXPECT_LT(momenta(world, state).linear.x(), 0);
    EXPECT_LT(bounding_box(body_positions(world, state, 0)).upper.x(), 1);
    RecordProperty("deepest_mm", int(1e3 * deepest));
    EXPECT_LT(deepest, 2 * pace * world.dt_s / std::sqrt(detail::contact_beta));
  }
}

// A fine cube on its corner: one node of 1/12,288 of its mass meets the wall first, and all of the body
// stands behind it.
TEST(Rigid, ALightNodeBearsTheWholeBody) {
  TetMesh mesh = cube(Vec3::Zero(), 1, 8);
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Vec3(1, 1, 1), Vec3::UnitX()).toRotationMatrix();
  mesh.positions = mesh.positions * turn.transpose();
  WorldSpec spec = alone(rigid(mesh));
  spec.bounds_m = {Vec3::Constant(-1), Vec3::Constant(1)};
  spec.walls = true;
  const World world = build_world(spec);
  State state = rest_state(world);
  const double pace = 2;
  set_motion(world, {pace, 0, 0}, {0, 0, 0}, state);
  double deepest = 0;
  for (int i = 0; i < 150; ++i) {
    state = coast(world, state, 1);
    deepest = std::max(deepest, deepest_penetration(world, state).depth_m);
  }
  EXPECT_LT(momenta(world, state).linear.x(), 0);
  EXPECT_GT(deepest, 0);
  EXPECT_LT(deepest, 1.2 * pace * world.dt_s / std::sqrt(2 * detail::contact_beta));
}

// A rigid robot pushed at a soft plate, by every manipulation: the same bits for any number of lanes and any
// instruction set, and 100 steps are 40 and then 60.
TEST(Rigid, ResultsDoNotDependOnLanesInstructionSetOrPauses) {
  WorldSpec spec = testing::barriers();
  spec.bodies[0].kind = BodyKind::rigid;
  spec.bodies[0].material.mass_damping_per_s = 0.2;
  const World world = build_world(spec);
  Control press;
  press.manipulation = Manipulation::body;
  press.force_n = {900, 0, -100};
  press.steps = 500;
  const State pressed = propagate(world, rest_state(world), press).end;
  ASSERT_EQ(deepest_penetration(world, pressed).other, 1);
  Rng rng(51, 0);
  std::vector<Rollout> rollouts;
  for (int i = 0; i < 20; ++i) {
    Control control;
    control.steps = 20 + rng.below(60);
    control.manipulation = Manipulation(i % 4);
    control.force_n = (800 * rng.direction()).cast<float>();
    control.node = rng.below(world.bodies[0].node_count());
    control.radius_m = 0.5f;
    control.target_m = {2.5f, 1.5f, 1.5f};
    control.max_force_n = 700;
    rollouts.push_back({&pressed, control, {}, {}});
  }
  const auto run = [&](int lanes, InstructionSet set) {
    Batch batch(world, lanes, set);
    std::vector<Rollout> copy = rollouts;
    propagate(batch, copy);
    std::vector<State> ends;
    for (const Rollout& r : copy) ends.push_back(r.end);
    return ends;
  };
  const std::vector<State> one = run(1, InstructionSet::sse2);
  for (const auto set : {InstructionSet::sse2, InstructionSet::avx2, InstructionSet::avx512}) {
    if (set == InstructionSet::avx512 && !__builtin_cpu_supports("avx512bw"))
      GTEST_SKIP() << "no AVX-512 here";
    for (const int lanes : {1, 4, 8, 16}) EXPECT_EQ(run(lanes, set), one) << lanes;
  }
  for (int i = 0; i < 4; ++i) {
    Control whole = rollouts[std::size_t(i)].control, first = whole, second = whole;
    whole.steps = 100, first.steps = 40, second.steps = 60;
    const State middle = propagate(world, pressed, first).end;
    EXPECT_EQ(propagate(world, middle, second).end, propagate(world, pressed, whole).end);
  }
}

// What each manipulation does to a free rigid robot: a force on the whole moves its centre as F/m, the same
// on one corner turns it too, and an interpolation brings it upright to its place.
TEST(Rigid, ManipulationsMoveARigidRobot) {
  const World world = build_world(alone(rigid(brick(Vec3::Zero()))));
  const Body& body = world.bodies[0];
  Control push;
  push.manipulation = Manipulation::body;
  push.force_n = {30, 0, 0};
  push.steps = 200;
  State state = propagate(world, rest_state(world), push).end;
  Momenta m = momenta(world, state);
  EXPECT_NEAR(m.linear.x(), 30 * 200 * world.dt_s, 1e-4);
  EXPECT_LT(m.angular.norm(), 1e-5);

  push.manipulation = Manipulation::control_point;
  push.node = 0, push.radius_m = 0.45f, push.steps = 20;
  const State corner = propagate(world, rest_state(world), push).end;
  m = momenta(world, corner);
  // What is pushed has its middle beside the line of the force through the centre.
  Vec3 middle = Vec3::Zero();
  double pushed = 0;
  for (int n = 0; n < body.node_count(); ++n)
    if ((body.cage.positions.row(n) - body.cage.positions.row(0)).norm() <= 0.45)
      pushed += body.node_mass_kg[n], middle += body.node_mass_kg[n] * body.cage.positions.row(n).transpose();
  ASSERT_GT(pushed, 0.1 * body.mass_kg);
  EXPECT_NEAR(m.linear.x(), 30 * 20 * world.dt_s, 1e-5);
  EXPECT_NEAR(m.angular.norm(), 30 * 20 * world.dt_s * middle.tail<2>().norm() / pushed, 0.002);

  Control settle;
  settle.manipulation = Manipulation::interpolation;
  settle.target_m = {0.5f, 0.2f, -0.3f};
  settle.max_force_n = 100;
  settle.steps = 6000;
  set_motion(world, {0, 0.2, 0}, {0.5, 0.5, 0}, state);
  const State end = propagate(world, state, settle).end;
  const Vec3 center = center_of_mass_m(world, rest_state(world), 0), goal(0.5, 0.2, -0.3);
  for (int n = 0; n < body.node_count(); ++n)
    EXPECT_LT((place(end, n) - goal - (body.cage.positions.row(n).transpose() - center)).norm(), 1e-3);
}

TEST(Rigid, AFixedNodeOfARigidBodyIsRefused) {
  BodySpec body = rigid(brick(Vec3::Zero()));
  body.fixed_nodes = {3};
  try {
    build_world(alone(body));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("body rigid: node 3 of a rigid body is fixed"));
  }
}

}  // namespace
}  // namespace limber::fem
