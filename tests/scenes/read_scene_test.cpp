#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "core/error.h"
#include "core/random.h"
#include "scenes/detail/schema.h"
#include "scenes/library.h"
#include "scenes/models.h"
#include "scenes/scene.h"
#include "tests/places.h"

namespace limber::scenes {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::string good = R"(name = "good"
[world]
bounds_m = [[0, 0, 0], [10, 3, 3]]
[[bodies]]
name = "robot"
role = "robot"
model = { box = { size_m = [1, 1, 1], bevel_m = 0.1 } }
cage = { cells = [3, 3, 3] }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [1, 1.5, 1.5] }
[[bodies]]
name = "gate"
role = "obstacle"
model = { plate = { size_m = [0.4, 3, 3], hole = { size_m = 1.0 } } }
cage = { tets = 200 }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [3, 1.5, 1.5] }
fixed = ["walls", { box_m = [[2, 0, 0], [4, 1, 1]] }]
[goal]
center_of_mass_m = [9, 1.5, 1.5]
radius_m = 0.25
[planner]
preset = "paper"
max_force_n = 500
[camera]
keyframes = [{ at = 0, eye_m = [0, -9, 1], target_m = [0, 0, 1] }, { at = 1, eye_m = [9, -9, 1], target_m = [9, 0, 1] }]
[[cameras]]
name = "side"
follow = "gate"
keyframes = [{ at = 0, eye_m = [0, -7, 1], target_m = [0, 0, 1] }]
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  LIMBER_CHECK(at != text.npos, from);
  return text.replace(at, from.size(), to);
}

std::string complaint(const std::string& text, const std::vector<std::string>& sets = {}) {
  try {
    read_scene(text, "s.toml", sets);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no complaint";
}

// "s.toml:LINE:COLUMN: " of the place where `what` starts in `text`.
std::string place(const std::string& text, const std::string& what) {
  const auto at = text.find(what);
  LIMBER_CHECK(at != text.npos, what);
  const auto line_start = text.rfind('\n', at) + 1;
  return fmt::format("s.toml:{}:{}: ", std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n') + 1,
                     at - line_start + 1);
}

TEST(ReadScene, ReadsWhatIsWritten) {
  const Scene s = read_scene(good, "s.toml");
  EXPECT_EQ(s.name, "good");
  EXPECT_EQ(s.bounds_m.upper, Vec3(10, 3, 3));
  ASSERT_EQ(s.bodies.size(), 2U);
  EXPECT_EQ(s.robot, 0);
  EXPECT_EQ(std::get<BoxModel>(s.bodies[0].model).bevel_m, 0.1);
  EXPECT_EQ(std::get<BoxModel>(s.bodies[0].model).triangle_m, 1.0 / 32);
  EXPECT_EQ(s.bodies[0].cage.cells, Eigen::Vector3i(3, 3, 3));
  EXPECT_EQ(s.bodies[0].material.youngs_modulus_pa, 5000);
  EXPECT_EQ(s.bodies[0].material.poisson_ratio, 0.45);
  EXPECT_TRUE(s.bodies[1].fixed.walls);
  ASSERT_EQ(s.bodies[1].fixed.boxes_m.size(), 1U);
  EXPECT_EQ(s.bodies[1].fixed.boxes_m[0].upper, Vec3(4, 1, 1));
  EXPECT_EQ(s.goal.center_of_mass_m, Vec3(9, 1.5, 1.5));
  EXPECT_EQ(s.planner.max_force_n, 500);
  EXPECT_EQ(s.cameras[0].keyframes[1].eye_m, Vec3(9, -9, 1));
  EXPECT_EQ(s.text, good);
}

// Edits may say what the text says, or what is so anyway; what they change counts, wherever it stands.
TEST(ReadScene, ScenesSayTheSameByTheirValues) {
  const Scene scene = read_scene(good, "s.toml");
  const auto edited = [](const char* set) { return read_scene(good, "t.toml", {set}); };
  EXPECT_TRUE(say_the_same(scene, edited("planner.max_force_n=500")));
  EXPECT_TRUE(say_the_same(scene, edited("planner.max_force_n=500.0")));
  EXPECT_TRUE(say_the_same(edited("planner.seed=1"), scene));  // a default
  EXPECT_TRUE(say_the_same(scene, read_scene("# more words\n" + std::string(good), "s.toml")));
  EXPECT_FALSE(say_the_same(scene, edited("planner.max_force_n=501")));
  EXPECT_FALSE(say_the_same(scene, edited("goal.radius_m=0.1")));
  EXPECT_FALSE(say_the_same(scene, edited("world.walls=false")));
  EXPECT_FALSE(say_the_same(scene, edited("bodies.robot.friction=0.25")));
  EXPECT_FALSE(say_the_same(scene, edited("film.caption=another")));
}

TEST(ReadScene, ReadsPartsAndRigidRobots) {
  const Scene s = read_scene(replaced(good, "role = \"obstacle\"\n",
                                      "role = \"obstacle\"\nparts = [{ shell = 3, youngs_modulus_pa = 9e3 }, "
                                      "{ box_m = [[2, 0, 0], [4, 1, 1]], "
                                      "density_kg_m3 = 50 }]\n"),
                             "s.toml",
                             {"bodies.gate.parts.1.density_kg_m3=70", "bodies.robot.kind=rigid",
                              "bodies.robot.material={ density_kg_m3 = 300 }"});
  ASSERT_EQ(s.bodies[1].parts.size(), 2U);
  const PartSpec &shell = s.bodies[1].parts[0], &box = s.bodies[1].parts[1];
  EXPECT_EQ(shell.shell, 3);
  EXPECT_EQ(shell.youngs_modulus_pa, 9e3);
  EXPECT_FALSE(shell.density_kg_m3 || box.shell || box.youngs_modulus_pa);
  EXPECT_EQ(box.box_m.upper, Vec3(4, 1, 1));
  EXPECT_EQ(box.density_kg_m3, 70);
  EXPECT_EQ(s.bodies[0].kind, Kind::rigid);
  EXPECT_EQ(s.bodies[0].material.density_kg_m3, 300);
}

TEST(ReadScene, ReadsHowSurfacesFollowTheirCages) {
  const Scene s = read_scene(
      replaced(good, "role = \"obstacle\"\n", "role = \"obstacle\"\ndeformation = \"phong\"\n"), "s.toml");
  EXPECT_EQ(s.bodies[0].deformation, Deformation::linear);  // the paper's
  EXPECT_EQ(s.bodies[1].deformation, Deformation::phong);
  const Scene fast =
      read_scene(replaced(good, "preset = \"paper\"\n", ""), "s.toml", {"bodies.gate.kind=rigid"});
  EXPECT_EQ(fast.planner.preset, "fast");
  EXPECT_EQ(fast.bodies[0].deformation, Deformation::phong);
  EXPECT_EQ(fast.bodies[0].contact, Contact::surface);
  EXPECT_EQ(fast.bodies[1].deformation, Deformation::linear);
  EXPECT_EQ(read_scene(s.text, "s.toml", {"bodies.gate.deformation=linear"}).bodies[1].deformation,
            Deformation::linear);
  EXPECT_THAT(complaint(good, {"bodies.gate.deformation=cubic"}), HasSubstr("\"linear\" or \"phong\""));
}

TEST(ReadScene, SceneryIsSeenAndNoBody) {
  const Scene s =
      read_scene(good +
                     "[[bodies]]\nname = \"skin\"\nrole = \"scenery\"\nopacity = 0.3\n"
                     "model = { sphere = { diameter_m = 20 } }\npose = { position_m = [5, 1, 1] }\n",
                 "s.toml", {"bodies.skin.color=#ff0000"});
  ASSERT_EQ(s.scenery.size(), 1U);
  EXPECT_EQ(s.scenery[0].name, "skin");
  EXPECT_EQ(s.scenery[0].opacity, 0.3);
  EXPECT_EQ(s.scenery[0].color_srgb, Vec3(1, 0, 0));
  EXPECT_EQ(s.bodies.size(), 2U);
  EXPECT_THAT(complaint(good, {"goal.above=skin"}), HasSubstr("than the robot: gate"));
}

TEST(ReadScene, CamerasAreMainAndThoseNamed) {
  const Scene s = read_scene(good, "s.toml", {"cameras.side.turn_deg=90", "camera.fov_deg=20"});
  ASSERT_EQ(s.cameras.size(), 2U);
  EXPECT_EQ(s.cameras[0].name, "main");
  EXPECT_EQ(s.cameras[0].fov_deg, 20);
  EXPECT_EQ(s.cameras[0].follow, -1);
  EXPECT_EQ(s.cameras[1].name, "side");
  EXPECT_EQ(s.cameras[1].follow, 1);
  EXPECT_EQ(s.cameras[1].turn_deg, 90);
}

TEST(ReadScene, PresetDecidesOnlyWhatIsNotWritten) {
  EXPECT_EQ(read_scene(good, "").planner.max_duration_s, 1);
  EXPECT_EQ(read_scene(good, "", {"planner.preset=fast"}).planner.max_duration_s, 3);
  EXPECT_EQ(read_scene(good, "", {"planner.preset=fast"}).planner.min_force_share, 0.8);
  EXPECT_EQ(
      read_scene(good, "", {"planner.preset=fast", "planner.duration_s=[0.1, 2]"}).planner.max_duration_s, 2);
}

// Replacing one text in the good scene by another brings a complaint at the place where `at` stands, with
// these words.
struct Slip {
  const char *from, *to, *at, *words;
};

TEST(ReadScene, ComplainsWithLineAndColumn) {
  constexpr const char* blocks_robot = "model = { box = { size_m = [1, 1, 1], bevel_m = 0.1 } }";
  const Slip slips[] = {
      {"radius_m = 0.25", "radius = 0.25", "radius = 0.25", "did you mean \"radius_m\"?"},
      {"max_force_n", "max_force",
       "max_force =", "unknown key \"max_force\" in planner; did you mean \"max_force_n\"?"},
      {"role = \"robot\"\n", "role = \"robot\"\nfriction = 1\n", "friction",
       "friction belongs into bodies[].material"},
      {"[goal]", "[goals]", "goals]", "did you mean \"goal\"?"},
      {"radius_m = 0.25", "radius_m = \"0.25\"", "\"0.25\"",
       "goal.radius_m must be a number > 0, not a text; write for example radius_m = 1.0"},
      {"name = \"gate\"", "name = 3", "3\nrole", "must be a name, not a whole number"},
      {"[1, 1.5, 1.5]", "[1, true, 1.5]", "true",
       "bodies.robot.pose.position_m must be a list of 3 numbers; its element [1] is true or false"},
      {"[1, 1.5, 1.5]", "[1, 1.5]", "[1, 1.5]", "has 2 elements; it must be a list of 3 numbers"},
      {"pose = { position_m = [1, 1.5, 1.5] }", "pose = 1", "1\n[[bodies]]\nname = \"gate",
       "must be a table"},
      {"density_kg_m3 = 100", "density_kg_m3 = -1", "-1 }",
       "is -1, out of its range; it must be ≥ 1e-06 and ≤ 100000"},
      {"density_kg_m3 = 100", "density_kg_m3 = nan", "nan", "write a finite number"},
      {"density_kg_m3 = 100", "density_kg_m3 = inf", "inf", "write a finite number"},
      {"density_kg_m3 = 100", "density_kg_m3 = 100, poisson_ratio = 0.5", "0.5 }", "must be ≥ 0 and ≤ 0.495"},
      {"cells = [3, 3, 3]", "cells = [3, 3.5, 3]", "3.5", "must be a whole number"},
      {"cells = [3, 3, 3]", "cells = [3, 3, 3], tets = 90", "{ cells",
       "more than one of tets, cells and cell_m"},
      {"cage = { cells = [3, 3, 3] }", "cage = {}", "{}", "none of tets, cells and cell_m"},
      {"cells = [3, 3, 3]", "cells = [200, 200, 200]", "[200", "make 40000000 tets"},
      {"size_m = [1, 1, 1], bevel_m = 0.1", "size_m = [1, 1e-9, 1e-9], triangle_m = 1e-8", "1e-8",
       "triangles"},
      {"tets = 200", "cells = [1, 1, 1]", "[1, 1, 1] }\nmaterial", "needs a box"},
      {"cells = [3, 3, 3]", "cells = [3, 3, 3], mode = \"paper\"", "\"paper\"", "leave mode out"},
      {"cells = [3, 3, 3]", "cells = [3, 3, 3], mode = \"lattice\"", "\"lattice\"", "no complaint"},
      {"size_m = [1, 1, 1]", "size_m = [1, 0, 1]", "0, 1], bevel", "bodies.robot.model.box.size_m[1] is 0"},
      {"bevel_m = 0.1", "bevel_m = 0.6", "0.6", "it must be ≤ 0.5"},
      {"bevel_m = 0.1", "triangle_m = 1e-5", "1e-5", "triangles"},
      {"size_m = 1.0", "size_m = 3.5", "3.5", "does not fit"},
      {"{ box = { size_m = [1, 1, 1], bevel_m = 0.1 } }", "{}", "{}",
       "none of file, made, box, plate, blocks, sphere, tube"},
      {", bevel_m = 0.1 } }", " }, sphere = { diameter_m = 1 } }", "{ box", "more than one of"},
      {", bevel_m = 0.1 } }", " }, scale = 2 }", "2 }\ncage", "goes with file only"},
      {"{ box = { size_m = [1, 1, 1], bevel_m = 0.1 } }", "{ file = \"a\", up = \"+x\" }", "\"+x\"",
       "same axis"},
      {"{ box = { size_m = [1, 1, 1], bevel_m = 0.1 } }", "{ file = \"a\", scale = 1, height_m = 1 }",
       "1, height", "both scale and height_m"},
      {blocks_robot, "model = { blocks = { solids = [[[0, 0, 0], [1, 1, 1]], [[2, 0, 0], [3, 1, 1]]] } }",
       "{ solids", "the solids do not hang together by faces"},
      {blocks_robot, "model = { blocks = { solids = [[[0, 0, 0], [1, 1, 1]], [[1, 1, 0], [2, 2, 1]]] } }",
       "{ solids", "the solids do not hang together by faces"},
      {blocks_robot,
       "model = { blocks = { solids = [[[0, 0, 0], [2, 2, 1]]], holes = [[[0, 0, 0], [1, 1, 1]], [[1, 1, 0], "
       "[2, "
       "2, 1]]] } }",
       "{ solids", "the solids do not hang together by faces"},
      {blocks_robot,
       "model = { blocks = { solids = [[[0, 0, 0], [3, 3, 1]]], holes = [[[1, 1, 0], [2, 2, 1]], [[2, 2, 0], "
       "[3, "
       "3, 1]]] } }",
       "{ solids", "at (2, 2, 0) solids or holes meet only in an edge or a corner"},
      {blocks_robot,
       "model = { blocks = { solids = [[[0, 0, 0], [1, 1, 1]]], holes = [[[-1, -1, -1], [2, 2, 2]]] } }",
       "{ solids", "the holes leave nothing"},
      {blocks_robot, "model = { blocks = { solids = [[[0, 0, 0], [1, 1, 1]]], bevel_m = 0.6 } }", "{ solids",
       "bevel_m is 0.6, more than half of the 1 m between two faces"},
      {blocks_robot, "model = { tube = { path_m = [[0, 0, 0]], diameter_m = 0.1 } }", "[[0, 0, 0]]",
       "has 1 points; write two"},
      {blocks_robot, "model = { tube = { path_m = [[0, 0, 0], [0, 0, 0]], diameter_m = 0.1 } }",
       "[[0, 0, 0], [0", "points 0 and 1 in one place"},
      {blocks_robot,
       "model = { tube = { path_m = [[0, 0, 0], [1, 0, 0]], diameter_m = 0.1, wall_m = 0.05 } }", "0.05",
       "which leaves no lumen; it must be < 0.05"},
      {blocks_robot,
       "model = { tube = { path_m = [[0, 0, 0], [0.3, 0, 0], [0, 0.1, 0]], diameter_m = 0.2 } }",
       "[[0, 0, 0], [0.3", "too sharply for a diameter of 0.2 m"},
      {blocks_robot, "model = { tube = { path_m = [[0, 0, 0], [1, 0, 0]], diameter_m = 2 } }",
       "[[0, 0, 0], [1, 0", "no longer than it is thick"},
      {blocks_robot,
       "model = { tube = { path_m = [[0, 0, 0], [1, 0, 0]], diameter_m = 0.2, wall_m = 0.02 } }", "[3, 3, 3]",
       "has 3 cells round the tube; write an even number"},
      {"[planner]", "[planner]\nlead = true", "true", "needs a patch that leads"},
      {"[planner]", "[planner]\ncarry = true", "true", "needs two patches"},
      {"[planner]",
       "[planner]\ncarry = true\npatches_m = [[[0, 0, 0], [1, 2, 2]], [[1, 0, 0], [2, 2, 2]]]\n"
       "weights = { body = 1, control_point = 0 }",
       "true", "make it > 0"},
      {blocks_robot, "model = { blocks = { solids = [] } }", "[] }", "write one solid at least"},
      {blocks_robot, "model = { blocks = { solids = [[[0, 0, 0], [1, 0, 1]]] } }", "[1, 0", "upper y = 0"},
      {"cells = [3, 3, 3]", "cell_m = 0.5", "0.5 }\nmaterial", "goes with model.blocks only"},
      {"role = \"obstacle\"", "role = \"robot\"", "\"robot\"\nmodel = { plate", "two robots, robot and gate"},
      {"role = \"robot\"", "role = \"free\"", "[[bodies]]", "there is no robot"},
      {"role = \"robot\"", "role = \"robt\"", "\"robt\"", "did you mean \"robot\"?"},
      {"role = \"robot\"", "role = \"robot\"\nkind = \"rigid\"", "role", "no complaint"},
      {"role = \"obstacle\"", "role = \"free\"\nkind = \"rigid\"", "[\"walls\"",
       "bodies.gate is rigid and moves, so no node of it can be fixed"},
      {"material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }\n", "kind = \"rigid\"\n", "[[bodies]]",
       "bodies.robot is rigid, moves and lacks a material"},
      {"pose = { position_m = [1, 1.5, 1.5] }\n",
       "pose = { position_m = [1, 1.5, 1.5] }\nparts = [{ shell = 1, box_m = [[0, 0, 0], [1, 1, 1]] }]\n",
       "{ shell", "both shell and box_m"},
      {"pose = { position_m = [1, 1.5, 1.5] }\n",
       "pose = { position_m = [1, 1.5, 1.5] }\nparts = [{ density_kg_m3 = 7 }]\n", "{ density_kg_m3 = 7",
       "neither shell nor box_m"},
      {"pose = { position_m = [1, 1.5, 1.5] }\n",
       "pose = { position_m = [1, 1.5, 1.5] }\nparts = [{ shell = 1 }]\n", "{ shell", "changes nothing"},
      {"pose = { position_m = [1, 1.5, 1.5] }\n",
       "pose = { position_m = [1, 1.5, 1.5] }\nparts = [{ shell = -1, youngs_modulus_pa = 3 }]\n", "-1",
       "it must be ≥ 0 and ≤ 999"},
      {"pose = { position_m = [1, 1.5, 1.5] }\n",
       "pose = { position_m = [1, 1.5, 1.5] }\nkind = \"rigid\"\nparts = [{ shell = 1, youngs_modulus_pa = 3 "
       "}]\n",
       "3 }]", "bodies.robot is rigid; remove it"},
      {"material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }\n", "", "[[bodies]]", "lacks a material"},
      {"youngs_modulus_pa = 5e3, ", "", "{ density", "bodies.robot.material lacks \"youngs_modulus_pa\""},
      {"radius_m = 0.25\n", "radius_m = 0.25\nmoves_with = \"robot\"\n", "\"robot\"\n[planner]",
       "must be a body other than the robot"},
      {"radius_m = 0.25\n", "radius_m = 0.25\nmoves_with = \"gate\"\n", "\"gate\"\n[planner]",
       "write planner.settle_time_s = 0"},
      {"radius_m = 0.25\n", "radius_m = 0.25\nlost_below_m = 1\n", "1\n[planner]",
       "goes with goal.moves_with only"},
      {"radius_m = 0.25\n", "", "[goal]", "either radius_m or box_m"},
      {"radius_m = 0.25\n", "radius_m = 0.25\nbox_m = [[8, 1, 1], [9, 2, 2]]\n", "[goal]",
       "either radius_m or box_m"},
      {"radius_m = 0.25\n", "box_m = [[8, 1, 1], [8.9, 2, 2]]\n", "[[8, 1", "is not in goal.box_m"},
      {"radius_m = 0.25\n", "radius_m = 0.25\nabove = \"gat\"\n", "\"gat\"",
       "must be a body other than the robot: gate"},
      {"[goal]", "[[goal]]", "[[goal]]", "write [goal], and [[via]] for each that comes before it"},
      {"[goal]", "[[via]]\nradius_m = 1\n[goal]", "[[via]]", "lacks \"center_of_mass_m\""},
      {"[goal]", "[[via]]\ncenter_of_mass_m = [4, 1, 1]\n[goal]", "[[via]]",
       "the via needs either radius_m or box_m"},
      {"[goal]", "[[via]]\ncenter_of_mass_m = [4, 1, 9]\nradius_m = 1\n[goal]", "[4, 1, 9]",
       "the via is outside the bounds: z = 9"},
      {"[goal]", "[[via]]\ncenter_of_mass_m = [4, 1, 1]\nradius_m = 1\nabove = \"robot\"\n[goal]",
       "\"robot\"\n[goal]", "via.above is \"robot\"; it must be a body other than the robot: gate"},
      {"[goal]",
       "[[via]]\ncenter_of_mass_m = [4, 1, 1]\nradius_m = 1\nmoves_with = \"gate\"\nrest = true\n[goal]",
       "true\n[goal]", "cannot come to rest in a via that moves"},
      {"[planner]",
       "[[via]]\ncenter_of_mass_m = [4, 1, 1]\nradius_m = 1\nrest = true\n[planner]\nsettle_time_s = 0",
       "true\n[planner]", "no time to come to rest"},
      {"[goal]", "[[via]]\ncenter_of_mass_m = [4, 1, 1]\nradius_m = 1\nlost_below_m = 1\n[goal]",
       "lost_below_m", "unknown key"},
      {"radius_m = 0.25\n", "radius_m = 0.25\nshape = { angle_deg = 90 }\n", "{ angle_deg",
       "without a tolerance"},
      {"radius_m = 0.25\n", "radius_m = 0.25\nshape = { tolerance_m = 1, half_turn = [0, 0, 2] }\n",
       "[0, 0, 2]", "would be drawn into goal.shape"},
      {"radius_m = 0.25\n", "radius_m = 0.25\nshape = { tolerance_m = 1, half_turn = [0, 0, 0] }\n",
       "[0, 0, 0] }\n", "points nowhere"},
      {"name = \"gate\"", "name = \"robot\"", "\"robot\"\nrole = \"obst", "two bodies are called \"robot\""},
      {"name = \"gate\"", "name = \"../gate\"", "\"../gate\"", "letters, digits"},
      {"[9, 1.5, 1.5]", "[11, 1.5, 1.5]", "[11,",
       "goal is outside the bounds: x = 11 is not between 0 and 10"},
      {"[1, 1.5, 1.5]", "[1, 1.5, 2.6]", "[1, 1.5, 2.6]", "it reaches z = 3.1, they end at 3"},
      {"[1, 1.5, 1.5]", "[1, 1.5, 1.5], angle_deg = 45", "[1, 1.5, 1.5], angle", "no complaint"},
      {"[1, 1.5, 1.5] }", "[1, 2.4, 1.5], angle_deg = 45 }", "[1, 2.4", "reaches y = 3.10711"},
      {"[1, 1.5, 1.5] }", "[1, 1.5, 1.5], axis = [0, 0, 0] }", "[0, 0, 0] }", "points nowhere"},
      {"[[0, 0, 0], [10, 3, 3]]", "[[0, 0, 0], [10, -3, 3]]", "[10, -3",
       "upper y = -3, which is not above lower y = 0"},
      {"[[0, 0, 0], [10, 3, 3]]", "[[0, 0, 0], [10, 0, 3]]", "[10, 0", "upper y = 0"},
      {"[[0, 0, 0], [10, 3, 3]]", "[0, 0, 0, 10, 3, 3]", "[0, 0, 0, 10", "two corners"},
      {"max_force_n = 500", "max_force_n = 500\nduration_s = [2, 1]", "[2, 1]",
       "write the smaller one first"},
      {"max_force_n = 500", "max_force_n = 500\nforce_share = [0, 1.5]", "1.5]\n[camera",
       "force_share[1] is 1.5"},
      {"max_force_n = 500", "max_force_n = 500\nweights = { body = 0, control_point = 0 }", "{ body",
       "both 0"},
      {"at = 1,", "at = 0,", "0, eye_m = [9", "put them in order"},
      {"name = \"side\"", "name = \"main\"", "\"main\"", "two cameras are called \"main\""},
      {"max_force_n = 500", "max_force_n = 500\nseed = 9007199254740993", "9007199254740993",
       "out of its range; it must be ≥ 0 and ≤ 9007199254740991"},
      {"follow = \"gate\"", "follow = \"gate\"\nsubject = \"gate\"", "\"gate\"\nkey", "frames no subject"},
      {"follow = \"gate\"", "subject = [\"gate\", \"robt\"]", "\"robt\"", "not scenery: robot, gate"},
      {"follow = \"gate\"", "subject = []", "[]", "names no body"},
      {"follow = \"gate\"", "follow = \"robt\"", "\"robt\"", "a body that is not scenery: robot, gate"},
      {"role = \"obstacle\"", "triangles = 500\nrole = \"obstacle\"", "500",
       "bodies.gate is not scenery, so its surface is kept vertex by vertex; remove triangles"},
      {"role = \"obstacle\"", "role = \"scenery\"", "{ tets", "bodies.gate is scenery, which has no cage"},
      {"cage = { tets = 200 }\n", "", "[[bodies]]\nname = \"gate", "bodies.gate lacks a cage"},
      {"[[cameras]]", "[film]\ncolor_range = [2, 2]\n[[cameras]]", "[2, 2]", "are the same"},
      {"[[cameras]]", "[film]\nframes_per_second = 100\nspeed = 0.005\n[[cameras]]", "0.005",
       "more than 10,000"},
      {"target_m = [0, 0, 1]", "target_m = [0, -9, 1]", "[0, -9, 1] }", "looks at the place where it is"},
      {"fixed = [\"walls\"", "fixed = [\"wall\"", "\"wall\"", "must be \"walls\", or a list"},
      {"fixed = [\"walls\"", "fixed = [\"walls\", { boxm = 1 }", "boxm", "did you mean \"box_m\"?"},
      {"name = \"good\"", "name = \"good\"\nname = \"twice\"", "\"twice\"", "not TOML"},
      {"name = \"good\"", "name = 1979-05-27", "1979", "dates"},
      {"radius_m = 0.25", "radius_m = 1e10", "1e10", "between"},
  };
  for (const Slip& slip : slips) {
    SCOPED_TRACE(fmt::format("{} → {}", slip.from, slip.to));
    const std::string text = replaced(good, slip.from, slip.to), said = complaint(text);
    EXPECT_THAT(said, HasSubstr(slip.words));
    if (said == "no complaint") continue;
    EXPECT_THAT(said, StartsWith(place(text, slip.at)));
    EXPECT_THAT(said, HasSubstr(";")) << "says nothing of what to try";
  }
}

TEST(ReadScene, EmptyTextsSayWhereToStart) {
  for (const char* text : {"", "\n\n", "# only a comment\n"})
    EXPECT_THAT(complaint(text), StartsWith("s.toml:1:1: the scene is empty; start from"));
}

// Names become folders, and on some disks capitals do not tell them apart.
TEST(ReadScene, NamesThatDifferInCapitalsAloneAreRefused) {
  EXPECT_THAT(complaint(replaced(good, "name = \"gate\"", "name = \"Robot\"")),
              HasSubstr("bodies are called \"robot\" and \"Robot\", which is one folder on some disks"));
  EXPECT_THAT(complaint(replaced(good, "name = \"side\"", "name = \"MAIN\"")),
              HasSubstr("two cameras are called \"MAIN\""));
}

TEST(ReadScene, APictureLargerThanTheRendererDrawsIsRefused) {
  EXPECT_THAT(complaint(good + "[film]\nsize_px = [8193, 100]\n"), HasSubstr("8192"));
  EXPECT_EQ(complaint(good + "[film]\nsize_px = [8192, 100]\n"), "no complaint");
}

TEST(ReadScene, MissingFile) { EXPECT_THROW(read_scene_file("/no/such/scene.toml"), InputError); }

TEST(Sets, EditBeforeReading) {
  const auto modulus = [](const std::string& set) {
    return read_scene(good, "s", {set}).bodies[0].material.youngs_modulus_pa;
  };
  EXPECT_EQ(modulus("bodies.robot.material.youngs_modulus_pa=7e4"), 7e4);
  EXPECT_EQ(modulus("bodies.robot.youngs_modulus_pa=7e4"), 7e4);
  EXPECT_EQ(modulus("bodies.0.youngs_modulus_pa=7e4"), 7e4);
  EXPECT_EQ(read_scene(good, "s", {"bodies.gate.hole.size_m=0.5"}).bodies.size(), 2U);
  EXPECT_EQ(std::get<BoxModel>(read_scene(good, "s", {"bodies.robot.bevel_m=0.2"}).bodies[0].model).bevel_m,
            0.2);
  EXPECT_EQ(read_scene(good, "s", {"film.frames_per_second=60"}).film.frames_per_second, 60);
  EXPECT_EQ(read_scene(good, "s", {"film.caption=\"Größe\""}).film.caption, "Größe");
  EXPECT_THROW(read_scene(good, "s", {"film.caption=\"two\\nlines\""}), InputError);
  EXPECT_EQ(read_scene(good, "s", {"description=two words"}).description, "two words");
  EXPECT_EQ(read_scene(good, "s", {"planner.seed=1", "planner.seed=2"}).planner.seed, 2);
  EXPECT_EQ(read_scene(good, "s", {"camera.keyframes.0.eye_m=[1,2,3]"}).cameras[0].keyframes[0].eye_m,
            Vec3(1, 2, 3));
}

TEST(Sets, ComplaintsNameTheEdit) {
  EXPECT_THAT(complaint(good, {"bodies.robt.color=#000000"}),
              StartsWith("--set bodies.robt.color=#000000: bodies has no \"robt\"; did you mean \"robot\"?"));
  EXPECT_THAT(
      complaint(good, {"planner.goal_bais=1"}),
      StartsWith(
          "--set planner.goal_bais=1: unknown key \"goal_bais\" in planner; did you mean \"goal_bias\"?"));
  EXPECT_THAT(complaint(good, {"planner.goal_bias=2"}),
              StartsWith("--set planner.goal_bias=2: planner.goal_bias is 2, out of"));
  EXPECT_THAT(complaint(good, {"planner.goal_bias=[1, \"x\"]"}),
              StartsWith("--set planner.goal_bias=[1, \"x\"]: planner.goal_bias must be a number"));
  for (const char* set : {"planner", "=3", "", "planner.=3", ".=1", "goal.radius_m.x=1", "bodies..x=1",
                          "bodies.robot.=1", "name.x.y=1", "bodies.robot=1", "bodies=1"})
    EXPECT_THAT(complaint(good, {set}),
                testing::AllOf(StartsWith(fmt::format("--set {}: ", set)), HasSubstr(";")))
        << set;
}

TEST(Sets, SceneIsReadAgainFromItsTextAndSets) {
  const Scene once = read_scene(good, "s", {"planner.seed=5", "bodies.robot.friction=0.7"});
  const Scene twice = read_scene(once.text, "s", once.sets);
  EXPECT_EQ(twice.planner.seed, 5);
  EXPECT_EQ(twice.bodies[0].material.friction, 0.7);
}

// All that a scene says, but for its text.
std::string all_of(const Scene& s);

bool reads_or_complains(const std::string& text) {
  try {
    read_scene(text, "s.toml");
  } catch (const InputError&) {
  }
  return true;  // anything else flies on and fails the test
}

const std::string shutter = R"([[bodies]]
name = "shutter"
role = "obstacle"
kind = "rigid"
model = { box = { size_m = [1, 1, 1] } }
cage = { cells = [1, 1, 1] }
pose = { position_m = [8, 1.5, 1.5] }
)";
const std::string script = R"([[forces]]
body = "robot"
from_s = 0.5
to_s = 2
force_n = [3, 4, 5]
[[motions]]
body = "shutter"
keyframes = [{ at_s = 1, position_m = [8, 1.5, 1.2] }, { at_s = 3, axis = [0, 0, 2], angle_deg = 720 }]
)";

// Where nothing is planned nothing is asked for that only planning needs.
TEST(ReadScene, AScenesGoalRobotAndPlannerMayLackWhereItIsSimulated) {
  const std::string no_goal =
                        replaced(good, "[goal]\ncenter_of_mass_m = [9, 1.5, 1.5]\nradius_m = 0.25\n", ""),
                    no_planner = replaced(no_goal, "[planner]\npreset = \"paper\"\nmax_force_n = 500\n", ""),
                    no_robot = replaced(no_planner, "role = \"robot\"", "role = \"free\"");
  const auto lack = [](const std::string& text) {
    const Scene scene = read_scene(text, "s.toml");
    try {
      require_plannable(scene);
    } catch (const InputError& error) {
      EXPECT_EQ(scene.lacks, error.what());
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string can =
      "s.toml:1:1: the scene can only be simulated (limber simulate); to be planned it lacks ";
  EXPECT_EQ(lack(good), "");
  EXPECT_EQ(lack(no_goal), can + "[goal]; add it");
  EXPECT_EQ(lack(no_planner), can + "[goal], [planner]; add them");
  EXPECT_EQ(lack(no_robot), can + "[goal], [planner], a body with role = \"robot\"; add them");
  EXPECT_EQ(read_scene(no_goal, "s.toml").planner.preset, "paper");

  // Sizes are told against the first that can be pushed.
  EXPECT_EQ(read_scene(no_robot, "s.toml").robot, 0);
  const std::string first_stands =
      replaced(no_robot, "role = \"free\"\n", "role = \"obstacle\"\nkind = \"rigid\"\n");
  EXPECT_EQ(read_scene(first_stands, "s.toml").robot, 1);
  EXPECT_NE(complaint(first_stands, {"bodies.gate.kind=rigid"}).find("s.toml:4:1: no body can be pushed"),
            std::string::npos)
      << complaint(first_stands, {"bodies.gate.kind=rigid"});

  // What is there is read as ever, and a goal wants the rest.
  EXPECT_NE(
      complaint(no_goal + "[[via]]\ncenter_of_mass_m = [5, 1, 1]\nradius_m = 1\n").find("before [goal]"),
      std::string::npos);
  EXPECT_NE(complaint(replaced(good, "[planner]\npreset = \"paper\"\nmax_force_n = 500\n", ""))
                .find("s.toml:1:1: the scene lacks \"planner\""),
            std::string::npos);
  EXPECT_NE(complaint(no_goal, {"planner.max_force_n=-1"}).find("planner.max_force_n"), std::string::npos);
}

TEST(Script, StandsInTheSceneOrInAFileOfItsOwn) {
  const Scene one = read_scene(good + shutter + script, "s.toml"),
              two = read_scene(good + shutter, "s.toml", {}, {script, "c.toml"});
  EXPECT_EQ(all_of(one), all_of(two));
  ASSERT_EQ(two.forces.size(), 1U);
  EXPECT_EQ(two.forces[0].body, 0);
  EXPECT_EQ(two.forces[0].force_n, Vec3(3, 4, 5));
  ASSERT_EQ(two.motions.size(), 1U);
  EXPECT_EQ(two.motions[0].keyframes[1].position_m, Vec3(8, 1.5, 1.5));  // its pose's
  EXPECT_EQ(two.motions[0].keyframes[1].axis, Vec3::UnitZ());
  EXPECT_EQ(two.script.text, script);
  // The file's lists follow the scene's; edits come last.
  const std::string force = "[[forces]]\nbody = \"gate\"\nto_s = 1\nforce_n = [0, 0, 1]\n";
  const Scene both = read_scene(good + shutter + force, "s.toml", {"forces.1.to_s=4"}, {script, "c.toml"});
  ASSERT_EQ(both.forces.size(), 2U);
  EXPECT_EQ(both.forces[0].body, 1);
  EXPECT_EQ(both.forces[1].to_s, 4);
  EXPECT_EQ(read_scene(good, "s.toml", {}, {"# nothing", "c.toml"}).forces.size(), 0U);
}

TEST(Script, PressuresAreInSoftBodies) {
  const std::string pressure = "[[pressures]]\nbody = \"gate\"\nto_s = 1\npressure_pa = 300\n";
  const Scene scene = read_scene(good + pressure, "s.toml");
  ASSERT_EQ(scene.pressures.size(), 1u);
  EXPECT_EQ(scene.pressures[0].body, 1);
  EXPECT_EQ(scene.pressures[0].pressure_pa, 300);
  EXPECT_EQ(all_of(scene), all_of(read_scene(good, "s.toml", {}, {pressure, "c.toml"})));
  const std::string balloon = replaced(good, "max_force_n = 500", "max_force_n = 500\nmax_pressure_pa = 400");
  EXPECT_EQ(read_scene(balloon, "s.toml", {"goal.volume=1.5", "planner.settle_hold=true"}).goal.volume, 1.5);
  const auto says = [](const std::string& text, const std::vector<std::string>& sets, const char* what) {
    EXPECT_NE(complaint(text, sets).find(what), std::string::npos) << complaint(text, sets);
  };
  says(good + pressure, {"pressures.0.to_s=0"}, "not after from_s");
  says(good + pressure, {"bodies.gate.kind=rigid"}, "is rigid, which no pressure blows up");
  says(balloon, {"bodies.robot.kind=rigid"}, "the robot is rigid, which no pressure blows up");
  says(good, {"goal.volume=1.5", "planner.settle_hold=true"}, "nothing blows the robot up");
  says(balloon, {"goal.volume=1.5", "planner.settle_hold=false"}, "drawn into its shape");
  says(balloon, {"goal.volume=1.5", "planner.settle_time_s=0", "planner.settle_hold=true"},
       "no time to blow");
}

TEST(Ligaments, AreBetweenTwoBodiesOrABodyAndTheWorld) {
  const std::string band =
      "[[ligaments]]\nname = \"band\"\nfrom = \"robot\"\nfrom_m = [1, 2, 3]\nto = \"gate\"\nto_m = [4, 5, "
      "6]\n"
      "stiffness_n_m = 70\n";
  const Scene scene = read_scene(good + band, "s.toml");
  ASSERT_EQ(scene.ligaments.size(), 1u);
  EXPECT_EQ(scene.ligaments[0].to, 1);
  EXPECT_EQ(scene.ligaments[0].damping_ratio, 0.3);
  EXPECT_EQ(read_scene(replaced(good + band, "to = \"gate\"\n", ""), "s.toml").ligaments[0].to, -1);
  const Slip slips[] = {
      {"from = \"robot\"", "from = \"robt\"", "\"robt\"", "it must be a body that is not scenery"},
      {"to = \"gate\"", "to = \"robot\"", "\"robot\"\nto_m", "goes from robot to itself"},
      {"stiffness_n_m = 70\n", "", "[[ligaments]]", "lacks \"stiffness_n_m\""},
      {"stiffness_n_m = 70", "stiffness_n_m = -70", "-70", "must be"},
      {"name = \"band\"", "name = \"a band\"", "\"a band\"", "letters"},
  };
  for (const Slip& slip : slips) {
    SCOPED_TRACE(fmt::format("{} → {}", slip.from, slip.to));
    const std::string slipped = replaced(good + band, slip.from, slip.to), said = complaint(slipped);
    EXPECT_THAT(said, HasSubstr(slip.words));
    EXPECT_THAT(said, StartsWith(place(slipped, slip.at)));
  }
  EXPECT_THAT(complaint(good + band + band), HasSubstr("two ligaments are called \"band\""));
}

TEST(Script, ComplainsWithLineAndColumn) {
  const std::string text = good + shutter + script;
  const Slip slips[] = {
      {"body = \"robot\"\nfrom", "body = \"robt\"\nfrom", "\"robt\"",
       "it must be a body that is not scenery"},
      {"body = \"robot\"\nfrom", "body = \"shutter\"\nfrom", "\"shutter\"\nfrom", "which no force moves"},
      {"to_s = 2", "to_s = 0.5", "0.5\nforce_n", "forces[0].to_s is 0.5, not after from_s, 0.5"},
      {"from_s = 0.5", "from_s = -1", "-1", "must be ≥ 0"},
      {"[3, 4, 5]", "[3, nan, 5]", "nan", "write a finite number"},
      {"to_s = 2\n", "", "[[forces]]", "lacks \"to_s\""},
      {"body = \"shutter\"\nkeyframes", "body = \"gate\"\nkeyframes", "\"gate\"\nkeyframes = [{ at_s",
       "no rigid obstacle, and goes where it is pushed"},
      {"at_s = 3", "at_s = 1", "1, axis", "keyframe at 1 s does not come after the one at 1 s"},
      {"at_s = 1", "at_s = 0", "0, position", "must be > 0"},
      {"axis = [0, 0, 2]", "axis = [0, 0, 0]", "[0, 0, 0], angle", "points nowhere"},
      {"keyframes = [{ at_s = 1, position_m = [8, 1.5, 1.2] }, { at_s = 3, axis = [0, 0, 2], angle_deg = 720 "
       "}]",
       "keyframes = []", "[]\n", "keyframes is empty"},
      {"pose = { position_m = [8, 1.5, 1.5] }\n",
       "pose = { position_m = [8, 1.5, 1.5] }\nvelocity_m_s = [1, 0, 0]\n", "[1, 0, 0]",
       "bodies.shutter cannot be pushed, and has no velocity_m_s"},
      {"pose = { position_m = [8, 1.5, 1.5] }\n",
       "pose = { position_m = [8, 1.5, 1.5] }\ngravity_m_s2 = [0, 0, -1]\n", "[0, 0, -1]",
       "bodies.shutter cannot be pushed, and has no gravity_m_s2"},
  };
  for (const Slip& slip : slips) {
    SCOPED_TRACE(fmt::format("{} → {}", slip.from, slip.to));
    const std::string slipped = replaced(text, slip.from, slip.to), said = complaint(slipped);
    EXPECT_THAT(said, HasSubstr(slip.words));
    EXPECT_THAT(said, StartsWith(place(slipped, slip.at)));
    EXPECT_THAT(said, HasSubstr(";"));
  }
  EXPECT_THAT(complaint(text + script.substr(script.find("[[motions]]"))), HasSubstr("has a motion already"));

  // Of a file of its own the complaint names that.
  const auto of_script = [&](const std::string& words) -> std::string {
    try {
      read_scene(good + shutter, "s.toml", {}, {words, "c.toml"});
    } catch (const InputError& error) {
      return error.what();
    }
    return "no complaint";
  };
  EXPECT_THAT(of_script(replaced(script, "to_s = 2", "to_s = 0.5")), StartsWith("c.toml:4:8: "));
  EXPECT_THAT(of_script(replaced(script, "force_n", "force")),
              StartsWith("c.toml:5:1: unknown key \"force\""));
  EXPECT_THAT(of_script("[planner]\nseed = 2\n"),
              AllOf(StartsWith("c.toml:1:"), HasSubstr("\"planner\" is not for this file")));
  EXPECT_THAT(of_script("forces = 3\n"), StartsWith("c.toml:1:"));
  EXPECT_THAT(of_script("forces = [\n"), StartsWith("c.toml:"));
  for (std::size_t n = 0; n < script.size(); ++n) of_script(script.substr(0, n));  // refused or read
}

TEST(ReadScene, EveryTruncatedPrefixIsReadOrRefused) {
  for (std::size_t n = 0; n < good.size(); ++n) ASSERT_TRUE(reads_or_complains(good.substr(0, n))) << n;
}

TEST(ReadScene, EveryDeletedOrChangedCharacterIsReadOrRefused) {
  Rng rng(7, 0);
  for (std::size_t n = 0; n < good.size(); ++n) {
    std::string text = good;
    ASSERT_TRUE(reads_or_complains(text.erase(n, 1))) << n;
    text = good;
    text[n] = char(rng.below(256));
    ASSERT_TRUE(reads_or_complains(text)) << n << " " << int(text[n]);
  }
}

// toml++ builds a table for each part, and takes them down by calling itself.
TEST(ReadScene, KeysOfManyPartsAreRefused) {
  for (const int parts : {17, 20000}) {
    std::string key = "a";
    for (int i = 1; i < parts; ++i) key += i % 3 ? ".a" : " . \"b\"";
    for (const std::string& line : {key + " = 1\n", "[" + key + "]\n", "x = { " + key + " = 1 }\n"})
      EXPECT_THAT(complaint("# 1.2.3.4.5.6.7.8.9.0.1.2.3.4.5.6.7.8\n" + line),
                  StartsWith("s.toml:2:1: a key has more"));
    EXPECT_THAT(complaint(good, {key + "=1"}), HasSubstr("its key has"));
    EXPECT_THAT(complaint(good, {"world={ " + key + " = 1 }"}), HasSubstr("a key has more than 16 parts"));
  }
  // Short keys in inline tables in inline tables.
  std::string nested = "1";
  for (int i = 0; i < 80; ++i) nested = "{ a.b = " + nested + " }";
  EXPECT_THAT(complaint("x = " + nested), HasSubstr("more than 64 deep"));
  // Dots that part no keys.
  const std::string dots(100, '.');
  const std::string texts = "description = \"" + dots + "\\\"\" # " + dots + "\n";
  EXPECT_EQ(complaint(texts + good), "no complaint");
  EXPECT_EQ(complaint("description = \"\"\"" + dots + "\n\"" + dots + "\"\"\"\n" + good), "no complaint");
  EXPECT_EQ(complaint("description = '" + dots + "'\n" + good), "no complaint");
}

TEST(ReadScene, DeepNestingIsRefused) {
  EXPECT_THAT(complaint("a = " + std::string(100000, '[')), HasSubstr("not TOML"));
}

TEST(ReadScene, FilesInOtherEncodingsAreToldFromWrongToml) {
  EXPECT_THAT(complaint("name = \"\xe4rger\""), HasSubstr("1:8: this is not UTF-8"));
  EXPECT_THAT(complaint("\xff\xfen\0a\0"), HasSubstr("1:1: this is not UTF-8"));
}

// ---- the reader's table of keys and docs/scene.md ----

// A legal value that differs from what `good` holds, so that reading it must change the scene.
std::string another_value(const Key& key) {
  static const std::map<std::string_view, std::string> particular = {
      {"name", "\"other\""},
      {"bodies[].name", "\"other\""},
      {"world.bounds_m", "[[-1, -1, -1], [11, 4, 4]]"},
      {"goal.center_of_mass_m", "[8, 1, 1]"},
      {"bodies[].pose.position_m", "[2, 1.5, 1.5]"},
      {"bodies[].pose.axis", "[1, 0, 0]"},
      {"bodies[].triangles", "777"},
      {"bodies[].max_stretch", "1.5"},
      {"bodies[].max_contact_load_n", "2.5"},
      {"bodies[].model.box.size_m", "[0.9, 0.8, 0.7]"},
      {"bodies[].model.box.bevel_m", "0.2"},
      {"bodies[].model.box.triangle_m", "0.2"},
      {"bodies[].model.plate.size_m", "[0.3, 2.9, 2.9]"},
      {"bodies[].model.plate.bevel_m", "0.02"},
      {"bodies[].model.plate.triangle_m", "0.2"},
      {"bodies[].model.plate.hole.size_m", "0.7"},
      {"bodies[].model.plate.hole.center_m", "[0.1, 0.2]"},
      {"bodies[].model.blocks.solids", "[[[0, 0, 0], [0.5, 1, 1]], [[0.5, 0, 0], [1, 1, 0.5]]]"},
      {"bodies[].model.blocks.holes", "[[[0.25, 0, 0.25], [0.75, 1, 0.75]]]"},
      {"bodies[].model.blocks.bevel_m", "0.2"},
      {"bodies[].model.blocks.triangle_m", "0.2"},
      {"bodies[].model.tube.path_m", "[[0, 0, 0], [1, 0.1, 0]]"},
      {"bodies[].model.tube.diameter_m", "0.3"},
      {"bodies[].model.tube.wall_m", "0.05"},
      {"bodies[].model.tube.triangle_m", "0.2"},
      {"planner.patches_m", "[[[0, 0, 0], [1, 2, 2]]]"},
      {"bodies[].model.sphere.diameter_m", "0.8"},
      {"bodies[].model.sphere.triangle_m", "0.2"},
      {"bodies[].fixed", "[]"},
      {"bodies[].parts[].box_m", "[[0, 0, 0], [1, 2, 2]]"},
      {"bodies[].fixed[].box_m", "[[2, 0, 0], [4, 2, 2]]"},
      {"bodies[].cage.cells", "[2, 2, 2]"},
      {"bodies[].model.up", "\"+y\""},
      {"bodies[].model.front", "\"-y\""},
      {"goal.moves_with", "\"gate\""},
      {"via[].center_of_mass_m", "[8, 1, 1]"},
      {"via[].moves_with", "\"gate\""},
      {"via[].above", "\"gate\""},
      {"via[].below", "\"gate\""},
      {"via[].clear_of", "\"gate\""},
      {"via[].box_m", "[[6, 1, 1], [7, 2, 2]]"},
      {"goal.above", "\"gate\""},
      {"goal.below", "\"gate\""},
      {"goal.clear_of", "\"gate\""},
      {"goal.through", "[\"gate\", \"gate\"]"},
      {"via[].through", "[\"gate\"]"},
      {"goal.box_m", "[[8.5, 1, 1], [9.5, 2, 2]]"},
      {"camera.keyframes[].at", "0.5"},
      {"camera.keyframes[].eye_m", "[0, -8, 1]"},
      {"camera.keyframes[].target_m", "[0, 0.5, 1]"},
      {"camera.keyframes", "[]"},
      {"camera.follow", "\"robot\""},
      {"camera.subject", "\"robot\""},
      {"cameras[].name", "\"other\""},
      {"cameras[].follow", "\"robot\""},
      {"cameras[].subject", "\"robot\""},
      {"cameras[].keyframes[].at", "0.5"},
      {"cameras[].keyframes[].eye_m", "[0, -8, 1]"},
      {"cameras[].keyframes[].target_m", "[0, 0.5, 1]"},
      {"bodies[].role", "\"free\""},
      {"planner.duration_s", "[0.3, 0.4]"},
      {"pressures[].body", "\"gate\""},
      {"goal.volume", "1.5"},
      {"forces[].body", "\"gate\""},
      {"forces[].box_m", "[[0, 0, 0], [1, 2, 2]]"},
      {"motions[].body", "\"shutter\""},
      {"ligaments[].name", "\"other\""},
      {"ligaments[].from", "\"shutter\""},
      {"ligaments[].to", "\"shutter\""},
      {"film.inset.camera", "\"main\""},
      {"film.labels", "[\"gate\"]"},
      {"film.cuts[].bodies", "[\"gate\"]"},
  };
  if (const auto at = particular.find(key.path); at != particular.end()) return at->second;
  switch (key.type) {
    case Type::text:
      return "\"other\"";
    case Type::choice:
      return fmt::format(
          "\"{}\"",
          key.choices.substr(key.choices.rfind(", ") == key.choices.npos ? 0 : key.choices.rfind(", ") + 2));
    case Type::number:
      return fmt::format("{}", std::max(0.4321, key.interval.lower));
    case Type::integer:
      return "77";
    case Type::boolean:
      return key.fallback == "true" ? "false" : "true";
    case Type::vector:
      return key.count == 2 ? "[0.5, 0.25]" : "[0.5, 0.25, 0.125]";
    case Type::integers:
      return "[17, 19]";
    case Type::range:
      return "[0.25, 0.5]";
    case Type::color:
      return "\"#123456\"";
    default:
      return "";
  }
}

TEST(Keys, EveryKeyChangesTheScene) {
  const std::string file_robot = "bodies.robot.model={ file = \"a.off\" }",
                    tets_robot = "bodies.robot.cage={ tets = 50 }";
  const std::string sphere_robot = "bodies.robot.model={ sphere = { diameter_m = 1.0 } }";
  int leaves = 0;
  for (const Key& key : keys()) {
    if (key.type == Type::table || key.type == Type::tables) continue;
    SCOPED_TRACE(std::string(key.path));
    const bool plate = key.path.find(".plate") != key.path.npos,
               fixed = key.path.find(".fixed") != key.path.npos;
    std::vector<std::string> sets;
    if (key.parent() == "bodies[].model" && key.path != "bodies[].model.made")
      sets = {file_robot, tets_robot};
    if (key.path == "bodies[].model.made") sets = {file_robot, tets_robot};
    if (key.path.find(".blocks") != key.path.npos || key.path == "bodies[].cage.cell_m")
      sets = {"bodies.robot.model={ blocks = { solids = [[[0, 0, 0], [1, 1, 1]]] } }",
              "bodies.robot.cage={ cell_m = 0.5 }"};
    if (key.path.find(".tube") != key.path.npos)
      sets = {"bodies.robot.model={ tube = { path_m = [[0, 0, 0], [1, 0, 0]], diameter_m = 0.2 } }",
              tets_robot};
    if (key.path == "planner.carry")
      sets = {"planner.patches_m=[[[0, 0, 0], [1, 2, 2]], [[0, 0, 0], [2, 2, 2]]]"};
    if (key.path == "planner.lead")
      sets = {"planner.patches_m=[[[0, 0, 0], [1, 2, 2]]]", "planner.settle_time_s=0",
              "planner.weights.interpolation=0"};
    if (key.path.find(".sphere") != key.path.npos) sets = {sphere_robot, tets_robot};
    if (key.path == "bodies[].cage.tets" || key.path == "bodies[].cage.mode" ||
        key.path == "bodies[].cage.shells")
      sets = {tets_robot};
    if (key.path == "bodies[].contact" || key.path == "planner.preset") sets = {"planner.preset=fast"};
    if (key.path == "planner.guidance") sets = {"planner.lag=3"};
    if (key.path == "planner.stop_in_goal" || key.path == "planner.end_hopeless")
      sets = {"planner.look_s=0.2"};
    if (key.path == "goal.moves_with") sets = {"planner.settle_time_s=0"};
    if (key.parent() == "via[]") sets = {"via=[{ center_of_mass_m = [6.5, 1.5, 1.5], radius_m = 0.5 }]"};
    if (key.path == "via[].box_m")
      sets = {"via=[{ center_of_mass_m = [6.5, 1.5, 1.5], box_m = [[6, 1, 1], [7, 2, 2.5]] }]"};
    if (key.path == "goal.box_m")
      sets = {"goal={ center_of_mass_m = [9, 1.5, 1.5], box_m = [[8, 1, 1], [9.5, 2, 2]] }"};
    if (key.parent() == "goal.shape") sets = {"goal.shape.tolerance_m=0.25"};
    if (key.path == "goal.shape.half_turn")
      sets = {"goal.shape.tolerance_m=0.25", "planner.weights.interpolation=0", "planner.settle_time_s=0"};
    if (key.path == "goal.lost_below_m") sets = {"planner.settle_time_s=0", "goal.moves_with=gate"};
    if (key.path == "bodies[].triangles")
      sets = {"cameras.side.follow=robot",
              "bodies.gate={ name = \"gate\", role = \"scenery\", model = { made = \"heart\" } }"};
    if (key.path == "camera.subject") sets = {"camera.keyframes=[]"};
    if (key.path == "cameras[].subject") sets = {"cameras=[{ name = \"side\" }]"};
    if (key.path == "film.length_s" || key.path == "film.pace_range") sets = {"film.pace=contact"};
    if (key.path.starts_with("film.inset.")) sets = {"film.inset={ camera = \"side\" }"};
    if (key.path.starts_with("film.cuts[]"))
      sets = {"film.cuts=[{ point_m = [1, 2, 3], normal = [0, 0, 1], bodies = [\"robot\"] }]"};
    for (const std::string_view card : {"film.title", "film.end_card"})
      if (key.parent() == card) sets = {fmt::format("{}={{ text = \"Before\" }}", card)};
    if (key.path == "bodies[].texture") sets = {"bodies.robot.color=\"#123456\""};  // a color turns it off
    if (key.path == "bodies[].pose.axis") sets = {"bodies.robot.pose.angle_deg=90"};
    if (key.parent() == "bodies[].parts[]")
      sets = {key.name() == "box_m"
                  ? "bodies.robot.parts=[{ box_m = [[0, 0, 0], [1, 1, 1]], density_kg_m3 = 1 }]"
                  : "bodies.robot.parts=[{ shell = 0, density_kg_m3 = 1 }]"};
    if (key.parent() == "forces[]") sets = {"forces=[{ body = \"robot\", to_s = 1, force_n = [1, 0, 0] }]"};
    if (key.parent() == "pressures[]") sets = {"pressures=[{ body = \"robot\", to_s = 1, pressure_pa = 5 }]"};
    if (key.path == "goal.volume") sets = {"planner.max_pressure_pa=9", "planner.settle_hold=true"};
    if (key.parent() == "ligaments[]")
      sets = {
          "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0, 0, 0], to = \"gate\", to_m = [1, 0, "
          "0], "
          "stiffness_n_m = 1 }]"};
    if (key.path.starts_with("motions[]"))
      sets = {"bodies.gate.kind=rigid",
              "motions=[{ body = \"gate\", keyframes = [{ at_s = 1, angle_deg = 10 }] }]"};
    std::string path = replaced(std::string(key.path) + " ", " ", "");
    const std::string body = plate || fixed || key.path == "bodies[].kind" || key.path == "bodies[].role" ||
                                     key.path == "bodies[].triangles"
                                 ? "bodies.gate"
                                 : "bodies.robot";
    for (const char* list : {"via", "forces", "pressures", "motions", "ligaments"})
      if (path.starts_with(list + std::string("[]")))
        path = replaced(path, list + std::string("[]"), list + std::string(".0"));
    if (path.starts_with("bodies[]")) path = replaced(path, "bodies[]", body);
    if (fixed && path.ends_with(".box_m")) path = replaced(path, "[]", ".1");
    if (path.find("parts[]") != path.npos) path = replaced(path, "parts[]", "parts.0");
    if (path.starts_with("film.cuts[]")) path = replaced(path, "cuts[]", "cuts.0");
    if (path.starts_with("cameras[]")) path = replaced(path, "cameras[]", "cameras.side");
    if (path.find("keyframes[]") != path.npos) path = replaced(path, "keyframes[]", "keyframes.0");
    const bool other =
        key.path == "motions[].body" || key.path == "ligaments[].from" || key.path == "ligaments[].to";
    const std::string text = other ? good + shutter : good, before = all_of(read_scene(text, "s", sets));
    sets.push_back(path + "=" + another_value(key));
    SCOPED_TRACE(sets.back());
    EXPECT_NE(all_of(read_scene(text, "s", sets)), before);
    ++leaves;
  }
  EXPECT_GT(leaves, 60);
}

TEST(ReadScene, LabelsNameBodiesOnceAndInWords) {
  const std::string skin =
      good +
      "[[bodies]]\nname = \"lung_left\"\nrole = \"scenery\"\nmodel = { sphere = { diameter_m = 1 } }\n";
  const auto labels = [&](const std::string& value) {
    std::string all;
    for (const LabelSpec& label : read_scene(skin, "s", {"film.labels=" + value}).film.labels)
      all += fmt::format("{} {}, ", label.body, label.text);
    return all;
  };
  EXPECT_EQ(labels("false"), "");
  EXPECT_EQ(labels("true"), "0 Robot, 1 Gate, 2 Left lung, ");
  EXPECT_EQ(labels("[\"lung_left\", \"gate\"]"), "2 Left lung, 1 Gate, ");
  EXPECT_EQ(labels("{ gate = \"Ψ door\" }"), "1 Ψ door, ");
  const auto said = [&](const std::string& set) { return complaint(skin, {"film.labels=" + set}); };
  EXPECT_THAT(said("[\"lung_let\"]"), HasSubstr("did you mean \"lung_left\"?"));
  EXPECT_THAT(said("[\"xyzw\"]"), HasSubstr("there are: robot, gate, lung_left"));
  EXPECT_THAT(said("[\"gate\", \"gate\"]"), HasSubstr("names gate twice"));
  EXPECT_THAT(said("{ gate = 3 }"), HasSubstr("film.labels.gate is a whole number; it must be a text"));
  EXPECT_THAT(said("{ gate = \"  \" }"), HasSubstr("is empty"));
  EXPECT_THAT(said("{ gate = \"a\\nb\" }"), HasSubstr("cannot be seen"));
  EXPECT_THAT(said("{ gate = \"" + std::string(61, 'x') + "\" }"), HasSubstr("longer than 60 bytes"));
  EXPECT_THAT(said("7"), HasSubstr("true or false, a list of bodies, or a table"));
  EXPECT_THAT(complaint(skin, {"film.labels=true", "film.side_by_side=true"}), HasSubstr("take one of them"));
}

TEST(ReadScene, CutsOpenWhatIsSeenThroughOrIsNamed) {
  const std::string skin = good +
                           "[[bodies]]\nname = \"skin\"\nrole = \"scenery\"\nmodel = { sphere = { diameter_m "
                           "= 1 } }\n",
                    plane = "point_m = [0, 0, 1], normal = [0, 0, 2]";
  const auto cut = [&](const std::string& text, const std::string& more, std::vector<std::string> sets) {
    sets.push_back(fmt::format("film.cuts=[{{ {}{} }}]", plane, more));
    return read_scene(text, "s", sets).film.cuts.at(0);
  };
  EXPECT_EQ(cut(skin, "", {}).bodies, std::vector<int>{2});
  EXPECT_EQ(cut(skin, "", {"bodies.gate.opacity=0.5"}).bodies, (std::vector<int>{1, 2}));
  EXPECT_EQ(cut(skin, ", bodies = [\"skin\", \"robot\"]", {}).bodies, (std::vector<int>{2, 0}));
  EXPECT_EQ(cut(skin, "", {}).normal, Vec3(0, 0, 1));
  const auto said = [&](const std::string& text, const std::string& cuts) {
    return complaint(text, {"film.cuts=" + cuts});
  };
  EXPECT_THAT(said(good, "[{ " + plane + " }]"), HasSubstr("there are none; name bodies"));
  EXPECT_THAT(said(skin, "[{ " + plane + ", bodies = [] }]"), HasSubstr("is empty"));
  EXPECT_THAT(said(skin, "[{ " + plane + ", bodies = [\"skim\"] }]"), HasSubstr("did you mean \"skin\"?"));
  EXPECT_THAT(said(skin, "[{ point_m = [0, 0, 1], normal = [0, 0, 0] }]"), HasSubstr("points nowhere"));
  std::string seven = "[";
  for (int i = 0; i < 7; ++i) seven += "{ " + plane + " },";
  EXPECT_THAT(said(skin, seven + "]"), HasSubstr("has 7 planes; at most 6"));
}

TEST(Keys, DefaultsAreInTheirRanges) {
  for (const Key& key : keys())
    for (const std::string_view toml : {key.fallback, key.fast})
      if (toml != required && toml != may_lack && toml != "[]" && toml != "{}") {
        const std::string path(key.path);
        SCOPED_TRACE(path);
        if (path.starts_with("bodies[]") || path.find("[]") != path.npos) continue;  // below, in a body
        const std::string preset = toml == key.fallback ? "paper" : "fast";  // keys that need one another
        std::vector<std::string> sets = {"planner.preset=" + preset, path + "=" + std::string(toml)};
        if (key.parent() == "goal.shape") sets.push_back("goal.shape.tolerance_m=0.25");
        if (key.parent() == "film.inset") sets.push_back("film.inset.camera=side");
        for (const std::string_view card : {"film.title", "film.end_card"})
          if (key.parent() == card) sets.push_back(fmt::format("{}.text=Before", card));
        EXPECT_NO_THROW(read_scene(good, "s", sets));
      }
  EXPECT_NO_THROW(read_scene(good, "s"));
}

// LIMBER_WRITE_DOCS=1 writes the page anew.
TEST(Keys, ReferencePageIsWhatTheReaderReads) {
  const fs::path page = fs::path(limber_source_dir) / "docs" / "scene.md";
  const std::string from = "<!-- keys: written by LIMBER_WRITE_DOCS=1 scenes_tests -->\n",
                    to = "<!-- end of keys -->\n";
  const std::string text = read_file(page);
  const auto begin = text.find(from), end = text.find(to);
  ASSERT_NE(begin, text.npos);
  ASSERT_NE(end, text.npos);
  const std::string wanted =
      text.substr(0, begin + from.size()) + "\n" + scene_reference() + text.substr(end);
  if (std::getenv("LIMBER_WRITE_DOCS")) write_file(page, wanted);
  EXPECT_EQ(read_file(page), wanted)
      << "docs/scene.md is behind the reader: run LIMBER_WRITE_DOCS=1 scenes_tests";
}

std::string all_of(const Model& model) {
  const auto v = [](const auto& x) { return fmt::format("{} {} ", x[0], x[1]); };
  const auto box_text = [&](const BoxModel& m) {
    return fmt::format("{}{} {} {} ", v(m.size_m), m.size_m[2], m.bevel_m, m.triangle_m);
  };
  if (const auto* m = std::get_if<FileModel>(&model))
    return fmt::format("file {} {} {} {} {}{} {}{}", m->file, m->made, m->scale, m->height_m.value_or(-1),
                       v(m->up), m->up[2], v(m->front), m->front[2]);
  if (const auto* m = std::get_if<MadeModel>(&model)) return fmt::format("made {} {}", m->made, m->height_m);
  if (const auto* m = std::get_if<BoxModel>(&model)) return "box " + box_text(*m);
  if (const auto* m = std::get_if<SphereModel>(&model))
    return fmt::format("sphere {} {}", m->diameter_m, m->triangle_m);
  if (const auto* m = std::get_if<TubeModel>(&model)) {
    std::string text = fmt::format("tube {} {} {} ", m->diameter_m, m->wall_m, m->triangle_m);
    for (const Vec3& p : m->path_m) text += v(p) + fmt::format("{} ", p[2]);
    return text;
  }
  if (const auto* m = std::get_if<BlocksModel>(&model)) {
    std::string text = fmt::format("blocks {} {} {} ", m->solids.size(), m->bevel_m, m->triangle_m);
    for (const auto* boxes : {&m->solids, &m->holes})
      for (const Box& b : *boxes)
        text += v(b.lower) + v(b.upper) + fmt::format("{} {} ", b.lower[2], b.upper[2]);
    return text;
  }
  const auto& plate = std::get<PlateModel>(model);
  return fmt::format("plate {}", box_text(plate.box)) +
         (plate.hole ? fmt::format("{} {} {}", plate.hole->round, plate.hole->size_m, v(plate.hole->center_m))
                     : "");
}

std::string all_of(const Scene& s) {
  const auto v = [](const auto& x) { return fmt::format("{} {} {} ", x[0], x[1], x[2]); };
  const auto b = [&](const Box& x) { return v(x.lower) + v(x.upper); };
  std::string t = fmt::format("{} {} {} {} {} {} {}\n", s.name, s.description, b(s.bounds_m), s.walls,
                              v(s.gravity_m_s2), s.rest_speed_m_s, s.max_dt_s.value_or(-1));
  t += fmt::format("{} {}\n", s.contact_offset_m.value_or(-1), s.part_overlaps);
  for (const BodySpec& body : s.bodies) {
    const MaterialSpec& m = body.material;
    t += fmt::format("{} {} {} {} {} | {} {} {} {} {} | {} {} {} {} {} {} {} | {} {} {} {} | {}", body.name,
                     int(body.role), int(body.kind),
                     4 * int(body.contact) + (body.self_contact ? int(*body.self_contact) : 2),
                     all_of(body.model), body.cage.tets, v(body.cage.cells), body.cage.cell_m, body.cage.mode,
                     body.cage.shells, m.model, m.youngs_modulus_pa, m.poisson_ratio, m.density_kg_m3,
                     m.damping_ratio, m.friction, m.mesh_independent, v(body.pose.position_m),
                     v(body.pose.axis), body.pose.angle_deg, body.pose.anchor, v(body.color_srgb));
    t += fmt::format(" {} {} {} {} {}", body.texture, body.opacity, body.roughness, body.metallic,
                     body.max_volume_change);
    t += fmt::format(" {}", int(body.deformation));
    t += fmt::format(" {} {} {}", body.fixed.walls, body.max_stretch.value_or(-1),
                     body.max_contact_load_n.value_or(-1));
    t += v(body.velocity_m_s) + v(body.angular_velocity_rad_s);
    t += fmt::format(" {} {}", m.fascia_hz, m.fascia_damping_ratio);
    t += fmt::format(" {} {}", m.mass_damping_per_s, v(body.gravity_m_s2.value_or(Vec3::Zero())));
    for (const Box& box : body.fixed.boxes_m) t += b(box);
    for (const PartSpec& part : body.parts)
      t += fmt::format(" {} {} {} {}", part.shell.value_or(-1), b(part.box_m),
                       part.youngs_modulus_pa.value_or(-1), part.density_kg_m3.value_or(-1));
    t += "\n";
  }
  for (const ForceSpec& f : s.forces)
    t += fmt::format("{} {} {} {} {}\n", f.body, f.from_s, f.to_s, v(f.force_n),
                     f.box_m ? b(*f.box_m) : std::string());
  for (const PressureSpec& p : s.pressures)
    t += fmt::format("{} {} {} {}\n", p.body, p.from_s, p.to_s, p.pressure_pa);
  for (const MotionSpec& m : s.motions) {
    t += fmt::format("{}", m.body);
    for (const MotionSpec::Keyframe& k : m.keyframes)
      t += fmt::format(" {} {} {} {}\n", k.at_s, v(k.position_m), v(k.axis), k.angle_deg);
  }
  for (const LigamentSpec& l : s.ligaments)
    t += fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}\n", l.name, l.from, v(l.from_m), l.to, v(l.to_m),
                     l.radius_m, l.stiffness_n_m, l.damping_ratio, l.rest_length, l.pushes,
                     l.diameter_m.value_or(-1), v(l.color_srgb));
  const PlannerSpec& p = s.planner;
  t += fmt::format("{} {} {} {} {}\n", s.robot, v(s.goal.center_of_mass_m), s.goal.radius_m,
                   s.goal.moves_with, s.goal.lost_below_m.value_or(-1));
  for (const auto& [ring, pieces] : s.goal.through) t += fmt::format("{} {}\n", ring, pieces);
  for (const Via& via : s.via)
    for (const auto& [ring, pieces] : via.goal.through) t += fmt::format("{} {}\n", ring, pieces);
  t += fmt::format("{} {} {} {}\n", s.goal.above, s.goal.below, s.goal.clear_of,
                   s.goal.box_m ? s.goal.box_m->lower.x() : 0);
  for (const Via& via : s.via)
    t += fmt::format("{} {} {} {} {} {} {} {}\n", v(via.goal.center_of_mass_m), via.goal.radius_m,
                     via.goal.moves_with, via.goal.above, via.goal.below, via.goal.clear_of, via.rest,
                     via.goal.box_m ? via.goal.box_m->lower.x() : 0);
  if (const auto& shape = s.goal.shape)
    t += fmt::format("{} {} {} {} {} {}\n", v(shape->axis), shape->angle_deg, v(shape->stretch), shape->cage,
                     shape->turn_tolerance_deg.value_or(-1), shape->tolerance_m.value_or(-1));
  if (s.goal.shape && s.goal.shape->half_turn) t += v(*s.goal.shape->half_turn);
  t += fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}\n", p.preset, p.seed, p.iterations,
                   p.goal_bias, p.weight_body, p.weight_control_point, p.weight_interpolation, p.max_force_n,
                   p.min_force_share, p.max_force_share, p.min_duration_s, p.max_duration_s,
                   p.control_point_radius_m, p.settle_time_s, p.settle_speed_m_s, p.settle_force_share);
  t += fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}\n", p.lag, p.metric, p.time_weight, p.guidance,
                   p.soft_price, p.density_price, p.look_s, p.learn_prices, p.steer, p.stop_in_goal,
                   p.end_hopeless, p.hold);
  t += fmt::format("{} {} {} {}\n", p.shortcut_rounds, p.settle_hold, p.lead, p.carry);
  t += fmt::format("{} {}\n", p.max_pressure_pa, s.goal.volume);
  for (const Box& patch : p.patches_m) t += b(patch);
  for (const CameraSpec& c : s.cameras) {
    t += fmt::format("{} {} {} {} {}", c.name, v(c.direction), c.fov_deg, c.turn_deg, c.follow);
    t += fmt::format(" {} {}", fmt::join(c.subjects, " "), c.fill);
    for (const Keyframe& k : c.keyframes) t += fmt::format(" {} {} {}", k.at, v(k.eye_m), v(k.target_m));
  }
  const FilmSpec& f = s.film;
  const Eigen::Vector2d range = f.color_range.value_or(Eigen::Vector2d(-1, -1));
  t += fmt::format("\n{} {} {} {} {} {} {}", f.width_px, f.height_px, f.frames_per_second,
                   v(f.background_srgb.value_or(Vec3(-1, -1, -1))), f.bounds_lines, f.sheet_columns,
                   f.sheet_rows);
  for (const BodySpec& body : s.bodies) t += fmt::format(" {}", int(body.look));
  for (const BodySpec& body : s.scenery) t += fmt::format(" {} {}", body.triangles, int(body.look));
  t += fmt::format(" {} {} {} {} {} {} {} {}", int(f.look), int(f.pace), f.slowest, f.quickest,
                   f.length_s.value_or(-1), int(f.end), f.panes, f.outlines);
  t += fmt::format(" {}", f.ground_m.value_or(-1));
  for (const LabelSpec& label : f.labels) t += fmt::format(" {} {}", label.body, label.text);
  for (const CutSpec& cut : f.cuts)
    t += fmt::format(" {} {} {}", v(cut.point_m), v(cut.normal), fmt::join(cut.bodies, " "));
  if (f.inset) t += fmt::format(" {} {}", f.inset->camera, f.inset->size);
  for (const auto& card : {f.title, f.end_card})
    if (card) t += fmt::format(" {} {} {}", fmt::join(card->lines, "|"), card->duration_s, card->plain);
  return t + fmt::format("\n{} {} {} {} {} {} {} {} {} {} {} {} {} {}", f.speed, f.transparent, f.caption,
                         f.clock, int(f.color_by), range[0], range[1], f.cages, f.forces, f.path, f.tree,
                         f.side_by_side, f.scale_bar, s.scenery.size());
}

}  // namespace
}  // namespace limber::scenes
