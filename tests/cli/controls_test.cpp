// Controls: that a scene is solved means something only where it would not be solved otherwise. The figures
// of thirty seeds are in docs/planning-measured.md.
#include <algorithm>

#include "limber/detail/plan/plan.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "scenes/library.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

using Sets = std::vector<std::string>;

class Controls : public Program {
 protected:
  static scenes::Scene scene_of(const std::string& name, Sets sets) {
    sets.push_back("planner.preset=fast");
    return scenes::read_scene_file(scenes::find_scene(name), sets);
  }
  plan::Plan plan_of(const scenes::Scene& scene, int seed, int iterations) {
    const std::vector<PreparedBody> bodies = prepare_bodies(scene, {}, folder.path());
    const fem::World world = build_world(scene, bodies);
    const FemSystem system(world, goal_rules_of(scene));
    PlanOptions options;
    options.seed = seed, options.iterations = iterations;
    plan::Plan p = plan::plan(system, settings_of(scene, options));
    path_.clear();
    for (const State& frame : p.trajectory.frames) path_.push_back(system.robot_center(frame));
    return p;
  }
  std::vector<Vec3> path_;  // of the robot's centre, in the last plan
};

TEST_F(Controls, WithoutItsPlatesBarriers1IsSolvedInFewIterations) {
  scenes::Scene scene = scene_of("barriers1", {});
  ASSERT_EQ(scene.robot, 0);
  scene.bodies.resize(1);
  for (int seed = 1; seed <= 5; ++seed) {
    const plan::Plan p = plan_of(scene, seed, 100);
    EXPECT_TRUE(p.solved()) << seed << ": " << plan::explain(p);
  }
}

// The gap is smaller than the cube: what gets it through is that plates give way.
TEST_F(Controls, RigidPlatesAreNotPassedWhereSoftOnesAre) {
  const scenes::Scene soft = scene_of("barriers1", {}),
                      rigid = scene_of("barriers1",
                                       {"bodies.lower_plate.kind=rigid", "bodies.upper_plate.kind=rigid"});
  for (int seed = 1; seed <= 3; ++seed) {
    EXPECT_TRUE(plan_of(soft, seed, 200).solved()) << seed;
    EXPECT_FALSE(plan_of(rigid, seed, 200).solved()) << seed;
  }
}

TEST_F(Controls, WithoutAPushNothingGetsAnywhere) {
  for (const char* name : {"barriers1", "barriers2"}) {
    const scenes::Scene scene = scene_of(name, {"planner.max_force_n=1e-6"});
    const plan::Plan p = plan_of(scene, 1, 60);
    EXPECT_FALSE(p.solved());
    EXPECT_LT((path_.back() - path_.front()).norm(), 1e-3) << name;
  }
}

// The way by chambers: FL is in front at the left, where the ball starts; B is behind, R at the right.
std::string chambers(const std::vector<Vec3>& path) {
  std::string way, last;
  for (const Vec3& p : path) {
    const bool in_a_window = (p.x() > 4 && p.x() < 4.4) || (p.y() > 4 && p.y() < 4.4);
    if (in_a_window) continue;
    const std::string now = std::string(p.y() > 4.2 ? "B" : "F") + (p.x() > 4.2 ? "R" : "L");
    if (now != last) way += (way.empty() ? "" : " ") + now;
    last = now;
  }
  return way;
}

// Those in the order in which the ball first comes there: a wall may throw it back once or twice.
std::string first_visits(const std::string& way) {
  std::string first;
  for (std::size_t i = 0; i < way.size(); i += 3)
    if (first.find(way.substr(i, 2)) == first.npos) first.append(first.empty() ? "" : " ").append(way, i, 2);
  return first;
}

// Only its size makes the direct window be avoided: where it is wider than the ball, the ball takes it.
// Linearly: bodies that bend give way more, and seed 1 gets half way through the smallest one and back.
TEST_F(Controls, TheSmallestWindowIsAvoidedAndAWideOneTaken) {
  const std::vector<std::string> linear{"bodies.ball.deformation=linear", "bodies.walls.deformation=linear"};
  const scenes::Scene windows = scene_of("windows", linear);
  const scenes::Scene wide =
      scene_of("windows",
               {linear[0], linear[1],
                "bodies.walls.model.blocks.holes=[[[4, 1.1, 1.2], [4.4, 2.9, 3.4]], [[1.25, 4, 1.2], [2.75, "
                "4.4, 2.7]], [[4, 5.7, 0.7], [4.4, 7.1, 2.1]], [[5.75, 4, 2.1], [7.05, 4.4, 3.4]]]"});
  for (int seed = 1; seed <= 2; ++seed) {
    EXPECT_TRUE(plan_of(windows, seed, 600).solved()) << seed;
    const std::string way = chambers(path_);
    EXPECT_EQ(first_visits(way), "FL BL BR FR") << seed << ": " << way;
    EXPECT_EQ(way.find("FL FR"), way.npos) << seed << ": " << way;
    EXPECT_EQ(way.substr(way.size() - 2), "FR") << seed << ": " << way;
    EXPECT_TRUE(plan_of(wide, seed, 600).solved()) << seed;
    EXPECT_EQ(first_visits(chambers(path_)), "FL FR") << seed;
  }
}

}  // namespace
}  // namespace limber::detail
