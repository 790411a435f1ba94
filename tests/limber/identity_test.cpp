// Every scene that comes with limber, in the middle of contact: the same bits whatever the number of lanes,
// the instruction set and the threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <thread>

#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "limber/detail/world/scene_world.h"
#include "scenes/library.h"
#include "tests/core/temporary_folder.h"

namespace limber::detail {
namespace {

constexpr int rollouts = 20;
constexpr int min_contact_steps = 3000;

struct Cases {
  State start;  // robot against an obstacle
  std::vector<Control> controls;
};

Control push(const Vec3& force_n, int steps) {
  Control control;
  control.manipulation = Manipulation::body;
  control.force_n = force_n.cast<float>();
  control.steps = steps;
  return control;
}

// What other bodies than walls push the robot with; nothing where none touches it.
std::optional<Vec3> push_on_robot_n(const fem::World& world, const State& state) {
  std::optional<Vec3> sum;
  for (const fem::ContactForce& contact : fem::contact_forces(world, state, Control{})) {
    if (contact.other < 0 || (contact.body != world.robot && contact.other != world.robot)) continue;
    sum = sum.value_or(Vec3::Zero()) + (contact.body == world.robot ? 1 : -1) * contact.force_n;
  }
  return sum;
}
bool touches(const fem::World& world, const State& state) {
  return push_on_robot_n(world, state).has_value();
}

// Of 600 steps' pushes from here the tenths after which the robot touches something.
int tenths_pressed(const fem::World& world, State state, const Vec3& force_n) {
  int tenths = 0;
  for (int i = 0; i < 10; ++i) {
    state = propagate(world, state, push(force_n, 60)).end;
    tenths += touches(world, state);
  }
  return tenths;
}

// Pushed towards the goal, or else towards one of the other bodies, until something is in the way, and on to
// where that pushes hardest within 0.2 s; then, from there or from rest there, in many ways against it.
Cases pressed_cases(const fem::World& world, const scenes::Scene& scene) {
  Cases cases;
  const State rest = rest_state(world);
  const Vec3 from = center_of_mass_m(world, rest, world.robot);
  std::vector<Vec3> places{scene.goal.center_of_mass_m};
  for (int b = 0; b < int(world.bodies.size()); ++b)
    if (b != world.robot) places.push_back(center_of_mass_m(world, rest, b));
  const double force_n = scene.planner.max_force_n;
  const int fifty_ms = std::max(1, int(0.05 / world.dt_s));
  Vec3 towards;
  const auto go_on = [&] {
    cases.start = propagate(world, cases.start, push(0.7 * force_n * towards, fifty_ms)).end;
  };
  for (const Vec3& place : places) {
    cases.start = rest;
    towards = (place - from).normalized();
    for (int i = 0; i < 100 && !touches(world, cases.start); ++i) go_on();
    if (touches(world, cases.start)) break;
  }
  std::optional<Vec3> hardest;
  State next = cases.start;
  for (int i = 0; i < 4; ++i, next = propagate(world, next, push(0.7 * force_n * towards, fifty_ms)).end) {
    const std::optional<Vec3> pushed = push_on_robot_n(world, next);
    if (!pushed || (hardest && pushed->norm() <= hardest->norm())) continue;
    hardest = pushed;
    cases.start = next;
  }
  EXPECT_TRUE(hardest);
  // From rest it springs back less, unless all are falling.
  State at_rest = cases.start;
  std::fill(at_rest.velocities.begin(), at_rest.velocities.end(), 0.f);
  std::vector<Vec3> directions{towards};
  if (hardest) directions.push_back(-hardest->normalized());
  const Vec3 here = center_of_mass_m(world, cases.start, world.robot);
  for (int b = 0; b < int(world.bodies.size()); ++b)
    if (b != world.robot) directions.push_back((center_of_mass_m(world, cases.start, b) - here).normalized());
  int longest = -1;
  for (const State& start : {State(cases.start), at_rest})
    for (const Vec3& direction : directions)
      if (const int tenths = tenths_pressed(world, start, 0.8 * force_n * direction); tenths > longest)
        longest = tenths, cases.start = start, towards = direction;
  // What pulls to a place pulls to one beyond what is in the way.
  const Points& cage = world.bodies[std::size_t(world.robot)].cage.positions;
  const Vec3 beyond = here + 0.5 * bounding_box(cage).size().maxCoeff() * towards;
  Rng rng(61, 0);
  for (int i = 0; i < rollouts; ++i) {
    Control control = push(force_n * (0.8 * towards + 0.2 * rng.direction()), 600 + rng.below(200));
    control.manipulation = Manipulation(i % 4);
    control.node = rng.below(world.bodies[std::size_t(world.robot)].node_count());
    control.radius_m = 0.4f;
    control.target_m = beyond.cast<float>();
    control.max_force_n = float(force_n);
    cases.controls.push_back(control);
  }
  return cases;
}

// The ends of the rollouts [first, last).
std::vector<State> ends(const fem::World& world, const Cases& cases, int first, int last, int lanes,
                        fem::InstructionSet set) {
  std::vector<fem::Rollout> work;
  for (int i = first; i < last; ++i) work.push_back({&cases.start, cases.controls[std::size_t(i)], {}, {}});
  fem::Batch batch(world, lanes, set);
  propagate(batch, work);
  std::vector<State> all;
  for (const fem::Rollout& r : work) {
    EXPECT_EQ(r.outcome.status, fem::RunStatus::ok) << r.outcome.reason;
    all.push_back(r.end);
  }
  return all;
}

std::vector<State> ends_of_two_threads(const fem::World& world, const Cases& cases, int lanes) {
  std::vector<State> all, others;
  std::thread other(
      [&] { others = ends(world, cases, rollouts / 2, rollouts, lanes, fem::InstructionSet::automatic); });
  all = ends(world, cases, 0, rollouts / 2, lanes, fem::InstructionSet::automatic);
  other.join();
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

// Steps in pieces of ten at whose end the robot touches something: a second way to the same ends.
int count_contact_steps(const fem::World& world, const Cases& cases, const std::vector<State>& expected) {
  constexpr int piece = 10;
  int steps = 0;
  for (int i = 0; i < rollouts; ++i) {
    State state = cases.start;
    fem::Batch batch(world, 1);
    for (Control rest = cases.controls[std::size_t(i)]; rest.steps > 0; rest.steps -= piece) {
      Control part = rest;
      part.steps = std::min(rest.steps, piece);
      fem::Rollout rollout{&state, part, {}, {}};
      propagate(batch, {&rollout, 1});
      state = rollout.end;
      if (touches(world, state)) steps += part.steps;
    }
    EXPECT_TRUE(state == expected[std::size_t(i)]) << i;
  }
  return steps;
}

// One test a scene, by its name.
class Identity : public testing::TestWithParam<std::string> {};
std::vector<std::string> names_of_scenes() {
  std::vector<std::string> names;
  for (const scenes::KnownScene& scene : scenes::known_scenes()) names.push_back(scene.name);
  return names;
}

TEST_P(Identity, OfASceneIsTheSameBitsEverywhere) {
  TemporaryFolder folder;
  ::setenv("LIMBER_MODELS", folder.path().c_str(), 1);  // the made models, on every machine
  std::vector<std::pair<fem::InstructionSet, const char*>> sets{{fem::InstructionSet::sse2, "SSE2"}};
  if (__builtin_cpu_supports("avx2")) sets.push_back({fem::InstructionSet::avx2, "AVX2"});
  if (__builtin_cpu_supports("avx512bw")) sets.push_back({fem::InstructionSet::avx512, "AVX-512"});
  const scenes::Scene scene = scenes::read_scene_file(scenes::find_scene(GetParam()));
  const fem::World world = build_world(scene, prepare_bodies(scene, {}, folder.path()));
  const Cases cases = pressed_cases(world, scene);
  const std::vector<State> alone = ends(world, cases, 0, rollouts, 1, fem::InstructionSet::automatic);
  EXPECT_NE(alone[0], alone[4]);
  const int contact_steps = count_contact_steps(world, cases, alone);
  EXPECT_GE(contact_steps, min_contact_steps);
  fmt::print("{}: {} steps in contact\n", GetParam(), contact_steps);
  for (const int lanes : {1, 4, 8, 16}) {
    for (const auto& [set, name] : sets)
      EXPECT_TRUE(ends(world, cases, 0, rollouts, lanes, set) == alone) << lanes << " lanes, " << name;
    EXPECT_TRUE(ends_of_two_threads(world, cases, lanes) == alone) << lanes << " lanes, two threads";
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Identity, testing::ValuesIn(names_of_scenes()),
                         [](const auto& name) { return name.param; });

}  // namespace
}  // namespace limber::detail
