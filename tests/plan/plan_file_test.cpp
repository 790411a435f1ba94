#include "plan/plan_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/error.h"
#include "core/npz.h"
#include "plan/timings.h"
#include "tests/core/temporary_folder.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

struct PlanFileTest : ::testing::Test {
  TemporaryFolder folder;
  fs::path file(const char* name = "plan.npz") const { return folder / name; }
};

void expect_same(const Plan& a, const Plan& b) {
  EXPECT_EQ(hash_of(a.tree), hash_of(b.tree));
  EXPECT_EQ(hash_of(a.trajectory), hash_of(b.trajectory));
  EXPECT_EQ(a.trajectory.frames, b.trajectory.frames);
  EXPECT_EQ(a.trajectory.end, b.trajectory.end);
  EXPECT_EQ(a.trajectory.controls, b.trajectory.controls);
  EXPECT_EQ(a.goal_node, b.goal_node);
  EXPECT_EQ(a.best_node, b.best_node);
  EXPECT_EQ(a.best_distance_m, b.best_distance_m);
  EXPECT_EQ(a.system_hash, b.system_hash);
  EXPECT_EQ(a.ending, b.ending);
  EXPECT_EQ(json_of(a.settings), json_of(b.settings));
  EXPECT_EQ(without_timings(json_of(a.statistics)), without_timings(json_of(b.statistics)));
}

// The same with a second carrier.
Control carried(Control control) {
  control.manipulation = Manipulation::control_point;
  control.node = 0, control.second_node = 1, control.second_force_n = {1, 2, -3};
  return control;
}

// Of plans in which nobody carries nothing is told of it.
TEST_F(PlanFileTest, SecondCarriersComeBack) {
  Plan p = plan(Toy(5, true, true, 1.6f), toy_settings());
  EXPECT_FALSE(npz_of(p, {}).arrays.contains("path_second_node"));
  const std::uint64_t before = hash_of(p.trajectory);
  p.trajectory.controls[1] = carried(p.trajectory.controls[1]);
  p.tree.controls[2] = carried(p.tree.controls[2]);
  EXPECT_NE(hash_of(p.trajectory), before);
  write_plan(file(), p, {});
  const PlanFile back = read_plan(file());
  expect_same(back.plan, p);
  EXPECT_EQ(back.plan.tree.controls, p.tree.controls);
}

// Likewise, and settings that nobody has are not in the file, as in those of before.
TEST_F(PlanFileTest, PressuresComeBack) {
  Settings settings = toy_settings();
  EXPECT_FALSE(json_of(settings).contains("max_pressure_pa"));
  settings.max_pressure_pa = 300, settings.settle.pressure_pa = 200;
  Plan p = plan(Toy(5, true, true, 1.6f), settings);
  Plan slack = p;
  for (std::vector<Control>* controls : {&slack.trajectory.controls, &slack.tree.controls})
    for (Control& control : *controls) control.pressure_pa = 0;
  EXPECT_FALSE(npz_of(slack, {}).arrays.contains("path_pressure_pa"));
  EXPECT_TRUE(std::any_of(p.tree.controls.begin(), p.tree.controls.end(),
                          [](const Control& control) { return control.pressure_pa > 0; }));
  EXPECT_NE(hash_of(p.tree), hash_of(slack.tree));
  write_plan(file(), p, {});
  const PlanFile back = read_plan(file());
  expect_same(back.plan, p);
  EXPECT_EQ(back.plan.tree.controls, p.tree.controls);
  EXPECT_EQ(back.plan.settings.settle.pressure_pa, 200);
}

TEST_F(PlanFileTest, RoundTrip) {
  const Json given = {{"scene", "name = \"toy\"\n"}, {"version", "0.1"}};
  Settings settings = toy_settings();
  for (const std::int64_t iterations : {0, 10, 2000}) {
    settings.max_iterations = iterations;
    const Plan p = plan(Toy(5, true, true, 1.6f), settings);
    write_plan(file(), p, given);
    const PlanFile back = read_plan(file());
    expect_same(back.plan, p);
    EXPECT_EQ(back.given, given);
  }
}

TEST_F(PlanFileTest, TheSameSearchWritesTheSameBytesHoweverItRan) {
  const Toy toy(5, true, true, 1.6f);
  Settings settings = toy_settings();
  settings.in_flight = 1;
  const Plan one = plan(toy, settings);
  settings.in_flight = 32, settings.time_limit_s = 1e6;
  Plan other = plan(toy, settings);
  other.statistics.cpu_s = 7, other.statistics.wall_s = 8, ++other.statistics.rollouts;
  write_plan(file("a.npz"), one, {});
  write_plan(file("b.npz"), other, {});
  EXPECT_EQ(read_file(file("a.npz")), read_file(file("b.npz")));
  // A limit that was reached is a result: the explanation tells it.
  settings.time_limit_s = 0;
  write_plan(file(), plan(toy, settings), {});
  EXPECT_EQ(read_plan(file()).plan.settings.time_limit_s, 0);
}

// They had the costs among the counts, and all settings.
TEST_F(PlanFileTest, AFileWithCostsInItIsReadAndWrittenAgainAsItWas) {
  Settings settings = toy_settings();
  settings.in_flight = 7, settings.time_limit_s = 1e6;
  const Plan p = plan(Toy(5, true, true, 1.6f), settings);
  const Npz before = npz_of(p, {{"note", "mine"}}, 3);
  write_npz(file(), before);
  const PlanFile read = read_plan(file());
  EXPECT_EQ(read.edition, 3);
  EXPECT_TRUE(read.sealed());
  expect_same(read.plan, p);
  EXPECT_EQ(json_of(read.plan.statistics), json_of(p.statistics));
  EXPECT_EQ(json_of(read.plan.settings), json_of(p.settings));
  const Npz again = npz_of(read.plan, read.given, read.edition);
  EXPECT_EQ(again.texts, before.texts);
  EXPECT_EQ(again.arrays, before.arrays);
}

TEST_F(PlanFileTest, ASavedTreeGoesOnToTheSameBytes) {
  const Toy toy(5, true, true, 1.6f);
  Settings s = toy_settings();
  const Plan whole = plan(toy, s);
  for (const std::int64_t cut :
       {std::int64_t(1), whole.statistics.iterations / 2, whole.statistics.iterations - 1}) {
    s.max_iterations = cut;
    write_plan(file(), plan(toy, s), {});
    s.max_iterations = toy_settings().max_iterations;
    const Plan resumed = plan(toy, s, read_plan(file()).plan);
    EXPECT_EQ(hash_of(resumed.tree), hash_of(whole.tree)) << cut;
    EXPECT_EQ(hash_of(resumed.trajectory), hash_of(whole.trajectory)) << cut;
    EXPECT_EQ(resumed.statistics.iterations, whole.statistics.iterations) << cut;
  }
}

// What is kept is the path, node by node, and by number and hash what the whole tree was.
TEST_F(PlanFileTest, APathAloneComesBackAndIsNotResumed) {
  const Toy toy(5, true, true, 1.6f);
  const Settings s = toy_settings();
  const Plan whole = plan(toy, s);
  Plan p = whole;
  keep_path(p);
  const std::vector<int> path = path_to(whole.tree, whole.best_node);
  ASSERT_LT(std::size_t(p.tree.size()), std::size_t(whole.tree.size()));
  ASSERT_EQ(p.left_out->numbers, path);
  write_plan(file(), p, {});
  const PlanFile back = read_plan(file());
  EXPECT_EQ(back.edition, path_alone);
  expect_same(back.plan, p);
  EXPECT_EQ(nodes_of(back.plan), whole.tree.size());
  EXPECT_EQ(tree_hash_of(back.plan), hash_of(whole.tree));
  EXPECT_EQ(back.plan.left_out->search_hash, hash_of_search(whole.tree));
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto n = std::size_t(path[i]);
    EXPECT_EQ(State(back.plan.tree.states[i]), State(whole.tree.states[n]));
    EXPECT_EQ(back.plan.tree.controls[i], whole.tree.controls[n]);
    EXPECT_EQ(back.plan.tree.iterations[i], whole.tree.iterations[n]);
  }
  const Npz npz = npz_of(back.plan, back.given, back.edition);
  EXPECT_EQ(npz.arrays, read_npz(file()).arrays);
  EXPECT_EQ(npz.texts, read_npz(file()).texts);
  try {
    plan(toy, s, back.plan);
    FAIL() << "a search went on from a path";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("holds its path alone"), std::string::npos) << error.what();
  }
}

TEST_F(PlanFileTest, APathAloneThatContradictsItselfIsRefused) {
  Plan good = plan(Toy(5, true, true, 1.6f), toy_settings());
  keep_path(good);
  const std::vector<std::pair<std::string, std::function<void(Plan&)>>> edits{
      {"tree_number[0]", [](Plan& p) { p.left_out->numbers[0] = 1; }},
      {"tree_number[1]", [](Plan& p) { p.left_out->numbers[1] = 0; }},
      {"whole_tree.nodes", [](Plan& p) { p.left_out->nodes = 2; }},
      {"best_node is not the last", [](Plan& p) { p.goal_node = -1, p.best_node = 0; }}};
  for (const auto& [complaint, edit] : edits) {
    Plan bad = good;
    edit(bad);
    write_plan(file(), bad, {});
    try {
      read_plan(file());
      ADD_FAILURE() << complaint;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(complaint), std::string::npos) << error.what();
    }
  }
}

// Rows that come piece by piece make the same file as arrays that are whole.
TEST_F(PlanFileTest, WrittenByPiecesItHasTheBytesOfTheWhole) {
  Plan p = plan(Toy(40, true, true, 1.6f), toy_settings());
  while (p.tree.size() < 3000) {  // more than a piece
    const int n = p.tree.size();
    State state = p.tree.states[std::size_t(n - 1)];
    for (float& x : state.positions) x += 0.01f;
    state.step += 1;
    p.tree.add(state, n - 1, {.steps = 1}, -1, Vec3f(1, 2, float(n)));
  }
  write_plan(file(), p, {{"note", "mine"}});
  write_npz(file("whole.npz"), npz_of(p, {{"note", "mine"}}));
  EXPECT_EQ(read_file(file()), read_file(file("whole.npz")));
  expect_same(read_plan(file()).plan, p);
}

TEST_F(PlanFileTest, EveryTruncatedPrefixIsAnInputError) {
  Settings s = toy_settings();
  s.max_iterations = 3;
  s.frames_per_second = 1;
  write_plan(file(), plan(Toy(), s), {});
  const std::string whole = read_file(file());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    fs::remove(file("cut.npz"));  // to overwrite it in place makes the file system wait for the disk
    std::ofstream(file("cut.npz"), std::ios::binary) << whole.substr(0, size);
    ASSERT_THROW(read_plan(file("cut.npz")), InputError) << size << " of " << whole.size() << " bytes";
  }
}

TEST_F(PlanFileTest, AMissingOrReshapedEntryIsAnInputError) {
  write_plan(file(), plan(Toy(), toy_settings()), {});
  const Npz good = read_npz(file());
  const auto expect_refused = [&](const Npz& bad, const std::string& why) {
    write_npz(file("bad.npz"), bad);
    EXPECT_THROW(read_plan(file("bad.npz")), InputError) << why;
  };
  for (const auto& [name, array] : good.arrays) {
    Npz bad = good;
    bad.arrays.erase(name);
    expect_refused(bad, name + " missing");

    bad = good;
    NpyArray& cut = bad.arrays[name];
    const std::size_t row = cut.bytes.size() / std::size_t(cut.shape[0]);
    --cut.shape[0];
    cut.bytes.resize(cut.bytes.size() - row);
    expect_refused(bad, name + " one row short");

    bad = good;
    bad.arrays[name].bytes.back() ^= std::byte(1);
    expect_refused(bad, name + " changed");

    bad = good;
    bad.arrays[name].shape = {bad.arrays[name].size(), 1, 1};
    expect_refused(bad, name + " reshaped");
  }
  Npz bad = good;
  bad.texts.erase("meta.json");
  expect_refused(bad, "no meta.json");
  const Json meta = parse_json(good.text("meta.json"), "meta.json");
  for (const auto& [key, value] : meta.items()) {
    Json changed = meta;
    changed.erase(key);
    bad = good;
    bad.texts["meta.json"] = changed.dump();
    expect_refused(bad, key + " missing");
    changed = meta;
    changed[key] = Json::array({1, 2});
    bad.texts["meta.json"] = changed.dump();
    expect_refused(bad, key + " of another kind");
  }
}

// What docs/planning.md tells people with numpy: pieces[piece], cut to length, are the states.
TEST_F(PlanFileTest, ThePiecesOfATreePutTogetherAreItsStates) {
  const Plan p =
      plan(Toy(40, true, true, 1.6f), toy_settings());  // 120 numbers: two pieces, the second part full
  write_plan(file(), p, {});
  const Npz npz = read_npz(file());
  const auto piece = npz.array("tree_piece").as<std::int32_t>("piece");
  const auto pieces = npz.array("tree_pieces").as<float>("pieces");
  const std::size_t width = std::size_t(npz.array("end_positions").shape.at(1));
  ASSERT_EQ(width, 120u);
  for (std::size_t n = 0; n < std::size_t(p.tree.size()); ++n) {
    const State state = p.tree.states[n];
    for (std::size_t half = 0; half < 2; ++half)
      for (std::size_t k = 0; k < width; ++k)
        ASSERT_EQ(pieces[std::size_t(piece[(2 * n + half) * 2 + k / 96]) * 96 + k % 96],
                  (half ? state.velocities : state.positions)[k]);
  }
}

// Twenty bodies sleep while one moves: a file of many nodes is hardly larger than what moves.
TEST_F(PlanFileTest, WhatSleepsIsWrittenOnce) {
  Plan p;
  State state{0, std::vector<float>(96 * 21, 1.5f), std::vector<float>(96 * 21, 0.f)};
  p.tree.add(state, -1, {}, -1, Vec3f::Zero());
  for (int n = 1; n < 1000; ++n) {
    state.step = n, state.positions[5] = float(n);
    p.tree.add(state, n - 1, {.steps = 1}, n - 1, Vec3f::Zero());
  }
  p.settings = toy_settings();
  p.trajectory.end = p.tree.states[0], p.trajectory.frames = {p.trajectory.end};
  write_plan(file(), p, {});
  EXPECT_EQ(read_npz(file()).array("tree_pieces").shape.at(0), 42 + 999);  // the start's, and one a node
  expect_same(read_plan(file()).plan, p);
}

TEST_F(PlanFileTest, AFileOfTheFormerFormatIsStillRead) {
  const Plan p = plan(Toy(5, true, true, 1.6f), toy_settings());
  Npz former = npz_of(p, {}, 3);
  former.arrays.erase("tree_piece"), former.arrays.erase("tree_pieces");
  std::vector<float> positions, velocities;
  for (std::size_t n = 0; n < std::size_t(p.tree.size()); ++n) {
    const State state = p.tree.states[n];
    positions.insert(positions.end(), state.positions.begin(), state.positions.end());
    velocities.insert(velocities.end(), state.velocities.begin(), state.velocities.end());
  }
  former.arrays["tree_positions"] = NpyArray::of<float>(positions, {p.tree.size(), 15});
  former.arrays["tree_velocities"] = NpyArray::of<float>(velocities, {p.tree.size(), 15});
  Json meta = parse_json(former.text("meta.json"), "meta.json");
  meta["format"] = "limber plan 1";
  former.texts.erase("hash.txt");
  former.texts["meta.json"] = meta.dump();
  write_npz(file("former.npz"), former);
  expect_same(read_plan(file("former.npz")).plan, p);
  EXPECT_FALSE(read_plan(file("former.npz")).sealed());
}

// One hash stands over all entries: also over what nothing else contradicts.
TEST_F(PlanFileTest, WhatNothingContradictsIsUnderTheHash) {
  write_plan(file(), plan(Toy(), toy_settings()), {{"note", "mine"}});
  ASSERT_TRUE(read_plan(file()).sealed());
  const Npz good = read_npz(file());
  const Json meta = parse_json(good.text("meta.json"), "meta.json");
  for (const char* pointer : {"/statistics/diverged", "/statistics/rollout_steps", "/settings/seed",
                              "/settings/max_iterations", "/settings/goal/radius_m", "/given/note"}) {
    Json changed = meta;
    Json& value = changed.at(Json::json_pointer(pointer));
    value = value.is_string() ? Json("yours") : Json(1234567);
    Npz bad = good;
    bad.texts["meta.json"] = changed.dump(2) + "\n";
    write_npz(file("bad.npz"), bad);
    EXPECT_THROW(read_plan(file("bad.npz")), InputError) << pointer;
  }
  Npz bad = good;
  bad.texts.erase("hash.txt");
  write_npz(file("bad.npz"), bad);
  EXPECT_THROW(read_plan(file("bad.npz")), InputError);
}

// Settings that came later lack in files of older builds: the complaint says what the user can do.
TEST_F(PlanFileTest, APlanOfAnOlderPlannerIsToBeMadeAnew) {
  Npz npz = npz_of(plan(Toy(), toy_settings()), {}, 3);
  Json meta = parse_json(npz.text("meta.json"), "meta.json");
  meta["format"] = "limber plan 2";
  npz.texts.erase("hash.txt");
  meta["settings"]["settle"].erase("hold");  // it was that of the laws then
  npz.texts["meta.json"] = meta.dump();
  write_npz(file("old.npz"), npz);
  EXPECT_FALSE(read_plan(file("old.npz")).plan.settings.settle.hold);
  meta["settings"]["laws"].erase("hold");
  npz.texts["meta.json"] = meta.dump();
  write_npz(file("older.npz"), npz);
  try {
    read_plan(file("older.npz"));
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    for (const char* part : {"older.npz", "made by an older limber", "'hold'", "plan anew"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

// Whoever changes a plan can write its hashes, too: so each number is looked at.
TEST_F(PlanFileTest, NumbersThatNoPlanHasAreInputErrors) {
  const Plan good = plan(Toy(5, true, true, 1.6f), toy_settings());
  ASSERT_TRUE(good.solved());
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   inf = std::numeric_limits<double>::infinity();
  const auto fps = [](double value) {
    return [value](Plan& p) { p.settings.frames_per_second = p.trajectory.frames_per_second = value; };
  };
  const std::vector<std::pair<const char*, std::function<void(Plan&)>>> changes{
      {"frames_per_second", fps(0)},
      {"frames_per_second", fps(-1)},
      {"frames_per_second", fps(1e9)},
      {"frames_per_second", fps(1e-300)},
      {"frames_per_second", [](Plan& p) { p.trajectory.frames_per_second *= 2; }},
      {"do not last as long",
       [](Plan& p) { p.trajectory.end.step = std::numeric_limits<std::int32_t>::max(); }},
      {"last longer",
       [](Plan& p) { p.trajectory.controls[0].steps = std::numeric_limits<std::int32_t>::max(); }},
      {"path_node[0]",
       [](Plan& p) {
         p.trajectory.controls[0].manipulation = Manipulation::control_point;
         p.trajectory.controls[0].node = -7;
       }},
      {"path_node[0]", [](Plan& p) { p.trajectory.controls[0].node = -2; }},
      {"path_second_node[0]",
       [](Plan& p) {
         p.trajectory.controls[0] = carried(p.trajectory.controls[0]);
         p.trajectory.controls[0].manipulation = Manipulation::body;
       }},
      {"path_second_force_n[0]",
       [=](Plan& p) {
         p.trajectory.controls[0] = carried(p.trajectory.controls[0]);
         p.trajectory.controls[0].second_force_n.x() = float(nan);
       }},
      {"path_force_n[1]", [=](Plan& p) { p.trajectory.controls[1].force_n.y() = float(nan); }},
      {"tree_target_m[1]", [=](Plan& p) { p.tree.controls[1].target_m.z() = float(inf); }},
      {"tree_center_m[1]", [=](Plan& p) { p.tree.centers.x[1] = float(nan); }},
      {"frame_positions[2]", [=](Plan& p) { p.trajectory.frames[2].positions[4] = float(nan); }},
      {"end_velocities[0]", [=](Plan& p) { p.trajectory.end.velocities[0] = float(inf); }},
      {"frame_positions", [](Plan& p) { p.trajectory.frames.clear(); }},
      {"frame 2 is before", [](Plan& p) { p.trajectory.frames[2].step = 0; }},
      {"node 1 is at step", [](Plan& p) { ++p.tree.controls[1].steps; }},
      {"node 1 is of iteration", [](Plan& p) { p.tree.iterations[1] = std::int64_t(1) << 62; }},
      {"statistics.iterations", [](Plan& p) { p.statistics.iterations = std::int64_t(1) << 62; }},
      {"statistics.iterations", [](Plan& p) { p.statistics.iterations = iteration_limit + 1; }},
      {"statistics.diverged", [](Plan& p) { p.statistics.diverged = -1; }},
      {"best_distance_m", [](Plan& p) { p.best_distance_m = -1; }},
      {"max_iterations", [](Plan& p) { p.settings.max_iterations = std::int64_t(1) << 62; }},
      {"goal_bias", [](Plan& p) { p.settings.goal_bias = 2; }},
      {"settle_steps", [](Plan& p) { p.trajectory.settle_steps = -1; }}};
  for (const auto& [named, change] : changes) {
    Plan bad = good;
    change(bad);
    write_plan(file(), bad, {});
    try {
      read_plan(file());
      FAIL() << named;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(named), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("again"), std::string::npos) << error.what();
    }
  }
}

// A replay has the frames of the file: how long it takes is told by how large that is.
TEST_F(PlanFileTest, FramesStandAtTheirTimes) {
  const Toy toy(5, true, true, 1.6f);
  Plan p = plan(toy, toy_settings());
  EXPECT_NO_THROW(require_frame_times(p.trajectory, toy.dt_s(), "a"));
  EXPECT_THROW(require_frame_times(p.trajectory, toy.dt_s() / 2, "a"), InputError);
  EXPECT_THROW(require_frame_times(p.trajectory, toy.dt_s() * 2, "a"), InputError);
  p.trajectory.frames.pop_back();
  EXPECT_THROW(require_frame_times(p.trajectory, toy.dt_s(), "a"), InputError);
}

TEST_F(PlanFileTest, AParentThatComesLaterIsAnInputError) {
  Plan p = plan(Toy(), toy_settings());
  const std::vector<int> path = path_to(p.tree, p.best_node);
  int off_path = 1;
  while (std::count(path.begin(), path.end(), off_path) > 0) ++off_path;
  p.tree.parents[std::size_t(off_path)] = off_path + 1;
  write_plan(file(), p, {});
  EXPECT_THROW(read_plan(file()), InputError);
}

TEST_F(PlanFileTest, AnotherFileIsAnInputError) {
  EXPECT_THROW(read_plan(file("absent.npz")), InputError);
  std::ofstream(file()) << "no zip";
  EXPECT_THROW(read_plan(file()), InputError);
}

}  // namespace
}  // namespace limber::plan
