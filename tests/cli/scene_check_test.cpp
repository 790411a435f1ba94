// What is said of a scene before it is planned.
#include "render/png_file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

class SceneCheck : public Program {
 protected:
  static std::string with(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    LIMBER_CHECK(at != text.npos, from);
    return text.replace(at, from.size(), to);
  }
  // Touched at fine surfaces.
  static std::string fast() { return replaced("preset = \"paper\"", "preset = \"fast\""); }
};
using SceneCheck_slow = SceneCheck;  // stays out of the sanitizer runs

TEST_F(SceneCheck_slow, TheTimeStepOfCellsIsThatOfThePlan) {
  for (const std::string& text : {std::string(small_scene), fast()}) {
    const Json checked = limber_program({"scene", "check", scene(text), "--json"}).json();
    EXPECT_TRUE(checked.at("can_be_planned"));
    EXPECT_EQ(checked.at("bodies").size(), 2u);
    EXPECT_EQ(checked.at("overlaps").size(), 0u);
    const Json planned =
        limber_program({"plan", scene(text), "-o", out(), "--iterations", "0", "--json"}).json();
    EXPECT_EQ(checked.at("dt_s"), planned.at("dt_s"));
    fs::remove_all(out());
  }
}

TEST_F(SceneCheck, AllProblemsAreListedNotTheFirstAlone) {
  std::string text = with(small_scene, "poisson_ratio = 0.45", "poisson_ratio = 7");
  text = with(text, "radius_m = 0.3", "radius_n = 0.3");
  text = with(text, "seed = 1", "seed = \"one\"");
  text = with(text, "fixed = \"walls\"", "fixd = \"walls\"");
  const Result result = limber_program({"scene", "check", scene(text), "--json"});
  EXPECT_EQ(result.code, exit_bad_input);
  const Json json = result.json();
  EXPECT_FALSE(json.at("can_be_planned"));
  EXPECT_EQ(json.at("exit_code"), 2);
  EXPECT_EQ(json.at("error"), json.at("problems")[0]);
  std::string all;
  for (const Json& problem : json.at("problems")) all += problem.get<std::string>() + "\n";
  for (const char* named : {"poisson_ratio", "radius_n", "seed", "fixd"})
    EXPECT_NE(all.find(named), all.npos) << named << " is not in\n" << all;
  EXPECT_EQ(json.at("problems").size(), 4u) << all;
}

// Each is right by itself.
TEST_F(SceneCheck, ProblemsBetweenKeysAreListedTogether) {
  std::string text = with(small_scene, "position_m = [0.6, 1, 1.3]", "position_m = [0.6, 1, 1.9]");
  text = with(text, "position_m = [2, 1, 0.45]", "position_m = [2, 1, 0.4]");
  text = with(text, "max_force_n = 100", "max_force_n = 100\nguidance = 0.5");
  const Json json = limber_program({"scene", "check", scene(text), "--json"}).json();
  EXPECT_EQ(json.at("problems").size(), 3u) << json.at("problems").dump(2);
}

TEST_F(SceneCheck, ModelsThatAreMissingAreAllNamed) {
  std::string text =
      with(small_scene, "model = { box = { size_m = [0.6, 0.6, 0.6] } }\ncage = { cells = [2, 2, 2] }",
           "model = { file = \"nobody_a.obj\" }\ncage = { tets = 100 }");
  text = with(text, "model = { box = { size_m = [0.4, 2, 0.9] } }\ncage = { cells = [2, 4, 2] }",
              "model = { file = \"nobody_b.obj\" }\ncage = { tets = 100 }");
  const Json json = limber_program({"scene", "check", scene(text), "--json"}).json();
  ASSERT_EQ(json.at("problems").size(), 2u) << json.dump(2);
  EXPECT_NE(json.at("problems")[0].get<std::string>().find("nobody_a.obj"), std::string::npos);
  EXPECT_NE(json.at("problems")[1].get<std::string>().find("nobody_b.obj"), std::string::npos);
}

// The robot's box reaches from x − 0.3 to x + 0.3, the block begins at x = 1.8 and is 0.9 high.
TEST_F(SceneCheck_slow, OverlapsAndGapsAtTheStartAreThoseOfTheBoxes) {
  const auto placed = [&](double gap) {
    return with(fast(), "position_m = [0.6, 1, 1.3]", fmt::format("position_m = [{}, 1, 0.5]", 1.5 - gap));
  };
  const std::string left = "world.part_overlaps=false";
  const Json parted = limber_program({"scene", "check", scene(placed(-0.1)), "--json"}).json();
  EXPECT_EQ(parted.at("overlaps")[0].at("parted"), true);
  const Result deep = limber_program({"scene", "check", scene(placed(-0.1)), "--set", left, "--json"});
  EXPECT_EQ(deep.code, exit_bad_input);
  ASSERT_EQ(deep.json().at("overlaps").size(), 1u);
  const Json overlap = deep.json().at("overlaps")[0];
  EXPECT_NEAR(overlap.at("depth_m").get<double>(), 0.1, 0.001);
  EXPECT_NEAR(overlap.at("of_robot_size").get<double>(), 0.1 / 0.6, 0.002);
  EXPECT_EQ(overlap.at("parted"), false);
  EXPECT_EQ(limber_program({"plan", scene(placed(-0.1)), "--set", left, "-o", out()}).code, exit_bad_input);

  const Result near = limber_program({"scene", "check", scene(placed(0.001)), "--json"});
  EXPECT_EQ(near.code, exit_done) << near.out;
  ASSERT_EQ(near.json().at("gaps_below_offset").size(), 1u);
  EXPECT_NEAR(near.json().at("gaps_below_offset")[0].at("gap_m").get<double>(), 0.001, 1e-5);
  EXPECT_NEAR(near.json().at("contact_offset_m").get<double>(), 0.003, 1e-6);

  const Json apart = limber_program({"scene", "check", scene(placed(0.01)), "--json"}).json();
  EXPECT_EQ(apart.at("gaps_below_offset").size(), 0u);
}

TEST_F(SceneCheck_slow, OfARobotThatIsThereItSaysSo) {
  const std::string there =
      scene(with(small_scene, "center_of_mass_m = [3.2, 1, 1]", "center_of_mass_m = [0.7, 1, 1.3]"));
  for (const std::vector<std::string>& words : {std::vector<std::string>{"scene", "check", there, "--json"},
                                                {"scene", "check", there, "--json", "--work", out()}}) {
    const Json json = limber_program(words).json();
    EXPECT_TRUE(json.at("goal")[0].at("met"));
    EXPECT_NE(json.at("warnings").dump().find("in the goal at the start"), std::string::npos) << json.dump(2);
  }
  const Json away = limber_program({"scene", "check", scene(), "--json"}).json();
  EXPECT_FALSE(away.at("goal")[0].at("met"));
  EXPECT_EQ(away.at("warnings").size(), 0u) << away.dump(2);
}

// The block is 0.4 m thick and 0.9 m high.
TEST_F(SceneCheck, AGoalWithinARigidBodyIsTold) {
  const auto is_told = [&](const std::string& kind, const std::string& goal) {
    std::string text = with(small_scene, "center_of_mass_m = [3.2, 1, 1]\nradius_m = 0.3", goal);
    text = with(text, "kind = \"deformable\"\nmodel = { box = { size_m = [0.4, 2, 0.9] } }",
                "kind = \"" + kind + "\"\nmodel = { box = { size_m = [0.4, 2, 0.9] } }");
    if (kind == "rigid") text = with(text, "fixed = \"walls\"\n", "");
    const Json json = limber_program({"scene", "check", scene(text), "--json"}).json();
    return json.at("warnings").dump().find("the goal lies within block") != std::string::npos;
  };
  EXPECT_TRUE(is_told("rigid", "center_of_mass_m = [2, 1, 0.45]\nradius_m = 0.19"));
  EXPECT_FALSE(is_told("rigid", "center_of_mass_m = [2, 1, 0.45]\nradius_m = 0.21"));
  EXPECT_FALSE(is_told("rigid", "center_of_mass_m = [3.2, 1, 1]\nradius_m = 0.1"));
  EXPECT_FALSE(is_told("deformable", "center_of_mass_m = [2, 1, 0.45]\nradius_m = 0.19"));
}

// The robot is 0.6 m wide, the walls are at y = 0 and 2 and z = 2.
TEST_F(SceneCheck, AGoalThatOnlyAFlatRobotReachesIsTold) {
  const auto is_told = [&](const std::string& goal, const std::string& wall) {
    const std::string text = with(small_scene, "center_of_mass_m = [3.2, 1, 1]\nradius_m = 0.3", goal);
    const Json json = limber_program({"scene", "check", scene(text), "--json"}).json();
    return json.at("warnings").dump().find("from the wall " + wall) != std::string::npos;
  };
  EXPECT_TRUE(is_told("center_of_mass_m = [3.2, 1, 1.9]\nradius_m = 0.1", "z = 2"));
  EXPECT_TRUE(is_told("center_of_mass_m = [3.2, 0.05, 1]\nradius_m = 0.1", "y = 0"));
  EXPECT_FALSE(is_told("center_of_mass_m = [3.2, 1, 1.9]\nradius_m = 0.25", "z"));
  EXPECT_FALSE(is_told("center_of_mass_m = [3.2, 1, 1.69]\nradius_m = 0.01", "z"));
}

TEST_F(SceneCheck, WhatElseAGoalAsksForIsTold) {
  const auto goals = [&](const std::string& more) {
    const std::string text = with(small_scene, "radius_m = 0.3", "radius_m = 0.3\n" + more);
    return limber_program({"scene", "check", scene(text)}).out;
  };
  const std::string both = goals("above = \"block\"\nshape = { angle_deg = 9, turn_tolerance_deg = 5 }");
  EXPECT_NE(both.find("goal.shape, goal.above: not known before"), std::string::npos) << both;
  EXPECT_EQ(goals("").find("not known before bodies are prepared; --work DIR tells"), std::string::npos);
}

// The robot is 0.6 m wide and ends at x = 0.9: a cage may reach to what is near it, never farther than its
// size.
TEST_F(SceneCheck, ABoxBesideTheBodyThatItShouldHoldIsTold) {
  const auto told = [&](const char* key, double from) {
    return limber_program({"scene", "check",
                           scene(with(small_scene, "name = \"robot\"\n",
                                      fmt::format("name = \"robot\"\nfixed = [{{ box_m = [[{}, 0, 0], "
                                                  "[{}, 2, 2]] }}]\n",
                                                  from, from + 0.2))),
                           "--json"})
               .json()
               .at(key)
               .dump()
               .find("is beside the body") != std::string::npos;
  };
  EXPECT_TRUE(told("warnings", 1.2));
  EXPECT_FALSE(told("problems", 1.2));
  EXPECT_TRUE(told("problems", 2.5));
  EXPECT_FALSE(told("warnings", 2.5));
  EXPECT_FALSE(told("warnings", 0.8));
  EXPECT_FALSE(told("problems", 0.8));
}

TEST_F(SceneCheck_slow, InAWorkFolderItPreparesAndTries) {
  const Result result = limber_program({"scene", "check", scene(), "--work", out(), "--json"});
  ASSERT_EQ(result.code, exit_done) << result.err;
  EXPECT_GT(result.json().at("estimate").at("plan").at("tried_iterations").get<int>(), 0);
  EXPECT_GT(result.json().at("rigid_passage").at("widest_rigid_passage_m").get<double>(), 0.0);
  EXPECT_FALSE(fs::exists(fs::path(out()) / "plan.npz"));
  const std::string report = read_file(fs::path(out()) / "bodies" / "robot" / "report.json");
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
  EXPECT_EQ(read_file(fs::path(out()) / "bodies" / "robot" / "report.json"), report);  // it was up to date
}

TEST_F(SceneCheck, AStillNeedsNoPlan) {
  ASSERT_EQ(limber_program({"render", scene(), "--still", "-o", out("a.png"), "--size", "64x48"}).code,
            exit_done);
  ASSERT_EQ(limber_program({"scene", "check", scene(), "--still", out("b.png"), "--size", "64x48"}).code,
            exit_done);
  EXPECT_EQ(read_file(out("a.png")), read_file(out("b.png")));
  const auto png = render::inspect_png(out("a.png"));
  ASSERT_TRUE(png.has_value());
  EXPECT_EQ(png->width, 64);
  EXPECT_EQ(png->height, 48);
  // The robot's red and the block's blue are in it.
  const render::Image8 image = render::read_png(out("a.png"));
  int red = 0, blue = 0;
  for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3)
    red += image.rgb[i] > image.rgb[i + 2] + 60, blue += image.rgb[i + 2] > image.rgb[i] + 40;
  EXPECT_GT(red, 20);
  EXPECT_GT(blue, 20);
  const Result nobody =
      limber_program({"render", scene(), "--still", "-o", out("c.png"), "--camera", "nobody"});
  EXPECT_EQ(nobody.code, exit_bad_input);
  EXPECT_NE(nobody.err.find("there are: main"), std::string::npos) << nobody.err;
  EXPECT_EQ(limber_program({"render", scene(), "--still", "-o", out("c.jpg")}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"render", scene(), "--still", "--resume"}).code, exit_bad_input);
}

TEST_F(SceneCheck, InfoTellsASceneWithoutItsModels) {
  const std::string text =
      with(small_scene, "model = { box = { size_m = [0.4, 2, 0.9] } }\ncage = { cells = [2, 4, 2] }",
           "model = { file = \"nobody.obj\" }\ncage = { tets = 100 }");
  const Result result = limber_program({"info", scene(text), "--json"});
  ASSERT_EQ(result.code, exit_done) << result.err;
  EXPECT_EQ(result.json().at("bodies").size(), 2u);
  EXPECT_EQ(result.json().at("bodies")[1].at("tets_asked"), 100);
  EXPECT_EQ(limber_program({"info", "barriers1", "--json"}).json().at("name"), "barriers1");
  EXPECT_EQ(limber_program({"info", out("nowhere")}).code, exit_bad_input);
}

// Names of files are bytes; what is told of them is text.
TEST_F(SceneCheck_slow, AModelWhoseNameIsNoUtf8IsPrepared) {
  const std::string model = out("caf\xe9.obj");
  std::ofstream(model) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const Result prepared = limber_program({"prepare", model, "-o", out(), "--tets", "60", "--json"});
  EXPECT_EQ(prepared.code, exit_done) << prepared.err;
  EXPECT_NE(prepared.json().at("model").get<std::string>().find("caf\xef\xbf\xbd.obj"), std::string::npos);
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);
  const Result missing = limber_program({"info", out("\xff.obj"), "--json"});
  EXPECT_EQ(missing.code, exit_bad_input);
  EXPECT_EQ(missing.json().at("exit_code"), 2);
  const Result set = limber_program({"plan", scene(), "-o", out(), "--set", "description=\xe9"});
  EXPECT_EQ(set.code, exit_bad_input);
  EXPECT_NE(set.err.find("no UTF-8"), std::string::npos) << set.err;
}

// Bodies made apart, in any order, are those that a plan makes, and it takes them.
TEST_F(SceneCheck, BodiesArePreparedApart) {
  const auto prepare = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"scene", "prepare", scene(), "-o", out(), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return limber_program(words);
  };
  const Result other = prepare({"--body", "robto"});
  EXPECT_EQ(other.code, exit_bad_input);
  EXPECT_NE(other.err.find("did you mean robot?"), std::string::npos) << other.err;
  EXPECT_FALSE(fs::exists(out()));

  const Json last = prepare({"--body", "block"}).json();
  ASSERT_EQ(last.at("bodies").size(), 1u);
  EXPECT_FALSE(fs::exists(out() + "/bodies/robot"));
  const auto block = contents(out() + "/bodies/block");
  EXPECT_EQ(prepare({}).json().at("bodies").size(), 2u);
  EXPECT_EQ(contents(out() + "/bodies/block"), block);
  const auto apart = contents(out() + "/bodies");
  const Result planned = limber_program({"plan", scene(), "-o", out(), "--iterations", "1"});
  EXPECT_NE(planned.err.find("bodies/robot: up to date"), std::string::npos) << planned.err;
  EXPECT_EQ(contents(out() + "/bodies"), apart);
}

}  // namespace
}  // namespace limber::detail
