// Folders from strangers: whoever changes a plan can write its hashes, too. Each command says what is wrong.
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "core/lock.h"
#include "plan/plan_file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

class Strangers_slow : public Program {
 protected:
  void SetUp() override {
    ASSERT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
    good_ = plan::read_plan(file());
  }
  fs::path file() const { return fs::path(out()) / "plan.npz"; }
  void write(const std::function<void(plan::Plan&)>& change) {
    plan::Plan bad = good_.plan;
    change(bad);
    plan::write_plan(file(), bad, good_.given);
  }
  // Every command that reads a plan ends with exit code 2 and these words.
  void expect_refused(const std::string& words) {
    for (std::vector<std::string> command : {std::vector<std::string>{"verify", out()},
                                             {"render", out(), "--set", "film.forces=true"},
                                             {"export", out(), "--format", "gltf"},
                                             {"report", out()},
                                             {"robust", out(), "-n", "1"},
                                             {"refine", out(), "-o", out("fine")},
                                             {"plan", scene(), "-o", out(), "--resume"}}) {
      const Result result = limber_program(command);
      EXPECT_EQ(result.code, exit_bad_input) << command[0] << ": " << result.err;
      EXPECT_NE(result.err.find(words), std::string::npos) << command[0] << ": " << result.err;
      EXPECT_NE(result.err.find("plan.npz"), std::string::npos) << command[0] << ": " << result.err;
    }
  }
  plan::PlanFile good_;
};

TEST_F(Strangers_slow, AControlAtANodeThatTheRobotLacksIsRefused) {
  for (const int node : {-7, 27, 1 << 30}) {
    write([&](plan::Plan& p) {
      p.trajectory.controls[0].manipulation = Manipulation::control_point;
      p.trajectory.controls[0].node = node;
    });
    expect_refused(fmt::format("path_node[0] is {}", node));
  }
  write([](plan::Plan& p) { p.tree.controls[1].node = 27; });
  expect_refused("tree_node[1] is 27");
}

// What cannot end well is told before a search begins, and what is lost before it is.
TEST_F(Strangers_slow, WhatASearchOrASimulationReplacesIsToldFirst) {
  const Result simulated = limber_program({"simulate", scene(), "-o", out(), "--duration", "0.01s"});
  EXPECT_EQ(simulated.code, exit_done);
  EXPECT_NE(simulated.err.find("is replaced when this ends: a plan of"), std::string::npos) << simulated.err;
  EXPECT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
  const Result other = limber_program({"plan", scene(), "-o", out(), "--resume", "--seed", "77"});
  EXPECT_EQ(other.code, exit_bad_input);
  EXPECT_NE(other.err.find("go on with --seed 1,"), std::string::npos) << other.err;
  const Result beyond =
      limber_program({"plan", scene(), "-o", out("p"), "--portfolio", "2", "--seed", "9007199254740992"});
  EXPECT_EQ(beyond.code, exit_bad_input);
  EXPECT_NE(beyond.err.find("its last seed would be beyond 9007199254740992"), std::string::npos)
      << beyond.err;
  fs::remove(file());
  fs::create_directory(file());
  for (const char* command : {"plan", "simulate"}) {
    const Result refused = limber_program({command, scene(), "-o", out()});
    EXPECT_EQ(refused.code, exit_bad_input) << refused.err;
    EXPECT_NE(refused.err.find("is a folder"), std::string::npos) << refused.err;
  }
}

// The whole file is of one piece, but of another world.
TEST_F(Strangers_slow, StatesOfOtherBodiesAreRefused) {
  write([](plan::Plan& p) {
    const auto cut = [](State s) {
      s.positions.resize(30), s.velocities.resize(30);
      return s;
    };
    plan::States states;
    for (std::size_t i = 0; i < std::size_t(p.tree.size()); ++i)
      states.push_back(cut(p.tree.states[i]), p.tree.parents[i]);
    p.tree.states = states;
    for (State& frame : p.trajectory.frames) frame = cut(frame);
    p.trajectory.end = cut(p.trajectory.end);
  });
  expect_refused("its states hold 30 numbers");
}

// 2³¹ − 1 steps in a path of three frames, all that can be added up being right.
TEST_F(Strangers_slow, APathThatHasFewerFramesThanItsReplayIsRefused) {
  write([](plan::Plan& p) {
    plan::Trajectory& t = p.trajectory;
    const std::int64_t more = std::numeric_limits<std::int32_t>::max() - t.controls.back().steps;
    t.controls.back().steps += std::int32_t(more), t.end.step += more;
  });
  expect_refused("lacks the frame at step");
}

TEST_F(Strangers_slow, NumbersThatNoPlanHasAreRefused) {
  write([](plan::Plan& p) { p.trajectory.frames[1].positions[0] = std::numeric_limits<float>::quiet_NaN(); });
  expect_refused("frame_positions[1] holds nan");
  for (const double fps : {0.0, -1.0, 1e9, 1e-300}) {
    write([&](plan::Plan& p) { p.settings.frames_per_second = p.trajectory.frames_per_second = fps; });
    expect_refused("frames_per_second is");
  }
  write([](plan::Plan& p) { p.statistics.iterations = std::int64_t(1) << 62; });
  expect_refused("statistics.iterations is");
}

// What is read of JSON has the kinds that were written.
TEST_F(Strangers_slow, ATextWhereANumberBelongsIsRefused) {
  const auto edited = [](const fs::path& path, const std::function<void(Json&)>& change) {
    Json json = read_json(path);
    change(json);
    write_json(path, json);
  };
  const fs::path report = fs::path(out()) / "bodies" / "robot" / "report.json",
                 manifest = fs::path(out()) / "manifest.json";
  const std::string good = read_file(report);
  for (const auto& [named, change] : std::vector<std::pair<std::string, std::function<void(Json&)>>>{
           {"certificate.holds is a text", [](Json& j) { j["certificate"]["holds"] = "yes"; }},
           {"certificate is a whole number", [](Json& j) { j["certificate"] = 7; }},
           {"cpu_seconds.cage is a list", [](Json& j) { j["cpu_seconds"]["cage"] = Json::array(); }},
           {"cage.tets is a number", [](Json& j) { j["cage"]["tets"] = 1e300; }},
           {"contact.samples is nothing", [](Json& j) { j["contact"]["samples"] = nullptr; }},
           {"model is missing", [](Json& j) { j.erase("model"); }}}) {
    edited(report, change);
    for (const std::vector<std::string>& command : {std::vector<std::string>{"verify", out()},
                                                    {"report", out()},
                                                    {"info", report.parent_path().string()}}) {
      const Result result = limber_program(command);
      EXPECT_EQ(result.code, exit_bad_input) << command[0] << result.err;
      EXPECT_NE(result.err.find("report.json: " + named), std::string::npos) << command[0] << result.err;
    }
    std::ofstream(report) << good;
  }
  edited(manifest, [](Json& j) { j["render"] = {{"cpu_s", "much"}}; });
  const Result result = limber_program({"report", out()});
  EXPECT_EQ(result.code, exit_bad_input);
  EXPECT_NE(result.err.find("manifest.json: render: cpu_s is a text"), std::string::npos) << result.err;
  fs::remove(manifest);
  plan::write_plan(file(), good_.plan, [&] {
    Json given = good_.given;
    given["summary"]["dynamics"] = "fast";
    return given;
  }());
  expect_refused("given.summary: dynamics is a text");
}

// A plan's folder without timings.json, or with one that is damaged or another plan's, is the same plan.
TEST_F(Strangers_slow, NothingDependsOnWhatAPlanCost) {
  const fs::path timings = fs::path(out()) / "timings.json";
  plan::write_plan(file(), good_.plan, good_.given);
  const auto facts = [&] {
    const Result info = limber_program({"info", out(), "--json"});
    EXPECT_EQ(info.code, exit_done) << info.err;
    return info.json();
  };
  ASSERT_TRUE(fs::exists(timings));
  const std::string good = read_file(timings);
  EXPECT_TRUE(facts().at("statistics").contains("cpu_s"));
  for (const char* what : {"missing", "cut", "another's"}) {
    Json of_another = Json::parse(good);
    of_another["of"][0] = "0123456789abcdef";
    write_file(timings, *what == 'c' ? good.substr(0, good.size() / 2) : of_another.dump());
    if (*what == 'm') fs::remove(timings);
    EXPECT_FALSE(facts().at("statistics").contains("cpu_s")) << what;
    EXPECT_FALSE(facts().contains("dynamics")) << what;
    for (const char* command : {"verify", "report"})
      EXPECT_EQ(limber_program({command, out()}).code, exit_done) << command << what;
  }
  for (const auto& [named, change] : std::vector<std::pair<std::string, std::function<void(Json&)>>>{
           {"summary: statistics.cpu_s is a text",
            [](Json& j) { j["summary"]["statistics"]["cpu_s"] = "much"; }},
           {"summary: statistics.rollouts is a number",
            [](Json& j) { j["summary"]["statistics"]["rollouts"] = 0.5; }},
           {"summary: dynamics is a text", [](Json& j) { j["summary"]["dynamics"] = "fast"; }},
           {"summary: dynamics.load_us is a text", [](Json& j) { j["summary"]["dynamics"]["load_us"] = ""; }},
           {"summary is a list", [](Json& j) { j["summary"] = Json::array(); }},
           {"of is missing", [](Json& j) { j.erase("of"); }}}) {
    Json edited = Json::parse(good);
    change(edited);
    write_file(timings, edited.dump());
    const Result result = limber_program({"info", out()});
    EXPECT_EQ(result.code, exit_bad_input) << named << result.out;
    EXPECT_NE(result.err.find("timings.json: " + named), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("remove the file"), std::string::npos) << result.err;
  }
  write_file(timings, good);
}

TEST_F(Strangers_slow, PipesAreRefusedWhereverFilesAreRead) {
  fs::remove(file());
  ASSERT_EQ(mkfifo(file().c_str(), 0600), 0);
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"info", file().string()}).code, exit_bad_input);
  fs::remove(file());
  plan::write_plan(file(), good_.plan, good_.given);
  fs::remove(fs::path(out()) / "manifest.json");
  ASSERT_EQ(mkfifo((fs::path(out()) / "manifest.json").c_str(), 0600), 0);
  EXPECT_EQ(limber_program({"report", out()}).code,
            exit_done);  // with a warning: it holds nothing else than others
  fs::create_directory(fs::path(out()) / "frames");
  ASSERT_EQ(mkfifo((fs::path(out()) / "frames" / "0000.png").c_str(), 0600), 0);
  EXPECT_EQ(limber_program({"render", out(), "--resume", "--frames", "0"}).code,
            exit_disk);  // it is not replaced
}

// Frames are what takes long: what would keep the film from being made is told before.
TEST_F(Strangers_slow, WithoutFfmpegNoFrameIsPainted) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", out("nowhere").c_str(), 1);
  const Result rendered = limber_program({"render", out()}),
               ran = limber_program({"run", scene(), "-o", out("new")});
  const Result one = limber_program({"render", out(), "--frames", "1"});
  ::setenv("PATH", path.c_str(), 1);
  for (const Result& result : {rendered, ran}) {
    EXPECT_EQ(result.code, exit_bad_input);
    EXPECT_NE(result.err.find("ffmpeg"), std::string::npos) << result.err;
  }
  EXPECT_FALSE(fs::exists(fs::path(out()) / "frames" / "0000.png"));
  EXPECT_FALSE(fs::exists(out("new")));
  EXPECT_EQ(one.code, exit_done) << one.err;  // a part of the frames makes no film
}

// The one that came first has the folder; the kernel takes the lock from one that is killed.
TEST_F(Strangers_slow, TwoRunsInOneFolderDoNotMixAndAKilledOneLeavesNothingThatBlocks) {
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const FolderLock lock(out(), FolderLock::alone);
    [[maybe_unused]] const auto told = ::write(ready[1], "!", 1);
    ::pause();
  }
  char byte;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  for (const std::vector<std::string>& command : {std::vector<std::string>{"plan", scene(), "-o", out()},
                                                  {"run", scene(), "-o", out()},
                                                  {"render", out()},
                                                  {"refine", out(), "-o", out("fine")}}) {
    const Result result = limber_program(command);
    const bool elsewhere = command[0] == "refine";
    EXPECT_EQ(result.code, elsewhere ? exit_done : exit_bad_input) << command[0] << result.err;
    EXPECT_EQ(result.err.find("another limber is at work in this folder") == std::string::npos, elsewhere)
        << result.err;
  }
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);  // who only reads waits for nobody
  ::kill(child, SIGKILL), ::waitpid(child, nullptr, 0);
  ::close(ready[0]), ::close(ready[1]);
  EXPECT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
  const FolderLock shared(out(), FolderLock::shared);
  EXPECT_EQ(limber_program({"render", out(), "--frames", "0"}).code, exit_done);  // as many as one likes
  EXPECT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_bad_input);
}

// Of a folder that may only be read.
TEST_F(Strangers_slow, AnExportToElsewhereNeedsNoPermissionToWriteBeside) {
  fs::remove(fs::path(out()) / "manifest.json");
  for (const auto& entry : fs::recursive_directory_iterator(folder.path()))
    fs::permissions(entry.path(), fs::perms::all);
  fs::permissions(folder.path(), fs::perms::all);
  fs::permissions(
      out(), fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_read | fs::perms::others_exec);
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr int nobody = 65534;
    if (::geteuid() == 0 && (::setgid(nobody) != 0 || ::setuid(nobody) != 0)) ::_exit(99);
    const int code = limber_program({"export", out(), "--format", "usd", "-o", out("elsewhere")}).code;
    const int refused = limber_program({"export", out(), "--format", "usd"}).code;
    ::_exit(code == exit_done && refused == exit_disk ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  fs::permissions(out(), fs::perms::all);
  EXPECT_TRUE(fs::exists(fs::path(out("elsewhere")) / "motion.usda"));
}

TEST_F(Program, AMistypedCommandOrOptionIsNamedWithWhatWasMeant) {
  for (const auto& [words, told] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"rendr", "x"}, "rendr is no command of limber; did you mean render?"},
           {{"frobnicate"}, "frobnicate is no command of limber; see limber --help"},
           {{"prepare", "a.obj", "-o", "b", "--tet", "500"},
            "--tet is no option of limber prepare; did you mean --tets?"},
           {{"prepare", "a.obj", "-o", "b", "--tet=500"}, "did you mean --tets?"},
           {{"scene", "nwe"}, "nwe is no command of limber scene; did you mean new?"},
           {{"--verson"}, "did you mean --version?"}}) {
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_bad_input);
    EXPECT_NE(result.err.find(told), std::string::npos) << result.err;
    std::vector<std::string> as_json = words;
    as_json.push_back("--json");
    EXPECT_NE(limber_program(as_json).json().at("error").get<std::string>().find(told), std::string::npos);
  }
  EXPECT_NE(limber_program({"plan", "x"}).err.find("--out is required"), std::string::npos);
  EXPECT_NE(limber_program({"plan", "x", "-o", "y", "--set", "a.b=1", "c.d=2"})
                .err.find("c.d=2; each KEY=VALUE wants a --set of its own"),
            std::string::npos);
  // A value that cannot be: limber says so, and where to read on.
  for (const auto& [words, told] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"render", "x", "--bits", "12"}, "limber: --bits: 12 not in {8,16}; see limber render --help"},
           {{"render", "x", "--passes", "depth,foo"}, "limber: --passes: foo not in"},
           {{"plan", "x", "-o", "y", "--seed", "1.5"}, "limber: --seed: 1.5 is no whole number from 0 to"},
           {{"plan", "x", "-o", "y", "--seed", "9007199254740993"}, "limber: --seed: 9007199254740993 is no"},
           {{"simulate", "x", "-o", "y", "--duration", "nan"},
            "limber: --duration: nan is no duration; write"},
           {{"plan", "x", "-o", "y", "--time-limit", "5 days"},
            "limber: --time-limit: 5 days is no duration"},
           {{"plan", "/", "-o", "y"}, "limber: /: a folder without a scene.toml"},
           {{"render", "x", "--as", ""}, "limber: --as: is empty; write a name"}}) {
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_bad_input);
    EXPECT_TRUE(result.err.starts_with(told)) << result.err;
  }
  for (const auto& [words, told] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{}, "limber needs a command, one of prepare, plan, "},
           {{"scene"}, "limber scene needs a command, one of "}}) {
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_bad_input);
    EXPECT_NE(result.err.find(told), std::string::npos) << result.err;
  }
}

// Without a settle nobody has looked whether the robot rests.
TEST_F(Program_slow, RobustSaysOfNoRobotThatItRestsWhereNoneWasAskedTo) {
  const std::string moving = scene(replaced("max_force_n = 100", "max_force_n = 100\nsettle_time_s = 0"));
  ASSERT_EQ(limber_program({"plan", moving, "-o", out()}).code, exit_done);
  const Result result =
      limber_program({"robust", out(), "-n", "2", "--materials", "0", "--forces", "0", "--turn", "0"});
  ASSERT_EQ(result.code, exit_done) << result.err;
  EXPECT_NE(result.out.find("2 of 2 end in the goal"), std::string::npos) << result.out;
  EXPECT_EQ(result.out.find("rest"), std::string::npos) << result.out;
}

}  // namespace
}  // namespace limber::detail
