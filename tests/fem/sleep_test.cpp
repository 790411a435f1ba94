// Bodies that stand still take no part in a step, and nothing shows it but the clock (docs/dynamics.md).
#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::cube;
using testing::grid;
using testing::nodes_where;

Control push(const Vec3f& force_n, int steps) {
  Control control;
  control.manipulation = Manipulation::body;
  control.force_n = force_n;
  control.steps = steps;
  return control;
}

Control come_back(int steps) {
  Control control;
  control.manipulation = Manipulation::interpolation;
  control.target_m = {1, 1.5f, 1.5f};
  control.max_force_n = 100;
  control.steps = steps;
  return control;
}

// The robot is driven against the first plate and back, and held until all has come to rest.
std::vector<Control> visit(const World& world) {
  const auto steps = [&](double seconds) { return int(seconds / world.dt_s); };
  return {push({300, 0, 0}, steps(1.2)), push({-200, 0, 0}, steps(0.8)), push({-40, 30, 0}, steps(0.5)),
          come_back(steps(6))};
}

World barriers_with_rest(MaterialModel model) {
  Material material;
  material.model = model;
  material.damping_ratio = 0.7;
  WorldSpec spec = testing::barriers(1, material);
  spec.rest_speed_m_s = 0.05;
  return build_world(spec);
}

bool stands(const World& world, const State& state, int body) {
  const auto first = state.velocities.begin() + 3 * world.bodies[body].first_node;
  return std::all_of(first, first + 3 * world.bodies[body].node_count(), [](float v) { return v == 0; });
}
bool same_place(const World& world, const State& a, const State& b, int body) {
  return body_positions(world, a, body) == body_positions(world, b, body);
}

// A rollout of one step never skips anything, because a load forgets who sleeps. So a long one, in which
// plates sleep, wake, swing and fall asleep again, equals single steps: alone and beside lanes that do other
// things.
TEST(Sleep_slow, ChangesNothing) {
  for (const MaterialModel model : {MaterialModel::springs, MaterialModel::neo_hookean}) {
    const World world = barriers_with_rest(model);
    std::vector<State> starts{rest_state(world)};
    std::vector<Control> controls = visit(world);
    bool slept[2] = {}, woke[2] = {};
    for (Control& control : controls) {
      const State whole = propagate(world, starts.back(), control).end;
      State stepped = starts.back();
      Batch batch(world, 1);
      Control one = control;
      one.steps = 1;
      for (int s = 0; s < control.steps; ++s) {
        batch.load(0, stepped, one);
        batch.advance();
        batch.store(0, stepped);
        for (const int plate : {1, 2}) (stands(world, stepped, plate) ? slept : woke)[plate - 1] = true;
      }
      EXPECT_EQ(stepped, whole);
      starts.push_back(whole);
    }
    EXPECT_TRUE(slept[0] && slept[1] && woke[0]);
    EXPECT_EQ(woke[1], false);  // the robot never came near the second plate
    for (const int body : {0, 1, 2}) EXPECT_TRUE(stands(world, starts.back(), body)) << body;

    std::vector<Rollout> rollouts;
    for (std::size_t i = 0; i < controls.size(); ++i) rollouts.push_back({&starts[i], controls[i], {}, {}});
    for (const int lanes : {4, 8, 16}) {
      Batch batch(world, lanes);
      propagate(batch, rollouts);
      for (std::size_t i = 0; i < controls.size(); ++i)
        EXPECT_EQ(rollouts[i].end, starts[i + 1]) << lanes << ' ' << i;
    }
  }
}

// What nothing touches keeps its bits, and what fell asleep keeps its place.
TEST(Sleep, UntouchedBodiesKeepTheirBits) {
  const World world = barriers_with_rest(MaterialModel::springs);
  State state = rest_state(world);
  for (const Control& control : visit(world)) state = propagate(world, state, control).end;
  EXPECT_TRUE(same_place(world, state, rest_state(world), 2));
  EXPECT_FALSE(same_place(world, state, rest_state(world), 1));  // it was hit, and rests a little elsewhere
  const State later = propagate(world, state, come_back(1000)).end;
  for (const int body : {0, 1, 2}) EXPECT_TRUE(same_place(world, state, later, body));
}

// Slow for a moment is not at rest: a body that is let go in a bent shape, or in mid-air, moves.
TEST(Sleep, AForceThatIsNotBalancedKeepsABodyAwake) {
  WorldSpec spec = alone({"cube", cube({0, 0, 0}, 1, 2), {}, {}});
  spec.rest_speed_m_s = 5e-3;
  spec.gravity_m_s2 = {0, 0, -0.2};
  const World falling = build_world(spec);
  const Control coast = push({0, 0, 0}, int(2 / falling.dt_s));
  EXPECT_NEAR(center_of_mass_m(falling, propagate(falling, rest_state(falling), coast).end, 0).z(), -0.4,
              1e-3);
  spec.gravity_m_s2.setZero();
  const World stretched = build_world(spec);
  State state = rest_state(stretched);
  for (float& x : state.positions) x *= 1.05f;
  EXPECT_GT(kinetic_energy_j(stretched, propagate(stretched, state, push({0, 0, 0}, 20)).end), 1e-6);
}

// A plate of the scenes' stuff, 2.2 m high and held at its foot alone, is struck and left: by damping of its
// strain alone it still swings after 20 s, by damping by mass it stands. What stands may be bent by
// a hair, for it comes to a stand where forces are small.
TEST(Sleep, ASoftPlateComesToAStandByDampingByMass) {
  for (const double mass_damping_per_s : {0.0, 1.0}) {
    Material material;
    material.model = MaterialModel::springs;
    material.poisson_ratio = 0.48;
    material.mass_damping_per_s = mass_damping_per_s;
    TetMesh plate = grid({0, 0, 0}, {0.35, 3, 2.2}, 2, 9, 3);
    const auto foot = nodes_where(plate, [](const Vec3& p) { return p.z() < 1e-9; });
    WorldSpec spec = alone({"plate", plate, material, foot});
    spec.rest_speed_m_s = 1e-3;
    const World world = build_world(spec);
    const auto steps = [&](double seconds) { return int(seconds / world.dt_s); };
    State state = propagate(world, rest_state(world), push({200, 0, 0}, steps(0.3))).end;
    EXPECT_GT(std::sqrt(2 * kinetic_energy_j(world, state) / world.bodies[0].mass_kg), 0.1);
    state = propagate(world, state, push({0, 0, 0}, steps(20))).end;
    EXPECT_EQ(stands(world, state, 0), mass_damping_per_s > 0);
    if (mass_damping_per_s > 0) {
      const Points moved = body_positions(world, state, 0) - world.bodies[0].cage.positions;
      EXPECT_LT(moved.rowwise().norm().maxCoeff(), 0.02);
    } else {
      EXPECT_GT(kinetic_energy_j(world, state), 0.01);
    }
  }
}

// Two cubes asleep on the floor; the one that is pushed wakes the other when it gets there, and not before.
TEST(Sleep, ABodyOnTheFloorSleepsUntilItIsHit) {
  Material material;
  material.damping_ratio = 1;
  WorldSpec spec;
  for (int i = 0; i < 2; ++i)
    spec.bodies.push_back({fmt::format("cube{}", i), cube({1.5 * i, 0, 0.25}, 0.5, 2), material, {}});
  spec.bounds_m = {Vec3(-5, -5, 0), Vec3(5, 5, 5)};
  spec.gravity_m_s2 = {0, 0, -2};
  spec.rest_speed_m_s = 0.02;
  const World world = build_world(spec);
  const State still = propagate(world, rest_state(world), push({0, 0, 0}, int(10 / world.dt_s))).end;
  for (const int body : {0, 1}) EXPECT_TRUE(stands(world, still, body)) << body;
  const auto after = [&](double seconds) {
    return propagate(world, still, push({20, 0, 0}, int(seconds / world.dt_s))).end;
  };
  const State on_the_way = after(0.8), hit = after(2.5);
  EXPECT_GT(center_of_mass_m(world, on_the_way, 0).x(), 0.1);
  EXPECT_TRUE(same_place(world, still, on_the_way, 1));
  EXPECT_FALSE(same_place(world, still, hit, 1));
}

}  // namespace
}  // namespace limber::fem
