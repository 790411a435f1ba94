// As tests/cli/mutation_test.cpp, of the folder of a simulation: ways to make a good one wrong, each by an
// adversary who knows limber, changes one thing and then makes all hashes, figures and pictures fit. verify
// must name each.
#include "core/hash.h"
#include "core/npz.h"
#include "limber/detail/plan/follow_plan.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "plan/plan_file.h"
#include "plan/simulation.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

// A soft cube thrown over a plate that turns and rises, and pushed on its way.
constexpr const char* scene_text = R"(name = "mutants"
[world]
bounds_m = [[0, 0, 0], [4, 2, 4]]
gravity_m_s2 = [0, 0, -9.81]
[[bodies]]
name = "cube"
role = "robot"
model = { box = { size_m = [0.6, 0.6, 0.6], triangle_m = 0.2 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e4, density_kg_m3 = 100, damping_ratio = 0.4 }
pose = { position_m = [1.2, 1, 0.75] }
velocity_m_s = [0.8, 0, 0.5]
angular_velocity_rad_s = [0, 0, 1]
[[bodies]]
name = "plate"
role = "obstacle"
kind = "rigid"
model = { box = { size_m = [2.4, 1.6, 0.2], triangle_m = 0.4 } }
cage = { cells = [2, 2, 1] }
pose = { position_m = [1.9, 1, 0.3] }
[goal]
center_of_mass_m = [3.2, 1, 1]
radius_m = 0.3
[planner]
max_force_n = 100
[film]
frames_per_second = 20
)";
constexpr const char* script_text = R"([[forces]]
body = "cube"
from_s = 0.1
to_s = 0.3
force_n = [10, 0, 0]
[[motions]]
body = "plate"
keyframes = [{ at_s = 0.1 }, { at_s = 0.6, position_m = [1.9, 1, 0.4], angle_deg = 20 }]
)";

// A simulation's folder in memory, to be changed and written so that it fits together again.
struct Mutant {
  explicit Mutant(const fs::path& at)
      : folder(at), planned(read_plan_folder(at)), bodies(read_world_of(planned, at).bodies) {}

  void write() {
    const fem::World world = build_world(planned.scene, bodies);
    const FemSystem system = system_of(planned, world, bodies);
    planned.plan.system_hash = system.hash();
    const MotionFigures figures = measure_motion(world, bodies, planned.plan.trajectory);
    planned.summary.update(facts_of(planned.plan, world, system, figures));
    for (const auto& [name, bytes] : pictures_of(planned.scene, world, planned.plan, figures))
      write_file(folder / name, bytes);
    write_summary();
  }
  void write_summary() {
    write_plan_folder(folder, planned.plan, planned.scene, bodies, planned.summary);
    update_manifest(folder, "plan", kept_summary(planned));
  }

  fs::path folder;
  PlanFolder planned;
  std::vector<PreparedBody> bodies;
};

struct Mutation {
  std::string what;
  std::string named;  // in a promise that is broken, or in the complaint
  std::function<void(Mutant&)> make;
};
using List = std::vector<Mutation>;

const std::string replay = "replay gives the same bits", claims = "what the simulation tells of itself is so",
                  nothing_else = "nothing acts but what the scene says",
                  lasts = "it lasts as long as was asked for", way = "the path is the way through the tree",
                  from_scene = "it starts as the scene says";

// A simulation's tree is its start and its end.
void change_tree(plan::Plan& p, int node, const std::function<void(State&, Control&)>& change) {
  plan::Tree tree;
  for (int n = 0; n < p.tree.size(); ++n) {
    State state = p.tree.states[std::size_t(n)];
    Control control = p.tree.controls[std::size_t(n)];
    if (n == node) change(state, control);
    tree.add(state, p.tree.parents[std::size_t(n)], control, p.tree.iterations[std::size_t(n)],
             p.tree.centers[std::size_t(n)]);
  }
  p.tree = tree;
}

// Of the start that is in the tree and in the first frame.
void change_start(plan::Plan& p, const std::function<void(State&)>& change) {
  change_tree(p, 0, [&](State& state, Control&) { change(state); });
  change(p.trajectory.frames[0]);
}

List of_the_motion() {
  List list;
  const auto add = [&](std::string what, std::string named, std::function<void(plan::Plan&)> change) {
    list.push_back({std::move(what), std::move(named), [change = std::move(change)](Mutant& m) {
                      change(m.planned.plan);
                      m.write();
                    }});
  };
  add("a frame's position", replay, [](plan::Plan& p) { p.trajectory.frames[3].positions[0] += 1e-4f; });
  add("a frame's velocity", replay, [](plan::Plan& p) { p.trajectory.frames[3].velocities[0] += 1e-4f; });
  add("where the plate is in a frame", replay,
      [](plan::Plan& p) { p.trajectory.frames[9].positions.back() += 1e-4f; });
  add("the end's position", replay, [](plan::Plan& p) { p.trajectory.end.positions[1] += 1e-4f; });
  add("the end's velocity", replay, [](plan::Plan& p) { p.trajectory.end.velocities[1] = 0; });
  add("the end in the tree", way,
      [](plan::Plan& p) { change_tree(p, 1, [](State& s, Control&) { s.positions[0] += 1e-4f; }); });
  add("a place at the start", from_scene,
      [](plan::Plan& p) { change_start(p, [](State& s) { s.positions[0] += 1e-4f; }); });
  add("a velocity at the start", from_scene,
      [](plan::Plan& p) { change_start(p, [](State& s) { s.velocities[0] += 1e-3f; }); });
  add("a frame less", "frame",
      [](plan::Plan& p) { p.trajectory.frames.erase(p.trajectory.frames.begin() + 4); });
  add("the last frame left out", "frame", [](plan::Plan& p) { p.trajectory.frames.pop_back(); });
  add("frames at another rate", "frame", [](plan::Plan& p) { p.trajectory.frames_per_second = 21; });
  const auto push = [](Control& control) {
    control.manipulation = Manipulation::body, control.force_n = {1, 0, 0};
  };
  add("a push", nothing_else, [push](plan::Plan& p) { push(p.trajectory.controls[0]); });
  add("a push, in the tree too", nothing_else, [push](plan::Plan& p) {
    push(p.trajectory.controls[0]);
    change_tree(p, 1, [&](State&, Control& control) { push(control); });
  });
  add("two controls for one", nothing_else, [](plan::Plan& p) {
    std::vector<Control>& controls = p.trajectory.controls;
    controls.push_back(controls[0]);
    controls[0].steps /= 2, controls[1].steps -= controls[0].steps;
  });
  add("a shorter motion that says it is whole", lasts, [](plan::Plan& p) {
    plan::Trajectory& t = p.trajectory;
    t.frames.pop_back();
    t.end = t.frames.back();
    t.controls[0].steps = std::int32_t(t.end.step - t.frames[0].step);
    change_tree(p, 1, [&](State& s, Control& c) { s = t.end, c = t.controls[0]; });
  });
  add("how long it was to last", lasts, [](plan::Plan& p) { p.simulation->duration_s = 0.7; });
  add("how it ended", lasts, [](plan::Plan& p) { p.simulation->ending = plan::Simulation::diverged; });
  add("stopped", lasts, [](plan::Plan& p) { p.simulation->ending = plan::Simulation::stopped; });
  add("a node more", "a start and an end, and nothing else",
      [](plan::Plan& p) { p.tree.add(p.tree.states[1], 0, p.tree.controls[1], -1, p.tree.centers[1]); });
  add("no simulation", "plan.npz", [](plan::Plan& p) { p.simulation.reset(); });
  return list;
}

// Another script, of which world and hashes are made anew.
List of_the_script() {
  List list;
  const auto text = [&](const std::string& from, const std::string& to, const std::string& named) {
    list.push_back({from + " → " + to, named, [=](Mutant& m) {
                      scenes::ScriptText script = m.planned.scene.script;
                      const auto at = script.text.find(from);
                      LIMBER_CHECK(at != script.text.npos, from);
                      script.text.replace(at, from.size(), to);
                      m.planned.scene =
                          scenes::read_scene(m.planned.scene.text, "scene", m.planned.scene.sets, script);
                      m.write();
                    }});
  };
  text("force_n = [10, 0, 0]", "force_n = [10, 0, 1]", replay);
  text("from_s = 0.1", "from_s = 0.15", replay);
  text("to_s = 0.3", "to_s = 0.31", replay);
  text("body = \"cube\"", "body = \"cube\"\nbox_m = [[0, 0, 0], [4, 2, 0.8]]", replay);
  text("at_s = 0.1", "at_s = 0.2", replay);
  text("at_s = 0.6", "at_s = 0.5", replay);
  text("1, 0.4]", "1, 0.41]", replay);
  text("angle_deg = 20", "angle_deg = -20", replay);
  text("angle_deg = 20", "angle_deg = 20, axis = [0, 1, 0]", replay);
  text(script_text, "", "its states hold");
  const auto set = [&](const std::string& edit, const std::string& named) {
    list.push_back({"the scene with " + edit, named, [=](Mutant& m) {
                      std::vector<std::string> sets = m.planned.scene.sets;
                      sets.push_back(edit);
                      m.planned.scene =
                          scenes::read_scene(m.planned.scene.text, "scene", sets, m.planned.scene.script);
                      m.write();
                    }});
  };
  set("bodies.cube.velocity_m_s=[0.8, 0, 0.6]", from_scene);
  set("bodies.cube.angular_velocity_rad_s=[0, 0, 0]", from_scene);
  set("world.gravity_m_s2=[0, 0, -9.8]", replay);
  set("bodies.cube.friction=0", replay);
  set("film.frames_per_second=21", "frames are as many a second");
  set("bodies.cube.pose.position_m=[1.3, 1, 0.75]", "cube: the cage has changed");
  // Without making world and hash anew: it is another world's.
  list.push_back({"a force more that acts later", "of this world and its script", [](Mutant& m) {
                    m.planned.scene.script.text +=
                        "[[forces]]\nbody = \"cube\"\nfrom_s = 9\nto_s = 10\nforce_n = [1, 0, 0]\n";
                    m.write_summary();
                  }});
  list.push_back({"no script", "its states hold", [](Mutant& m) {
                    m.planned.scene.script = {};
                    m.write_summary();
                  }});
  return list;
}

List of_the_summary(const Json& summary) {
  List list;
  const auto other = [](const Json& value) -> Json {
    if (value.is_boolean()) return !value.get<bool>();
    if (value.is_number_integer()) return value.get<std::int64_t>() + 1;
    if (value.is_number()) return value.get<double>() * 1.01 + 1e-6;
    if (value.is_string()) return value.get<std::string>() + "?";
    return Json(7);
  };
  const Json flat = summary.flatten();
  for (const auto& [pointer, value] : flat.items())
    list.push_back({"summary" + pointer, claims, [pointer = pointer, value = other(value)](Mutant& m) {
                      m.planned.summary.at(Json::json_pointer(pointer)) = value;
                      m.write_summary();
                    }});
  for (const char* key : {"solved", "distance_m", "seed", "statistics", "quality"})
    list.push_back({std::string("a summary with ") + key,
                    key == std::string_view("statistics") ? "statistics is true or false" : claims,
                    [key](Mutant& m) {
                      m.planned.summary[key] = true;
                      m.write_summary();
                    }});
  list.push_back({"a summary that begins elsewhere", "", [](Mutant& m) {
                    m.planned.summary["from"] = {{"folder", "../good"}, {"frame", "3"}};
                    m.write_summary();
                  }});
  return list;
}

List of_files() {
  List list;
  const auto replace = [&](const std::string& name, std::function<std::string(std::string)> change) {
    list.push_back({"the file " + name, name, [=](Mutant& m) {
                      const std::string bytes = change(read_file(m.folder / name));
                      write_file(m.folder / name, bytes);
                    }});
  };
  for (const char* name : {"volume.svg", "volume.png"}) {
    replace(name, [](std::string bytes) { return bytes + " "; });
    list.push_back({std::string("no ") + name, name, [=](Mutant& m) { fs::remove(m.folder / name); }});
  }
  replace("plan.npz", [](std::string bytes) { return bytes.substr(0, bytes.size() / 2); });
  list.push_back(
      {"no manifest.json", "manifest.json", [](Mutant& m) { fs::remove(m.folder / "manifest.json"); }});
  list.push_back({"a manifest of another simulation", "manifest.json", [](Mutant& m) {
                    Json summary = m.planned.summary;
                    summary["trajectory_hash"] = "0123456789abcdef";
                    update_manifest(m.folder, "plan", summary);
                  }});
  const auto meta = [&](const std::string& from, const std::string& to, const std::string& named) {
    list.push_back({"meta.json: " + from + " → " + to, named, [=](Mutant& m) {
                      Npz npz = read_npz(m.folder / "plan.npz");
                      std::string& text = npz.texts.at("meta.json");
                      const auto at = text.find(from);
                      LIMBER_CHECK(at != text.npos, from, text);
                      text.replace(at, from.size(), to);
                      write_npz(m.folder / "plan.npz", npz);
                    }});
  };
  meta("\"ending\": \"whole\"", "\"ending\": \"wholes\"", "its ending is");
  meta("\"duration_s\": 0.6", "\"duration_s\": 0.7", "an entry was changed");
  meta("\"duration_s\": 0.6", "\"duration_s\": -0.6", "it lasts -0.6 s");
  meta("\"simulation\"", "\"simulacrum\"", "'settings' not found");
  return list;
}

// Of a motion that begins as a frame of another one, which is there.
List of_its_beginning() {
  List list;
  const std::string starts = "it starts as frame 4 of another motion";
  const auto add = [&](std::string what, std::string named, std::function<void(Mutant&)> make) {
    list.push_back({std::move(what), std::move(named), std::move(make)});
  };
  add("a place at the start", starts, [](Mutant& m) {
    change_start(m.planned.plan, [](State& s) { s.positions[0] += 1e-4f; });
    m.write();
  });
  add("a velocity at the start", starts, [](Mutant& m) {
    change_start(m.planned.plan, [](State& s) { s.velocities[0] += 1e-3f; });
    m.write();
  });
  add("another frame", "it starts as frame 5 of another motion", [](Mutant& m) {
    m.planned.summary["from"]["frame"] = 5;
    m.write_summary();
  });
  add("a frame that is not there", "it starts as frame 99 of another motion", [](Mutant& m) {
    m.planned.summary["from"]["frame"] = 99;
    m.write_summary();
  });
  add("a frame before the first", "it starts as frame -1 of another motion", [](Mutant& m) {
    m.planned.summary["from"]["frame"] = -1;
    m.write_summary();
  });
  for (const auto& [key, value] :
       {std::pair("trajectory_hash", "0123456789abcdef"), {"folder", "../nowhere"}})
    add(fmt::format("a start of one's own, and of its {} another", key), starts, [key, value](Mutant& m) {
      change_start(m.planned.plan, [](State& s) { s.positions[0] += 1e-4f; });
      m.planned.summary["from"][key] = value;
      m.write();
    });
  add("from the scene", "", [](Mutant& m) {
    m.planned.summary.erase("from");
    m.write();
  });
  add("frame as a text", "given.summary.from", [](Mutant& m) {
    m.planned.summary["from"]["frame"] = "4";
    m.write_summary();
  });
  return list;
}

// As if the follower had chosen what `change` makes of its third control.
void follow_otherwise(Mutant& m, const std::function<void(Control&)>& change) {
  plan::Plan& p = m.planned.plan;
  const fem::World world = build_world(m.planned.scene, m.bodies);
  const FemSystem system = system_of(m.planned, world, m.bodies);
  const fs::path other = m.folder / m.planned.summary.at("follows").at("folder").get<std::string>();
  const FollowedPlan followed(other, m.planned.scene, world);
  int control = 0;
  p = plan::simulate_for(system, p.simulation->duration_s, p.trajectory.frames_per_second, std::nullopt, {},
                         [&](const State& state) {
                           Control next = followed.next(state);
                           if (++control == 3) change(next);
                           return next;
                         });
  m.planned.summary["follows"] = json_of_fields(followed.facts(p, m.folder));
  m.write();
}

// Of a motion that follows a plan, which is there.
List of_what_it_follows() {
  List list;
  const std::string follows = "each control is the follower's of another plan",
                    tells = "what it tells of following is so";
  const auto add = [&](std::string what, std::string named, std::function<void(Mutant&)> make) {
    list.push_back({std::move(what), std::move(named), std::move(make)});
  };
  add("a push of one's own", follows,
      [](Mutant& m) { follow_otherwise(m, [](Control& c) { c.force_n.x() *= 0.99f; }); });
  add("a push for longer", follows, [](Mutant& m) { follow_otherwise(m, [](Control& c) { ++c.steps; }); });
  add("too strong a push", "no force is above the maximum",
      [](Mutant& m) { follow_otherwise(m, [](Control& c) { c.force_n = Vec3f(0, 0, 150); }); });
  for (const auto& [key, value] :
       {std::pair("trajectory_hash", "0123456789abcdef"), {"folder", "../nowhere"}})
    add(fmt::format("a push of one's own, and of the plan's {} another", key), follows,
        [key, value](Mutant& m) {
          follow_otherwise(m, [](Control& c) { c.force_n.x() *= 0.99f; });
          m.planned.summary["follows"][key] = value;
          m.write_summary();
        });
  add("nothing is followed", follows, [](Mutant& m) {
    m.planned.summary.erase("follows");
    m.write_summary();
  });
  add("follows itself", follows, [](Mutant& m) {
    m.planned.summary["follows"]["folder"] = ".";
    m.write_summary();
  });
  add("not steered", "has a start and an end, and nothing else", [](Mutant& m) {
    m.planned.plan.simulation->steered = false;
    m.write();
  });
  add("shorter", lasts, [](Mutant& m) {
    m.planned.plan.simulation->duration_s += 0.1;
    m.write();
  });
  for (const char* key : {"farthest_from_path_m", "largest_force_n", "distance_m", "speed_m_s"})
    add(std::string(key), tells, [key](Mutant& m) {
      m.planned.summary["follows"][key] = 0.5 * m.planned.summary["follows"][key].get<double>();
      m.write_summary();
    });
  add("reaches", tells, [](Mutant& m) {
    Json& reaches = m.planned.summary["follows"]["reaches"];
    reaches = !reaches.get<bool>();
    m.write_summary();
  });
  add("reaches as a text", "given.summary.follows", [](Mutant& m) {
    m.planned.summary["follows"]["reaches"] = "yes";
    m.write_summary();
  });
  add("a list for what is followed", "given.summary.follows", [](Mutant& m) {
    m.planned.summary["follows"] = Json::array({1, 2});
    m.write_summary();
  });
  return list;
}

class SimulationMutations_slow : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    const std::string scene = (shared_->path() / "scene.toml").string(),
                      script = (shared_->path() / "script.toml").string();
    std::ofstream(scene) << scene_text;
    std::ofstream(script) << script_text;
    const auto simulate = [&](const char* name, std::vector<std::string> more) {
      std::vector<std::string> words{"simulate",   scene, "-o",        (shared_->path() / name).string(),
                                     "--duration", "0.6", "--control", script};
      words.insert(words.end(), more.begin(), more.end());
      const Result result = limber_program(words);
      if (result.code != exit_done) trouble_ += result.err;
    };
    simulate("good", {});
    const std::string good = (shared_->path() / "good").string();
    simulate("on", {"--from", good, "--frame", "4"});
    const Result planned =
        limber_program({"plan", scene, "-o", (shared_->path() / "planned").string(), "--from", good,
                        "--frame", "4", "--set", "world.gravity_m_s2=[0, 0, 0]"});
    if (planned.code != exit_done) trouble_ += planned.err;
    const std::string small = (shared_->path() / "small.toml").string(),
                      route = (shared_->path() / "route").string();
    std::ofstream(small) << small_scene;
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"plan", small, "-o", route},
          {"simulate", small, "-o", (shared_->path() / "following").string(), "--follow", route, "--set",
           "bodies.robot.material.density_kg_m3=105"}})
      if (const Result result = limber_program(words); result.code != exit_done) trouble_ += result.err;
  }
  static void TearDownTestSuite() { delete shared_; }
  void SetUp() override { ASSERT_EQ(trouble_, ""); }
  static fs::path folder(const char* name) { return shared_->path() / name; }

  static void expect_good(const char* name) {
    const Result result = limber_program({"verify", folder(name).string()});
    EXPECT_EQ(result.code, exit_done) << result.out << result.err;
    // What a mutant is written by changes nothing where nothing is changed.
    const auto before = contents(folder(name));
    Mutant(folder(name)).write();
    // File by file, so that what differs is named and not printed.
    const auto after = contents(folder(name));
    ASSERT_EQ(after.size(), before.size());
    for (std::size_t i = 0; i < after.size(); ++i) EXPECT_TRUE(after[i] == before[i]) << after[i].first;
  }

  // Each mutant is refused, by the promise or complaint that is said.
  static void expect_named(const char* name, const List& list) {
    const fs::path bad = folder("bad");
    std::size_t row = 0, made = 0;
    for (const Mutation& mutation : list) {
      if (!mine(row++)) continue;
      ++made;
      SCOPED_TRACE(mutation.what);
      fs::remove_all(bad);
      fs::copy(folder(name), bad, fs::copy_options::recursive);
      try {
        Mutant mutant(bad);
        mutation.make(mutant);
      } catch (const std::exception& error) {
        ADD_FAILURE() << "is not made: " << error.what();
        continue;
      }
      const Result result = limber_program({"verify", bad.string(), "--json"});
      EXPECT_TRUE(result.code == exit_defect || result.code == exit_bad_input) << result.code;
      std::string found;
      const Json answer = result.json();
      for (const Json& row : answer.value("promises", Json::array()))
        if (!row.at("kept").get<bool>()) found += row.at("promise").get<std::string>() + "\n";
      if (result.code == exit_bad_input) found = answer.at("error").get<std::string>();
      EXPECT_NE(found.find(mutation.named), std::string::npos)
          << "wanted: " << mutation.named << "\nfound: " << (found.empty() ? result.out : found);
    }
    fmt::print("{} mutants\n", made);
  }

 private:
  static inline TemporaryFolder* shared_;
  static inline std::string trouble_;
};

TEST_F(SimulationMutations_slow, GoodFoldersKeepEveryPromise) { expect_good("good"), expect_good("on"); }
TEST_F(SimulationMutations_slow, OfTheMotion) { expect_named("good", of_the_motion()); }
TEST_F(SimulationMutations_slow, OfTheScript) { expect_named("good", of_the_script()); }
TEST_F(SimulationMutations_slow, OfItsSummary) {
  expect_named("good", of_the_summary(read_plan_folder(folder("good")).summary));
}
TEST_F(SimulationMutations_slow, OfFiles) { expect_named("good", of_files()); }
TEST_F(SimulationMutations_slow, OfItsBeginning) { expect_named("on", of_its_beginning()); }
TEST_F(SimulationMutations_slow, OfAPlansBeginning) {
  expect_good("planned");
  expect_named("planned", of_its_beginning());
}
TEST_F(SimulationMutations_slow, OfWhatItFollows) {
  expect_good("following");
  expect_named("following", of_what_it_follows());
}

}  // namespace
}  // namespace limber::detail
