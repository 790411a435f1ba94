// Springs between bodies: closed forms of one and two bodies, and that a world with them is as deterministic
// as one without.
#include "fem/ligament.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {
using namespace testing;
using ::testing::HasSubstr;

constexpr double everywhere = 10;  // a radius that holds all of a body

BodySpec body(const char* name, double x, double edge, BodyKind kind = BodyKind::rigid) {
  BodySpec spec{name, cube({x, 0, 0}, edge, 2), {}, {}, kind};
  spec.material.mesh_independent = false;
  return spec;
}

// Two cubes, 1 and 0.8 m, whose centres are 3 m apart, and a ligament between these.
WorldSpec pair(const LigamentSpec& ligament, BodyKind kind = BodyKind::rigid) {
  WorldSpec spec = alone(body("one", 0, 1, kind));
  spec.bodies.push_back(body("other", 3, 0.8, kind));
  spec.ligaments = {ligament};
  return spec;
}
LigamentSpec between_centres(double stiffness_n_m) {
  LigamentSpec ligament;
  ligament.name = "band";
  ligament.ends = {{{0, {0, 0, 0}, everywhere}, {1, {3, 0, 0}, everywhere}}};
  ligament.stiffness_n_m = stiffness_n_m;
  return ligament;
}
State after(const World& world, double seconds) {
  Control coast;
  coast.steps = int(std::lround(seconds / world.dt_s));
  const Rollout rollout = propagate(world, start_state(world), coast);
  EXPECT_EQ(rollout.outcome.status, RunStatus::ok) << rollout.outcome.reason;
  return rollout.end;
}
double apart(const World& world, const State& state) {
  return (center_of_mass_m(world, state, 1) - center_of_mass_m(world, state, 0)).norm();
}

// x'' + 2 ζ ω x' + ω² x = 0 of what they are apart by more than at rest, ω² = k (1/m + 1/m'); their common
// centre of mass stays. Rigid and soft bodies, which a pull by mass does not deform.
TEST(Ligaments, TwoBodiesSwingAsOneOscillator) {
  for (const BodyKind kind : {BodyKind::rigid, BodyKind::deformable})
    for (const double ratio : {0.0, 0.2, 1.0}) {
      LigamentSpec ligament = between_centres(300);
      ligament.damping_ratio = ratio, ligament.rest_length = 0.9, ligament.pushes = true;
      WorldSpec spec = pair(ligament, kind);
      spec.max_dt_s = 5e-4;
      const World world = build_world(spec);
      const double m = world.bodies[0].mass_kg, n = world.bodies[1].mass_kg,
                   omega = std::sqrt(300 / m + 300 / n);
      EXPECT_NEAR(world.ligaments[0].inverse_mass_per_kg, 1 / m + 1 / n, 1e-6);
      for (const double t : {0.3, 1.1}) {
        const double slow = std::exp(-ratio * omega * t), w = omega * std::sqrt(1 - ratio * ratio);
        const double share = ratio == 1 ? slow * (1 + omega * t)
                                        : slow * (std::cos(w * t) + ratio * omega / w * std::sin(w * t));
        const State state = after(world, t);
        EXPECT_NEAR(apart(world, state), 2.7 + 0.3 * share, 2e-3) << ratio << ' ' << t;
        const Vec3 common =
            (m * center_of_mass_m(world, state, 0) + n * center_of_mass_m(world, state, 1)) / (m + n);
        EXPECT_NEAR((common - Vec3(3 * n / (m + n), 0, 0)).norm(), 0, 1e-5);
      }
    }
}

// Off centre it turns what it pulls, and leaves the sum of linear and angular momenta what it was: none.
TEST(Ligaments, KeepAngularMomentum) {
  for (const BodyKind kind : {BodyKind::rigid, BodyKind::deformable}) {
    LigamentSpec ligament = between_centres(300);
    ligament.ends = {{{0, {0.5, 0.5, 0.2}, 0}, {1, {2.6, -0.4, 0.1}, 0}}};
    ligament.rest_length = 0.7;
    const World world = build_world(pair(ligament, kind));
    const State state = after(world, 0.4);
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double most = 0;
    for (const Body& b : world.bodies)
      for (int i = 0; i < b.node_count(); ++i) {
        const auto at = [&](const std::vector<float>& of) {
          const float* three = &of[std::size_t(3 * (b.first_node + i))];
          return Vec3(double(three[0]), double(three[1]), double(three[2]));
        };
        const Vec3 momentum = b.node_mass_kg[std::size_t(i)] * at(state.velocities);
        // Velocities are of the middle of a step.
        linear += momentum,
            angular += (at(state.positions) - 0.5 * world.dt_s * at(state.velocities)).cross(momentum);
        most += momentum.norm();
      }
    EXPECT_GT(most, 1) << "nothing moves";
    EXPECT_LT(linear.norm(), 1e-4 * most);
    EXPECT_LT(angular.norm(), 1e-3 * most);
  }
}

// A body that hangs on one comes to rest m g/k lower than where it is at its rest length.
TEST(Ligaments, CarryTheWeightThatHangsOnThem) {
  for (const BodyKind kind : {BodyKind::rigid, BodyKind::deformable}) {
    WorldSpec spec = alone(body("one", 0, 1, kind));
    spec.gravity_m_s2 = {0, 0, -9.81};
    LigamentSpec band;
    band.name = "band";
    band.ends = {{{-1, {0, 0, 3}, 0}, {0, {0, 0, 0}, everywhere}}};
    band.stiffness_n_m = 4e3, band.damping_ratio = 1;
    spec.ligaments = {band};
    const World world = build_world(spec);
    const State state = after(world, 6);
    const double weight = 9.81 * world.bodies[0].mass_kg;
    EXPECT_NEAR(ligament_pulls(world, state)[0].tension_n / weight, 1, 1e-3);
    EXPECT_NEAR(-center_of_mass_m(world, state, 0).z() / (weight / 4e3), 1, 2e-3);
  }
}

// Shorter than at rest it does nothing, bit for bit, unless it pushes; and it never pulls towards what it has
// passed.
TEST(Ligaments, AreSlackWhereTheyAreShort) {
  LigamentSpec ligament = between_centres(300);
  ligament.rest_length = 1.2;
  const World slack = build_world(pair(ligament));
  WorldSpec without = pair(ligament);
  without.ligaments.clear(), without.max_dt_s = slack.dt_s;
  EXPECT_EQ(after(slack, 0.5), after(build_world(without), 0.5));
  ligament.pushes = true;
  const World pushes = build_world(pair(ligament));
  EXPECT_GT(apart(pushes, after(pushes, 0.2)), 3.05);
  EXPECT_LT(ligament_pulls(pushes, start_state(pushes))[0].tension_n, -100);
  EXPECT_EQ(ligament_pulls(slack, start_state(slack))[0].tension_n, 0);
}

// However stiff: the step is short enough, and the energy of what swings stays.
TEST(Ligaments, StiffOnesShortenTheStep) {
  const double loose = build_world(pair(between_centres(1))).dt_s;
  for (const double ratio : {0.0, 2.0}) {
    WorldSpec spec = pair(between_centres(1e8));
    spec.ligaments[0].pushes = true, spec.ligaments[0].rest_length = 0.99,
    spec.ligaments[0].damping_ratio = ratio;
    for (int more = 1; more < 6; ++more) spec.ligaments.push_back(spec.ligaments[0]);
    const World world = build_world(spec);
    EXPECT_LT(world.dt_s, 0.2 * loose);
    State state = start_state(world);
    Control coast;
    coast.steps = 50;
    for (int i = 0; i < 20; ++i) {
      state = propagate(world, state, coast).end;
      EXPECT_NEAR(apart(world, state), 2.97, 0.031);
    }
  }
}

// Bodies that a ligament ties sleep and wake together: a long rollout is one of single steps, alone and
// beside other lanes. The chain is pulled at one end until the other moves, and comes to rest.
TEST(Ligaments_slow, SleepChangesNothing) {
  WorldSpec spec = alone(body("robot", 0, 1, BodyKind::deformable));
  spec.rest_speed_m_s = 2e-3;
  for (int b = 1; b < 4; ++b) {
    static const char* const names[] = {"", "a", "b", "c"};
    spec.bodies.push_back(body(names[b], 1.5 * b, 1, BodyKind::deformable));
  }
  for (BodySpec& b : spec.bodies) b.material.damping_ratio = 0.3, b.material.mass_damping_per_s = 2;
  for (int b = 0; b < 3; ++b) {
    LigamentSpec ligament;
    ligament.name = fmt::format("band-{}", b);
    ligament.ends = {{{b, {1.5 * b + 0.5, 0, 0}, 0}, {b + 1, {1.5 * b + 1, 0, 0}, 0.4}}};
    ligament.stiffness_n_m = 400, ligament.damping_ratio = 1;
    spec.ligaments.push_back(ligament);
  }
  const World world = build_world(spec);
  const auto push = [&](float force, int steps) {
    Control control;
    control.manipulation = Manipulation::body, control.force_n = {force, 0, 0}, control.steps = steps;
    return control;
  };
  Control coast;
  coast.steps = 6000;
  const std::vector<Control> controls{push(-40, 400), coast, push(40, 200), coast};
  const auto moves = [&](const State& state, int b) { return mean_speed_m_s(world, state, b) > 0; };
  std::vector<State> starts{rest_state(world)};
  int slept = 0, last_moved = 0;
  for (const Control& control : controls) {
    const State whole = propagate(world, starts.back(), control).end;
    State stepped = starts.back();
    Batch batch(world, 1);
    Control one = control;
    one.steps = 1;
    for (int s = 0; s < control.steps; ++s) {
      batch.load(0, stepped, one);
      batch.advance();
      batch.store(0, stepped);
      slept += !moves(stepped, 0), last_moved += moves(stepped, 3);
    }
    EXPECT_EQ(stepped, whole);
    starts.push_back(whole);
  }
  EXPECT_GT(slept, 100);
  EXPECT_GT(last_moved, 100);
  std::vector<Rollout> rollouts;
  for (std::size_t i = 0; i < controls.size(); ++i) rollouts.push_back({&starts[i], controls[i], {}, {}});
  for (const int lanes : {4, 16}) {
    Batch batch(world, lanes);
    propagate(batch, rollouts);
    for (std::size_t i = 0; i < controls.size(); ++i)
      EXPECT_EQ(rollouts[i].end, starts[i + 1]) << lanes << ' ' << i;
  }
}

TEST(Ligaments, WhatCannotBeIsTold) {
  const auto complaint = [](const auto& change) {
    WorldSpec spec = pair(between_centres(300));
    change(spec.ligaments[0]);
    try {
      build_world(spec);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("taken");
  };
  EXPECT_EQ(complaint([](LigamentSpec&) {}), "taken");
  EXPECT_THAT(complaint([](LigamentSpec& l) { l.ends[1].body = 0; }),
              HasSubstr("both its ends are on one body"));
  EXPECT_THAT(complaint([](LigamentSpec& l) { l.ends[0].body = l.ends[1].body = -1; }),
              HasSubstr("on no body"));
  EXPECT_THAT(complaint([](LigamentSpec& l) { l.ends[1].body = 7; }), HasSubstr("there is no body 7"));
  EXPECT_THAT(complaint([](LigamentSpec& l) {
                l.ends[1] = {1, {5, 0, 0}, 0};
              }),
              HasSubstr("1.6 m away from body other, at 3.4, 0, 0"));
  EXPECT_THAT(complaint([](LigamentSpec& l) {
                l.ends[1] = {1, {3.1, 0.1, 0}, 0.01};
              }),
              HasSubstr("has no node"));
  EXPECT_THAT(complaint([](LigamentSpec& l) { l.ends[1] = {-1, {0, 0, 0}, 0}; }), HasSubstr("at one place"));
  EXPECT_THAT(complaint([](LigamentSpec& l) { l.stiffness_n_m = 0; }), HasSubstr("stiffness_n_m is 0"));
  EXPECT_THAT(complaint([](LigamentSpec& l) { l.damping_ratio = 2.1; }), HasSubstr("damping_ratio"));
  EXPECT_THAT(complaint([](LigamentSpec& l) { l.rest_length = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("rest_length"));
  WorldSpec still = pair(between_centres(300));
  still.bodies.push_back(body("robot", 9, 1));
  still.robot = 2;
  still.bodies[0].kind = still.bodies[1].kind = BodyKind::immovable;
  EXPECT_THROW(build_world(still), InputError);
}

}  // namespace
}  // namespace limber::fem
