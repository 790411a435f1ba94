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
    const auto cube = [&](const char* name, const Vec3& center_mm, double edge_mm) {
      SurfaceMesh mesh{Points(8, 3), Triangles(12, 3)};
      for (int i = 0; i < 8; ++i)
        mesh.positions.row(i) =
            (center_mm + edge_mm * Vec3((i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2) - 0.5)).transpose();
      mesh.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6,
          2, 1, 3, 7, 1, 7, 5;
      write_obj(models() / (std::string(name) + ".obj"), mesh);
    };
    cube("heart", {0, 0, 1000}, 80);
    cube("lung", {150, -100, 1000}, 80);
    cube("spine", {0, 200, 1000}, 60);
    cube("skin", {0, 0, 1000}, 900);
  }
  fs::path models() const { return folder / "models"; }
  std::vector<std::string> words(std::vector<std::string> more = {"--robot", "heart"}) const {
    std::vector<std::string> all{"scene",           "new", "--from",
                                 models().string(), "-o",  (folder / "chest.toml").string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

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
    EXPECT_EQ(std::get<scenes::FileModel>(body.model).scale, 0.0008);
    if (body.name == "lung") {  // −y is our x
      EXPECT_LT((body.pose.position_m - Vec3(0.1, 0.15, 1)).norm(), 1e-12);
    }
  }
  EXPECT_EQ(scene.scenery[0].name, "skin");
  EXPECT_EQ(std::get<scenes::FileModel>(scene.scenery[0].model).scale, 0.001);
  EXPECT_LT(scene.scenery[0].opacity, 0.5);
  // One and a half lengths of the heart, 64 mm then, to the front.
  EXPECT_LT((scene.goal.center_of_mass_m - Vec3(0.096, 0, 1)).norm(), 1e-12);
}

TEST_F(NewScene, IsPlannedAsItIs) {
  ASSERT_EQ(limber_program(words()).code, exit_done);
  const Result planned = limber_program(
      {"plan", (folder / "chest.toml").string(), "--data", models().string(), "-o", out(), "--json"});
  EXPECT_EQ(planned.code, exit_done) << planned.err;
  EXPECT_EQ(planned.json().at("solved"), true);
}

TEST_F(NewScene, WhatIsNotThereIsRefusedWithWhatIs) {
  EXPECT_THAT(limber_program(words({"--robot", "liver"})).err, HasSubstr("there are: heart, lung"));
  EXPECT_THAT(limber_program(words({"--robot", "heart", "--only", "liver"})).err,
              HasSubstr("heart, lung, skin, spine"));
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
