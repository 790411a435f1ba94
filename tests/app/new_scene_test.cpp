// limber scene new: from a folder of models to a scene that limber plans.
#include <gmock/gmock.h>

#include "core/mesh_files.h"
#include "scenes/scene.h"
#include "tests/app/program.h"

namespace limber::app {
namespace {

using testing::HasSubstr;

// Cubes in millimetres, y to the back: the heart stands 100 behind the lung.
class NewScene : public Program {
 protected:
  void SetUp() override {
    fs::create_directories(models());
    cube("heart", {0, 0, 1000}, 80);
    cube("lung", {150, -100, 1000}, 80);
    cube("spine", {0, 200, 1000}, 60);
    cube("skin", {0, 0, 1000}, 900);
  }
  void box(const char* name, const Vec3& center_mm, const Vec3& edges_mm) const {
    SurfaceMesh mesh{Points(8, 3), Triangles(12, 3)};
    for (int i = 0; i < 8; ++i)
      mesh.positions.row(i) =
          (center_mm + edges_mm.cwiseProduct(Vec3((i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2) - 0.5)))
              .transpose();
    mesh.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6,
        2, 1, 3, 7, 1, 7, 5;
    write_obj(models() / (std::string(name) + ".obj"), mesh);
  }
  void cube(const char* name, const Vec3& center_mm, double edge_mm) const {
    box(name, center_mm, Vec3::Constant(edge_mm));
  }
  fs::path models() const { return folder / "models"; }
  std::vector<std::string> words(std::vector<std::string> more = {"--robot", "heart"}) const {
    std::vector<std::string> all{"scene",           "new", "--from",
                                 models().string(), "-o",  (folder / "chest.toml").string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};
using NewScene_slow = NewScene;  // stays out of the sanitizer runs

TEST_F(NewScene, OrgansAreInTheirPlacesAndRoles) {
  const Result made = limber_program(words());
  ASSERT_EQ(made.code, exit_done) << made.err;
  const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
  ASSERT_EQ(scene.bodies.size(), 3u);
  ASSERT_EQ(scene.scenery.size(), 1u);
  const auto& heart = scene.bodies[std::size_t(scene.robot)];
  EXPECT_EQ(heart.name, "heart");
  EXPECT_LT((heart.pose.position_m - Vec3(0, 0, 1)).norm(), 1e-12);
  for (const scenes::BodySpec& body : scene.bodies) {
    EXPECT_EQ(body.kind, body.name == "spine" ? scenes::Kind::rigid : scenes::Kind::deformable);
    EXPECT_EQ(std::get<scenes::FileModel>(body.model).scale, 0.001);  // they are apart
    if (body.name == "lung") {                                        // −y is our x
      EXPECT_LT((body.pose.position_m - Vec3(0.1, 0.15, 1)).norm(), 1e-12);
    }
  }
  EXPECT_EQ(scene.scenery[0].name, "skin");
  EXPECT_EQ(std::get<scenes::FileModel>(scene.scenery[0].model).scale, 0.001);
  EXPECT_LT(scene.scenery[0].opacity, 0.5);
  // One and a half lengths of the heart to the front of the middle of its cage.
  EXPECT_LT((scene.goal.center_of_mass_m - Vec3(0.12, 0, 1)).norm(), 0.005);
  ASSERT_EQ(scene.cameras.size(), 4u);
  EXPECT_EQ(scene.cameras[0].subject, scene.robot);
  EXPECT_LT(scene.cameras[0].fill, 0.6);
}

// Behind a wall that ends at its left side.
TEST_F(NewScene_slow, TheCameraStandsWhereTheRobotIsSeen) {
  fs::remove(models() / "lung.obj");
  for (const double side : {1.0, -1.0}) {
    box("stomach", {-155 * side, -100, 1000}, {390, 40, 700});
    ASSERT_EQ(limber_program(words({"--robot", "heart", "--goal", "up"})).code, exit_done);
    const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
    const Vec3 direction = scene.cameras[0].direction;
    EXPECT_GT(side * direction.y(), 0.8 * direction.x());
    fs::remove(folder / "chest.toml");
  }
}

// 20 mm deep, 100 mm wide: one and a half times its depth would be within its goal's radius.
TEST_F(NewScene_slow, AFlatRobotsGoalIsOutOfItsReachAtTheStart) {
  box("heart", {0, 0, 1000}, {100, 20, 100});
  ASSERT_EQ(limber_program(words()).code, exit_done);
  const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
  EXPECT_NEAR(scene.goal.center_of_mass_m.x(), 0.1, 0.005);
  EXPECT_NEAR(scene.goal.radius_m, 0.04, 1e-9);
}

TEST_F(NewScene_slow, IsPlannedAsItIs) {
  ASSERT_EQ(limber_program(words()).code, exit_done);
  const Result planned = limber_program(
      {"plan", (folder / "chest.toml").string(), "--data", models().string(), "-o", out(), "--json"});
  EXPECT_EQ(planned.code, exit_done) << planned.err;
  EXPECT_EQ(planned.json().at("solved"), true);
}

// Two lungs that reach 10 mm into the heart, and a liver 5 mm into all three.
TEST_F(NewScene_slow, OrgansThatOverlapComeApartAndArePlanned) {
  fs::remove(models() / "lung.obj");
  cube("lung_left", {70, 0, 1000}, 80);
  cube("lung_right", {-70, 10, 1000}, 80);
  cube("liver", {0, 0, 925}, 80);
  std::vector<std::string> with_json = words();
  with_json.push_back("--json");
  const Result made = limber_program(with_json);
  ASSERT_EQ(made.code, exit_done) << made.err;
  EXPECT_LT(made.json().at("scale").get<double>(), 1);
  EXPECT_GE(made.json().at("scale").get<double>(), 0.5);
  const std::string text = read_file(folder / "chest.toml");
  const Result planned = limber_program(
      {"plan", (folder / "chest.toml").string(), "--data", models().string(), "-o", out(), "--json"});
  EXPECT_EQ(planned.code, exit_done) << planned.err;
  fs::remove(folder / "chest.toml");
  ASSERT_EQ(limber_program(with_json).code, exit_done);
  EXPECT_EQ(read_file(folder / "chest.toml"), text);
}

TEST_F(NewScene_slow, TheGoalIsPastAllThatLiesInItsWay) {
  cube("stomach", {0, -300, 1000}, 80);
  for (const auto& [word, direction] :
       {std::pair("front", Vec3(1, 0, 0)), {"left", Vec3(0, 1, 0)}, {"down", Vec3(0, 0, -1)}}) {
    SCOPED_TRACE(word);
    ASSERT_EQ(limber_program(words({"--robot", "heart", "--goal", word})).code, exit_done);
    const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
    const Vec3 way = scene.goal.center_of_mass_m - Vec3(0, 0, 1);
    EXPECT_GT(way.dot(direction), 0.115);
    EXPECT_LT((way - way.dot(direction) * direction).norm(), 0.01);
    if (word == std::string("front")) {
      EXPECT_GT(way.x(), 0.34 + 0.04);  // the stomach's front, and half the heart
    }
    fs::remove(folder / "chest.toml");
  }
}

TEST_F(NewScene, SheetsAreOnlySeenAndDoublesLeftOut) {
  box("diaphragm", {0, 0, 900}, {300, 300, 4});
  cube("body", {0, 1, 1000}, 900);
  ASSERT_EQ(limber_program(words()).code, exit_done);
  const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
  ASSERT_EQ(scene.scenery.size(), 2u);
  EXPECT_EQ(scene.scenery[0].name, "body");
  EXPECT_EQ(scene.scenery[1].name, "diaphragm");
  EXPECT_EQ(scene.bodies.size(), 3u);
}

TEST_F(NewScene_slow, OrgansWithinOneAnotherAreRefused) {
  cube("liver", {0, 0, 1000}, 70);
  const Result made = limber_program(words());
  EXPECT_EQ(made.code, exit_bad_input);
  EXPECT_THAT(made.err, HasSubstr("still do not come apart; take fewer with --only"));
  EXPECT_FALSE(fs::exists(folder / "chest.toml"));
}

TEST_F(NewScene, WhatIsNotThereIsRefusedWithWhatIs) {
  EXPECT_THAT(limber_program(words({"--robot", "liver"})).err, HasSubstr("there are: heart, lung"));
  EXPECT_THAT(limber_program(words({"--robot", "heart", "--only", "liver"})).err,
              HasSubstr("heart, lung, skin, spine"));
  EXPECT_THAT(limber_program(words({"--robot", "heart", "--rigid", "liver"})).err,
              HasSubstr("--rigid liver: "));
  EXPECT_THAT(limber_program(words({"--robot", "heart", "--goal", "away"})).err, HasSubstr("front"));
  EXPECT_THAT(limber_program(words({"--robot", "spine"})).err, HasSubstr("there are: heart, lung"));
  EXPECT_THAT(limber_program(words({"--robot", "heart", "--up", "+z", "--front", "-z"})).err,
              HasSubstr("same axis"));
  EXPECT_FALSE(fs::exists(folder / "chest.toml"));
  ASSERT_EQ(limber_program(words()).code, exit_done);
  EXPECT_THAT(limber_program(words()).err, HasSubstr("is there already"));
  fs::create_directories(folder / "empty");
  const Result empty = limber_program({"scene", "new", "--from", (folder / "empty").string(), "-o",
                                       (folder / "a.toml").string(), "--robot", "heart"});
  EXPECT_EQ(empty.code, exit_bad_input);
  EXPECT_THAT(empty.err, HasSubstr("holds no model"));
}

}  // namespace
}  // namespace limber::app
