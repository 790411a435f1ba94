// Bodies that stiffen towards their max_stretch (docs/dynamics.md, "Stretch").
#include "fem/detail/stretch_limits.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/error.h"
#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/lane.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::Lane;

WorldSpec bar(double max_stretch) {
  WorldSpec spec;
  BodySpec body{"bar", testing::leaning_grid({0, 0, 0}, {3, 1, 1}, 6, 2, 2), {}, {}, BodyKind::deformable};
  body.max_stretch = max_stretch;
  body.material.youngs_modulus_pa = 2e3;
  spec.bodies.push_back(std::move(body));
  spec.bounds_m = {Vec3::Constant(-50), Vec3::Constant(50)};
  spec.walls = false;
  return spec;
}

std::vector<Vec3> forces_of(Lane& lane) {
  detail::StretchLimits<float> limits(lane.world, detail::kernels<float>(detail::best_isa(), 1));
  // The kernel of one lane reads records of eight numbers.
  std::vector<float> records(8 * std::size_t(lane.world.nodes), 0.f);
  for (int n = 0; n < lane.world.nodes; ++n) std::copy_n(&lane.x[3 * n], 3, &records[8 * n]);
  limits.find(records.data(), lane.inner_travel.data(), {false});
  std::fill(lane.f.begin(), lane.f.end(), 0.f);
  limits.add_forces(0, lane.view());
  std::vector<Vec3> forces;
  for (int n = 0; n < lane.world.nodes; ++n)
    forces.push_back(Eigen::Map<const Vec3f>(&lane.f[3 * n]).cast<double>());
  return forces;
}

// Nodes thrown about, so that many tets are beyond and some inverted.
Lane thrown(const World& world, double far, Rng& rng) {
  Lane lane(world);
  lane.move(0, [&](const Vec3f& p) {
    return Vec3f(p + (far * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1))).cast<float>());
  });
  return lane;
}

// Of affine maps with given singular values, however turned before and after: those beyond meet forces, those
// within none at all. (The force begins at 1.6 of 2.)
TEST(StretchLimits, PushBodiesThatAreBeyondAndNoOthers) {
  const World world = build_world(bar(2));
  Rng rng(31, 0);
  int beyond = 0, within = 0;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(rng.uniform(0, 3), rng.direction()).toRotationMatrix();
    const Vec3 sizes(rng.uniform(0.5, 1.8), rng.uniform(0.5, 1.8), rng.uniform(0.5, 1.8));
    const Eigen::Matrix3d f =
        turn * sizes.asDiagonal() * Eigen::AngleAxisd(rng.uniform(0, 3), rng.direction()).toRotationMatrix();
    Lane lane(world);
    lane.move(0, [&](const Vec3f& p) { return Vec3f((f * p.cast<double>()).cast<float>()); });
    double sum = 0;
    for (const Vec3& force : forces_of(lane)) sum += force.norm();
    if (sizes.maxCoeff() > 1.61 || sizes.minCoeff() < 1 / 1.61) {
      EXPECT_GT(sum, 0) << sizes.transpose();
      ++beyond;
    } else if (sizes.maxCoeff() < 1.59 && sizes.minCoeff() > 1 / 1.59) {
      EXPECT_EQ(sum, 0) << sizes.transpose();
      ++within;
    }
  }
  EXPECT_GT(beyond, 20);
  EXPECT_GT(within, 3);
}

TEST(StretchLimits, ForcesKeepMomentumAndAngularMomentum) {
  const World world = build_world(bar(2));
  Rng rng(32, 0);
  for (int i = 0; i < 10; ++i) {
    Lane lane = thrown(world, 0.3, rng);
    Vec3 sum = Vec3::Zero(), turning = Vec3::Zero();
    double all = 0;
    const std::vector<Vec3> forces = forces_of(lane);
    for (int n = 0; n < world.nodes; ++n) {
      sum += forces[std::size_t(n)], turning += lane.node(n).cross(forces[std::size_t(n)]);
      all += forces[std::size_t(n)].norm();
    }
    ASSERT_GT(all, 0);
    EXPECT_LT(sum.norm(), 1e-5 * all);
    EXPECT_LT(turning.norm(), 3e-5 * all);
  }
}

// Against a uniform stretch forces do negative work, as against a squeeze, and a mirrored body is turned
// back.
TEST(StretchLimits, ForcesLeadBack) {
  const World world = build_world(bar(2));
  for (const double size : {2.2, 1.7, 0.5, 0.05, -0.3}) {
    Lane lane(world);
    lane.move(0, [&](const Vec3f& p) { return Vec3f(p.x(), float(size) * p.y(), p.z()); });
    double work = 0;
    const std::vector<Vec3> forces = forces_of(lane);
    for (int n = 0; n < world.nodes; ++n)
      work += forces[std::size_t(n)].y() * double(world.tables.rest_positions[3 * std::size_t(n) + 1]);
    EXPECT_GT(work * (size > 1 ? -1 : 1), 0) << size;
  }
}

// Hung up by one end under what draws it out threefold a bar stays within its limit, and thrown about all
// tets find back.
TEST(StretchLimits, HoldWhatIsDrawnAndLetGoOfWhatIsThrown) {
  for (const double limit : {2.0, 1e9}) {
    WorldSpec spec = bar(limit);
    for (int n = 0; n < spec.bodies[0].cage.positions.rows(); ++n)
      if (spec.bodies[0].cage.positions(n, 0) == 0) spec.bodies[0].fixed_nodes.push_back(n);
    spec.gravity_m_s2 = {25, 0, 0};
    const World world = build_world(spec);
    Control wait;
    wait.steps = 400;
    State state = rest_state(world);
    double longest = 1, shortest = 1;
    for (int i = 0; i < 5; ++i) {
      state = propagate(world, state, wait).end;
      const Strains strains = fem::strains(world, state, 0);
      longest = std::max(longest, *std::max_element(strains.longest.begin(), strains.longest.end()));
      shortest = std::min(shortest, *std::min_element(strains.shortest.begin(), strains.shortest.end()));
    }
    EXPECT_EQ(longest < 2 && shortest > 0.5, limit == 2) << longest << ' ' << shortest;
    EXPECT_GT(longest, 1.6) << "and is drawn";
  }
  const World limited = build_world(bar(2));
  Rng rng(33, 0);
  for (int i = 0; i < 10; ++i) {
    State state = thrown(limited, 0.35, rng).state();
    Control wait;
    wait.steps = 1500;
    const Rollout rollout = propagate(limited, state, wait);
    ASSERT_EQ(rollout.outcome.status == RunStatus::ok, true) << i;
    EXPECT_TRUE(is_sound(limited, rollout.end)) << i;
  }
}

TEST(StretchLimits, SameBitsForAnyLanesAndInstructionSet) {
  const World world = build_world(bar(2));
  Rng rng(34, 0);
  std::vector<Control> controls;
  for (int i = 0; i < 12; ++i) {
    Control& control = controls.emplace_back();
    control.manipulation = Manipulation::control_point;
    control.node = rng.below(world.bodies[0].node_count());
    control.radius_m = 0.8, control.steps = 20 + rng.below(60);
    control.force_n = (3000 * rng.direction()).cast<float>();
  }
  const State start = thrown(world, 0.3, rng).state();  // so that limits act, in other tets as it goes on
  const auto run = [&](int lanes, InstructionSet set) {
    std::vector<Rollout> rollouts;
    for (const Control& control : controls) rollouts.push_back({&start, control, {}, {}});
    Batch batch(world, lanes, set);
    propagate(batch, rollouts);
    std::vector<State> ends;
    for (const Rollout& rollout : rollouts) ends.push_back(rollout.end);
    return ends;
  };
  const std::vector<State> expected = run(1, InstructionSet::sse2);
  for (const int lanes : {1, 4, 8, 16})
    for (const auto set : {InstructionSet::sse2, InstructionSet::avx2, InstructionSet::avx512}) {
      SCOPED_TRACE(fmt::format("{} lanes, set {}", lanes, int(set)));
      try {
        EXPECT_EQ(run(lanes, set), expected);
      } catch (const InputError& lacking) {
        std::puts(lacking.what());
      }
    }
}

}  // namespace
}  // namespace limber::fem
