// What happens by itself: velocities at the start, forces and pressures between two times, bodies that go
// from keyframe to keyframe (docs/simulation.md).
#include "fem/script.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::cube;
using testing::grid;

constexpr BodyKind kinds[] = {BodyKind::deformable, BodyKind::rigid};

BodySpec body(TetMesh mesh, BodyKind kind, const char* name = "body") {
  BodySpec spec;
  spec.name = name, spec.cage = std::move(mesh), spec.kind = kind;
  spec.material.youngs_modulus_pa = 2e4, spec.material.damping_ratio = 0.5;
  return spec;
}

State run(const World& world, const State& from, int steps, const Control& pushed = {}) {
  Control control = pushed;
  control.steps = steps;
  const Rollout rollout = propagate(world, from, control);
  EXPECT_EQ(rollout.outcome.status, RunStatus::ok) << rollout.outcome.reason;
  return rollout.end;
}
State run(const World& world, int steps) { return run(world, start_state(world), steps); }

Vec3 momentum(const World& world, const State& state, int index = 0) {
  return world.bodies[std::size_t(index)].mass_kg * center_velocity_m_s(world, state, index);
}

// A plate of 2 × 2 × 0.2 m with its upper side at z = 0, and a cube of 1 m that stands on it.
WorldSpec lift(BodyKind kind, std::vector<Keyframe> keyframes) {
  WorldSpec spec = alone(body(cube({0, 0, 0.5}, 1, 2), kind));
  spec.bodies.push_back(body(grid({-1, -1, -0.2}, {2, 2, 0.2}, 2, 2, 1), BodyKind::kinematic, "plate"));
  spec.bodies.back().track = {{0, 0, 0}, std::move(keyframes)};
  spec.gravity_m_s2 = {0, 0, -9.81};
  return spec;
}

TEST(Script, AThrownBodyGoesOnAParabola) {
  for (const BodyKind kind : kinds) {
    WorldSpec spec = alone(body(cube({0, 0, 3}, 1, 2), kind));
    spec.gravity_m_s2 = {0, 0, -9.81};
    spec.bodies[0].velocity_m_s = {3, -1, 4};
    spec.bodies[0].angular_velocity_rad_s = {0, 0.5, 0.2};
    const World world = build_world(spec);
    const State start = start_state(world);
    const int n = int(1 / world.dt_s);
    const State end = run(world, n);
    const double t = n * world.dt_s;
    // Σ k dt² g over the steps: the parabola, and half a step of it.
    const Vec3 fallen = spec.gravity_m_s2 * world.dt_s * world.dt_s * n * (n + 1) / 2;
    const Vec3 way = center_of_mass_m(world, end, 0) - center_of_mass_m(world, start, 0);
    EXPECT_LT((way - t * spec.bodies[0].velocity_m_s - fallen).norm(), 2e-5);
    EXPECT_LT((way - t * spec.bodies[0].velocity_m_s - 0.5 * t * t * spec.gravity_m_s2).norm(),
              0.51 * 9.81 * world.dt_s * t);
    EXPECT_LT(
        (center_velocity_m_s(world, end, 0) - spec.bodies[0].velocity_m_s - t * spec.gravity_m_s2).norm(),
        2e-5);
  }
}

TEST(Script, ABodySpinsAboutItsCentreFromTheStart) {
  WorldSpec spec = alone(body(grid({1, 2, 3}, {1, 0.6, 0.4}, 3, 2, 2), BodyKind::rigid));
  spec.bodies[0].velocity_m_s = {0.3, 0, 0};
  spec.bodies[0].angular_velocity_rad_s = {0, 0, 2};
  const World world = build_world(spec);
  const State start = start_state(world), end = run(world, int(1.5 / world.dt_s));
  const double angle = 2 * double(end.step) * world.dt_s;
  const auto from_center = [&](const State& state) -> Vec3 {
    return body_positions(world, state, 0).row(0).transpose() - center_of_mass_m(world, state, 0);
  };
  const Vec3 turned = Eigen::AngleAxisd(angle, Vec3::UnitZ()) * from_center(start);
  EXPECT_LT((from_center(end) - turned).norm(), 1e-3);
  EXPECT_LT((center_velocity_m_s(world, end, 0) - Vec3(0.3, 0, 0)).norm(), 1e-5);
}

// Whichever nodes it falls on; a held node bears its share.
TEST(Script, MomentumIsTheImpulseOfTheForce) {
  for (const BodyKind kind : kinds)
    for (const bool some : {false, true}) {
      WorldSpec spec = alone(body(cube({0, 0, 0}, 1, 3), kind));
      const std::vector<int> right =
          testing::nodes_where(spec.bodies[0].cage, [](const Vec3& p) { return p.x() > 0.4; });
      const Vec3 force(5, 2, -3);
      spec.forces.push_back({0, 0.1, 0.35, force, some ? right : std::vector<int>{}});
      spec.forces.push_back({0, 0.2, 0.3, {0, 0, 7}});
      const World world = build_world(spec);
      const auto steps = [&](double s) { return double(std::llround(s / world.dt_s)); };
      const State end = run(world, int(0.5 / world.dt_s));
      const Vec3 impulse =
          world.dt_s * (force * (steps(0.35) - steps(0.1)) + Vec3(0, 0, 7) * (steps(0.3) - steps(0.2)));
      EXPECT_LT((momentum(world, end) - impulse).norm(), 1e-4 * impulse.norm()) << some;
      EXPECT_LT(momentum(world, run(world, int(steps(0.1)))).norm(), 1e-9);  // nothing before it begins
      if (some && kind == BodyKind::rigid) {  // off its centre it turns the body
        EXPECT_GT(
            (body_positions(world, end, 0) - body_positions(world, start_state(world), 0))
                .rowwise()
                .norm()
                .maxCoeff(),
            1.2 * (center_of_mass_m(world, end, 0) - center_of_mass_m(world, start_state(world), 0)).norm());
      }
    }
}

// So a simulation from a plan's frame can go on as the plan does.
TEST(Script, AForceOnTheRobotIsABodyControlBitForBit) {
  for (const BodyKind kind : kinds) {
    WorldSpec spec = alone(body(cube({0, 0, 0}, 1, 3), kind));
    const World plain = build_world(spec);
    Control control;
    control.manipulation = Manipulation::body, control.force_n = {3, 5, -7};
    spec.forces.push_back({0, 0, 200 * plain.dt_s, {3, 5, -7}});
    const World forced = build_world(spec);
    const State pushed = run(plain, start_state(plain), 200, control);
    EXPECT_EQ(run(forced, 200), pushed);
    EXPECT_EQ(run(forced, 300), run(plain, pushed, 100));
  }
}

// Against Eigen's rotations, which use the sine of the library.
TEST(Script, PosesGoEvenlyFromKeyframeToKeyframe) {
  const double whole = 2 * std::numbers::pi;
  const Track track{
      {1, 2, 3},
      {{1, {1, 2, 5}, {0, 0, 0}}, {3, {4, 2, 5}, {0, 0, 2 * whole}}, {4, {4, 2, 5}, {1, -2, 0.5}}}};
  EXPECT_EQ(pose_at(track, 0), (Pose{Eigen::Matrix3d::Identity(), {1, 2, 3}}));
  EXPECT_EQ(pose_at(track, 0.5).place_m, Vec3(1, 2, 4));
  EXPECT_EQ(pose_at(track, 2).place_m, Vec3(2.5, 2, 5));
  EXPECT_EQ(pose_at(track, 9), pose_at(track, 4));
  Rng rng(3, 0);
  for (int k = 0; k < 1000; ++k) {
    const double time = rng.uniform(1, 4), u = time < 3 ? (time - 1) / 2 : time - 3;
    const Vec3 from = time < 3 ? Vec3(0, 0, 0) : Vec3(0, 0, 2 * whole),
               to = time < 3 ? Vec3(0, 0, 2 * whole) : Vec3(1, -2, 0.5), turn = from + u * (to - from);
    const Eigen::Matrix3d expected = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    ASSERT_LT((pose_at(track, time).turn - expected).norm(), 1e-13) << time;
  }
}

// Steadily lifted, the cube goes as the plate does and weighs what it weighs.
TEST(Script, AKinematicPlateCarriesWhatStandsOnIt) {
  for (const BodyKind kind : kinds) {
    const World world = build_world(lift(kind, {{10, {0, 0, 3}, {0, 0, 0}}}));
    const State settled = run(world, int(5 / world.dt_s));
    const int steps = int(0.5 / world.dt_s);
    State state = settled;
    double force_n = 0;  // a body chatters a little on a penalty: the mean of all steps
    for (int k = 0; k < steps; ++k) {
      for (const PairForce& pair : pair_forces(contact_forces(world, state))) {
        EXPECT_EQ(pair.other, 1);
        force_n += pair.force_n.z() / steps;
      }
      state = run(world, state, 1);
    }
    const double way_m = center_of_mass_m(world, state, 0).z() - center_of_mass_m(world, settled, 0).z();
    EXPECT_NEAR(way_m / (steps * world.dt_s), 0.3, 1e-3);
    EXPECT_NEAR(center_velocity_m_s(world, state, 0).z(), 0.3, 5e-3);
    EXPECT_LT((center_velocity_m_s(world, state, 1) - Vec3(0, 0, 0.3)).norm(), 1e-6);
    EXPECT_NEAR(force_n / (9.81 * world.bodies[0].mass_kg), 1, 0.01);
  }
}

TEST(Script, NothingPushesAKinematicBody) {
  std::vector<Keyframe> keyframes{{0.5, {0, 0, 0.2}, {0, 0, 0.4}}, {1.5, {0.3, 0, 0}, {0, 0, -0.1}}};
  WorldSpec spec = lift(BodyKind::rigid, keyframes);
  spec.bodies[0].material.density_kg_m3 = 5000;
  const World world = build_world(spec);
  State state = start_state(world);
  for (int k = 0; k < 20; ++k) {
    state = run(world, state, int(0.1 / world.dt_s));
    State placed = state;
    follow_keyframes(world, placed);
    EXPECT_EQ(placed.positions, state.positions) << k;
    EXPECT_EQ(inverted_tets(world, state), 0);
  }
  EXPECT_GT(center_of_mass_m(world, state, 0).z(), 0.3);  // and it has held that weight
}

// Bodies at rest cost nothing until something begins to happen; then they are there.
TEST(Script, WhatBeginsWakesWhatSleeps) {
  WorldSpec spec =
      lift(BodyKind::deformable,
           {{1, {0, 0, -0.1}, {0, 0, 0}}, {2, {0, 0, -0.1}, {0, 0, 0}}, {3, {0, 0, 0.5}, {0, 0, 0}}});
  spec.gravity_m_s2.setZero();
  spec.rest_speed_m_s = 0.01;
  const World pushed = build_world(spec);
  const State before = run(pushed, int(2 / pushed.dt_s));
  EXPECT_EQ(body_positions(pushed, before, 0), body_positions(pushed, start_state(pushed), 0));
  const State after = run(pushed, int(3 / pushed.dt_s));
  EXPECT_GT(center_of_mass_m(pushed, after, 0).z() - center_of_mass_m(pushed, before, 0).z(), 0.45);

  spec.bodies[1].track.keyframes.clear();
  spec.forces.push_back({0, 2, 2.5, {0, 0, pushed.bodies[0].mass_kg}});
  const World thrown = build_world(spec);
  EXPECT_EQ(center_velocity_m_s(thrown, run(thrown, int(2 / thrown.dt_s)), 0), Vec3::Zero());
  EXPECT_NEAR(center_velocity_m_s(thrown, run(thrown, int(3 / thrown.dt_s)), 0).z(), 0.5, thrown.dt_s);
}

// ---- Pressure ----

// A slab of 3 × 3 × 3 cells, and the tets of its middle one.
struct Slab {
  TetMesh whole, hollow;
  Tets middle;
};
Slab slab(const Vec3& center = Vec3::Zero()) {
  Slab made;
  made.whole = made.hollow = grid(center - Vec3(0.5, 0.4, 0.3), {1, 0.8, 0.6}, 3, 3, 3);
  std::vector<Eigen::Index> inside, outside;
  for (Eigen::Index t = 0; t < made.whole.tets.rows(); ++t) {
    Vec3 middle = Vec3::Zero();
    for (int i = 0; i < 4; ++i) middle += made.whole.positions.row(made.whole.tets(t, i)) / 4;
    const Vec3 away = (middle - center).cwiseQuotient(Vec3(1, 0.8, 0.6)).cwiseAbs();
    (away.maxCoeff() < 1. / 6 ? inside : outside).push_back(t);
  }
  made.middle = made.whole.tets(inside, Eigen::all);
  made.hollow.tets = made.whole.tets(outside, Eigen::all);
  return made;
}

double volume_of(const Tets& tets, const Points& x) {
  double sum = 0;
  for (Eigen::Index t = 0; t < tets.rows(); ++t)
    sum += signed_volume(x.row(tets(t, 0)), x.row(tets(t, 1)), x.row(tets(t, 2)), x.row(tets(t, 3)));
  return sum;
}

World blown(TetMesh mesh, MaterialModel model, double pressure_pa) {
  WorldSpec spec = alone(body(std::move(mesh), BodyKind::deformable));
  spec.bodies[0].material.model = model;
  spec.pressures.push_back({0, 0, 100, pressure_pa});
  return build_world(spec);
}

// Small pressures dilate a body of one material alike all over, whatever its shape: ΔV/V = p/K.
TEST(Pressure, ABodyGrowsByThePressureOverItsBulkModulus) {
  const double bulk_pa = 2e4 / 3 / (1 - 2 * 0.45);
  for (const double pressure : {400., -400.}) {
    const World world = blown(slab().whole, MaterialModel::neo_hookean, pressure);
    const State end = run(world, int(20 / world.dt_s));
    const Points x = body_positions(world, end, 0);
    EXPECT_NEAR(volume_m3(world, end, 0) / world.bodies[0].rest_volume_m3 - 1, pressure / bulk_pa,
                0.01 * std::abs(pressure) / bulk_pa);
    const Strains all = strains(world, end, 0);
    EXPECT_LT(*std::max_element(all.von_mises.begin(), all.von_mises.end()), 2e-5);
  }
}

// At rest the elastic energy is half of what the pressure gave, p ΔV (Clapeyron): of the body or, where it is
// hollow, of its hollow.
TEST(Pressure, AHollowIsBlownUpFromWithin) {
  const Slab made = slab();
  for (const MaterialModel model : {MaterialModel::springs, MaterialModel::neo_hookean})
    for (const bool hollow : {false, true}) {
      const double pressure = hollow ? 500 : 200;
      const World world = blown(hollow ? made.hollow : made.whole, model, pressure);
      const State end = run(world, int(3 / world.dt_s));
      const Tets& held = hollow ? made.middle : made.whole.tets;
      const double grown =
          volume_of(held, body_positions(world, end, 0)) - volume_of(held, world.bodies[0].cage.positions);
      EXPECT_GT(grown, 0);
      EXPECT_NEAR(2 * elastic_energy_j(world, end) / (pressure * grown), 1, 0.02) << hollow;
    }
}

// A closed surface is neither pushed nor turned, blown up as it may be.
TEST(Pressure, GivesNeitherMomentumNorTurn) {
  Slab made = slab();
  for (Eigen::Index n = 0; n < made.whole.positions.rows(); ++n)  // no symmetry
    made.whole.positions.row(n) += 0.05 * made.whole.positions.row(n).array().sin().matrix().reverse();
  made.hollow.positions = made.whole.positions;
  for (const TetMesh& mesh : {made.whole, made.hollow}) {
    const World world = blown(mesh, MaterialModel::neo_hookean, 5e3);
    const State end = run(world, int(0.05 / world.dt_s));
    EXPECT_GT(mean_speed_m_s(world, end, 0), 1e-3);
    const Points x = body_positions(world, end, 0);
    const Vec3 center = center_of_mass_m(world, end, 0);
    Vec3 turning = Vec3::Zero();
    double all = 0;
    for (int n = 0; n < int(x.rows()); ++n) {
      const Vec3 v = Eigen::Map<const Vec3f>(end.velocities.data() + 3 * n).cast<double>();
      turning += world.bodies[0].node_mass_kg[std::size_t(n)] * (Vec3(x.row(n)) - center).cross(v);
      all += world.bodies[0].node_mass_kg[std::size_t(n)] * v.norm();
    }
    EXPECT_LT(momentum(world, end).norm(), 1e-4 * all);
    EXPECT_LT(turning.norm(), 1e-4 * all);
  }
}

TEST(Pressure, OfAControlIsThatOfTheWorldBitForBit) {
  WorldSpec spec = alone(body(slab().whole, BodyKind::deformable));
  const World plain = build_world(spec);
  spec.pressures.push_back({0, 0, 200 * plain.dt_s, 700});
  const World forced = build_world(spec);
  Control control;
  control.pressure_pa = 700;
  const State pushed = run(plain, start_state(plain), 200, control);
  EXPECT_NE(pushed, run(plain, 200));
  EXPECT_EQ(run(forced, 200), pushed);
  EXPECT_EQ(run(forced, 300), run(plain, pushed, 100));
}

// It sleeps while it is blown up, as it did before.
TEST(Pressure, WakesWhoSleeps) {
  WorldSpec spec = alone(body(slab({1.5, 2.4, 3.3}).whole, BodyKind::deformable));
  spec.rest_speed_m_s = 0.01;
  spec.pressures.push_back({0, 2, 5, 4e3});
  const World world = build_world(spec);
  const auto at = [&](double s) { return run(world, int(s / world.dt_s)); };
  const auto share = [&](const State& state) {
    return volume_m3(world, state, 0) / world.bodies[0].rest_volume_m3;
  };
  for (const double rests_at_s : {1.9, 4.9})
    EXPECT_EQ(mean_speed_m_s(world, at(rests_at_s), 0), 0) << rests_at_s;
  EXPECT_GT(share(at(4.9)), 1.03);
  EXPECT_NEAR(share(at(7)), 1, 2e-3);
}

// A result is a function of the state, whose step is its time: however the way there is cut, and whoever goes
// beside it.
TEST(Script, CutsAndLanesDoNotChangeABit) {
  WorldSpec spec = lift(BodyKind::deformable, {{0.3, {0, 0, 0}, {0, 0, 0}}, {0.7, {0.1, 0, 0.2}, {0, 0, 1}}});
  spec.rest_speed_m_s = 0.01;
  spec.forces.push_back({0, 0.2, 0.5, {30, 0, 0}});
  spec.forces.push_back({0, 0.4, 0.9, {0, 40, 0}});
  spec.pressures.push_back({0, 0.35, 0.8, 2e3});
  const World world = build_world(spec);
  const State start = start_state(world);
  const int n = int(1.2 / world.dt_s);
  const State whole = run(world, n);
  for (const int cut : {1, n / 7, n / 3, n / 2, n - 1})
    EXPECT_EQ(run(world, run(world, cut), n - cut), whole) << cut;
  std::vector<State> starts{start};
  for (int k = 1; k < 20; ++k) starts.push_back(run(world, starts.back(), n / 20));
  for (const int lanes : {4, 8, 16}) {
    Batch batch(world, lanes);
    std::vector<Rollout> rollouts;
    for (const State& from : starts) {
      Control control;
      control.steps = n - int(from.step);
      rollouts.push_back({&from, control, {}, {}});
    }
    propagate(batch, rollouts);
    for (std::size_t k = 0; k < rollouts.size(); ++k) EXPECT_EQ(rollouts[k].end, whole) << lanes << " " << k;
  }
}

TEST(Script, WhatIsWrongIsRefused) {
  const auto refused = [](const WorldSpec& spec) { EXPECT_THROW(build_world(spec), InputError); };
  WorldSpec good = lift(BodyKind::deformable, {{1, {0, 0, 1}, {0, 0, 0}}});
  good.forces.push_back({0, 0, 1, {1, 0, 0}});
  good.pressures.push_back({0, 0, 1, 10});
  EXPECT_NO_THROW(build_world(good));
  const auto with = [&](auto change) {
    WorldSpec spec = good;
    change(spec);
    refused(spec);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  with([](WorldSpec& s) { s.forces[0].body = 2; });
  with([](WorldSpec& s) { s.forces[0].body = 1; });  // kinematic
  with([](WorldSpec& s) { s.forces[0].to_s = 0; });
  with([](WorldSpec& s) { s.forces[0].from_s = -1; });
  with([&](WorldSpec& s) { s.forces[0].to_s = nan; });
  with([&](WorldSpec& s) { s.forces[0].force_n.x() = nan; });
  with([](WorldSpec& s) { s.pressures[0].body = 2; });
  with([](WorldSpec& s) { s.pressures[0].body = 1; });
  with([](WorldSpec& s) { s.bodies[0].kind = BodyKind::rigid; });
  with([](WorldSpec& s) { s.pressures[0].to_s = 0; });
  with([](WorldSpec& s) { s.pressures[0].from_s = -1; });
  with([&](WorldSpec& s) { s.pressures[0].pressure_pa = nan; });
  with([&](WorldSpec& s) { s.bodies[0].velocity_m_s.x() = nan; });
  with([](WorldSpec& s) { s.bodies[1].track.keyframes[0].at_s = 0; });
  with([](WorldSpec& s) { s.bodies[1].track.keyframes.push_back(s.bodies[1].track.keyframes[0]); });
  with([](WorldSpec& s) { s.bodies[0].fixed_nodes = {0}, s.forces[0].nodes = {0}; });
  with([](WorldSpec& s) { s.robot = 1; });
}

}  // namespace
}  // namespace limber::fem
