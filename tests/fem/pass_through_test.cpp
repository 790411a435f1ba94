// Up to which speed nothing passes through, and at which it fails: found by bisection, and held to what
// docs/contact.md states.
#include <gtest/gtest.h>

#include <cmath>

#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/proofs.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::ball;
using testing::cube;
using testing::grid;

const Material soft{.poisson_ratio = 0.48};

WorldSpec thrown(TetMesh body) {
  WorldSpec spec = testing::alone({"thrown", std::move(body), soft, {}});
  return spec;
}
BodySpec plate(BodyKind kind) {
  TetMesh mesh = grid({0.6, -1.5, -1.5}, {0.35, 3, 3}, 2, 6, 6);
  std::vector<int> rim;
  if (kind == BodyKind::deformable)
    rim = testing::nodes_where(
        mesh, [](const Vec3& p) { return std::abs(p.y()) > 1.49 || std::abs(p.z()) > 1.49; });
  return {"plate", std::move(mesh), soft, rim, kind};
}

// Whether the thrown body, all of it at `speed` along x, ends with its middle behind x = behind, or lost, or
// with inverted tets.
bool fails(const World& world, double speed, double behind) {
  State state = rest_state(world);
  for (int n = 0; n < world.bodies[0].node_count(); ++n) state.velocities[3 * n] = float(speed);
  Control coast;
  coast.steps = int((0.5 + 3 / speed) / world.dt_s);
  const Rollout end = propagate(world, state, coast);
  return end.outcome.status != RunStatus::ok || center_of_mass_m(world, end.end, 0).x() > behind ||
         inverted_tets(world, end.end) > 0;
}

// The lowest speed that fails, to 3 %, of those from `lowest` on, doubled; 1000: none.
template <class Fails>
double failing_speed(double lowest, const Fails& does_fail) {
  double good = 0, bad = lowest;
  while (bad < 1000 && !does_fail(bad)) good = bad, bad *= 2;
  if (bad >= 1000) return 1000;
  while (good > 0 && bad / good > 1.03) {
    const double middle = std::sqrt(good * bad);
    (does_fail(middle) ? bad : good) = middle;
  }
  return bad;
}

void prove_above(const std::string& what, double stated, double found) {
  testing::prove_at_least(15, what + ": speed at which it fails, m/s", fmt::format("none up to {}", stated),
                          found, std::nextafter(stated, 1000));
}

TEST(PassThrough, ACubeAtAPlate) {
  for (const bool is_static : {true, false}) {
    WorldSpec spec = thrown(cube({0, 0, 0}, 1, 3));
    spec.bodies.push_back(plate(is_static ? BodyKind::immovable : BodyKind::deformable));
    const World world = build_world(spec);
    prove_above(is_static ? "cube at a static plate" : "cube at a soft plate", is_static ? 16 : 12,
                failing_speed(1, [&](double speed) { return fails(world, speed, 0.8); }));
  }
}

// Three rods of 0.3 side by side, 0.25 apart, which the ball of 1 m can only be held up by.
TEST(PassThrough, ABallAtRollers) {
  WorldSpec spec = thrown(ball({0, 0, 0}, 0.5, 4));
  for (const double y : {-0.55, 0.0, 0.55}) {
    TetMesh rod = grid({0.6, y - 0.15, -1}, {0.3, 0.3, 2}, 1, 1, 6);
    spec.bodies.push_back({"rod", rod, soft, {}, BodyKind::immovable});
  }
  const World world = build_world(spec);
  prove_above("ball at static rollers", 12,
              failing_speed(1, [&](double speed) { return fails(world, speed, 0.9); }));
}

TEST(PassThrough, AChainOfBodies) {
  WorldSpec spec = thrown(cube({0, 0, 0}, 0.5, 2));
  for (int k = 1; k < 4; ++k)
    spec.bodies.push_back({"link", cube({0.6 * k, 0.03 * k, 0}, 0.5, 2 + k % 2), soft, {}});
  const World world = build_world(spec);
  const auto out_of_order = [&](double speed) {
    State state = rest_state(world);
    for (int n = 0; n < world.bodies[0].node_count(); ++n) state.velocities[3 * n] = float(speed);
    Control coast;
    coast.steps = int(3 / speed / world.dt_s) + 1;
    const Rollout end = propagate(world, state, coast);
    bool bad = end.outcome.status != RunStatus::ok;
    for (int b = 0; b < 3; ++b)
      bad |= center_of_mass_m(world, end.end, b).x() > center_of_mass_m(world, end.end, b + 1).x();
    return bad;
  };
  prove_above("chain of four bodies", 16, failing_speed(1, out_of_order));
}

// A ball of 1 m pushed through a slit of 0.6 m between two soft jaws: it comes through whole.
TEST(PassThrough, ABallThroughASlit) {
  WorldSpec spec = thrown(ball({0, 0, 0}, 0.5, 5));
  for (const double side : {-1.0, 1.0}) {
    TetMesh jaw = grid({0.6, side > 0 ? 0.3 : -1.3, -1}, {0.5, 1, 2}, 2, 4, 8);
    const auto held = testing::nodes_where(jaw, [](const Vec3& p) { return std::abs(p.y()) > 1.29; });
    spec.bodies.push_back({"jaw", jaw, soft, held});
  }
  for (BodySpec& body : spec.bodies) body.material.friction = 0.1;
  const World world = build_world(spec);
  State state = rest_state(world);
  double deepest = 0, time = 0;
  while (time < 30 && center_of_mass_m(world, state, 0).x() < 2.2) {
    Control push;
    push.manipulation = Manipulation::body;
    const double speed = mean_speed_m_s(world, state, 0);
    push.force_n = {speed < 0.5 ? 500.f : 50.f, 0, 0};
    push.steps = int(0.05 / world.dt_s);
    const Rollout next = propagate(world, state, push);
    ASSERT_EQ(next.outcome.status, RunStatus::ok) << next.outcome.reason;
    state = next.end, time += 0.05;
    deepest = std::max(deepest, deepest_penetration(world, state).depth_m);
  }
  EXPECT_GT(center_of_mass_m(world, state, 0).x(), 2.2);
  testing::prove_at_most(15, "ball of 1 m through a slit of 0.6: deepest overlap, m",
                         fmt::format("through in {:.1f} s", time), deepest, 0.03);
  Control rest;
  rest.steps = int(3 / world.dt_s);
  const State end = propagate(world, state, rest).end;
  EXPECT_EQ(inverted_tets(world, end), 0);
  EXPECT_LT(largest_volume_change(world, end), 0.03);
}

}  // namespace
}  // namespace limber::fem
