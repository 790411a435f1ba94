// The program as a user meets it: arguments in, files, texts and exit codes out.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <sstream>

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "limber/detail/body/body.h"
#include "limber/detail/body/export.h"
#include "limber/detail/body/preview.h"
#include "limber/detail/plan/diagnosis.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "limber/exit_codes.h"
#include "plan/search.h"
#include "render/png_file.h"
#include "scenes/scene.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

TEST_F(Program, RunFilmsASceneVerifyAgreesAndASecondRunChangesNothing) {
  // Of 24 seeds 8 press the cube's cage no deeper into walls and block than is promised.
  const std::string scene_file = scene(replaced("seed = 1", "seed = 6"));
  const Result first = limber_program({"run", scene_file, "-o", out(), "--json"});
  ASSERT_EQ(first.code, exit_done) << first.err;
  EXPECT_TRUE(first.json().at("plan").at("solved").get<bool>());
  for (const char* name : {"plan.npz", "film.mp4", "sheet.png", "volume.svg", "manifest.json",
                           "frames/0000.png", "bodies/robot/cage.msh"})
    EXPECT_TRUE(fs::exists(folder.path() / "out" / name)) << name;

  const Result verified = limber_program({"verify", out(), "--json"});
  EXPECT_EQ(verified.code, exit_done) << verified.err << verified.out;
  EXPECT_TRUE(verified.json().at("all_kept").get<bool>());

  const auto before = contents(out());
  const Result second = limber_program({"run", scene_file, "-o", out(), "--json"});
  EXPECT_EQ(second.code, exit_done);
  EXPECT_EQ(second.json().at("render").at("painted"), 0);
  for (const auto& file : contents(out())) {
    if (file.first == "manifest.json") continue;
    EXPECT_NE(std::find(before.begin(), before.end(), file), before.end()) << file.first << " has changed";
  }
}

// The paper's falling objects collide, all three, also where made models take the places of the fetched ones.
TEST_F(Program_slow, AllThreeFallingObjectsCollide) {
  const Result planned = limber_program({"plan", "falling_objects", "-o", out()});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  const std::string csv = out("observables.csv");
  const Result verified = limber_program({"verify", out(), "--observables", csv});
  ASSERT_EQ(verified.code, exit_done) << verified.err;
  const std::string text = read_file(csv), head = text.substr(0, text.find('\n'));
  for (const char* pair : {"bunny|dragon", "bunny|plate", "dragon|plate"})
    EXPECT_NE(head.find(fmt::format(",{}.contact_force_n", pair)), std::string::npos) << pair;
}

// One row a frame, as many numbers as the head has names, and their extremes are those that verify and plan
// tell.
TEST_F(Program_slow, ObservablesOfAPathAgreeWithItsSummary) {
  const std::string touching = scene(replaced("seed = 1", "seed = 3"));
  const Result planned = limber_program({"plan", touching, "-o", out(), "--json"});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  const std::string csv = out("observables.csv");
  const Result verified = limber_program({"verify", out(), "--observables", csv, "--json"});
  ASSERT_EQ(verified.code, exit_done) << verified.err;
  const Json motion = verified.json().at("motion");

  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(read_file(csv));
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  ASSERT_EQ(int(rows.size()), planned.json().at("frames").get<int>() + 1);
  const auto column = [&](const std::string& name) {
    const auto at = std::find(rows[0].begin(), rows[0].end(), name);
    EXPECT_NE(at, rows[0].end()) << name;
    std::vector<double> numbers;
    for (std::size_t r = 1; r < rows.size(); ++r)
      numbers.push_back(std::stod(rows[r].at(std::size_t(at - rows[0].begin()))));
    return numbers;
  };
  const auto largest = [&](const std::string& name) {
    const std::vector<double> numbers = column(name);
    return *std::max_element(numbers.begin(), numbers.end());
  };
  for (const auto& row : rows) EXPECT_EQ(row.size(), rows[0].size());
  const std::vector<double> times = column("time_s");
  EXPECT_EQ(times[0], 0);
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_NEAR(times[i] - times[i - 1], 0.2, 0.01);
  EXPECT_EQ(std::max(largest("robot.largest_strain"), largest("block.largest_strain")),
            motion.at("largest_strain"));
  EXPECT_EQ(largest("contact_force_n"), motion.at("largest_contact_force_n"));
  EXPECT_EQ(largest("penetration_m"), motion.at("deepest_penetration_m"));
  EXPECT_EQ(largest("overlap_m"), motion.at("deepest_overlap_m"));
  EXPECT_EQ(largest("self_overlap_m"), motion.at("deepest_self_overlap_m"));
  EXPECT_EQ(largest("gap_m"), motion.at("gap").at("worst_m"));
  EXPECT_EQ(largest("gap_at_contact_m"), motion.at("gap_at_contact").at("worst_m"));
  EXPECT_EQ(largest("gap_to_wall_m"), motion.at("gap_to_wall").at("worst_m"));
  // The strongest pair of each frame is the largest of the columns of pairs, which come last.
  const std::vector<double> strongest = column("contact_force_n");
  const auto is_pair = [](const std::string& name) { return name.find('|') != std::string::npos; };
  const auto first_pair = std::find_if(rows[0].begin(), rows[0].end(), is_pair);
  EXPECT_TRUE(std::all_of(first_pair, rows[0].end(), is_pair));
  EXPECT_NE(std::find(first_pair, rows[0].end(), "robot|block.contact_force_n"), rows[0].end());
  for (std::size_t r = 1; r < rows.size(); ++r) {
    double most = 0;
    for (std::size_t c = std::size_t(first_pair - rows[0].begin()); c < rows[r].size(); ++c)
      most = std::max(most, std::stod(rows[r][c]));
    EXPECT_EQ(most, strongest[r - 1]) << r;
  }
  const std::vector<double> pressing = column("pressing");
  EXPECT_GT(largest("pressing"), 0);
  EXPECT_EQ(std::accumulate(pressing.begin(), pressing.end(), 0.0),
            motion.at("gap").at("pairs_and_frames").get<double>());
  // The surfaces of the boxes are within their cages, and the nearest is not farther than where they press.
  EXPECT_LE(largest("overlap_m"), largest("penetration_m"));
  EXPECT_LE(motion.at("gap").at("worst_m").get<double>(),
            motion.at("gap_at_contact").at("worst_m").get<double>());
  EXPECT_EQ(std::max(largest("robot.largest_stretch"), largest("block.largest_stretch")),
            motion.at("largest_stretch"));
  // What is found is told beside the promises, and is the same on any number of threads.
  const std::string told = verified.json().at("measured").dump();
  for (const char* what : {"deepest overlap of two surfaces", "gap between surfaces that press each other",
                           "the same gap where the strongest force acts",
                           "gap between a surface and a wall that it presses", "a body's overlap with itself",
                           "deepest overlap of a surface and a wall", "least and largest stretch of a tet"})
    EXPECT_NE(told.find(what), std::string::npos) << what << " in " << told;
  const std::string again = out("again.csv");
  for (const char* threads : {"1", "2"}) {
    limber_program({"verify", out(), "--observables", again, "--threads", threads});
    EXPECT_EQ(read_file(again), read_file(csv)) << threads;
  }
  EXPECT_GT(largest("robot.contact_force_n"), 0);
  EXPECT_GT(largest("robot.kinetic_energy_j"), largest("robot.elastic_energy_j"));
  for (const auto& [key, value] : motion.items()) EXPECT_EQ(planned.json().at(key), value) << key;
  EXPECT_EQ(limber_program({"verify", out() + "/bodies/robot", "--observables", csv}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"verify", out(), "--observables", "/dev/null/x.csv"}).code, exit_bad_input);
}

// The same cube as one piece: every manipulation still makes sense, so a plan is found and keeps its
// promises.
TEST_F(Program_slow, ARigidRobotIsPlannedAndVerified) {
  const std::vector<std::string> sets{"--set", "bodies.robot.kind=rigid", "--set",
                                      "bodies.robot.material={ density_kg_m3 = 100 }"};
  std::vector<std::string> plan{"plan", scene(), "-o", out(), "--json"};
  plan.insert(plan.end(), sets.begin(), sets.end());
  const Result planned = limber_program(plan);
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  EXPECT_LT(planned.json().at("largest_volume_change_percent").at("robot").get<double>(), 1e-3);
  // It sets no time step of its own.
  const Json soft =
      limber_program({"plan", scene(), "-o", out("soft"), "--iterations", "1", "--json"}).json();
  EXPECT_GE(planned.json().at("dt_s").get<double>(), soft.at("dt_s").get<double>());
  const Result verified = limber_program({"verify", out()});
  EXPECT_EQ(verified.code, exit_done) << verified.out;
}

// The shells that `info` lists are those that a scene may name as parts; together they have all tets.
TEST_F(Program_slow, PartsAreChosenByTheShellsThatInfoLists) {
  std::ofstream(folder / "ell.obj")
      << "v 0 0 0\nv 1 0 0\nv 1 0.3 0\nv 0.3 0.3 0\nv 0.3 1 0\nv 0 1 0\n"
         "v 0 0 0.4\nv 1 0 0.4\nv 1 0.3 0.4\nv 0.3 0.3 0.4\nv 0.3 1 0.4\nv 0 1 0.4\n"
         "f 4 3 2 1\nf 6 5 4 1\nf 7 8 9 10\nf 7 10 11 12\n"
         "f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
  const std::string file =
      scene(replaced("{ box = { size_m = [0.4, 2, 0.9] } }\ncage = { cells = [2, 4, 2] }",
                     "{ file = \"ell.obj\" }\ncage = { tets = 200, shells = 2 }\n"
                     "parts = [{ shell = 1, youngs_modulus_pa = 2e4 }]"));
  const auto plan = [&](const std::string& name, const std::vector<std::string>& sets) {
    std::vector<std::string> words{"plan",
                                   file,
                                   "-o",
                                   out(name),
                                   "--iterations",
                                   "3",
                                   "--json",
                                   "--set",
                                   "bodies.block.fixed=[]",
                                   "--set",
                                   "bodies.block.pose.position_m=[2, 0.5, 0.5]"};
    for (const std::string& set : sets) words.insert(words.end(), {"--set", set});
    return limber_program(words);
  };
  const Result stiff = plan("out", {});
  ASSERT_EQ(stiff.code, exit_no_plan) << stiff.err;
  const Json info = limber_program({"info", out("out") + "/bodies/block", "--json"}).json();
  const int shells = info.at("shells").at("count");
  ASSERT_EQ(shells, 2);
  ASSERT_EQ(int(info.at("shell_list").size()), shells);
  int tets = 0;
  for (const Json& shell : info.at("shell_list")) tets += shell.at("tets").get<int>();
  EXPECT_EQ(tets, info.at("cage").at("tets").get<int>());

  const Result softer = plan("out", {"bodies.block.parts.0.youngs_modulus_pa=5e3"});
  EXPECT_GT(softer.json().at("dt_s").get<double>(), 1.3 * stiff.json().at("dt_s").get<double>());

  const Result none = plan("out", {"bodies.block.parts.0.shell=7"});
  EXPECT_EQ(none.code, exit_bad_input);
  EXPECT_NE(none.err.find(fmt::format("there is no shell 7; the body has {}", shells)), std::string::npos)
      << none.err;
  const Result empty =
      plan("out", {"bodies.block.parts=[{ box_m = [[0, 0, 0], [1, 1, 1]], density_kg_m3 = 5 }]"});
  EXPECT_EQ(empty.code, exit_bad_input);
  EXPECT_NE(empty.err.find("no tet of the cage has its middle in that box"), std::string::npos) << empty.err;
}

// A search of one iteration that finds no way.
struct Vain {
  Vain(const std::string& file, const std::vector<std::string>& sets, const fs::path& folder)
      : scene(scenes::read_scene_file(file, sets)),
        bodies(prepare_bodies(scene, {}, folder)),
        world(build_world(scene, bodies)),
        system(world, bodies, goal_rules_of(scene)) {
    plan::Settings settings = settings_of(scene, PlanOptions{});
    settings.max_iterations = 1;
    found = plan::plan(system, settings);
    EXPECT_FALSE(found.solved());
  }
  scenes::Scene scene;
  std::vector<PreparedBody> bodies;
  fem::World world;
  FemSystem system;
  plan::Plan found;
};

// Why a search came to nothing may take minutes to find; a stop is heard there too.
TEST_F(Program_slow, ADiagnosisHearsAStop) {
  const Vain vain(scene(), {"bodies.robot.max_volume_change=1e-6"}, out());  // refuses most pushes
  EXPECT_FALSE(diagnose(vain.world, vain.system, vain.found).text.empty());
  request_stop(SIGTERM);
  EXPECT_THROW(diagnose(vain.world, vain.system, vain.found), Interrupted);
  request_stop(0);
}

// A goal in the air, where the robot starts, in which nothing holds it: that it does not move yet is no rest.
// It is told how far away the robot is in the end, which is how far it fell to the floor, where it stands a
// little pressed.
TEST_F(Program_slow, ADiagnosisTellsWhereTheRobotComesToRest) {
  const Vain vain(scene(),
                  {"world.gravity_m_s2=[0, 0, -5]", "goal.center_of_mass_m=[0.6, 1, 1.3]",
                   "goal.radius_m=0.05", "planner.max_force_n=1"},
                  out());
  const Diagnosis told = diagnose(vain.world, vain.system, vain.found);
  EXPECT_NEAR(told.json.at("rest").at("distance_m").get<double>(), 1.3 - 0.3, 0.05);
  EXPECT_NEAR(told.json.at("weight_n").get<double>(), 0.6 * 0.6 * 0.6 * 100 * 5, 0.1);
  for (const char* words :
       {"What holds it there is too weak", "It weighs 108 N, and is pushed with 1 N at most"})
    EXPECT_NE(told.text.find(words), told.text.npos) << told.text;
}

// No motion hangs on shells, so none are made where nothing reads them; whoever wants them is told how.
TEST_F(Program_slow, BodiesOfAPlanHaveShellsWhereTheSceneReadsThem) {
  const std::string file = scene(replaced("size_m = [0.4, 2, 0.9] } }\ncage = { cells = [2, 4, 2] }",
                                          "size_m = [0.4, 1.6, 0.7] } }\ncage = { tets = 120 }"));
  const auto plan = [&](const std::string& name, const std::string& set) {
    std::vector<std::string> words{"plan",
                                   file,
                                   "-o",
                                   out(name),
                                   "--iterations",
                                   "2",
                                   "--json",
                                   "--set",
                                   "bodies.block.fixed=[]",
                                   "--set",
                                   "bodies.block.pose.position_m=[2, 1, 0.7]"};
    if (!set.empty()) words.insert(words.end(), {"--set", set});
    return limber_program(words);
  };
  const auto has_shells = [&](const std::string& name) {
    return fs::exists(fs::path(out(name)) / "bodies" / "block" / "shells.obj");
  };
  const Result bare = plan("bare", "");
  ASSERT_EQ(bare.code, exit_no_plan) << bare.err;
  EXPECT_FALSE(has_shells("bare"));
  const Result asked = plan("asked", "bodies.block.cage.shells=4");
  EXPECT_TRUE(has_shells("asked"));
  EXPECT_EQ(bare.json().at("tree_hash"), asked.json().at("tree_hash"));
  plan("named", "bodies.block.parts=[{ shell = 0, youngs_modulus_pa = 2e4 }]");
  EXPECT_TRUE(has_shells("named"));
  EXPECT_EQ(plan("paper", "bodies.block.cage.mode=paper").code, exit_no_plan);
  EXPECT_TRUE(has_shells("paper"));

  const auto exported = [&](const std::string& name, const std::string& format) {
    return limber_program({"export", out(name) + "/bodies/block", "--format", format});
  };
  EXPECT_EQ(exported("asked", "urdf").code, exit_done);
  EXPECT_EQ(exported("bare", "vtu").code, exit_done);
  const Result none = exported("bare", "urdf");
  EXPECT_EQ(none.code, exit_bad_input);
  EXPECT_NE(none.err.find("shells = 32"), std::string::npos) << none.err;
  const Result info = limber_program({"info", out("bare") + "/bodies/block", "--json"});
  EXPECT_EQ(info.code, exit_done) << info.err;
  EXPECT_FALSE(info.json().contains("shell_list"));

  // Shells of elsewhere, and settings that limber does not take, are told.
  const fs::path with_others = folder.path() / "others", odd = folder.path() / "odd";
  fs::copy(out("bare") + "/bodies/block", with_others);
  fs::copy_file(out("asked") + "/bodies/block/shells.obj", with_others / "shells.obj");
  const Result others = limber_program({"verify", with_others.string()});
  EXPECT_EQ(others.code, exit_defect);
  EXPECT_NE(others.out.find("shells.obj is there"), std::string::npos) << others.out;
  for (const char* from : {"bare", "asked"}) {
    fs::remove_all(odd);
    fs::copy(out(from) + "/bodies/block", odd);
    Json told = read_json(odd / "report.json");
    told["input"]["settings"]["shells"] = -1;
    write_json(odd / "report.json", told);
    const Result refused = limber_program({"verify", odd.string()});
    EXPECT_EQ(refused.code, exit_defect) << from;
    EXPECT_NE(refused.out.find("BROKEN  body: its settings are some that limber takes"), std::string::npos)
        << from << refused.out << refused.err;
  }

  // What verify says of such bodies, and of one whose tets name a shell all the same.
  const Result verified = limber_program({"verify", out("bare") + "/bodies/block"});
  EXPECT_EQ(verified.code, exit_done) << verified.out;
  const fs::path folder = fs::path(out("bare")) / "bodies" / "block";
  std::vector<int> shell_from_tet;
  const TetMesh cage = read_msh(folder / "cage.msh", &shell_from_tet);
  shell_from_tet.back() = 1;
  write_msh(folder / "cage.msh", cage, shell_from_tet);
  Json report = read_json(folder / "report.json");
  report["files"]["cage.msh"] = hex(hash_of_file(folder / "cage.msh"));
  write_json(folder / "report.json", report);
  const Result forged = limber_program({"verify", folder.string()});
  EXPECT_EQ(forged.code, exit_defect);
  EXPECT_NE(forged.out.find("no tet of the cage is of a shell"), std::string::npos) << forged.out;
}

TEST_F(Program_slow, TheSameSeedGivesTheSameBytesForAnyThreadCount) {
  std::vector<Json> results;
  for (const char* threads : {"1", "2", "2"})
    results.push_back(limber_program({"plan", scene(), "-o", out(threads + std::to_string(results.size())),
                                      "--threads", threads, "--json"})
                          .json());
  for (const Json& r : results) {
    EXPECT_EQ(r.at("tree_hash"), results[0].at("tree_hash"));
    EXPECT_EQ(r.at("trajectory_hash"), results[0].at("trajectory_hash"));
  }
  const Json other = limber_program({"plan", scene(), "-o", out("other"), "--seed", "2", "--json"}).json();
  EXPECT_NE(other.at("tree_hash"), results[0].at("tree_hash"));
}

TEST_F(Program_slow, ASearchCutShortAndResumedEndsLikeAnUninterruptedOne) {
  const Json whole = limber_program({"plan", scene(), "-o", out("whole"), "--json"}).json();
  const Result cut = limber_program({"plan", scene(), "-o", out("cut"), "--iterations", "2", "--json"});
  EXPECT_EQ(cut.code, exit_no_plan);
  EXPECT_EQ(cut.json().at("statistics").at("iterations"), 2);
  const Json resumed = limber_program({"plan", scene(), "-o", out("cut"), "--resume", "--json"}).json();
  EXPECT_EQ(resumed.at("tree_hash"), whole.at("tree_hash"));
  EXPECT_EQ(resumed.at("trajectory_hash"), whole.at("trajectory_hash"));
}

TEST_F(Program_slow, ASignalKeepsThePlanSoFar) {
  limber_program({"plan", scene(), "-o", out(), "--iterations", "3"});  // prepares the bodies
  fs::remove(fs::path(out()) / "plan.npz");
  request_stop(SIGINT);
  const Result stopped = limber_program({"plan", scene(), "-o", out()});
  request_stop(0);
  EXPECT_EQ(stopped.code, 130) << stopped.err;
}

TEST_F(Program_slow, ChunksOfFramesAreTheFramesOfOneRun) {
  ASSERT_EQ(limber_program({"run", scene(), "-o", out("whole")}).code, exit_done);
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out("parts")}).code, exit_done);
  for (const char* chunk : {"2/3", "1/3", "3/3"}) {
    EXPECT_FALSE(fs::exists(fs::path(out("parts")) / "film.mp4"));
    EXPECT_EQ(limber_program({"render", out("parts"), "--chunk", chunk, "--threads", "1"}).code, exit_done);
  }
  EXPECT_TRUE(fs::exists(fs::path(out("parts")) / "film.mp4"));
  EXPECT_EQ(contents(fs::path(out("whole")) / "frames"), contents(fs::path(out("parts")) / "frames"));
}

TEST_F(Program_slow, ResumePaintsOnlyFramesThatAreMissingOrDamaged) {
  ASSERT_EQ(limber_program({"run", scene(), "-o", out()}).code, exit_done);
  const fs::path frames = fs::path(out()) / "frames";
  const auto good = contents(frames);
  ASSERT_GT(good.size(), 3u);
  fs::remove(frames / "0001.png");
  fs::resize_file(frames / "0002.png", fs::file_size(frames / "0002.png") / 2);
  const Result resumed = limber_program({"render", out(), "--resume", "--json"});
  EXPECT_EQ(resumed.json().at("painted"), 2);
  EXPECT_EQ(contents(frames), good);
}

TEST_F(Program_slow, BadScenesAreRefusedWithAPlaceAndAWayOut) {
  struct Case {
    std::string text, place, words;
  };
  const std::vector<Case> cases{
      {"", "scene.toml:1", ""},
      {replaced("gravity_m_s2", "gravity"), "scene.toml:4:1", "gravity_m_s2"},
      {replaced("iterations = 400", "iterations = \"many\""), "scene.toml:30:14", ""},
      {replaced("poisson_ratio = 0.45", "poisson_ratio = 0.7"), "scene.toml:11:", ""},
      {replaced("center_of_mass_m = [3.2, 1, 1]", "center_of_mass_m = [5, 1, 1]"), "scene.toml:", ""},
      {replaced("role = \"obstacle\"", "role = \"robot\""), "scene.toml:", "robot"},
      {replaced("size_m = [0.6, 0.6, 0.6]", "size_m = [0, 0.6, 0.6]"), "scene.toml:9:", ""},
      {replaced("max_force_n = 100", "max_force_n = nan"), "scene.toml:31:15", ""},
      {replaced("pose = { position_m = [0.6, 1, 1.3] }", "pose = { position_m = [1.9, 1, 1] }"),
       "scene.toml:12:23", "overlap"},
  };
  for (const Case& c : cases) {
    const Result run = limber_program({"plan", scene(c.text), "-o", out()});
    EXPECT_EQ(run.code, exit_bad_input) << c.text;
    EXPECT_NE(run.err.find(c.place), std::string::npos) << c.place << " in: " << run.err;
    EXPECT_NE(run.err.find(c.words), std::string::npos) << c.words << " in: " << run.err;
    EXPECT_FALSE(fs::exists(fs::path(out()) / "plan.npz"));
  }
}

TEST_F(Program, UsageErrorsAreBadInput) {
  EXPECT_EQ(limber_program({}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"paint"}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"plan", "barriers1"}).code, exit_bad_input);  // no -o
  EXPECT_EQ(limber_program({"prepare", "x.obj", "-o", out(), "--tets", "many"}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"prepare", "x.obj", "-o", out(), "--tets", "3"}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"plan", scene(), "-o", out(), "--set", "planner.iteration=5"}).code,
            exit_bad_input);
  EXPECT_NE(limber_program({"refine", out(), "-o", out("fine"), "--tets-factor", "nan"})
                .err.find("nan is no number"),
            std::string::npos);
  EXPECT_EQ(limber_program({"plan", "no_such_scene", "-o", out()}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"render", out("nothing")}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"verify", folder.path().string()}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"info", out("nothing")}).code, exit_bad_input);
  for (const auto& words :
       {std::vector<std::string>{"verify", ""}, {"robust", ""}, {"plan", ""}, {"plan", scene(), "-o", ""}}) {
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_bad_input);
    EXPECT_NE(result.err.find("is empty; give a name"), std::string::npos) << result.err;
  }
  // A picture that cannot be written is refused before it is painted.
  for (const char* picture : {"--still", "--storyboard"})
    for (const auto& [file, told] : {std::pair(out("nowhere/x.png"), "make it first"),
                                     {folder.path().string(), "write for example"},
                                     {out("a.png"), "is a folder"}}) {
      fs::create_directories(out("a.png"));
      const Result result = limber_program({"render", scene(), picture, "-o", file});
      EXPECT_EQ(result.code, exit_bad_input);
      EXPECT_NE(result.err.find(told), std::string::npos) << result.err;
    }
  for (const char* command :
       {"prepare", "plan", "render", "export", "run", "verify", "report", "info", "scenes"})
    EXPECT_EQ(limber_program({command, "--help"}).code, exit_done) << command;
  EXPECT_EQ(limber_program({"--version"}).out, "limber 0.1.0\n");
}

TEST_F(Program, AnErrorIsOneJsonDocumentToo) {
  const Result run = limber_program({"plan", "no_such_scene", "-o", out(), "--json"});
  EXPECT_EQ(run.json().at("exit_code"), exit_bad_input);
  EXPECT_NE(run.json().at("error").get<std::string>().find("no_such_scene"), std::string::npos);
  const Result usage = limber_program({"plan", "barriers1", "-o", out(), "--json", "--seed", "abc"});
  EXPECT_EQ(usage.json().at("exit_code"), exit_bad_input);
  EXPECT_NE(usage.json().at("error").get<std::string>().find("abc"), std::string::npos);
}

TEST_F(Program, AnUnwritableFolderIsADiskError) {
  EXPECT_EQ(limber_program({"plan", scene(), "-o", "/dev/null/out"}).code, exit_disk);
  std::ofstream(folder / "file") << "x";
  EXPECT_EQ(limber_program({"plan", scene(), "-o", (folder / "file").string()}).code, exit_disk);
}

// A limit on the size of a file makes write() fail in its middle, as a full disk does.
TEST_F(Program_slow, ADiskThatFillsUpLeavesNothingHalfWritten) {
  const std::string scene_file = scene();
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const rlimit small{20000, old.rlim_max};
  signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  const Result run = limber_program({"plan", scene_file, "-o", out()});
  setrlimit(RLIMIT_FSIZE, &old);
  signal(SIGXFSZ, SIG_DFL);
  EXPECT_EQ(run.code, exit_disk) << run.err;
  for (const auto& [name, content] : contents(out())) EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
  EXPECT_EQ(limber_program({"plan", scene_file, "-o", out()}).code,
            exit_done);  // with room, the same command goes through
}

TEST_F(Program_slow, FilesThatDoNotBelongTogetherAreRefused) {
  const std::string kept = scene(replaced("seed = 1", "seed = 6"));  // all promises are
  ASSERT_EQ(limber_program({"plan", kept, "-o", out()}).code, exit_done);
  const fs::path cage = fs::path(out()) / "bodies" / "robot" / "cage.msh";
  const std::string content = read_file(cage);
  std::ofstream(cage) << content << " ";
  const Result changed = limber_program({"render", out()});
  EXPECT_EQ(changed.code, exit_bad_input);
  EXPECT_NE(changed.err.find("the scene's plan"), std::string::npos) << changed.err;
  write_file(cage, content);
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);

  // Bodies of another shape: the plan says that it is not theirs.
  ASSERT_EQ(limber_program({"plan", scene(replaced("[0.6, 0.6, 0.6]", "[0.6, 0.6, 0.5]")), "-o", out("other"),
                            "--seed", "3"})
                .code,
            exit_done);
  fs::copy_file(fs::path(out()) / "plan.npz", fs::path(out("other")) / "plan.npz",
                fs::copy_options::overwrite_existing);
  EXPECT_EQ(limber_program({"verify", out("other")}).code, exit_bad_input);
}

TEST_F(Program, PrepareReportsAndVerifyProvesAgain) {
  std::ofstream(folder / "tetrahedron.obj")
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  const Result prepared = limber_program(
      {"prepare", (folder / "tetrahedron.obj").string(), "-o", out(), "--tets", "100", "--json"});
  ASSERT_EQ(prepared.code, exit_done) << prepared.err;
  // Cut, so that it can bend.
  EXPECT_GT(prepared.json().at("surface").at("triangles"), 1000);
  EXPECT_NEAR(prepared.json().at("surface").at("volume_m3"), 1. / 6, 1e-12);
  EXPECT_NE(prepared.json().at("mended").dump().find("cut long edges"), std::string::npos);
  EXPECT_EQ(prepared.json().at("shells").at("count"), 1);
  EXPECT_TRUE(prepared.json().at("certificate").at("holds").get<bool>());
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);
  EXPECT_EQ(limber_program({"info", out()}).code, exit_done);
  for (const char* name :
       {"surface.ply", "shells.obj", "cage.msh", "binding.npz", "contact.npz", "report.json"})
    EXPECT_EQ(limber_program({"info", (fs::path(out()) / name).string()}).code, exit_done) << name;
}

// As models of maps lie. Farther away, or smaller than anything, there is no body that could be read again.
TEST_F(Program_slow, FarFromTheOriginABodyIsKeptOrRefused) {
  const std::string model = (folder / "far.obj").string();
  const auto prepared = [&](double far_m, double size_m) {
    std::ofstream file(model);
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)})
      file << fmt::format("v {:.17g} {:.17g} {:.17g}\n", far_m + size_m * p.x(), size_m * p.y() - far_m,
                          size_m * p.z());
    file << "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    file.close();
    return limber_program({"prepare", model, "-o", out(), "--tets", "60"});
  };
  for (const double far_m : {5.4e6, 9e7}) {
    const Result near_enough = prepared(far_m, 0.37);
    ASSERT_EQ(near_enough.code, exit_done) << near_enough.err;
    const Result kept = limber_program({"verify", out()});
    EXPECT_EQ(kept.code, exit_done) << kept.out;
  }
  for (const auto& [far_m, size_m] : {std::pair(1e12, 1.), {0., 1e-28}, {0., 1e28}}) {
    const Result beyond = prepared(far_m, size_m);
    EXPECT_EQ(beyond.code, exit_bad_input);
    EXPECT_NE(beyond.err.find("scale or move the model"), std::string::npos) << beyond.err;
  }
}

// Of its own triangles: cut as other models are it would have ten thousand.
TEST_F(Program_slow, ACubeHasOneExactPart) {
  const std::string model = (folder / "cube.obj").string();
  std::ofstream(model) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
                          "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  const Result parts = limber_program({"prepare", model, "-o", out(), "--exact", "--json"});
  ASSERT_EQ(parts.code, exit_done) << parts.err;
  EXPECT_EQ(parts.json().at("shells").at("count"), 1);
  EXPECT_EQ(parts.json().at("surface").at("triangles"), 12);
  EXPECT_EQ(limber_program({"verify", out(), "--model", model}).code, exit_done);
}

// An open model has no exact parts, which shows after it was read.
TEST_F(Program_slow, ARefusedModelLeavesTheFolderAsItWas) {
  const std::string model = (folder / "open.obj").string();
  std::ofstream(model) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
  EXPECT_EQ(limber_program({"prepare", model, "-o", out("new"), "--exact"}).code, exit_bad_input);
  EXPECT_FALSE(fs::exists(out("new")));
  ASSERT_EQ(limber_program({"prepare", model, "-o", out(), "--tets", "100"}).code, exit_done);
  const auto before = contents(out());
  EXPECT_EQ(limber_program({"prepare", model, "-o", out(), "--exact"}).code, exit_bad_input);
  EXPECT_EQ(contents(out()), before);
}

TEST_F(Program_slow, ExportsAreWrittenAlsoOfABodyThatIsUpToDateAndGoWithIt) {
  const std::string model = (folder / "tetrahedron.obj").string();
  std::ofstream(model) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  ASSERT_EQ(limber_program({"prepare", model, "-o", out(), "--tets", "100"}).code, exit_done);
  const std::string formats = fmt::format("{}", fmt::join(export_formats, ","));
  const Result exported = limber_program(
      {"prepare", model, "-o", out(), "--tets", "100", "--export", formats, "--density", "500", "--json"});
  ASSERT_EQ(exported.code, exit_done) << exported.err;
  EXPECT_NE(exported.err.find("up to date"), std::string::npos) << exported.err;
  const Json files = exported.json().at("also_written");
  EXPECT_EQ(files.size(), 28);  // one of them the only hull
  const Json mass = Json::parse(read_file(fs::path(out()) / "mass.json"));
  EXPECT_NEAR(mass.at("whole").at("mass_kg").get<double>(), 500. / 6, 1e-9);
  for (const Json& name : files) EXPECT_TRUE(fs::exists(fs::path(out()) / name)) << name;

  // Of the body alone, elsewhere: the same files, and the cage with them.
  const Result elsewhere = limber_program(
      {"export", out(), "--format", formats, "-o", out("elsewhere"), "--density", "500", "--json"});
  ASSERT_EQ(elsewhere.code, exit_done) << elsewhere.err;
  EXPECT_EQ(elsewhere.json().at("files").size(), files.size() + 1);
  for (const auto& [name, bytes] : contents(out("elsewhere")))
    EXPECT_EQ(bytes, read_file(fs::path(out()) / name)) << name;

  const std::string command = std::string(limber_source_dir) + "/tools/check_exports '" + out() + "'";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));

  ASSERT_EQ(limber_program({"prepare", model, "-o", out(), "--tets", "200"}).code, exit_done);
  for (const Json& name : files)
    EXPECT_FALSE(fs::exists(fs::path(out()) / name)) << name << " is of the old cage";

  EXPECT_FALSE(fs::exists(fs::path(out()) / "hulls"));
  EXPECT_EQ(limber_program({"prepare", model, "-o", out(), "--export", "stl"}).code, exit_bad_input);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "no other program's reader is installed: see " << command;
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

// Two boxes apart: masses, centres and moments of each and of both are those of the book, by Steiner's
// theorem. Shells stand off by a millionth.
TEST_F(Program_slow, MassesOfHullsAndOfTheWholeAreThoseOfTheBook) {
  struct Brick {
    Vec3 lower, upper;
    double mass() const { return 500 * (upper - lower).prod(); }
    Vec3 center() const { return (lower + upper) / 2; }
    Eigen::Matrix3d inertia() const {
      const Vec3 square = (upper - lower).cwiseAbs2();
      return (mass() / 12 * (Vec3::Constant(square.sum()) - square)).asDiagonal();
    }
  };
  const std::array bricks{Brick{{0, 0, 0}, {1, 2, 3}}, Brick{{2, 0, 0.5}, {2.5, 1, 1.5}}};
  const std::string model = (folder / "bricks.obj").string();
  {
    std::ofstream file(model);
    for (const Brick& b : bricks)
      for (int corner = 0; corner < 8; ++corner)
        file << fmt::format("v {} {} {}\n", (corner & 1 ? b.upper : b.lower).x(),
                            (corner & 2 ? b.upper : b.lower).y(), (corner & 4 ? b.upper : b.lower).z());
    for (const int first : {1, 9})
      for (const auto& [a, b, c, d] :
           {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
        file << fmt::format("f {} {} {} {}\n", first + a, first + b, first + c, first + d);
  }
  ASSERT_EQ(limber_program({"prepare", model, "-o", out(), "--tets", "100", "--shells", "2", "--export",
                            "mjcf,urdf", "--density", "500"})
                .code,
            exit_done);
  const Json told = Json::parse(read_file(fs::path(out()) / "mass.json"));
  const auto expect = [](const Json& one, double mass, const Vec3& center, const Eigen::Matrix3d& inertia,
                         double to) {
    EXPECT_NEAR(one.at("mass_kg").get<double>(), mass, to * mass);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(one.at("center_m").at(i).get<double>(), center[Eigen::Index(i)], to);
      for (std::size_t j = 0; j < 3; ++j)
        EXPECT_NEAR(one.at("inertia_kg_m2").at(i).at(j).get<double>(),
                    inertia(Eigen::Index(i), Eigen::Index(j)), to * mass)
            << i << j;
    }
  };
  const Json& hulls = told.at("hulls");
  ASSERT_EQ(hulls.size(), 2);
  const bool swapped = hulls.at(0).at("mass_kg") < hulls.at(1).at("mass_kg");
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  const double mass = bricks[0].mass() + bricks[1].mass();
  const Vec3 center = (bricks[0].mass() * bricks[0].center() + bricks[1].mass() * bricks[1].center()) / mass;
  for (std::size_t b = 0; b < 2; ++b) {
    expect(hulls.at(swapped ? 1 - b : b), bricks[b].mass(), bricks[b].center(), bricks[b].inertia(), 1e-4);
    const Vec3 way = bricks[b].center() - center;
    inertia += bricks[b].inertia() +
               bricks[b].mass() * (way.squaredNorm() * Eigen::Matrix3d::Identity() - way * way.transpose());
  }
  expect(told.at("whole"), mass, center, inertia, 1e-9);
  const std::string xml = read_file(fs::path(out()) / "body.xml");
  for (std::size_t hull = 0; hull < 2; ++hull)
    EXPECT_NE(xml.find(fmt::format("mesh=\"hull_00{}\" group=\"3\" mass=\"{}\"", hull,
                                   hulls.at(hull).at("mass_kg").get<double>())),
              std::string::npos)
        << xml;
}

TEST_F(Program_slow, ExportsOfABodyAskForABody) {
  const std::string model = (folder / "tetrahedron.obj").string();
  std::ofstream(model) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  for (const char* name : {"one", "two"})
    ASSERT_EQ(limber_program({"prepare", model, "-o", out(name), "--tets", "100"}).code, exit_done);
  fs::create_directory(out("empty"));
  const auto expect_refused = [&](std::vector<std::string> words, const std::string& why) {
    words.insert(words.begin(), "export");
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_bad_input) << why;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
  };
  const auto before = contents(folder.path());
  expect_refused({out("one"), "--format", "gltf"}, "the format gltf is of motions");
  expect_refused({out("one"), "--format", "vtk", "--frames", "0"}, "--frames is of motions");
  expect_refused({out("empty"), "--format", "vtk"}, "the format vtk is of bodies");
  expect_refused({out("empty"), "--format", "vtu", "--density", "1"}, "--density is of bodies");
  expect_refused({out("one"), "--format", "msh", "-o", out("two")}, "the folder of another body");
  EXPECT_EQ(contents(folder.path()), before);
  const Result beside = limber_program({"export", out("one"), "--format", "vtk,msh", "--json"});
  EXPECT_EQ(beside.code, exit_done) << beside.err;
  EXPECT_EQ(beside.json().at("files"), Json::array({"cage.vtk"}));  // the cage is there already
  EXPECT_TRUE(fs::exists(fs::path(out("one")) / "cage.vtk"));
  fs::remove(fs::path(out("one")) / "cage.msh");
  expect_refused({out("one"), "--format", "vtk"}, "cage.msh");
}

TEST_F(Program_slow, PreviewPaintsTheSamePicturesEachTime) {
  const std::string model = (folder / "tetrahedron.obj").string();
  std::ofstream(model) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  for (const char* name : {"one", "two"})
    ASSERT_EQ(limber_program({"prepare", model, "-o", out(name), "--tets", "100", "--preview"}).code,
              exit_done);
  for (const char* name :
       {"preview-shells.png", "preview-cage.png", "preview-cut.png", "preview-dihedrals.png"}) {
    const auto picture = render::inspect_png(folder.path() / "one" / name);
    ASSERT_TRUE(picture) << name;
    EXPECT_EQ(picture->width, 1600) << name;
    EXPECT_EQ(read_file(folder.path() / "one" / name), read_file(folder.path() / "two" / name)) << name;
  }
  // Nor does it matter where the model lies: two million of its lengths from the origin, to the bit where no
  // coordinate is rounded there.
  const auto painted = [&](const char* name, double at) {
    const auto moved = [&](Points& p) { p = (p * 0x1p20).array().round() * 0x1p-20 + at; };
    PreparedBody body = read_body(folder.path() / "one");
    std::vector<ConvexShell> shells = read_obj_shells(folder.path() / "one" / "shells.obj");
    moved(body.surface.positions), moved(body.cage.positions);
    for (ConvexShell& shell : shells) moved(shell.vertices);
    make_folder(folder.path() / name);
    write_previews(body, shells, folder.path() / name);
    return contents(folder.path() / name);
  };
  EXPECT_EQ(painted("here", 0), painted("there", 0x1p21));
  ASSERT_EQ(limber_program({"prepare", model, "-o", out("one"), "--tets", "200"}).code, exit_done);
  EXPECT_FALSE(fs::exists(folder.path() / "one" / "preview-cut.png")) << "it shows the old cage";
}

}  // namespace
}  // namespace limber::detail
