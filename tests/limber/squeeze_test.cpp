// The scene `squeeze`: a ball thrown at a slit of 60 % of its diameter in a soft wall.
#include <gtest/gtest.h>

#include "fem/batch.h"
#include "fem/observe.h"
#include "limber/detail/world/scene_world.h"
#include "scenes/library.h"
#include "tests/core/temporary_folder.h"

namespace limber::detail {
namespace {

struct Throw {
  bool ok = true;                                           // did not diverge
  double farthest_m = 0, deepest_m = 0, volume_change = 0;  // on the way
  int inverted_on_the_way = 0, inverted_after = 0;
};

Throw throw_ball(const fem::World& world, double speed_m_s) {
  Throw result;
  State state = rest_state(world);
  const int ball = world.robot, first = world.bodies[std::size_t(ball)].first_node;
  for (int n = 0; n < world.bodies[std::size_t(ball)].node_count(); ++n)
    state.velocities[std::size_t(3 * (first + n))] = float(speed_m_s);
  Control coast;
  coast.steps = int(0.01 / world.dt_s);
  for (int i = 0; i < 350; ++i) {
    const fem::Rollout next = propagate(world, state, coast);
    result.ok = next.outcome.status == fem::RunStatus::ok;
    if (!result.ok) return result;
    state = next.end;
    result.inverted_after = inverted_tets(world, state);
    if (i >= 150) continue;
    result.farthest_m = std::max(result.farthest_m, center_of_mass_m(world, state, ball).x());
    result.deepest_m = std::max(result.deepest_m, deepest_penetration(world, state).depth_m);
    result.volume_change = std::max(result.volume_change, largest_volume_change(world, state));
    result.inverted_on_the_way = std::max(result.inverted_on_the_way, result.inverted_after);
  }
  return result;
}

// The wall reaches from x = 2.4 to 2.8, and the ball is 1 m thick.
TEST(Squeeze, ABallComesThroughTheSlitWhole) {
  TemporaryFolder folder;
  const scenes::Scene scene = scenes::read_scene_file(
      scenes::find_scene("squeeze"), {"bodies.ball.contact=cage", "bodies.wall.contact=cage"});
  const fem::World world = build_world(scene, prepare_bodies(scene, {}, folder.path()));
  fmt::print("speed, m/s | comes to x, m | deepest, m | volume change, % | inverted on the way, after\n");
  for (const double speed : {2.0, 4.0, 8.0, 12.0, 14.0, 16.0, 20.0}) {
    const Throw t = throw_ball(world, speed);
    if (t.ok)
      fmt::print("{} | {:.2f} | {:.4f} | {:.1f} | {}, {}\n", speed, t.farthest_m, t.deepest_m,
                 100 * t.volume_change, t.inverted_on_the_way, t.inverted_after);
    else
      fmt::print("{} | diverges\n", speed);
    if (speed > 12) continue;
    EXPECT_TRUE(t.ok) << speed;
    EXPECT_EQ(t.farthest_m > 3.3, speed >= 4) << speed;  // slower it swings back
    EXPECT_LT(t.deepest_m, 0.01) << speed;
    EXPECT_EQ(t.inverted_on_the_way + t.inverted_after, 0) << speed;
    if (speed <= 4) {
      EXPECT_LT(t.volume_change, 0.03) << speed;
    }
  }
}

}  // namespace
}  // namespace limber::detail
