// limber scene new: from a folder of models to a scene that limber plans.
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "core/mesh_files.h"
#include "meshing/import.h"
#include "render/image_file.h"
#include "render/png_file.h"
#include "scenes/scene.h"
#include "tests/cli/program.h"
#include "tests/imaging/made_maps.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

using testing::HasSubstr;
using testing::Not;

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
  EXPECT_EQ(scene.cameras[0].subjects, std::vector<int>{scene.robot});
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

// Four cameras, names of all but the skin, which is opened; what moves is what the story says.
TEST_F(NewScene_slow, EachStoryIsAFilmOfFourCameras) {
  for (const char* story : {"away", "instrument", "endoscope", "balloon", "aside", "tour"}) {
    SCOPED_TRACE(story);
    const Result made = limber_program(words({"--robot", "heart", "--story", story}));
    ASSERT_EQ(made.code, exit_done) << made.err;
    const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
    const bool tour = story == std::string("tour"), instrument = story == std::string("instrument");
    EXPECT_EQ(scene.cameras.size(), 4u);
    EXPECT_EQ(scene.film.look, scenes::FilmLook::clinical);
    const bool endoscope = story == std::string("endoscope"), balloon = story == std::string("balloon");
    EXPECT_EQ(scene.film.labels.size(), instrument || endoscope || balloon ? 4u : 3u);
    ASSERT_EQ(scene.film.cuts.size(), 1u);
    EXPECT_EQ(scene.film.cuts[0].bodies, std::vector<int>{int(scene.bodies.size())});  // the skin
    EXPECT_EQ(scene.lacks.empty(), !tour);
    EXPECT_THAT(made.out, HasSubstr(tour ? "limber simulate" : "limber run"));
    EXPECT_EQ(scene.cameras[0].keyframes.size(), tour ? 5u : 0u);
    const scenes::BodySpec& robot = scene.bodies[std::size_t(scene.robot)];
    if (instrument) {
      EXPECT_EQ(robot.name, "instrument");
      // From before the heart, past the lung, to 2 mm before its front, 40 mm from its middle.
      const double left_m = (scene.goal.center_of_mass_m - Vec3(0, 0, 1)).norm();
      EXPECT_NEAR(left_m, 0.04 + 0.002 + 0.075, 0.02);
      EXPECT_GT((robot.pose.position_m - scene.goal.center_of_mass_m).norm(), 0.07);
    }
    EXPECT_EQ(scene.planner.lead, endoscope);
    EXPECT_EQ(scene.planner.max_pressure_pa > 0, balloon);
    EXPECT_EQ(scene.goal.volume, balloon ? 2 : 0);
    if (endoscope || balloon) {
      EXPECT_EQ(robot.name, story);
      // Of the one the tip is led to 2 mm before the heart, of the other the middle is half its length
      // farther out.
      const double left_m = (scene.goal.center_of_mass_m - Vec3(0, 0, 1)).norm(),
                   before_m = 0.002 + (balloon ? 0.05 : 0);
      EXPECT_GT(left_m, 0.04 + before_m - 1e-6);
      EXPECT_LT(left_m, 0.04 * std::sqrt(3.) + before_m + 1e-6);
    }
    if (story == std::string("aside")) {
      EXPECT_LT((scene.goal.center_of_mass_m - Vec3(0, 0, 1)).norm(), 0.09);
      EXPECT_GT((scene.goal.center_of_mass_m - Vec3(0, 0, 1)).norm(), scene.goal.radius_m + 0.03);
    }
    fs::remove(folder / "chest.toml");
  }
  EXPECT_THAT(limber_program(words({"--robot", "heart", "--story", "tour", "--goal", "left"})).err,
              HasSubstr("does not move"));
  EXPECT_THAT(limber_program(words({"--robot", "spine", "--story", "aside"})).err,
              HasSubstr("there are: heart, lung"));
}

TEST_F(NewScene_slow, AnEndoscopeAndABalloonGoAsTheyAre) {
  const std::string file = (folder / "chest.toml").string();
  for (const char* story : {"endoscope", "balloon"}) {
    ASSERT_EQ(limber_program(words({"--robot", "heart", "--story", story})).code, exit_done);
    const Result planned =
        limber_program({"plan", file, "--data", models().string(), "-o", out(story), "--json"});
    EXPECT_EQ(planned.code, exit_done) << planned.err;
    const Result verified = limber_program({"verify", out(story), "--json"});
    EXPECT_EQ(verified.code, exit_done) << verified.out;
    EXPECT_EQ(verified.out.find("blown up to 2 times its volume") != std::string::npos,
              story == std::string("balloon"));
    fs::remove(file);
  }
}

TEST_F(NewScene_slow, AnInstrumentAndATourGoAsTheyAre) {
  ASSERT_EQ(limber_program(words({"--robot", "heart", "--story", "instrument"})).code, exit_done);
  const std::string file = (folder / "chest.toml").string();
  const Result sheet = limber_program({"render", file, "--storyboard", "--data", models().string(), "-o",
                                       (folder / "sheet.png").string(), "--size", "160x90", "--json"});
  ASSERT_EQ(sheet.code, exit_done) << sheet.err;
  EXPECT_EQ(sheet.json().at("cameras").size(), 4u);
  EXPECT_EQ(sheet.json().at("moments"), Json({"start", "goal"}));
  const render::Image8 picture = render::read_png(folder / "sheet.png");
  EXPECT_GT(picture.width, 2 * 160);
  EXPECT_GT(picture.height, 4 * 90);
  const Result planned = limber_program({"plan", file, "--data", models().string(), "-o", out(), "--json"});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  fs::remove(file);
  ASSERT_EQ(limber_program(words({"--robot", "heart", "--story", "tour"})).code, exit_done);
  const Result simulated = limber_program(
      {"simulate", file, "--data", models().string(), "--duration", "0.1s", "-o", out("tour"), "-q"});
  EXPECT_EQ(simulated.code, exit_done) << simulated.err;
}

// Under gravity organs in fascia of 11 Hz sag by g/ω² = 2.05 mm and no farther, and the scene is planned; the
// lung that rests on nothing, and the liver that rests on the spine.
TEST_F(NewScene_slow, FasciaHoldsOrgansInTheirPlaces) {
  cube("liver", {0, 200, 1075}, 80);
  ASSERT_EQ(limber_program(words({"--robot", "heart", "--fascia", "11"})).code, exit_done);
  const std::string file = (folder / "chest.toml").string();
  const scenes::Scene scene = scenes::read_scene_file(file);
  EXPECT_EQ(scene.gravity_m_s2, Vec3(0, 0, -9.81));
  for (const scenes::BodySpec& body : scene.bodies)
    EXPECT_EQ(body.material.fascia_hz, body.name == "lung" || body.name == "liver" ? 11 : 0) << body.name;
  const Result simulated = limber_program(
      {"simulate", file, "--data", models().string(), "--duration", "2s", "-o", out("rest"), "-q"});
  ASSERT_EQ(simulated.code, exit_done) << simulated.err;
  const std::string csv = (folder / "rest.csv").string();
  ASSERT_EQ(limber_program({"verify", out("rest"), "--observables", csv, "-q"}).code, exit_done);
  std::istringstream lines(read_file(csv));
  const auto cells = [](const std::string& line) {
    std::vector<std::string> list;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) list.push_back(cell);
    return list;
  };
  std::string head, line, last;
  std::getline(lines, head);
  while (std::getline(lines, line)) last = line;
  std::map<std::string, double> at_the_end;
  const std::vector<std::string> names = cells(head), values = cells(last);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i].ends_with(".away_m")) at_the_end[names[i]] = std::stod(values.at(i));
  const double omega = 2 * std::numbers::pi * 11, sag_m = 9.81 / (omega * omega);
  EXPECT_NEAR(at_the_end.at("lung.away_m"), sag_m, 0.02 * sag_m);
  EXPECT_LT(at_the_end.at("liver.away_m"), 1.05 * sag_m);
  EXPECT_LT(at_the_end.at("heart.away_m"), 1e-6) << "nobody pushes it";
  const Result planned = limber_program({"plan", file, "--data", models().string(), "-o", out(), "--json"});
  EXPECT_EQ(planned.code, exit_done) << planned.err;
  // What a tour is about hangs as the others do, and what is promised is in shares of its size.
  fs::remove(file);
  ASSERT_EQ(limber_program(words({"--robot", "lung", "--fascia", "11", "--story", "tour"})).code, exit_done);
  const scenes::Scene tour = scenes::read_scene_file(file);
  EXPECT_EQ(tour.bodies[std::size_t(tour.robot)].name, "lung");
  EXPECT_EQ(tour.bodies[std::size_t(tour.robot)].material.fascia_hz, 11);
}

// Labels of a scan are apart by their gap, a vein in its tunnel through the liver, too: all stand at their
// true size, where they are.
TEST_F(NewScene_slow, PartsOfAScanStandWhereTheyAre) {
  const std::string tool = std::string(limber_source_dir) + "/tools/make_torso",
                    scan = (folder / "torso.nii.gz").string();
  ASSERT_EQ(std::system(("/usr/bin/python3 '" + tool + "' '" + scan + "' --voxel 4 > /dev/null").c_str()), 0);
  EXPECT_EQ(read_json(folder / "torso.json").size(), 81u);
  const Result made =
      limber_program({"scene", "new", "--from", scan, "--labels", (folder / "torso.json").string(), "--robot",
                      "heart", "--only", "heart,liver,portal_vein,gallbladder,stomach,aorta", "-o",
                      (folder / "belly.toml").string(), "--json"});
  ASSERT_EQ(made.code, exit_done) << made.err;
  EXPECT_EQ(made.json().at("scale"), 1);
  EXPECT_EQ(made.json().at("bodies"), 6);
  EXPECT_EQ(made.json().at("moved_m"), Json::object());
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

// Boxes of voxels of 4 mm: a heart, a lung beside it, two vertebrae behind, two ribs before, and a crumb.
class SceneOfAScan : public NewScene {
 protected:
  struct Block {
    int label;
    Vec3 center_m, edges_m;
  };
  const std::vector<Block> blocks{{51, {0, 0, 1}, {0.08, 0.08, 0.08}},
                                  {9, {0.1, 0, 1}, {0.08, 0.08, 0.08}},
                                  {30, {0, 0.1, 0.96}, {0.04, 0.04, 0.04}},
                                  {31, {0, 0.1, 1.04}, {0.04, 0.04, 0.04}},
                                  {92, {0, -0.1, 0.96}, {0.2, 0.012, 0.012}},
                                  {93, {0, -0.1, 1.04}, {0.2, 0.012, 0.012}},
                                  {77, {0.002, 0.002, 1.142}, {0.004, 0.004, 0.004}}};
  void SetUp() override {
    imaging::LabelMap map = imaging::made_map(
        {72, 64, 80}, 0.004 * Eigen::Matrix3d::Identity(), Vec3(-0.126, -0.126, 0.85), [&](const Vec3& p) {
          for (std::size_t b = 0; b < blocks.size(); ++b)
            if (((p - blocks[b].center_m).cwiseAbs() - 0.5 * blocks[b].edges_m).maxCoeff() < 0)
              return int(b) + 1;
          return 0;
        });
    ASSERT_EQ(map.labels.size(), blocks.size() + 1);
    for (std::size_t b = 0; b < blocks.size(); ++b) map.labels[b + 1] = blocks[b].label;
    imaging::write_nifti(scan(), map);
    std::ofstream(names()) << R"({"labels": {"background": 0, "heart": 51, "lung left": 9, "vertebrae_L1": 30,
      "vertebrae_L2": 31, "rib_left_1": 92, "rib_left_2": 93, "cyst": 77, "spleen": 200}})";
  }
  fs::path scan() const { return folder / "scan.nii.gz"; }
  fs::path names() const { return folder / "names.json"; }
  fs::path made() const { return folder / "chest_models"; }
  std::vector<std::string> words(std::vector<std::string> more = {"--robot", "heart"}) const {
    std::vector<std::string> all{"scene",    "new",
                                 "--from",   scan().string(),
                                 "--labels", names().string(),
                                 "-o",       (folder / "chest.toml").string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  void refused(const std::vector<std::string>& all, const char* why) const {
    const Result result = limber_program(all);
    EXPECT_EQ(result.code, exit_bad_input) << why;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(fs::exists(made()));
    EXPECT_FALSE(fs::exists(folder / "chest.toml"));
  }
};
using SceneOfAScan_slow = SceneOfAScan;

TEST_F(SceneOfAScan, PartsAreInTheirPlacesAndRoles) {
  const Result result = limber_program(words());
  ASSERT_EQ(result.code, exit_done) << result.err;
  for (const char* said :
       {"skeleton is 2 labels in one: vertebrae_L1, vertebrae_L2",
        "ribcage is 2 labels in one: rib_left_1, rib_left_2", "lung left is called lung_left",
        "cyst: left out 1 small pieces, 1 voxels", "1 names of", "next: limber run"})
    EXPECT_THAT(result.out, HasSubstr(said));
  const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
  std::map<std::string, const scenes::BodySpec*> bodies;
  for (const scenes::BodySpec& body : scene.bodies) bodies[body.name] = &body;
  ASSERT_EQ(bodies.size(), 3u);
  EXPECT_EQ(scene.bodies[std::size_t(scene.robot)].name, "heart");
  EXPECT_EQ(bodies.at("skeleton")->kind, scenes::Kind::rigid);
  ASSERT_EQ(scene.scenery.size(), 1u);
  EXPECT_EQ(scene.scenery[0].name, "ribcage");
  // x to the left and y to the back, of the scan, are y and −x here; they are apart, and stay.
  EXPECT_LT((bodies.at("heart")->pose.position_m - Vec3(0, 0, 1)).norm(), 1e-4);
  EXPECT_LT((bodies.at("lung_left")->pose.position_m - Vec3(0, 0.1, 1)).norm(), 1e-4);
  EXPECT_LT((bodies.at("skeleton")->pose.position_m - Vec3(-0.1, 0, 1)).norm(), 1e-4);
  EXPECT_EQ(bodies.at("heart")->material.density_kg_m3, 1050);
  EXPECT_EQ(bodies.at("lung_left")->material.density_kg_m3, 400);
  const SurfaceMesh heart = read_ply(made() / "heart.ply");
  EXPECT_NEAR(volume(heart) * 1e-9, 0.08 * 0.08 * 0.08, 0.02 * 0.08 * 0.08 * 0.08);
}

TEST_F(SceneOfAScan, ChosenPartsAreMadeAlone) {
  ASSERT_EQ(limber_program(words({"--robot", "heart", "--only", "heart,30,31"})).code, exit_done);
  const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
  std::vector<std::string> all;
  for (const scenes::BodySpec& body : scene.bodies) all.push_back(body.name);
  EXPECT_THAT(all, testing::UnorderedElementsAre("heart", "vertebrae_L1", "vertebrae_L2"));
}

// A wider gap is seen between what touches; more of a crumb is left where crumbs may be small.
TEST_F(SceneOfAScan_slow, SurfacesAreMadeAsAskedFor) {
  ASSERT_EQ(limber_program(words({"--robot", "heart", "--least-island", "1"})).code, exit_done);
  EXPECT_TRUE(fs::exists(made() / "cyst.ply"));
  const double smooth = volume(read_ply(made() / "heart.ply"));
  fs::remove_all(made()), fs::remove(folder / "chest.toml");
  ASSERT_EQ(limber_program(words({"--robot", "heart", "--label-smoothing", "0"})).code, exit_done);
  EXPECT_FALSE(fs::exists(made() / "cyst.ply"));
  EXPECT_NEAR(volume(read_ply(made() / "heart.ply")), 80 * 80 * 80, 1);  // its voxels
  EXPECT_GT(std::abs(smooth - 80 * 80 * 80), 100);
  EXPECT_EQ(limber_program(words({"--robot", "heart", "--label-gap", "0.7"})).code, exit_bad_input);
}

TEST_F(SceneOfAScan_slow, ItIsPlannedWithoutAnEdit) {
  ASSERT_EQ(limber_program(words()).code, exit_done);
  const Result planned = limber_program({"plan", (folder / "chest.toml").string(), "-o", out(), "--json"});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  EXPECT_TRUE(planned.json().at("solved"));
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);
}

TEST_F(SceneOfAScan, WhatDoesNotFitIsRefusedAndNothingStays) {
  refused(words({"--robot", "spleen"}), "there are: heart, lung_left");
  refused(words({"--robot", "heart", "--only", "heart,8"}), "has no label 8; it has 9 (lung left)");
  refused(words({"--robot", "heart", "--scale", "1"}), "leave --scale, --up and --front out");
  const auto with_names = [&](const char* text, const char* why) {
    std::ofstream(names()) << text;
    refused(words(), why);
  };
  with_names("[1, 2]", "is no object");
  with_names(R"({"labels": 3})", "\"labels\" is no object");
  with_names(R"({"heart": "yes"})", "neither a label's number with a name");
  with_names(R"({"heart": 51, "51": "lung"})", "label 51 has two names");
  with_names(R"({"heart": 51, "Heart": 9})", "would both be called");
  with_names(R"({"heart": 4})", "names none of the scan's labels");
  with_names(R"({"51": ""})", "has an empty name");
  std::ofstream(folder / "text.nii") << "no scan";
  refused({"scene", "new", "--from", (folder / "text.nii").string(), "-o", (folder / "chest.toml").string(),
           "--robot", "heart"},
          "neither a folder of models nor a label map");
  NewScene::SetUp();
  refused({"scene", "new", "--from", models().string(), "--labels", names().string(), "-o",
           (folder / "chest.toml").string(), "--robot", "heart"},
          "is a folder; leave it out");
  fs::create_directories(made());
  EXPECT_THAT(limber_program(words()).err, HasSubstr("is there already"));
}

// Files as BodyParts3D has them, of made cubes: a heart of two elements, a kidney, a bone.
class SceneOfAnAtlas : public NewScene {
 protected:
  void SetUp() override {
    fs::create_directories(models());
    cube("FJ1", {0, 0, 980}, 40), cube("FJ2", {0, 0, 1020}, 40);
    cube("FJ3", {150, -100, 1000}, 80), cube("FJ4M", {0, 200, 1000}, 60);
    fs::create_directories(atlas() / "isa_BP3D_4.0_obj_99");
    for (const auto& entry : fs::directory_iterator(models()))
      fs::rename(entry.path(), atlas() / "isa_BP3D_4.0_obj_99" / entry.path().filename());
    table("isa_element_parts.txt",
          "FMA7088\theart\tFJ1\r\nFMA7088\theart\tFJ2\r\nFMA7205\tleft kidney\tFJ3\r\n"
          "FMA13322\tlumbar vertebra\tFJ4M\r\nFMA1\tlost\tFJ99\r\nFMA2\tlost\tFJ98\r\n");
  }
  fs::path atlas() const { return folder / "atlas"; }
  void table(const char* name, const std::string& lines) const {
    std::ofstream(atlas() / name) << "concept id\tname\telement file id\r\n" << lines;
  }
  Result made(const std::vector<std::string>& more) const {
    std::vector<std::string> all{"scene",          "new", "--from",
                                 atlas().string(), "-o",  (folder / "chest.toml").string()};
    all.insert(all.end(), more.begin(), more.end());
    return limber_program(all);
  }
};

TEST_F(SceneOfAnAtlas, PartsAreFoundByNameAndId) {
  const Result result = made({"--robot", "heart", "--only", "Heart,left_kidney,fma13322"});
  ASSERT_EQ(result.code, exit_done) << result.err;
  EXPECT_THAT(result.out, HasSubstr("heart is 2 elements in one; FJ1, FJ2 meet and are united"));
  const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
  std::map<std::string, Vec3> at;
  for (const scenes::BodySpec& body : scene.bodies) at[body.name] = body.pose.position_m;
  ASSERT_EQ(at.size(), 3u);
  EXPECT_LT((at.at("heart") - Vec3(0, 0, 1)).norm(), 1e-9);
  EXPECT_LT((at.at("left_kidney") - Vec3(0.1, 0.15, 1)).norm(), 1e-9);
  EXPECT_LT((at.at("lumbar_vertebra") - Vec3(-0.2, 0, 1)).norm(), 1e-9);
  EXPECT_EQ(scene.bodies[2].kind, scenes::Kind::rigid);
}

// Cubes of 40 mm, 30 above one another: by inclusion and exclusion. FJ7 is off, FJ8 open and in the way.
TEST_F(SceneOfAnAtlas, ElementsOfAPartAreUnited) {
  cube("FJ5", {0, 0, 985}, 40), cube("FJ6", {3, 5, 1015}, 40), cube("FJ7", {0, 0, 1100}, 40);
  cube("FJ8", {0, 0, 1005}, 10);
  SurfaceMesh open = meshing::import_model(models() / "FJ8.obj").surface;
  open.triangles.conservativeResize(11, 3);
  write_obj(models() / "FJ8.obj", open);
  for (const char* element : {"FJ5", "FJ6", "FJ7", "FJ8"})
    fs::rename(models() / (std::string(element) + ".obj"), atlas() / (std::string(element) + ".obj"));
  table("partof_element_parts.txt",
        "FMA3\tstomach\tFJ5\nFMA3\tstomach\tFJ6\nFMA3\tstomach\tFJ7\n"
        "FMA4\tspleen\tFJ8\nFMA4\tspleen\tFJ1\n");
  const Result result = made({"--robot", "stomach", "--only", "stomach,left_kidney"});
  ASSERT_EQ(result.code, exit_done) << result.err;
  EXPECT_THAT(result.out, HasSubstr("stomach is 3 elements in one; FJ5, FJ6 meet and are united"));
  EXPECT_THAT(result.out, Not(HasSubstr("not united")));
  const meshing::ImportedModel model = meshing::import_model(folder / "chest_models" / "stomach.ply");
  EXPECT_NEAR(volume(model.surface), 3 * 40 * 40 * 40 - 37 * 35 * 10, 1e-6);
  EXPECT_TRUE(model.left.closed());
  EXPECT_EQ(model.left.self_intersecting_pairs.count, 0);
  EXPECT_TRUE(model.left.all_self_intersections_counted);

  fs::remove(folder / "chest.toml"), fs::remove_all(folder / "chest_models");
  const Result beside = made({"--robot", "spleen", "--only", "spleen,left_kidney"});
  ASSERT_EQ(beside.code, exit_done) << beside.err;
  EXPECT_THAT(beside.out,
              HasSubstr("spleen: FJ8 is not united with what it meets, and walls may be left within: "
                        "it is open"));
}

TEST_F(SceneOfAnAtlas, BonesAreOneBody) {
  cube("FJ5", {0, 200, 1100}, 60);
  fs::rename(models() / "FJ5.obj", atlas() / "FJ5.obj");
  table("partof_element_parts.txt", "FMA3\tthoracic vertebra\tFJ5\n");
  const Result result = made({"--robot", "heart", "--only", "heart,left_kidney,FMA13322,FMA3"});
  ASSERT_EQ(result.code, exit_done) << result.err;
  EXPECT_THAT(result.out, HasSubstr("skeleton is 2 parts in one: lumbar vertebra, thoracic vertebra"));
  const scenes::Scene scene = scenes::read_scene_file(folder / "chest.toml");
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.bodies[2].name, "skeleton");
  EXPECT_EQ(scene.bodies[2].kind, scenes::Kind::rigid);
  EXPECT_LT((scene.bodies[2].pose.position_m - Vec3(-0.2, 0, 1.05)).norm(), 1e-9);
}

TEST_F(SceneOfAnAtlas, WhatDoesNotFitIsRefusedAndNothingStays) {
  const auto refused = [&](const std::vector<std::string>& more, const char* why) {
    const Result result = made(more);
    EXPECT_EQ(result.code, exit_bad_input) << why;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(fs::exists(folder / "chest.toml"));
    EXPECT_FALSE(fs::exists(folder / "chest_models"));
  };
  refused({"--robot", "heart"}, "choose some with --only");
  refused({"--robot", "heart", "--only", "kidney"}, "did you mean left kidney (FMA7205)?");
  refused({"--robot", "heart", "--only", "lost"}, "are both called lost");
  refused({"--robot", "heart", "--only", "FMA1"}, "1 of them are not here: FJ99");
  table("partof_element_parts.txt", "FMA9\tchest\tFJ1\n");
  refused({"--robot", "heart", "--only", "heart,chest"}, "FJ1 is a part of heart and of chest");
  table("partof_element_parts.txt", "FMA9\tchest\n");
  refused({"--robot", "heart", "--only", "heart"}, "partof_element_parts.txt: line 2: ");
  table("partof_element_parts.txt", "FMA9\tchest\t../../etc/passwd\n");
  refused({"--robot", "heart", "--only", "heart"}, "is no element's id");
}

}  // namespace
}  // namespace limber::detail
