// The scenes that come with limber, as far as a plan needs them: their bodies prepared, their world built and
// stepped.
#include "limber/detail/world/scene_world.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "core/threads.h"
#include "limber/detail/world/fem_system.h"
#include "plan/expansion.h"
#include "scenes/library.h"
#include "tests/core/temporary_folder.h"

namespace limber::detail {
namespace {

// All tets of the scene: exactly where all cages are cells, within a tenth where limber makes one round a
// model.
const std::map<std::string, int> tets_of_scene{
    {"barriers1", 675}, {"barriers2", 2335},      {"bunny_gate", 620},   {"squeeze", 957},
    {"windows", 1710},  {"falling_objects", 503}, {"body_parts", 557},   {"there_and_back", 435},
    {"torso", 1411},    {"heart_and_lung", 500},  {"moving_door", 1790}, {"colon", 1760},
    {"crowd", 2550},    {"mattress", 2820},       {"knot", 1220},        {"dilation", 1600}};

TEST(SceneWorld, EveryScenePreparesBuildsAndSteps) {
  TemporaryFolder folder;
  ::setenv("LIMBER_MODELS", folder.path().c_str(), 1);  // the made models, on every machine
  for (const scenes::KnownScene& known : scenes::known_scenes()) {
    SCOPED_TRACE(known.name);
    const scenes::Scene scene = scenes::read_scene_file(known.file);
    const std::vector<PreparedBody> bodies = prepare_bodies(scene, {}, folder / known.name);
    int tets = 0;
    bool by_budget = false;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      SCOPED_TRACE(scene.bodies[b].name);
      EXPECT_TRUE(bodies[b].report.certificate->holds);
      tets += int(bodies[b].cage.tets.rows());
      by_budget |= scene.bodies[b].cage.tets > 0;
    }
    EXPECT_NEAR(tets, tets_of_scene.at(known.name), by_budget ? 0.1 * tets : 0);

    const fem::World world = build_world(scene, bodies);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      SCOPED_TRACE(scene.bodies[b].name);
      // What its model weighs, whatever its cage is.
      const double mass_kg = scene.bodies[b].material.density_kg_m3 * volume(bodies[b].surface);
      ASSERT_TRUE(scene.bodies[b].parts.empty());
      EXPECT_NEAR(world.bodies[b].mass_kg, mass_kg, 1e-5 * mass_kg);
    }
    const FemSystem system(world, goal_rules_of(scene));
    const State start = system.start();
    const scenes::Goal& first = scene.via.empty() ? scene.goal : scene.via.front().goal;
    EXPECT_GT((system.robot_center(start) - first.center_of_mass_m).norm(), 2 * first.radius_m);
    plan::Rollout rollout{&start, {}, {}, false};
    rollout.control.manipulation = Manipulation::body;
    rollout.control.force_n = Vec3f::UnitX() * float(scene.planner.max_force_n);
    rollout.control.steps = plan::steps_of(0.15, system.dt_s());  // nothing gets to a wall by then
    system.make_propagator()->propagate({&rollout, 1});
    ASSERT_TRUE(rollout.ok);
    EXPECT_TRUE(system.acceptable(rollout.to));
    EXPECT_NE(rollout.to.positions, start.positions);
  }
}

TEST(SceneWorld, BodiesThatArePreparedSideBySideHaveTheSameBytes) {
  TemporaryFolder folder;
  const scenes::Scene scene = scenes::read_scene_file(scenes::find_scene("barriers1"));
  std::vector<std::vector<std::map<std::string, std::string>>> hashes;  // of all files, [threads][body]
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    auto& of_bodies = hashes.emplace_back();
    for (const PreparedBody& body : prepare_bodies(scene, {}, folder / std::to_string(threads))) {
      const bool is_copied = of_bodies.size() == 2;  // the upper plate is the lower one
      of_bodies.push_back(body.report.files);
      EXPECT_EQ(body.report.cpu_seconds.empty(), threads > 1 || is_copied)
          << "the process' costs are not one body's";
    }
  }
  set_thread_count(0);
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0].size(), scene.bodies.size());
}

// Three boxes that are the same, one of them turned, and one that is larger.
constexpr const char* boxes = R"(name = "boxes"
[world]
bounds_m = [[0, 0, 0], [8, 2, 2]]
[[bodies]]
name = "robot"
role = "robot"
model = { box = { size_m = [1, 1, 1], bevel_m = 0.1, triangle_m = 0.3 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [0.9, 1, 1] }
[[bodies]]
name = "same"
role = "free"
model = { box = { size_m = [1, 1, 1], bevel_m = 0.1, triangle_m = 0.3 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [2.7, 1.1, 0.7] }
[[bodies]]
name = "turned"
role = "free"
model = { box = { size_m = [1, 1, 1], bevel_m = 0.1, triangle_m = 0.3 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [4.5, 1, 1], angle_deg = 20 }
[[bodies]]
name = "larger"
role = "free"
model = { box = { size_m = [1.1, 1, 1], bevel_m = 0.1, triangle_m = 0.3 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [6.3, 1, 1] }
[goal]
center_of_mass_m = [7, 1, 1]
radius_m = 0.1
[planner]
max_force_n = 10
)";

TEST(SceneWorld, BodiesThatAreTheSameButForTheirPlaceAreMadeOnce) {
  TemporaryFolder folder;
  const scenes::Scene scene = scenes::read_scene(boxes, "boxes");
  const auto report_of = [](const PreparedBody& body) {
    Json told = body.report.json;
    for (const char* cost : {"model", "cpu_seconds", "peak_memory_mb", "peak_memory_mb_after"})
      told.erase(cost);
    return told;
  };
  std::vector<std::vector<Json>> reports;
  for (const int threads : {1, 3}) {
    SCOPED_TRACE(threads);
    set_thread_count(threads);
    const fs::path work = folder / std::to_string(threads);
    const std::vector<PreparedBody> bodies = prepare_bodies(scene, {}, work);
    auto& told = reports.emplace_back();
    for (const PreparedBody& body : bodies) told.push_back(report_of(body));
    EXPECT_EQ(told[0], told[1]);
    EXPECT_NE(told[0].at("input"), told[2].at("input"));
    EXPECT_NE(told[0].at("input"), told[3].at("input"));
    if (threads == 1) {
      EXPECT_FALSE(bodies[0].report.cpu_seconds.empty());
      EXPECT_TRUE(bodies[1].report.cpu_seconds.empty()) << "made a second time";
    }
    // Each is where the scene puts it, to the last bit.
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const PreparedBody own = read_body(body_folder(work, scene.bodies[b]));
      const Eigen::RowVector3d place = scene.bodies[b].pose.position_m.transpose();
      EXPECT_EQ(bodies[b].cage.positions, Points(own.cage.positions.rowwise() + place));
      EXPECT_EQ(bodies[b].surface.positions, Points(own.surface.positions.rowwise() + place));
      EXPECT_EQ(bodies[b].contact.samples.positions_m,
                Points(own.contact.samples.positions_m.rowwise() + place));
      EXPECT_EQ(bodies[b].contact.field.lower_m, own.contact.field.lower_m + place.transpose());
      EXPECT_LT(bounding_box(own.cage.positions).center().norm(), 1e-9) << "its anchor is at 0";
    }
    const std::map<std::string, double> shares = stiffness_shares_of(build_world(scene, bodies));
    EXPECT_EQ(shares.at("robot"), shares.at("same"));
    // Another run, of which some is there, leaves the same.
    fs::remove_all(body_folder(work, scene.bodies[0]));
    EXPECT_EQ(report_of(prepare_bodies(scene, {}, work)[0]), told[0]);
  }
  set_thread_count(0);
  EXPECT_EQ(reports[0], reports[1]);
}

}  // namespace
}  // namespace limber::detail
