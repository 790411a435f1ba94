// A rollout is a function of world, state and control alone.
#include "fem/batch.h"

#include <gtest/gtest.h>

#include <thread>

#include "core/error.h"
#include "core/random.h"
#include "fem/observe.h"
#include "tests/fem/proofs.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {
using namespace testing;

struct Case {
  State start;
  Control control;
};

// States in the middle of contact, and controls of every kind and of different lengths.
std::vector<Case> pressed_cases(const World& world, int count) {
  Rng rng(21, 0);
  Control press;
  press.manipulation = Manipulation::body;
  press.force_n = {900, 0, -100};
  press.steps = 500;
  const State pressed = propagate(world, rest_state(world), press).end;
  EXPECT_EQ(deepest_penetration(world, pressed).other, 1);
  std::vector<Case> cases;
  for (int i = 0; i < count; ++i) {
    Control control;
    control.steps = 20 + rng.below(60);
    control.manipulation = Manipulation(i % 5);
    control.force_n = (800 * rng.direction()).cast<float>();
    control.node = rng.below(world.bodies[world.robot].node_count());
    control.radius_m = 0.5f;
    control.target_m = {2.5f, 1.5f, 1.5f};
    control.max_force_n = 700;
    cases.push_back({pressed, control});
  }
  return cases;
}

std::vector<State> run(const World& world, const std::vector<Case>& cases, const std::vector<int>& order,
                       int lanes, InstructionSet set = InstructionSet::automatic) {
  std::vector<Rollout> rollouts;
  for (int i : order) rollouts.push_back({&cases[i].start, cases[i].control, {}, {}});
  Batch batch(world, lanes, set);
  propagate(batch, rollouts);
  std::vector<State> ends(cases.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    EXPECT_EQ(rollouts[k].outcome.status, RunStatus::ok) << rollouts[k].outcome.reason;
    ends[order[k]] = rollouts[k].end;
  }
  return ends;
}

int differing(const std::vector<State>& a, const std::vector<State>& b) {
  int count = 0;
  for (std::size_t i = 0; i < b.size(); ++i) count += !(a.at(i) == b[i]);
  return count;
}

TEST(Batch, ResultsDoNotDependOnLanesNeighboursOrderOrInstructionSet) {
  WorldSpec spec = testing::barriers();
  spec.bodies[2].material.model = MaterialModel::neo_hookean;
  spec.bodies[0].material.model = MaterialModel::neo_hookean;
  spec.bodies[2].material.fascia_hz = 3;
  spec.bodies[1].material.mass_damping_per_s = 1, spec.bodies[1].gravity_m_s2 = Vec3(0, 0.3, -0.5);
  LigamentSpec band;
  band.name = "band";
  band.ends = {{{0, {1, 1.5, 2}, 0.3}, {1, {3.4, 1.5, 2}, 0}}};
  band.stiffness_n_m = 50, band.rest_length = 0.5;
  spec.ligaments = {band};
  const World world = build_world(spec);
  const std::vector<Case> cases = pressed_cases(world, 24);
  std::vector<int> order;
  for (int i = 0; i < int(cases.size()); ++i) order.push_back(i);
  const std::vector<State> alone = run(world, cases, order, 1);
  EXPECT_NE(alone[0], alone[1]);
  const auto prove_same = [&](const std::string& what, const std::string& where,
                              const std::vector<State>& ends) {
    testing::prove_at_most(16, what + ": rollouts that differ", where, differing(ends, alone), 0);
  };
  prove_same("twice", "one lane", run(world, cases, order, 1));
  for (const int lanes : {4, 8, 16}) {
    const std::string where = fmt::format("{} lanes", lanes);
    prove_same("lanes side by side", where, run(world, cases, order, lanes));
    std::reverse(order.begin(), order.end());
    std::rotate(order.begin(), order.begin() + 5, order.end());
    prove_same("lanes permuted", where, run(world, cases, order, lanes));
  }
  for (const auto& [set, name] :
       {std::pair(InstructionSet::sse2, "SSE2"), std::pair(InstructionSet::avx2, "AVX2"),
        std::pair(InstructionSet::avx512, "AVX-512")}) {
    if (set == InstructionSet::avx512 && !__builtin_cpu_supports("avx512bw"))
      GTEST_SKIP() << "no AVX-512 here";
    for (const int lanes : {1, 4, 8, 16})
      prove_same("instruction sets", fmt::format("{}, {} lanes", name, lanes),
                 run(world, cases, order, lanes, set));
  }
}

// Two threads share a world, each with a Batch of its own.
TEST(Batch, TwoThreadsGiveTheBitsOfOne) {
  const World world = build_world(testing::barriers());
  const std::vector<Case> cases = pressed_cases(world, 16);
  const std::vector<Case> first(cases.begin(), cases.begin() + 8), second(cases.begin() + 8, cases.end());
  const std::vector<int> eight{0, 1, 2, 3, 4, 5, 6, 7};
  std::vector<State> both = run(world, first, eight, 4);
  for (const State& s : run(world, second, eight, 4)) both.push_back(s);
  std::vector<State> ends, others;
  std::thread other([&] { others = run(world, second, eight, 4); });
  ends = run(world, first, eight, 4);
  other.join();
  ends.insert(ends.end(), others.begin(), others.end());
  testing::prove_at_most(16, "two threads: rollouts that differ", "4 lanes each", differing(ends, both), 0);
}

TEST(Batch, AHundredStepsAreFortyAndThenSixty) {
  const World world = build_world(testing::barriers());
  for (const Case& c : pressed_cases(world, 4)) {
    Control whole = c.control, first = c.control, second = c.control;
    whole.steps = 100, first.steps = 40, second.steps = 60;
    // Saved and restored: nothing of the first part is left but the numbers of its end.
    const State saved = propagate(world, c.start, first).end, restored = saved;
    const State end = propagate(world, restored, second).end;
    testing::prove_at_most(16, "saved and restored in the middle of a contact: rollouts that differ",
                           "40 and 60 steps", !(end == propagate(world, c.start, whole).end), 0);
  }
}

// Steps and moves in and out of lanes are counted each; seconds add up to no more than the thread had.
TEST(Batch, CountsWhatItSpends) {
  const World world = build_world(testing::barriers());
  const std::vector<Case> cases = pressed_cases(world, 6);
  std::vector<Rollout> rollouts;
  for (const Case& c : cases) rollouts.push_back({&c.start, c.control, {}, {}});
  Batch batch(world, 4);
  const double before = thread_cpu_s();
  propagate(batch, rollouts);
  const double all = thread_cpu_s() - before;
  const Cost cost = batch.cost();
  EXPECT_EQ(cost.loads, 6);
  EXPECT_EQ(cost.stores, 6);
  std::int64_t longest = 0, sum = 0;
  for (const Case& c : cases)
    longest = std::max<std::int64_t>(longest, c.control.steps), sum += c.control.steps;
  EXPECT_GE(cost.steps, longest);
  EXPECT_LE(cost.steps, sum);
  for (const double part :
       {cost.contact_s, cost.controls_s, cost.elastic_s, cost.integration_s, cost.load_s, cost.store_s})
    EXPECT_GT(part, 0);
  EXPECT_LT(cost.load_s + cost.store_s, all);
}

// A rollout that blows up in the middle of a contact ends with a reason, and its neighbours do not notice.
TEST(Batch, ARolloutThatBlowsUpIsDivergedAndHarmsNobody) {
  const World world = build_world(testing::barriers());
  std::vector<Case> cases = pressed_cases(world, 16);
  std::vector<Rollout> calm, mixed;
  for (Case& c : cases) calm.push_back({&c.start, c.control, {}, {}});
  std::vector<State> wild(cases.size());
  mixed = calm;
  for (std::size_t i = 0; i < cases.size(); i += 3) {
    wild[i] = cases[i].start;
    // From fast to beyond what float32 holds.
    for (std::size_t k = 0; k < wild[i].velocities.size(); ++k)
      wild[i].velocities[k] = float(k % 5 == 0) * std::pow(10.0f, float(2 + 2 * i));
    mixed[i].start = &wild[i];
  }
  Batch batch(world, 16);
  propagate(batch, calm);
  propagate(batch, mixed);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(i);
    if (i % 3 == 0) {
      EXPECT_EQ(mixed[i].outcome.status, RunStatus::diverged);
      EXPECT_NE(mixed[i].outcome.reason.find("body "), std::string::npos) << mixed[i].outcome.reason;
    } else {
      EXPECT_EQ(mixed[i].outcome.status, RunStatus::ok);
      EXPECT_EQ(mixed[i].end, calm[i].end);
    }
  }
}

// The centre of mass under hold, in the reach of its force, is a critically damped oscillator of 6 rad/s,
// however the body is turned: d (1 + ω t) e^(−ω t). And what was turned stays turned and comes to rest, where
// interpolation would have to turn it upright.
TEST(Hold, StopsTheRobotAsItIsTurned) {
  const World world = build_world(alone({"ball", cube(Vec3::Zero(), 1, 3), {}, {}, BodyKind::deformable}));
  const State rest = rest_state(world);
  const Vec3 start = center_of_mass_m(world, rest, 0);
  State state = rest;
  for (int n = 0; n < world.moving_nodes; ++n) {  // upside down
    const Vec3f p = Vec3f(&state.positions[std::size_t(3 * n)]) - start.cast<float>();
    const Vec3f turned = Vec3f(p.x(), -p.y(), -p.z()) + start.cast<float>();
    std::copy(turned.begin(), turned.end(), &state.positions[std::size_t(3 * n)]);
  }
  Control hold;
  hold.manipulation = Manipulation::hold;
  const Vec3 way(0.01, -0.02, 0.005);
  hold.target_m = (start + way).cast<float>();
  hold.max_force_n = 1e6f;
  for (const double t : {0.1, 0.3, 1.0}) {
    hold.steps = int(std::lround(t / world.dt_s));
    const double w = 6 * hold.steps * world.dt_s;
    const State now = propagate(world, state, hold).end;
    const Vec3 left = start + way - center_of_mass_m(world, now, 0);
    EXPECT_LT((left - way * (1 + w) * std::exp(-w)).norm(), 0.01 * way.norm()) << t;
  }
  hold.steps = int(3 / world.dt_s);
  const State end = propagate(world, state, hold).end;
  EXPECT_LT(mean_speed_m_s(world, end, 0), 1e-4);
  const auto up = [&](const State& s) {
    return s.positions[std::size_t(3 * (world.moving_nodes - 1) + 2)] - s.positions[2];
  };
  EXPECT_NEAR(up(end), -up(rest), 1e-3);
}

// A lane that is stopped gives what a control of so many steps gives; and what it shows on its way is what
// its state shows.
TEST(Batch, ALaneCanBeWatchedAndStopped) {
  const World world = build_world(barriers());
  for (const int lanes : {1, 4, 16}) {
    std::vector<Case> cases = pressed_cases(world, lanes);
    Batch batch(world, lanes);
    for (int lane = 0; lane < lanes; ++lane) {
      cases[std::size_t(lane)].control.steps = 40 + lane;
      batch.load(lane, cases[std::size_t(lane)].start, cases[std::size_t(lane)].control);
    }
    ASSERT_EQ(batch.advance(25), 25);
    const int last = lanes - 1;
    const Batch::Motion robot = batch.motion(last, 0), plate = batch.motion(last, 1);
    State peeked;
    batch.peek(last, peeked);
    batch.stop(last);
    EXPECT_EQ(batch.steps_left(last), 0);
    State stopped;
    batch.store(last, stopped);
    Control cut = cases[std::size_t(last)].control;
    cut.steps = 25;
    EXPECT_EQ(stopped, propagate(world, cases[std::size_t(last)].start, cut).end);
    EXPECT_EQ(peeked, stopped);
    EXPECT_LT((robot.center_m - center_of_mass_m(world, stopped, 0)).norm(), 1e-12);
    EXPECT_LT((robot.velocity_m_s - center_velocity_m_s(world, stopped, 0)).norm(), 1e-12);
    EXPECT_LT((plate.center_m - center_of_mass_m(world, stopped, 1)).norm(), 1e-12);
    // The others go on as if nothing had been.
    while (batch.advance() > 0) {
    }
    for (int lane = 0; lane < last; ++lane) {
      State end;
      batch.store(lane, end);
      ASSERT_EQ(end, propagate(world, cases[std::size_t(lane)].start, cases[std::size_t(lane)].control).end);
    }
  }
}

}  // namespace
}  // namespace limber::fem
