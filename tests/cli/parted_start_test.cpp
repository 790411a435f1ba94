// A scene whose bodies overlap at the start, from its text to verify: they are parted, and all begins there.
#include "core/npz.h"
#include "fem/observe.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "limber/detail/world/workspace.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

// The robot and a ball that goes along with the goal are 0.05 m in one another.
constexpr const char* overlapping = R"(name = "overlapping"
[world]
bounds_m = [[0, 0, 0], [4, 2, 2]]
gravity_m_s2 = [0, 0, 0]
[[bodies]]
name = "robot"
role = "robot"
model = { sphere = { diameter_m = 0.6, triangle_m = 0.08 } }
cage = { tets = 48 }
material = { youngs_modulus_pa = 5e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [1.5, 1, 1] }
[[bodies]]
name = "ball"
role = "free"
model = { sphere = { diameter_m = 0.6, triangle_m = 0.08 } }
cage = { tets = 48 }
material = { youngs_modulus_pa = 5e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [0.95, 1, 1] }
[goal]
center_of_mass_m = [2.6, 1, 1]
radius_m = 0.2
[planner]
preset = "fast"
seed = 1
iterations = 200
max_force_n = 60
[film]
size_px = [96, 64]
frames_per_second = 5
)";

using PartedStart_slow = Program_slow;

TEST_F(PartedStart_slow, IsPartedToldAndVerified) {
  const Result planned = limber_program({"plan", scene(overlapping), "-o", out(), "--json"});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  const Json parted = planned.json().at("parted");
  ASSERT_EQ(parted.at("pairs").size(), 1u);
  const Json& pair = parted.at("pairs")[0];
  EXPECT_EQ(pair.at("bodies"), Json({"robot", "ball"}));
  EXPECT_NEAR(pair.at("depth_m").get<double>(), 0.05, 0.004);
  EXPECT_NEAR(pair.at("gap_m").get<double>(), 0.003, 0.001);
  for (const Json& moved : pair.at("moved_m")) EXPECT_NEAR(moved.get<double>(), 0.0265, 0.004);
  EXPECT_GT(parted.at("steps").get<int>(), 0);

  // All begins there: the tree, the path, the first frame, the goal test, the search's map.
  const PlanFolder planned_folder = read_plan_folder(out());
  const std::vector<PreparedBody> bodies = read_world_of(planned_folder, out()).bodies;
  const fem::World world = build_world(planned_folder.scene, bodies),
                   known = world_of(planned_folder, bodies);
  const FemSystem system(world, goal_rules_of(planned_folder.scene)),
      same(known, goal_rules_of(planned_folder.scene));
  EXPECT_EQ(known.parting.steps, 0);
  EXPECT_EQ(same.hash(), system.hash());
  const State start = fem::start_state(world);
  EXPECT_NE(start, fem::rest_state(world));
  EXPECT_EQ(system.start(), start);
  EXPECT_EQ(State(planned_folder.plan.tree.states[0]), start);
  EXPECT_EQ(planned_folder.plan.trajectory.frames[0], start);
  const double half_m = (pair.at("depth_m").get<double>() + pair.at("gap_m").get<double>()) / 2;
  EXPECT_NEAR((system.robot_center(start) - system.robot_center(fem::rest_state(world))).x(), half_m,
              0.1 * half_m);

  const Result verified = limber_program({"verify", out()});
  EXPECT_EQ(verified.code, exit_done) << verified.out;
  EXPECT_NE(verified.out.find("the same start"), std::string::npos);
  EXPECT_EQ(limber_program({"robust", out(), "--perturbations", "2"}).code, exit_done);

  // The same bytes again, by another number of threads; and what is up to date is not planned again.
  const Result again =
      limber_program({"plan", scene(overlapping), "-o", out("again"), "--json", "--threads", "3"});
  ASSERT_EQ(again.code, exit_done) << again.err;
  EXPECT_EQ(again.json().at("tree_hash"), planned.json().at("tree_hash"));
  EXPECT_EQ(again.json().at("parted"), parted);
  const Result resumed = limber_program({"plan", scene(overlapping), "-o", out(), "--resume"});
  EXPECT_EQ(resumed.code, exit_done) << resumed.err;
  EXPECT_NE(resumed.out.find("robot and ball overlapped by"), std::string::npos) << resumed.out;
}

// What was marked at rest is marked where it has gone: as many cells, about the parted place.
TEST_F(PartedStart_slow, TheSearchLooksWhereBodiesWereParted) {
  const scenes::Scene read = scenes::read_scene(overlapping, "scene");
  const std::vector<PreparedBody> bodies = prepare_bodies(read, {}, out());
  const fem::World world = build_world(read, bodies);
  const plan::Workspace w = workspace_of(world);
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (int z = 0; z < w.cells.z(); ++z)
    for (int y = 0; y < w.cells.y(); ++y)
      for (int x = 0; x < w.cells.x(); ++x)
        if (w.what[std::size_t((z * w.cells.y() + y) * w.cells.x() + x)] == plan::Workspace::soft)
          sum += w.box.lower + w.cell_m * Vec3(x + 0.5, y + 0.5, z + 0.5), ++count;
  ASSERT_GT(count, 0);
  EXPECT_LT((sum / count - fem::center_of_mass_m(world, fem::start_state(world), 1)).norm(), 0.01);
  const double ball_m3 = 4.0 / 3 * M_PI * 0.3 * 0.3 * 0.3;
  EXPECT_NEAR(count * w.cell_m * w.cell_m * w.cell_m, ball_m3, 0.1 * ball_m3);
}

TEST_F(PartedStart_slow, IsRefusedWhereTheSceneWantsThatOrItCannotBe) {
  const Result refused =
      limber_program({"plan", scene(overlapping), "-o", out(), "--set", "world.part_overlaps=false"});
  EXPECT_EQ(refused.code, exit_bad_input);
  EXPECT_NE(refused.err.find("bodies robot and ball overlap at the start"), std::string::npos) << refused.err;
  const std::string into_it = "bodies.ball.pose.position_m=[1.3, 1, 1]";
  const Result checked = limber_program({"scene", "check", scene(overlapping), "--set", into_it});
  EXPECT_EQ(checked.code, exit_bad_input);
  EXPECT_NE(checked.out.find("too deep to be parted; move them apart"), std::string::npos) << checked.out;
  const Result deep = limber_program({"plan", scene(overlapping), "-o", out(), "--set", into_it});
  EXPECT_EQ(deep.code, exit_bad_input);
  EXPECT_NE(deep.err.find("cannot be parted: that is more than a quarter of"), std::string::npos) << deep.err;
}

// Their surfaces are near one another all over, so that nothing is deep in anything.
TEST_F(PartedStart_slow, IsRefusedWhereTwoBodiesFillTheSamePlace) {
  for (const char* at : {"[1.5, 1, 1]", "[1.501, 1, 1]"}) {
    const std::string into_it = fmt::format("bodies.ball.pose.position_m={}", at);
    const Result checked = limber_program({"scene", "check", scene(overlapping), "--set", into_it});
    EXPECT_EQ(checked.code, exit_bad_input);
    EXPECT_NE(checked.out.find("too deep to be parted; move them apart"), std::string::npos) << checked.out;
    for (const char* command : {"plan", "simulate"}) {
      const Result deep = limber_program({command, scene(overlapping), "-o", out(command), "--set", into_it});
      EXPECT_EQ(deep.code, exit_bad_input);
      EXPECT_NE(deep.err.find("bodies robot and ball overlap at the start"), std::string::npos) << deep.err;
      EXPECT_NE(deep.err.find("more than a quarter of"), std::string::npos) << deep.err;
      EXPECT_FALSE(fs::exists(out(command) + "/plan.npz"));
    }
  }
}

}  // namespace
}  // namespace limber::detail
