// limber simulate: a scene left to itself, as a user meets it (docs/simulation.md).
#include <gmock/gmock.h>

#include <csignal>
#include <thread>

#include "core/progress.h"
#include "fem/observe.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "plan/simulation.h"
#include "render/png_file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

// A soft cube thrown into a room, and a plate that goes up under it.
constexpr const char* thrown = R"(name = "thrown"
[world]
bounds_m = [[0, 0, 0], [4, 2, 4]]
gravity_m_s2 = [0, 0, -9.81]
[[bodies]]
name = "cube"
role = "robot"
model = { box = { size_m = [0.6, 0.6, 0.6], triangle_m = 0.1 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e4, density_kg_m3 = 100, damping_ratio = 0.4 }
pose = { position_m = [1.2, 1, 0.95] }
velocity_m_s = [0.8, 0, 1]
[[bodies]]
name = "plate"
role = "obstacle"
kind = "rigid"
model = { box = { size_m = [2.4, 1.6, 0.2], triangle_m = 0.2 } }
cage = { cells = [2, 2, 1] }
pose = { position_m = [1.9, 1, 0.3] }
[goal]
center_of_mass_m = [3.2, 1, 1]
radius_m = 0.3
[planner]
max_force_n = 100
[film]
size_px = [96, 64]
frames_per_second = 20
)";
constexpr const char* lifting = R"([[motions]]
body = "plate"
keyframes = [{ at_s = 1 }, { at_s = 4, position_m = [1.9, 1, 1.2] }]
)";

struct Moved {
  PlanFolder planned;
  std::vector<PreparedBody> bodies;
  fem::World world;
  const std::vector<State>& frames() const { return planned.plan.trajectory.frames; }
  Vec3 center(std::size_t frame, int body = 0) const {
    return fem::center_of_mass_m(world, frames()[frame], body);
  }
  double time_s(std::size_t frame) const { return fem::time_s(world, frames()[frame]); }
};

class Simulate_slow : public Program {
 protected:
  // Exit code 0, or the test fails.
  Json simulate(const std::string& text, const std::string& name, std::vector<std::string> more = {}) const {
    const Result result = run(text, name, std::move(more));
    EXPECT_EQ(result.code, exit_done) << result.err;
    return result.code == exit_done ? result.json() : Json();
  }
  Result run(const std::string& text, const std::string& name, std::vector<std::string> more = {}) const {
    std::vector<std::string> words{"simulate", scene(text), "-o", out(name), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return limber_program(words);
  }
  Moved moved(const std::string& name) const {
    PlanFolder planned = read_plan_folder(out(name));
    std::vector<PreparedBody> bodies = read_world_of(planned, out(name)).bodies;
    fem::World world = world_of(planned, bodies);
    return {std::move(planned), std::move(bodies), std::move(world)};
  }
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(folder / name) << text;
    return (folder / name).string();
  }
  std::string bytes(const std::string& name) const { return read_file(fs::path(out(name)) / "plan.npz"); }

  struct Table {
    int code;
    std::map<std::string, bool> kept;
    bool broken(const std::string& promise) const { return kept.contains(promise) && !kept.at(promise); }
  };
  Table verify(const std::string& name) const {
    const Result result = limber_program({"verify", out(name), "--json"});
    Table table{result.code, {}};
    const Json json = result.json();
    for (const Json& row : json.at("promises"))
      table.kept[row.at("promise").get<std::string>()] = row.at("kept").get<bool>();
    return table;
  }
};

TEST_F(Simulate_slow, AThrownBodyFliesOnAParabolaAndIsCarried) {
  const Json json = simulate(thrown, "out", {"--duration", "3", "--control", file("lift.toml", lifting)});
  EXPECT_NEAR(json.at("motion_s").get<double>(), 3, 0.01);
  EXPECT_TRUE(json.at("simulation").at("whole"));
  for (const char* key : {"solved", "statistics", "distance_m", "seed", "dynamics", "largest_force_n"})
    EXPECT_FALSE(json.contains(key)) << key;

  const Moved m = moved("out");
  for (std::size_t f = 0; m.time_s(f) < 0.3; ++f) {
    const double t = m.time_s(f);
    const Vec3 parabola =
        m.center(0) + t * Vec3(0.8, 0, 1) + 0.5 * t * (t + m.world.dt_s) * Vec3(0, 0, -9.81);
    EXPECT_LT((m.center(f) - parabola).norm(), 2e-5) << t;
  }
  // It has landed on the plate, and goes up with it, weighing what it weighs.
  const State& last = m.frames().back();
  EXPECT_NEAR(fem::center_velocity_m_s(m.world, last, 0).z(), 0.3, 0.01);
  EXPECT_NEAR(fem::center_velocity_m_s(m.world, last, 1).z(), 0.3, 1e-5);
  double force = 0;
  for (const fem::PairForce& pair : fem::pair_forces(fem::contact_forces(m.world, last)))
    if (pair.body == 0 && pair.other == 1) force = pair.force_n.z();
  EXPECT_NEAR(force / (9.81 * m.world.bodies[0].mass_kg), 1, 0.05);

  // All that is done with a plan is done with it, and none says that it is one.
  const Table table = verify("out");
  EXPECT_EQ(table.code, exit_done);
  for (const auto& [promise, kept] : table.kept) {
    EXPECT_TRUE(kept) << promise;
    EXPECT_EQ(promise.find("goal"), promise.npos) << promise;
    EXPECT_EQ(promise.find("search"), promise.npos) << promise;
  }
  EXPECT_FALSE(fs::exists(fs::path(out()) / "tree.svg"));
  EXPECT_TRUE(fs::exists(fs::path(out()) / "volume.svg"));
  EXPECT_EQ(limber_program({"info", out()}).code, exit_done);
  EXPECT_EQ(limber_program({"render", out(), "--frames", "0-2"}).code, exit_done);
  EXPECT_EQ(limber_program({"export", out(), "--format", "gltf,pc2,usd,vtu"}).code, exit_done);
  ASSERT_EQ(limber_program({"report", out()}).code, exit_done);
  const std::string page = read_file(fs::path(out()) / "report.html");
  EXPECT_NE(page.find("<dt>Simulation</dt>"), page.npos);
  EXPECT_NE(page.find("body = &quot;plate&quot;"), page.npos);
  for (const char* of_a_plan : {"How the tree grew", "not solved", "Wall time of the search"})
    EXPECT_EQ(page.find(of_a_plan), page.npos) << of_a_plan;
  for (const char* command : {"robust", "refine"}) {
    std::vector<std::string> words{command, out()};
    if (command == std::string("refine")) words.insert(words.end(), {"-o", out("finer")});
    const Result refused = limber_program(words);
    EXPECT_EQ(refused.code, exit_bad_input);
    EXPECT_NE(refused.err.find("holds a simulation"), refused.err.npos) << refused.err;
  }
  EXPECT_EQ(limber_program({"plan", scene(thrown), "-o", out(), "--resume"}).code, exit_bad_input);
}

TEST_F(Simulate_slow, MomentumIsTheImpulseOfAForce) {
  const std::string push = R"([[forces]]
body = "cube"
from_s = 0.1
to_s = 0.3
force_n = [20, 0, 30]
[[forces]]
body = "cube"
from_s = 0.2
to_s = 0.4
force_n = [0, -10, 0]
box_m = [[0, 0, 1.2], [4, 2, 4]]
)";
  std::string text = thrown;
  text = text.substr(0, text.find("velocity_m_s")) + "# " + text.substr(text.find("velocity_m_s") + 26);
  simulate(
      text, "out",
      {"--duration", "0.5", "--set", "world.gravity_m_s2=[0, 0, 0]", "--control", file("push.toml", push)});
  const Moved m = moved("out");
  const Vec3 momentum = m.world.bodies[0].mass_kg * fem::center_velocity_m_s(m.world, m.frames().back(), 0);
  EXPECT_LT((momentum - Vec3(4, -2, 6)).norm(), 60 * m.world.dt_s);  // both ends to the nearest step
  EXPECT_EQ(verify("out").code, exit_done);
}

// Bytes of plan.npz, whatever the threads, and however often it was stopped or made longer.
TEST_F(Simulate_slow, ThreadsAndStopsDoNotChangeAByte) {
  const std::string lift = file("lift.toml", lifting);
  simulate(thrown, "whole", {"--duration", "1.4", "--control", lift, "--threads", "1"});
  simulate(thrown, "two", {"--duration", "1.4", "--control", lift, "--threads", "2"});
  EXPECT_EQ(bytes("two"), bytes("whole"));

  simulate(thrown, "cut", {"--duration", "0.33", "--control", lift});
  simulate(thrown, "cut", {"--duration", "1.4", "--control", lift, "--resume"});
  EXPECT_EQ(bytes("cut"), bytes("whole"));

  // From a frame of it, the plate on its way, it goes on to the same end.
  const Moved m = moved("whole");
  const plan::Trajectory& path = m.planned.plan.trajectory;
  const std::size_t frame = path.frames.size() - 4;
  const double rest_s = double(path.end.step - path.frames[frame].step) * m.world.dt_s;
  simulate(thrown, "on",
           {"--from", out("whole"), "--frame", std::to_string(frame), "--duration",
            fmt::format("{:.17g}", rest_s), "--control", lift});
  EXPECT_EQ(moved("on").frames()[0], path.frames[frame]);
  EXPECT_EQ(moved("on").planned.plan.trajectory.end, path.end);

  // A signal as soon as it simulates.
  const std::string events = (folder / "events.jsonl").string();
  std::jthread signal([&] {
    const auto simulating = [&] {
      return fs::exists(events) && read_file(events).find("simulating") != std::string::npos;
    };
    while (!simulating()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    request_stop(SIGINT);
  });
  const Result stopped = run(thrown, "cut", {"--duration", "10000", "--control", lift, "--progress", events});
  signal.join();
  request_stop(0);
  EXPECT_EQ(stopped.code, exit_signal + SIGINT);
  EXPECT_NE(stopped.err.find("--resume"), stopped.err.npos);
  EXPECT_TRUE(is_unmeasured(moved("cut").planned.plan));
  const Table table = verify("cut");  // it did not get to its end, and says so
  EXPECT_EQ(table.code, exit_defect);
  EXPECT_TRUE(table.broken("it lasts as long as was asked for"));
  EXPECT_FALSE(table.broken("replay gives the same bits"));
  EXPECT_FALSE(table.broken("what the simulation tells of itself is so"));
  const double kept_s = moved("cut").time_s(moved("cut").frames().size() - 1);
  const std::string longer = fmt::format("{:.3f}", kept_s + 0.7);
  simulate(thrown, "cut", {"--duration", longer, "--control", lift, "--resume"});
  simulate(thrown, "uncut", {"--duration", longer, "--control", lift});
  EXPECT_EQ(bytes("cut"), bytes("uncut"));

  // What it goes on from must be the same.
  EXPECT_EQ(run(thrown, "cut", {"--duration", "20000", "--resume"}).code, exit_bad_input);
  EXPECT_EQ(run(thrown, "cut", {"--duration", "0.5", "--control", lift, "--resume"}).code, exit_bad_input);
}

// A plan's push goes on as a force of the scene: the plan's own next frames. 32 steps a frame, exactly.
TEST_F(Simulate_slow, FromAPlansFrameItGoesOnAsThePlanDoes) {
  const std::vector<std::string> sets{"--set", "world.max_dt_s=0.0009765625", "--set",
                                      "film.frames_per_second=32"};
  std::vector<std::string> words{"plan",      scene(),          "-o",
                                 out("plan"), "--set",          "planner.weights.control_point=0",
                                 "--set",     "planner.seed=3", "--json"};
  words.insert(words.end(), sets.begin(), sets.end());
  const int code = limber_program(words).code;
  ASSERT_TRUE(code == exit_done || code == exit_no_plan) << code;
  const Moved plan = moved("plan");
  const plan::Trajectory& path = plan.planned.plan.trajectory;
  ASSERT_EQ(plan.world.dt_s, 0.0009765625);
  // A frame within the second push that has two frames behind it.
  std::int64_t end = path.controls.at(0).steps;
  const Control& push = path.controls.at(1);
  ASSERT_EQ(push.manipulation, Manipulation::body);
  const std::size_t frame = std::size_t((end + 31) / 32);
  end += push.steps;
  ASSERT_GT(end, 32 * std::int64_t(frame + 2));
  const std::string text =
      std::string(small_scene) +
      fmt::format("[[forces]]\nbody = \"robot\"\nfrom_s = 0\nto_s = {}\nforce_n = [{:.9g}, {:.9g}, {:.9g}]\n",
                  double(end) * plan.world.dt_s, push.force_n.x(), push.force_n.y(), push.force_n.z());
  std::vector<std::string> from{"--from", out("plan"), "--frame", std::to_string(frame), "--duration", "0.5"};
  from.insert(from.end(), sets.begin(), sets.end());
  const Json json = simulate(text, "out", from);
  EXPECT_EQ(json.at("from").at("frame"), frame);
  const Moved m = moved("out");
  int same = 0;
  for (std::size_t f = 0; f < m.frames().size(); ++f) {
    if (m.frames()[f].step > end) break;
    EXPECT_EQ(m.frames()[f], path.frames[frame + f]) << f;
    ++same;
  }
  EXPECT_GE(same, 3);
  EXPECT_EQ(verify("out").kept.at(fmt::format("it starts as frame {} of another motion", frame)), true);
  EXPECT_EQ(verify("out").code, exit_done);

  // Its own end is where the next begins.
  simulate(text, "next", {"--from", out("out"), "--duration", "0.1", sets[0], sets[1], sets[2], sets[3]});
  EXPECT_EQ(moved("next").frames()[0], m.frames().back());
  fs::remove_all(out("plan"));
  const Table alone = verify("out");  // of its start nobody can tell
  EXPECT_EQ(alone.code, exit_defect);
  EXPECT_FALSE(alone.kept.at(fmt::format("it starts as frame {} of another motion", frame)));
}

// Whoever goes on from a motion prepares none of its bodies again.
TEST_F(Simulate_slow, BodiesAreCopiedFromTheMotionThatItBeginsAs) {
  const Result made = run(thrown, "whole", {"--duration", "0.2"});
  const Result taken = run(thrown, "on", {"--duration", "0.2", "--from", out("whole")});
  for (const Result* result : {&made, &taken}) ASSERT_EQ(result->code, exit_done) << result->err;
  for (const std::string name : {"cube", "plate"}) {
    EXPECT_NE(made.err.find(name + ": preparing"), std::string::npos) << made.err;
    EXPECT_NE(taken.err.find(name + ": as in " + out("whole") + "/bodies/" + name), std::string::npos);
    for (const fs::directory_entry& file : fs::directory_iterator(out("whole") + "/bodies/" + name)) {
      const fs::path of = file.path().filename();
      if (of == "report.json") continue;  // which tells costs
      EXPECT_EQ(read_file(fs::path(out("on")) / "bodies" / name / of), read_file(file.path())) << of;
    }
  }
  EXPECT_EQ(taken.err.find("preparing"), std::string::npos) << taken.err;
  EXPECT_EQ(verify("on").code, exit_done);
}

// Another script, another start, or frames that are not those of the scene: made to fit, and named.
TEST_F(Simulate_slow, VerifyNamesWhatWasChanged) {
  simulate(thrown, "out", {"--duration", "1.3", "--control", file("lift.toml", lifting)});
  const PlanFolder good = read_plan_folder(out());
  const std::vector<PreparedBody> bodies = read_world_of(good, out()).bodies;
  const auto verified = [&](auto change) {
    PlanFolder other = good;
    change(other);
    write_plan_folder(out(), other.plan, other.scene, bodies, other.summary);
    return verify("out");
  };
  const std::string replay = "replay gives the same bits",
                    world = "the simulation is of this world and its script";
  EXPECT_EQ(verified([](PlanFolder&) {}).code, exit_done);
  EXPECT_TRUE(
      verified([](PlanFolder& p) { p.plan.trajectory.frames[3].positions[0] += 1e-3f; }).broken(replay));
  EXPECT_TRUE(verified([](PlanFolder& p) { p.plan.trajectory.end.velocities[0] += 1e-3f; }).broken(replay));
  EXPECT_TRUE(verified([](PlanFolder& p) {
                std::string& text = p.scene.script.text;
                text.replace(text.find("1.2]"), 4, "1.1]");
              }).broken(replay));
  EXPECT_TRUE(verified([](PlanFolder& p) {
                p.scene.script.text +=
                    "[[forces]]\nbody = \"cube\"\nfrom_s = 100\nto_s = 101\nforce_n = [1, 0, 0]\n";
              }).broken(world));
  EXPECT_TRUE(verified([](PlanFolder& p) {
                p.plan.simulation->duration_s = 2;
              }).broken("it lasts as long as was asked for"));
  EXPECT_TRUE(verified([](PlanFolder& p) {
                p.summary["motion_s"] = 7;
              }).broken("what the simulation tells of itself is so"));
  EXPECT_TRUE(verified([](PlanFolder& p) {
                Control& control = p.plan.trajectory.controls[0];
                control.manipulation = Manipulation::body, control.force_n = {1, 0, 0};
              }).broken("nothing acts but what the scene says"));
}

// Time is part of a state, so what moves by itself moves in planning, too.
TEST_F(Simulate_slow, APlanIsMadeAmongWhatMovesByItself) {
  std::string text = thrown;
  text = text.substr(0, text.find("velocity_m_s")) + "# " + text.substr(text.find("velocity_m_s") + 26);
  const Result planned =
      limber_program({"plan", scene(text + lifting), "-o", out(), "--iterations", "20", "--set",
                      "world.gravity_m_s2=[0, 0, 0]", "--set", "planner.max_force_n=30", "--json"});
  ASSERT_TRUE(planned.code == exit_done || planned.code == exit_no_plan) << planned.err;
  const Moved m = moved("out");
  for (const State& frame : m.frames()) {
    State placed = frame;
    fem::follow_keyframes(m.world, placed);
    EXPECT_EQ(placed.positions, frame.positions);
  }
  const Table table = verify("out");
  EXPECT_TRUE(table.kept.at("replay gives the same bits"));
  EXPECT_TRUE(table.kept.at("searched again from the scene: the same tree"));
}

std::string without_search(std::string text) {
  const auto cut = [&](const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    text.erase(at, text.find(to, at) - at);
  };
  cut("[goal]", "[planner]"), cut("[planner]", "[film]");
  return text.replace(text.find("\"robot\""), 7, "\"free\"");
}

// No robot, no goal, no planner: all that is done with a simulation is done with it, and no more.
TEST_F(Simulate_slow, ASceneThatOnlyHappensNeedsNoRobotGoalOrPlanner) {
  const std::string text = without_search(thrown), lift = file("lift.toml", lifting);
  simulate(text, "out", {"--duration", "0.3", "--control", lift});
  simulate(thrown, "as", {"--duration", "0.3", "--control", lift});
  EXPECT_EQ(moved("out").frames(), moved("as").frames());
  EXPECT_EQ(verify("out").code, exit_done);
  EXPECT_EQ(limber_program({"info", out()}).code, exit_done);
  EXPECT_EQ(limber_program({"render", out(), "--frames", "0"}).code, exit_done);
  EXPECT_EQ(limber_program({"report", out()}).code, exit_done);

  EXPECT_EQ(limber_program({"info", scene(text)}).code, exit_done);
  const Result check = limber_program({"scene", "check", scene(text), "--json"});
  EXPECT_EQ(check.code, exit_done) << check.err;
  EXPECT_TRUE(check.json().at("can_be_simulated"));
  EXPECT_FALSE(check.json().at("can_be_planned"));
  for (const char* command : {"plan", "run"}) {
    const Result refused = limber_program({command, scene(text), "-o", out("plan")});
    EXPECT_EQ(refused.code, exit_bad_input);
    EXPECT_NE(refused.err.find("scene.toml:1:1: the scene can only be simulated"), refused.err.npos)
        << refused.err;
    EXPECT_FALSE(fs::exists(out("plan")));
  }
}

// Planning goes on from a state that a motion has reached, robot and obstacles as they are there.
TEST_F(Simulate_slow, APlanBeginsAsAFrameOfAnotherMotion) {
  std::string text = small_scene;
  const auto plan = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> words{"plan", scene(text), "-o", out(name), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return limber_program(words);
  };
  ASSERT_EQ(plan("plan", {"--preset", "fast"}).code, exit_done);
  const Moved first = moved("plan");
  const std::size_t frame = first.frames().size() / 2;
  const std::vector<std::string> from{"--preset",  "fast",    "--from",
                                      out("plan"), "--frame", std::to_string(frame)};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), from.begin(), from.end());
    return more;
  };
  // To another goal, and in a softer world.
  const std::vector<std::string> back{"--set", "goal.center_of_mass_m=[0.8, 1, 1.2]", "--set",
                                      "bodies.block.youngs_modulus_pa=4e3"};
  const Result result = plan("back", with(back));
  ASSERT_EQ(result.code, exit_done) << result.err;
  EXPECT_EQ(result.json().at("from").at("frame"), frame);
  EXPECT_EQ(moved("back").frames()[0], first.frames()[frame]);
  EXPECT_LT((moved("back").center(moved("back").frames().size() - 1) - Vec3(0.8, 1, 1.2)).norm(), 0.3 + 0.1);
  const Table table = verify("back");
  EXPECT_EQ(table.code, exit_done);
  EXPECT_TRUE(table.kept.at(fmt::format("it starts as frame {} of another motion", frame)));
  EXPECT_TRUE(table.kept.at("searched again from the scene: the same tree"));

  // Cut short and resumed, it is the same plan.
  std::vector<std::string> few = with(back), on = with(back);
  few.insert(few.end(), {"--iterations", "1"}), on.emplace_back("--resume");
  plan("cut", few);
  EXPECT_EQ(plan("cut", back).code, exit_done) << "anew, from the scene's start";
  EXPECT_NE(moved("cut").frames()[0], first.frames()[frame]);
  plan("cut", few);
  EXPECT_EQ(plan("cut", on).code, exit_done);
  EXPECT_EQ(moved("cut").frames(), moved("back").frames());
  std::vector<std::string> elsewhere = back;
  elsewhere.insert(elsewhere.end(), {"--preset", "fast", "--resume"});
  EXPECT_NE(plan("cut", elsewhere).err.find("the same --from and --frame"), std::string::npos);

  for (const char* command : {"robust", "refine"}) {
    std::vector<std::string> words{command, out("back")};
    if (command == std::string("refine")) words.insert(words.end(), {"-o", out("fine")});
    const Result refused = limber_program(words);
    EXPECT_EQ(refused.code, exit_bad_input);
    EXPECT_NE(refused.err.find(fmt::format("begins as frame {} of another motion", frame)), std::string::npos)
        << refused.err;
  }
  EXPECT_NE(plan("plan", with({})).err.find("name another with -o"), std::string::npos);
  EXPECT_EQ(plan("none", {"--frame", "1"}).code, exit_bad_input);
}

// An arrow of the colour of pushes, in the frames between which it acts, from where it acts.
TEST_F(Simulate_slow, FilmShowsTheScenesForces) {
  const std::string push =
      "[[forces]]\nbody = \"cube\"\nfrom_s = 0.11\nto_s = 0.24\nforce_n = [0, 0, 40]\n";  // frames 2, 3, 4
  simulate(without_search(thrown), "out", {"--duration", "0.4", "--control", file("push.toml", push)});
  const auto arrow = [&](int frame, const std::string& name) {
    const render::Image8 image =
        render::read_png(fs::path(out()) / ("frames-" + name) / fmt::format("{:04}.png", frame));
    int pixels = 0;  // orange: far more red than blue
    for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3)
      pixels += int(image.rgb[i]) > int(image.rgb[i + 2]) + 90 && image.rgb[i] > 130;
    return pixels;
  };
  for (const char* forces : {"false", "true"})
    ASSERT_EQ(limber_program({"render", out(), "--as", forces, "--set", fmt::format("film.forces={}", forces),
                              "--set", "bodies.cube.color=#203060", "--set", "bodies.plate.color=#203060",
                              "--size", "384x256"})
                  .code,
              exit_done);
  for (int frame = 0; frame < 9; ++frame) {
    EXPECT_EQ(arrow(frame, "false"), 0) << frame;
    if (frame >= 2 && frame <= 4)
      EXPECT_GT(arrow(frame, "true"), 5) << frame;
    else
      EXPECT_EQ(arrow(frame, "true"), 0) << frame;
  }
}

TEST_F(Simulate_slow, WrongInputsSayWhatAndWhere) {
  const auto refused = [&](const Result& result, const std::string& words) {
    EXPECT_EQ(result.code, exit_bad_input) << result.err;
    EXPECT_NE(result.err.find(words), result.err.npos) << result.err;
  };
  const auto with = [&](const std::string& script) {
    return run(thrown, "out", {"--duration", "0.1", "--control", file("c.toml", script)});
  };
  refused(with("[[forces]]\nbody = \"ball\"\nto_s = 1\nforce_n = [0, 0, 1]\n"), "c.toml:2:8: forces[0].body");
  refused(with("[[forces]]\nbody = \"plate\"\nto_s = 1\nforce_n = [0, 0, 1]\n"), "c.toml:2:8: ");
  refused(with("[[forces]]\nbody = \"cube\"\nfrom_s = 2\nto_s = 1\nforce_n = [0, 0, 1]\n"), "c.toml:4:8: ");
  refused(with("[[forces]]\nbody = \"cube\"\nto_s = 1\nforce_n = [0, 0, nan]\n"), "c.toml:4:18: ");
  refused(
      with("[[forces]]\nbody = \"cube\"\nto_s = 1\nforce_n = [0, 0, 1]\nbox_m = [[3, 0, 0], [4, 1, 1]]\n"),
      "c.toml:1:1: no node of the cage of cube");
  refused(with("[[motions]]\nbody = \"plate\"\nkeyframes = [{ at_s = 2 }, { at_s = 1 }]\n"), "c.toml:3:");
  refused(with("[[motions]]\nbody = \"cube\"\nkeyframes = [{ at_s = 2 }]\n"), "c.toml:2:8: ");
  refused(run(thrown, "out", {"--duration", "-1"}), "--duration");
  refused(run(thrown, "out", {"--duration", "0"}), "--duration");
  refused(run(thrown, "out", {"--duration", "nan"}), "--duration");
  refused(run(thrown, "out", {"--duration", "1e12"}), "--duration");
  refused(run(thrown, "out", {"--control", out("nowhere.toml")}), "nowhere.toml");
  refused(run(thrown, "out", {"--frame", "3"}), "--from");
  refused(run(thrown, "out", {"--from", out("nowhere"), "--frame", "3"}), "nowhere");

  const std::string lift = file("lift.toml", lifting);
  simulate(thrown, "short", {"--duration", "0.2", "--control", lift});
  refused(run(thrown, "out", {"--from", out("short"), "--frame", "99"}), "frame 99: there is none");
  refused(run(thrown, "out", {"--from", out("short"), "--frame", "-1"}), "frame -1: there is none");
  refused(run(thrown, "short", {"--from", out("short"), "--frame", "1"}), "name another with -o");
  // The plate was elsewhere.
  simulate(thrown, "late",
           {"--duration", "1.5", "--control", lift, "--set", "bodies.cube.velocity_m_s=[0, 0, 0]"});
  refused(
      run(thrown, "out",
          {"--from", out("late"), "--control",
           file("c.toml", "[[motions]]\nbody = \"plate\"\nkeyframes = [{ at_s = 9, angle_deg = 90 }]\n")}),
      "body plate is");
  std::string finer = thrown;
  finer.replace(finer.find("cells = [2, 2, 2]"), 17, "cells = [3, 3, 3]");
  refused(run(finer, "out", {"--from", out("short"), "--control", lift}), "body cube has another cage there");
  std::string stranger = thrown;
  stranger.replace(stranger.find("\"cube\""), 6, "\"dice\"");
  refused(run(stranger, "out", {"--from", out("short"), "--control", lift}),
          "there cube can be pushed, and here dice");
  refused(run(thrown, "nothing", {"--resume"}), "there is none to go on from");
}

// It is taken, with a word; a force that acts in the last step, and a lift that stays in the bounds, without.
TEST_F(Simulate_slow, WhatNeverActsAndWhatLeavesTheBoundsIsTold) {
  const auto told = [&](const std::string& script, std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--duration", "0.5", "--control", file("c.toml", script)});
    const Result result = run(thrown, "out", std::move(more));
    EXPECT_EQ(result.code, exit_done) << result.err;
    return result.err;
  };
  const auto force = [](const char* from_s, const char* to_s) {
    return fmt::format("[[forces]]\nbody = \"cube\"\nfrom_s = {}\nto_s = {}\nforce_n = [0, 0, 1]\n", from_s,
                       to_s);
  };
  const auto rises_to = [](double z_m) {
    return fmt::format(
        "[[motions]]\nbody = \"plate\"\nkeyframes = [{{ at_s = 4, position_m = [1.9, 1, {}] }}]\n", z_m);
  };
  using testing::HasSubstr, testing::Not;
  EXPECT_THAT(told(force("0.5", "1")), HasSubstr("c.toml:1:1: a force on cube acts from 0.5 s to 1 s"));
  EXPECT_THAT(told(force("0.1", "0.100001")), HasSubstr("c.toml:1:1: a force on cube acts from 0.1 s"));
  EXPECT_THAT(told("[[pressures]]\nbody = \"cube\"\nfrom_s = 1\nto_s = 2\npressure_pa = 5\n"),
              HasSubstr("c.toml:1:1: a pressure in cube acts from 1 s to 2 s"));
  EXPECT_THAT(told(force("0", "1")), Not(HasSubstr("c.toml")));
  EXPECT_THAT(told(force("0.49", "1")), Not(HasSubstr("c.toml")));
  // The room ends at 4 m, half of the plate's 0.2 m above its middle.
  EXPECT_THAT(told(rises_to(5)), HasSubstr("c.toml:1:1: the keyframe at 4 s takes plate 1.1"));
  EXPECT_THAT(told(rises_to(3.5)), Not(HasSubstr("c.toml")));
  simulate(thrown, "before", {"--duration", "0.5"});
  EXPECT_THAT(told(force("0", "0.2"), {"--from", out("before"), "--frame", "9"}),
              HasSubstr("and the motion begins at 0.4"));
}

// In its own world the plan comes out again, bit for bit; in another, where its controls alone go astray, the
// robot still arrives. verify asks the follower again.
TEST_F(Simulate_slow, APlanIsFollowedByFeedback) {
  const Json plan = limber_program({"plan", scene(), "-o", out("plan"), "--json"}).json();
  ASSERT_TRUE(plan.at("solved"));
  const auto follow = [&](const std::string& name, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--follow", out("plan")});
    return simulate(small_scene, name, more);
  };
  const Json same = follow("same");
  EXPECT_EQ(same.at("motion_s"), plan.at("motion_s"));
  EXPECT_EQ(same.at("follows").at("farthest_from_path_m"), 0);
  EXPECT_TRUE(same.at("follows").at("reaches"));
  const PlanFolder planned = read_plan_folder(out("plan")), followed = read_plan_folder(out("same"));
  EXPECT_TRUE(planned.plan.trajectory.frames == followed.plan.trajectory.frames);
  EXPECT_TRUE(planned.plan.trajectory.end == followed.plan.trajectory.end);
  EXPECT_EQ(verify("same").code, exit_done);

  const auto with_density = [](const std::string& kg_m3) {
    return std::vector<std::string>{"--set", "bodies.robot.material.density_kg_m3=" + kg_m3, "--duration",
                                    "30"};
  };
  const std::vector<std::string> heavier = with_density("106");
  const Json other = follow("other", heavier);
  EXPECT_TRUE(other.at("follows").at("reaches")) << other.at("follows");
  EXPECT_GT(other.at("follows").at("farthest_from_path_m"), 0);
  EXPECT_LE(other.at("largest_force_n").get<double>(), 100);
  const Table verified = verify("other");
  EXPECT_EQ(verified.code, exit_done);
  for (const auto& [promise, kept] : verified.kept) EXPECT_TRUE(kept) << promise;
  // Heavier still it swings into a wall, a little deeper than is promised, which is all that is broken.
  EXPECT_TRUE(follow("heaviest", with_density("110")).at("follows").at("reaches"));
  const Table deep = verify("heaviest");
  EXPECT_EQ(deep.code, exit_defect);
  for (const auto& [promise, kept] : deep.kept)
    EXPECT_EQ(kept, !promise.starts_with("penetration of cages")) << promise;
  const std::string first = bytes("other");
  std::vector<std::string> one_thread = heavier;
  one_thread.insert(one_thread.end(), {"--threads", "1"});
  follow("other", one_thread);
  EXPECT_EQ(bytes("other"), first);
  EXPECT_EQ(limber_program({"render", out("other"), "--frames", "0-1"}).code, exit_done);
  EXPECT_EQ(limber_program({"info", out("other")}).code, exit_done);
  EXPECT_EQ(limber_program({"report", out("other")}).code, exit_done);

  // Without the plan nobody can tell whether its follower chose the controls.
  fs::rename(out("plan"), out("gone"));
  const Result alone = limber_program({"verify", out("other"), "--json"});
  EXPECT_EQ(alone.code, exit_defect);
  EXPECT_NE(alone.out.find("so nobody can tell"), alone.out.npos) << alone.out;
}

TEST_F(Simulate_slow, WhatCannotBeFollowedIsRefusedWithASentence) {
  limber_program({"plan", scene(), "-o", out("plan")});
  limber_program({"plan", scene(), "-o", out("few"), "--iterations", "1"});
  const auto refused = [&](const std::string& text, std::vector<std::string> more, const std::string& why) {
    const Result result = run(text, "out", std::move(more));
    EXPECT_EQ(result.code, exit_bad_input) << why;
    EXPECT_NE(result.err.find(why), result.err.npos) << result.err;
  };
  refused(small_scene, {"--follow", out("few")}, "does not reach the goal");
  refused(small_scene, {"--follow", out("nowhere")}, "there is no such file");
  fs::create_directories(out("out"));
  refused(small_scene, {"--follow", out("out")}, "is the folder of the plan that is followed");
  refused(small_scene, {"--follow", out("plan"), "--resume"}, "--resume does not go with --follow");
  refused(small_scene, {"--follow", out("plan"), "--from", out("plan")},
          "--follow begins where the plan begins");
  refused(small_scene, {"--follow", out("plan"), "--set", "bodies.robot.cage.cells=[3, 2, 2]"},
          "limber refine");
  refused(thrown, {"--follow", out("plan")}, "has another name, place or cage");
  simulate(small_scene, "followed", {"--follow", out("plan"), "--duration", "0.2"});
  refused(small_scene, {"--follow", out("followed")}, "holds a simulation");
  const Result resumed =
      limber_program({"simulate", scene(), "-o", out("followed"), "--resume", "--duration", "1"});
  EXPECT_EQ(resumed.code, exit_bad_input);
  EXPECT_NE(resumed.err.find("was steered"), resumed.err.npos) << resumed.err;
}

}  // namespace
}  // namespace limber::detail
