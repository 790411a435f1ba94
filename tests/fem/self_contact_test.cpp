// A body that touches itself (docs/contact.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/laws.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

// A bar of 0.2 × 0.4 bent to a U at rest: two arms of 1.6 m, 0.3 m apart, the bend at x = 0.
TetMesh bent_bar() {
  constexpr double arm = 1.6, radius = 0.25, length = 2 * arm + M_PI * radius;
  TetMesh mesh = testing::grid({0, -0.1, -0.2}, {length, 0.2, 0.4}, 26, 2, 2);
  for (int n = 0; n < mesh.positions.rows(); ++n) {
    const Vec3 p = mesh.positions.row(n);
    const double bend = (p.x() - arm) / radius;  // angle round the bend
    Vec3 q;
    if (bend < 0)
      q = {arm - p.x(), -radius - p.y(), p.z()};
    else if (bend > M_PI)
      q = {p.x() - arm - M_PI * radius, radius + p.y(), p.z()};
    else
      q = {-(radius + p.y()) * std::sin(bend), -(radius + p.y()) * std::cos(bend), p.z()};
    mesh.positions.row(n) = q.transpose();
  }
  return mesh;
}

// How far the ends of the arms are apart, from surface to surface, at the least, while the arms move towards
// one another, each at `speed` at its end; negative: one is in the other, or beyond it.
double min_gap(bool self_contact, double speed) {
  WorldSpec spec = testing::alone({"bar", bent_bar(), {}, {}});
  spec.bodies[0].self_contact = self_contact;
  const World world = build_world(spec);
  State state = rest_state(world);
  const Points rest = world.bodies[0].cage.positions;
  for (int n = 0; n < world.nodes; ++n)
    if (rest(n, 0) > 0)
      state.velocities[3 * n + 1] = float((rest(n, 1) > 0 ? -speed : speed) * rest(n, 0) / 1.6);
  Batch batch(world, 1);
  Control coast;
  coast.steps = std::max(1, int(0.02 / speed / world.dt_s));
  double least = 1;
  for (int i = 0; i < 40; ++i) {
    batch.load(0, state, coast);
    while (batch.advance() > 0) {
    }
    batch.store(0, state);
    EXPECT_EQ(batch.outcome(0).status, RunStatus::ok);
    const Points now = body_positions(world, state, 0);
    double lower = -1e9, upper = 1e9;  // faces that look at one another
    for (int n = 0; n < world.nodes; ++n) {
      if (rest(n, 0) < 1.2) continue;
      if (rest(n, 1) < 0) lower = std::max(lower, now(n, 1));
      if (rest(n, 1) > 0) upper = std::min(upper, now(n, 1));
    }
    least = std::min(least, upper - lower);
  }
  return least;
}

TEST(SelfContact, TheEndsOfABentBarMeetAndDoNotPass) {
  EXPECT_LT(min_gap(false, 2), -0.2);  // through one another
  for (const double speed : {1.0, 2.0, 4.0}) {
    SCOPED_TRACE(speed);
    std::vector<double>
        gaps;  // at speeds nearby: how deep a single one goes is chance, 0.7 to 3.2 cm at 1 m/s
    for (const double near : {0.96, 0.98, 1.0, 1.02, 1.04}) gaps.push_back(min_gap(true, near * speed));
    std::sort(gaps.begin(), gaps.end());
    EXPECT_LT(gaps.back(), 0.01);   // they met
    EXPECT_GT(gaps.front(), -0.1);  // whatever the speed, no arm gets half through the other
    // Up to 2 m/s the middle one is no deeper than this.
    testing::prove_at_least(15, fmt::format("ends of a bent bar's arms at {} m/s: least gap, m", speed),
                            "0.2 m thick", gaps[2], speed > 2 ? -0.1 : -0.02 - 0.01 * speed);
  }
}

// Momentum and angular momentum are those of before.
TEST(SelfContact, KeepsMomentum) {
  WorldSpec spec = testing::alone({"bar", bent_bar(), {}, {}});
  spec.bodies[0].self_contact = true;
  const World world = build_world(spec);
  State state = rest_state(world);
  for (int n = 0; n < world.nodes; ++n) {
    const float y = state.positions[3 * n + 1];
    if (state.positions[3 * n] > 0) state.velocities[3 * n + 1] = y > 0 ? -3.f : 1.f;
  }
  Control coast;
  coast.steps = int(0.5 / world.dt_s);
  const State end = propagate(world, state, coast).end;
  const auto before = testing::momenta(world, state), after = testing::momenta(world, end);
  EXPECT_LT((after - before).norm(), 2e-5 * before.head<3>().norm());
}

// Where a body does not overlap itself, asking for self-contact changes not one bit.
TEST(SelfContact, NothingChangesWithoutOverlap) {
  WorldSpec spec = testing::barriers();
  const World plain = build_world(spec);
  for (BodySpec& body : spec.bodies) body.self_contact = true;
  const World asking = build_world(spec);
  State state = rest_state(plain);
  Rng rng(8, 1);
  for (int i = 0; i < 20; ++i) {
    Control control;
    control.manipulation = Manipulation::body;
    control.force_n = Vec3f(400, 0, 100) + (300 * rng.direction()).cast<float>();
    control.steps = 100;
    const State next = propagate(plain, state, control).end;
    EXPECT_EQ(propagate(asking, state, control).end, next);
    state = next;
  }
  EXPECT_GT(center_of_mass_m(plain, state, 0).x(), 2);  // it met the plate
}

}  // namespace
}  // namespace limber::fem
