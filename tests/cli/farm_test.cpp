// One scene done by many processes: what comes out has the bytes of one process, whoever was killed on the
// way.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <map>
#include <thread>

#include "core/random.h"
#include "core/temporary_files.h"
#include "limber/detail/farm/engines.h"
#include "limber/detail/farm/lease.h"
#include "limber/detail/plan/plan_folder.h"
#include "plan/plan_file.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

using testing::HasSubstr;

class Farm : public Program {
 protected:
  void SetUp() override { ::setenv("LIMBER_STORE", out("store").c_str(), 1); }
  void TearDown() override { ::unsetenv("LIMBER_STORE"); }

  // Bevelled, which is prepared in a moment.
  std::string quick_scene() const {
    std::string text = replaced("seed = 1\niterations = 400\nmax_force_n = 100",
                                "seed = 3\niterations = 400\nmax_force_n = 60");
    for (const std::string size : {"size_m = [0.6, 0.6, 0.6]", "size_m = [0.4, 2, 0.9]"})
      text.insert(text.find(size) + size.size(), ", bevel_m = 0.05, triangle_m = 0.1");
    return scene(text);
  }

  // limber in a process of its own, since the local engine starts the program that it is part of.
  struct Process {
    pid_t pid;
    fs::path said;
  };
  Process start(std::vector<std::string> words) const {
    static int count = 0;
    const std::string program = std::string(limber_binary_dir) + "/cli/limber";
    words.push_back("--json");
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    const fs::path said = folder / fmt::format("said-{}", ++count);
    const pid_t child = ::fork();
    if (child == 0) {
      ::dup2(::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), 1);
      ::dup2(::open("/dev/null", O_WRONLY), 2);
      ::execv(program.c_str(), argv.data());
      ::_exit(127);
    }
    return {child, said};
  }
  struct Ended {
    int code;  // −1: killed
    Json json;
  };
  static Ended wait_for(const Process& process) {
    int status = 0;
    EXPECT_EQ(::waitpid(process.pid, &status, 0), process.pid);
    const bool exited = WIFEXITED(status);
    return {exited ? WEXITSTATUS(status) : -1,
            exited ? Json::parse(read_file(process.said), nullptr, false) : Json()};
  }
  Ended run(const std::vector<std::string>& words) const { return wait_for(start(words)); }

  std::vector<std::string> submit(const std::string& name, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"farm",     "submit", quick_scene(), "-o", out(name),
                                   "--engine", "local",  "--workers",   "2",  "--frames-per-task",
                                   "3"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  std::vector<std::string> submit_none() const {
    return {"farm", "submit", quick_scene(), "-o", out(), "--engine", "none", "--workers", "2"};
  }
  std::vector<std::string> scene_without_goal() const {
    std::string text = small_scene;
    const auto goal = text.find("[goal]");
    text.erase(goal, text.find("[planner]") - goal);
    std::ofstream(folder / "aimless.toml") << text;
    return {"farm", "submit", (folder / "aimless.toml").string(), "-o", out()};
  }

  static std::string box_model(double height) {
    std::string text;
    for (int c = 0; c < 8; ++c) text += fmt::format("v {} {} {}\n", c & 1, c >> 1 & 1, height * (c >> 2));
    return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  }
  std::string box_models(int count) const {
    fs::create_directories(folder / "models");
    for (int m = 0; m < count; ++m)
      std::ofstream(folder / "models" / fmt::format("box-{:02}.obj", m)) << box_model(1 + 0.1 * m);
    return (folder / "models").string();
  }

  // Less what tells of its making.
  static std::map<std::string, std::string> result_of_batch(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& [name, bytes] : contents(folder))
      if (name != "seconds.csv" && name != "journal.jsonl" && !name.starts_with("farm/")) files[name] = bytes;
    return files;
  }

  // Pictures and film by name, and the plan's hashes.
  std::map<std::string, std::string> result(const std::string& name) const {
    const fs::path work = out(name);
    const PlanFolder planned = read_plan_folder(work);
    std::map<std::string, std::string> files{{"tree", planned.summary.at("tree_hash")},
                                             {"path", planned.summary.at("trajectory_hash")},
                                             {"film", read_file(work / "film.mp4")},
                                             {"sheet", read_file(work / "sheet.png")}};
    for (const auto& entry : fs::directory_iterator(work / "frames"))
      files[entry.path().filename().string()] = read_file(entry.path());
    return files;
  }
  void expect_same(const std::string& a, const std::string& b) const {
    const auto files = result(a), others = result(b);
    EXPECT_GT(files.size(), 10u);
    for (const auto& [name, bytes] : files)
      EXPECT_TRUE(others.contains(name) && others.at(name) == bytes) << name;
    EXPECT_EQ(files.size(), others.size());
  }
  // Process numbers of those who are at units of the stage.
  std::vector<pid_t> owners(const std::string& name, const std::string& stage) const {
    std::vector<pid_t> found;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(fs::path(out(name)) / "farm" / "leases", none)) {
      if (!entry.path().filename().string().starts_with(stage)) continue;
      try {
        found.push_back(Json::parse(read_file(entry.path())).at("pid").get<pid_t>());
      } catch (const std::exception&) {  // it has gone, or was just made
      }
    }
    return found;
  }
  // Whether a process lives whose command names this folder.
  static bool anyone_works_on(const std::string& folder) {
    return std::ranges::any_of(fs::directory_iterator("/proc"), [&](const fs::directory_entry& entry) {
      std::ifstream file(entry.path() / "cmdline");
      return std::string(std::istreambuf_iterator<char>(file), {}).find(folder) != std::string::npos;
    });
  }

  template <class Condition>
  static bool soon(const Condition& holds) {
    for (int tries = 0; tries < 12000; ++tries, ::usleep(5000))
      if (holds()) return true;
    return false;
  }
};
using Farm_slow = Farm;

TEST_F(Farm_slow, LocalWorkersGiveTheBytesOfOneProcess) {
  ASSERT_EQ(run({"run", quick_scene(), "-o", out("one")}).code, exit_done);
  const Ended first = run(submit("farm"));
  ASSERT_EQ(first.code, exit_done) << first.json;
  EXPECT_EQ(first.json.at("status").at("state"), "done");
  expect_same("one", "farm");
  EXPECT_EQ(run({"verify", out("farm")}).code, exit_done);
  EXPECT_TRUE(fs::exists(fs::path(out("farm")) / "report.html"));
  EXPECT_TRUE(fs::is_empty(fs::path(out("farm")) / "farm" / "leases"));

  const auto film = fs::last_write_time(fs::path(out("farm")) / "film.mp4");
  const Ended again = run({"farm", "submit", "-o", out("farm"), "--engine", "local"});
  EXPECT_TRUE(again.json.at("was_done").get<bool>());
  // Neither plans nor paints, and does not make the film again.
  EXPECT_EQ(run({"run", quick_scene(), "-o", out("farm")}).json.at("render").at("painted"), 0);
  EXPECT_EQ(fs::last_write_time(fs::path(out("farm")) / "film.mp4"), film);

  // What is taken away comes back, and no more than that is done.
  fs::remove(fs::path(out("farm")) / "frames" / "0004.png");
  const Ended mended = run(submit("farm"));
  EXPECT_EQ(mended.code, exit_done);
  EXPECT_EQ(fs::last_write_time(fs::path(out("farm")) / "film.mp4"), film);
  expect_same("one", "farm");
}

TEST_F(Farm_slow, APathIsKeptAlone) {
  ASSERT_EQ(run({"plan", quick_scene(), "-o", out("one"), "--keep-tree", "path"}).code, exit_done);
  ASSERT_EQ(run(submit("farm", {"--keep-tree", "path", "--until", "plan"})).code, exit_done);
  EXPECT_EQ(read_file(fs::path(out("farm")) / "plan.npz"), read_file(fs::path(out("one")) / "plan.npz"));
  const Ended again = run({"farm", "submit", "-o", out("farm"), "--engine", "local", "--until", "plan"});
  EXPECT_TRUE(again.json.at("was_done").get<bool>());
  // What is to be kept is part of the result.
  ASSERT_EQ(run(submit("farm", {"--until", "plan"})).code, exit_done);
  EXPECT_GT(fs::file_size(fs::path(out("farm")) / "plan.npz"),
            fs::file_size(fs::path(out("one")) / "plan.npz"));
  EXPECT_EQ(run(submit("tree", {"--keep-tree", "path", "--set", "film.tree=true"})).code, exit_bad_input);
}

TEST_F(Farm_slow, KilledAtAnyTimeItEndsWithTheSameBytes) {
  ::unsetenv("LIMBER_STORE");  // bodies are made each time
  const std::vector<std::string> until_film{"--until", "film"};
  ASSERT_EQ(run(submit("whole", until_film)).code, exit_done);
  Rng rng(20261127, 0);
  for (int kill = 0; kill < 6; ++kill) {
    const Process process = start(submit("cut", until_film));
    ::usleep(useconds_t(1e6 * rng.uniform(0.05, 1.5)));
    if (kill % 3 == 2)
      ::kill(process.pid, SIGTERM);
    else
      ::kill(process.pid, SIGKILL);  // its workers end with it
    wait_for(process);
  }
  EXPECT_EQ(run(submit("cut", until_film)).code, exit_done);
  expect_same("whole", "cut");
}

TEST_F(Farm_slow, AWorkerThatIsKilledIsReplaced) {
  ::unsetenv("LIMBER_STORE");  // bodies are made each time
  const std::vector<std::string> until_film{"--until", "film"};
  ASSERT_EQ(run(submit("whole", until_film)).code, exit_done);
  const Process process = start(submit("cut", until_film));
  int killed = 0;
  for (const char* stage : {"body-", "search-", "frames-"}) {
    std::vector<pid_t> at_it;
    ASSERT_TRUE(soon([&] { return !(at_it = owners("cut", stage)).empty() || ::kill(process.pid, 0) != 0; }));
    if (at_it.empty()) continue;
    ASSERT_NE(at_it[0], ::getpid());
    killed += ::kill(at_it[0], SIGKILL) == 0;
  }
  EXPECT_EQ(wait_for(process).code, exit_done);
  EXPECT_GT(killed, 1);
  expect_same("whole", "cut");
}

TEST_F(Farm_slow, APortfolioHasTheSamePlanOnAnyNumberOfWorkers) {
  ASSERT_EQ(run({"plan", quick_scene(), "-o", out("one"), "--portfolio", "4"}).code, exit_done);
  const Json one = read_plan_folder(out("one")).summary;
  EXPECT_NE(one.at("seed"), 3) << "the first of them wins, which proves little";
  for (const char* workers : {"1", "3"}) {
    SCOPED_TRACE(workers);
    const std::string name = std::string("of-") + workers;
    ASSERT_EQ(run({"farm", "submit", quick_scene(), "-o", out(name), "--engine", "local", "--workers",
                   workers, "--portfolio", "4", "--until", "plan"})
                  .code,
              exit_done);
    const Json summary = read_plan_folder(out(name)).summary;
    for (const char* key : {"seed", "tree_hash", "trajectory_hash"})
      EXPECT_EQ(summary.at(key), one.at(key)) << key;
    EXPECT_EQ(summary.at("portfolio").at("searches").size(), 4u);
    // Nothing is left for `limber plan` to do.
    EXPECT_THAT(limber_program({"plan", quick_scene(), "-o", out(name), "--portfolio", "4"}).err,
                HasSubstr("plan.npz: up to date"));
  }
  EXPECT_EQ(read_plan_folder(out("of-1")).summary.at("portfolio").at("searches"),
            read_plan_folder(out("of-3")).summary.at("portfolio").at("searches"));
}

// Stopped in the middle a search is kept, and goes on to the tree of one that nobody stopped.
TEST_F(Farm_slow, ASearchThatIsStoppedGoesOn) {
  const std::vector<std::string> hard{"--set", "goal.radius_m=0.001", "--iterations", "30000"};
  std::vector<std::string> words{"plan", quick_scene(), "-o", out("one")};
  words.insert(words.end(), hard.begin(), hard.end());
  ASSERT_EQ(run(words).code, exit_no_plan);
  std::vector<std::string> farm = hard;
  farm.insert(farm.end(), {"--until", "plan"});
  const fs::path kept = fs::path(out()) / "farm" / "searches" / "search-3.npz";
  std::int64_t iterations = 0;
  for (int stops = 0, gains = 0; stops < 30 && gains < 2; ++stops) {
    const Process process = start(submit("out", farm));
    ASSERT_TRUE(soon([&] { return !owners("out", "search-").empty(); }));
    ::usleep(300'000);
    ::kill(process.pid, SIGTERM);
    ASSERT_EQ(wait_for(process).code, 128 + SIGTERM) << "it was done before it was stopped";
    if (!fs::exists(kept)) continue;  // it came before the search
    const std::int64_t so_far = plan::read_plan(kept).plan.statistics.iterations;
    ASSERT_GE(so_far, iterations);
    gains += so_far > iterations;
    iterations = so_far;
  }
  EXPECT_GT(iterations, 0);
  EXPECT_EQ(run(submit("out", farm)).code, exit_no_plan);
  for (const char* key : {"tree_hash", "trajectory_hash", "explanation"})
    EXPECT_EQ(read_plan_folder(out()).summary.at(key), read_plan_folder(out("one")).summary.at(key));
}

TEST_F(Farm_slow, OneIsAtWorkInAFolderAndCancelEndsIt) {
  const Process process = start(submit("out"));
  ASSERT_TRUE(soon([&] { return !owners("out", "frames-").empty(); }));
  EXPECT_EQ(limber_program({"farm", "status", out(), "--json"}).json().at("state"), "at work");
  const Result second = limber_program(submit("out"));
  EXPECT_EQ(second.code, exit_bad_input);
  EXPECT_THAT(second.err, HasSubstr("is being worked on by another limber farm submit"));
  const Result other = limber_program(submit("out", {"--seed", "7"}));
  EXPECT_EQ(other.code, exit_bad_input);

  EXPECT_EQ(limber_program({"farm", "cancel", out()}).code, exit_done);
  EXPECT_EQ(wait_for(process).code, 128 + SIGTERM);
  EXPECT_EQ(limber_program({"farm", "status", out(), "--json"}).json().at("state"), "cancelled");
  EXPECT_EQ(run({"farm", "work", out()}).code, 128 + SIGTERM);
  EXPECT_EQ(run({"farm", "submit", "-o", out(), "--engine", "local", "--until", "film"}).code, exit_done);
}

// Of a unit that fails the others go on; what failed is told, and tried when it is submitted again.
// What a run found, without what it cost and who did it: by file and key.
std::map<std::string, std::string> records_of(const fs::path& folder) {
  std::map<std::string, std::string> records;
  const std::vector<std::string> costs{"cpu_s", "wall_s", "threads", "host", "rollouts", "rollouts_wrong"};
  for (const auto& file : fs::directory_iterator(folder / "runs")) {
    const Json record = read_json(file.path());
    for (const auto& [key, value] : record.items())
      if (std::count(costs.begin(), costs.end(), key) == 0)
        records[file.path().filename().string() + ": " + key] = value.dump();
  }
  return records;
}
void expect_same_records(const fs::path& one, const fs::path& other) {
  const auto expected = records_of(one), found = records_of(other);
  for (const auto& [what, value] : expected) {
    const auto there = found.find(what);
    EXPECT_TRUE(there != found.end() && there->second == value) << what;
  }
  EXPECT_EQ(found.size(), expected.size());
}

TEST_F(Farm_slow, ABenchmarkHasTheRecordsOfOneProcess) {
  const std::vector<std::string> of_runs{quick_scene(), "--seeds", "1-4", "--presets", "paper,fast"};
  const auto words = [&](std::vector<std::string> command, const std::string& name,
                         const std::vector<std::string>& more = {}) {
    command.insert(command.end(), of_runs.begin(), of_runs.end());
    command.insert(command.end(), {"-o", out(name)});
    command.insert(command.end(), more.begin(), more.end());
    return command;
  };
  const auto on_a_farm = words({"farm", "bench"}, "farm", {"--engine", "local", "--workers", "2"});
  ASSERT_EQ(run(words({"bench"}, "one")).code, exit_done);
  const Process process = start(on_a_farm);
  ::usleep(700000);
  ::kill(process.pid, SIGKILL);  // its workers end with it
  wait_for(process);
  const Ended ended = run(on_a_farm);
  ASSERT_EQ(ended.code, exit_done) << ended.json;
  EXPECT_EQ(ended.json.at("status").at("state"), "done");
  expect_same_records(out("one"), out("farm"));
  const std::string lines = read_file(fs::path(out("farm")) / "runs.jsonl");
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 8);
  EXPECT_EQ(ended.json.at("status").at("report"), out("farm") + "/bench.html");
  EXPECT_TRUE(
      run({"farm", "submit", "-o", out("farm"), "--engine", "local"}).json.at("was_done").get<bool>());

  // A record that is taken away is made again, and no other.
  const fs::path runs = fs::path(out("farm")) / "runs";
  std::vector<fs::path> files;
  for (const auto& file : fs::directory_iterator(runs)) files.push_back(file.path());
  const auto kept = fs::last_write_time(files[0]);
  fs::remove(files[1]);
  EXPECT_EQ(run({"farm", "submit", "-o", out("farm"), "--engine", "local"}).code, exit_done);
  expect_same_records(out("one"), out("farm"));
  EXPECT_EQ(fs::last_write_time(files[0]), kept);
}

TEST_F(Farm_slow, ManyModelsHaveTheBytesOfOneBatch) {
  const std::string models = box_models(11);
  std::ofstream(fs::path(models) / "broken.obj") << "v 0 0 0\nf 1 2 3\n";
  const std::vector<std::string> of_bodies{models, "--only", "cage", "--tets", "24"};
  const auto words = [&](std::vector<std::string> command, const std::string& name,
                         const std::vector<std::string>& more = {}) {
    command.insert(command.end(), of_bodies.begin(), of_bodies.end());
    command.insert(command.end(), {"-o", out(name), "--store", out(name + "-store")});
    command.insert(command.end(), more.begin(), more.end());
    return command;
  };
  const auto on_a_farm =
      words({"farm", "prepare"}, "farm", {"--engine", "local", "--workers", "2", "--models-per-task", "3"});
  const auto expect_same_batch = [&] {
    const auto one = result_of_batch(out("one")), farm = result_of_batch(out("farm"));
    EXPECT_GT(one.size(), 25u);
    for (const auto& [name, bytes] : one) EXPECT_TRUE(farm.contains(name) && farm.at(name) == bytes) << name;
    EXPECT_EQ(one.size(), farm.size());
  };
  ASSERT_EQ(run(words({"prepare"}, "one")).code, exit_models_failed);
  const Process process = start(on_a_farm);
  EXPECT_TRUE(soon([&] { return owners("farm", "models-2").size() == 1; }));
  ::kill(process.pid, SIGKILL);  // its workers end with it, and theirs with them
  wait_for(process);
  EXPECT_TRUE(soon([&] { return !anyone_works_on(out("farm")); }));
  EXPECT_FALSE(fs::exists(fs::path(out("farm")) / "index.html"));
  const Ended ended = run(on_a_farm);
  ASSERT_EQ(ended.code, exit_models_failed) << ended.json;
  EXPECT_EQ(ended.json.at("status").at("models"), 12);
  EXPECT_EQ(ended.json.at("status").at("failed_models"), 1);
  expect_same_batch();
  EXPECT_TRUE(run(on_a_farm).json.at("was_done").get<bool>());

  // A model that is edited is made anew by who submits anew, and its costs are told once.
  std::ofstream(fs::path(models) / "broken.obj") << box_model(3);
  EXPECT_EQ(run(words({"prepare"}, "one")).code, exit_done);
  EXPECT_EQ(run(on_a_farm).code, exit_done);
  expect_same_batch();
  const std::string lines = read_file(fs::path(out("farm")) / "journal.jsonl");
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 12);
  EXPECT_FALSE(fs::exists(fs::path(out("farm")) / "journal"));
}

TEST_F(Farm_slow, WhatFailsIsToldAndTriedAgain) {
  const std::vector<std::string> until_film{"--until", "film"};
  ASSERT_EQ(run(submit("out", {"--until", "plan"})).code, exit_done);
  fs::create_directories(fs::path(out()) / "frames" / "0004.png");  // a folder where a picture belongs
  const Ended failed = run(submit("out", until_film));
  EXPECT_NE(failed.code, exit_done);
  EXPECT_NE(failed.json.value("error", failed.json.dump()).find("0004.png"), std::string::npos)
      << failed.json;
  fs::remove(fs::path(out()) / "frames" / "0004.png");
  EXPECT_EQ(run(submit("out", until_film)).code, exit_done);

  const std::string edited = replaced("radius_m = 0.3", "radius_m = 0.31");
  std::ofstream(folder / "scene.toml") << edited;
  const Ended worker = run({"farm", "work", out()});
  EXPECT_EQ(worker.code, exit_bad_input);
  EXPECT_THAT(worker.json.at("error").get<std::string>(), HasSubstr("was edited after it was submitted"));
  EXPECT_THAT(limber_program({"farm", "status", out()}).out, HasSubstr("was edited since"));
}

TEST_F(Farm_slow, AFilmThatShowsTheseFramesIsKept) {
  ASSERT_EQ(limber_program({"plan", quick_scene(), "-o", out()}).code, exit_done);
  const auto films_told = [&](const std::string& name) {
    const std::string events = read_file(folder / name);
    int films = 0;
    for (std::size_t at = 0; (at = events.find(R"({"event":"film")", at)) != events.npos; ++at) ++films;
    return films;
  };
  // Two parts at once: one of them makes it.
  std::vector<Process> parts;
  for (const char* part : {"1", "2"})
    parts.push_back(start({"render", out(), "--resume", "--chunk", std::string(part) + "/2", "--progress",
                           (folder / (std::string(part) + ".jsonl")).string()}));
  for (const Process& part : parts) EXPECT_EQ(wait_for(part).code, exit_done);
  EXPECT_EQ(films_told("1.jsonl") + films_told("2.jsonl"), 1);
  const fs::path film = fs::path(out()) / "film.mp4";
  const std::string bytes = read_file(film);
  const auto made = fs::last_write_time(film);

  const auto resume = [&](std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"render", out(), "--resume", "--json"});
    const Result result = limber_program(more);
    EXPECT_EQ(result.code, exit_done) << result.err;
    EXPECT_TRUE(result.json().contains("film"));
  };
  resume({"--chunk", "1/2"});
  fs::remove(fs::path(out()) / "frames" / "0002.png");
  resume();
  EXPECT_EQ(fs::last_write_time(film), made);

  std::ofstream(film) << "no film";
  resume();
  EXPECT_EQ(read_file(film), bytes);
  resume({"--set", "film.background=#102030"});  // other frames
  EXPECT_NE(read_file(film), bytes);
  resume();
  EXPECT_EQ(read_file(film), bytes);
  fs::remove(fs::path(out()) / "sheet.png");
  resume();
  EXPECT_TRUE(fs::exists(fs::path(out()) / "sheet.png"));
}

TEST_F(Farm, WrongWordsAreRefusedBeforeAnythingIsWritten) {
  const auto refused = [&](std::vector<std::string> words, const std::string& why) {
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_bad_input) << result.out << result.err;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(fs::exists(out()));
  };
  for (const char* command : {"status", "cancel", "work"})
    refused({"farm", command, out()}, "nothing was submitted");
  refused({"farm"}, "needs a command, one of submit, bench, prepare, status, cancel, work");
  refused({"farm", "prepare", "-o", out()}, "MODEL");
  refused({"farm", "prepare", box_models(1)}, "--out");
  refused({"farm", "prepare", "no.obj", "-o", out()}, "no.obj: there is no such file");
  refused({"farm", "prepare", box_models(1), "-o", out(), "--models-per-task", "0"}, "--models-per-task");
  refused({"farm", "prepare", box_models(1), "-o", out(), "--tets", "3"}, "--tets");
  refused({"farm", "prepare", box_models(1), "-o", out(), "--exact", "--mode", "conform", "--only", "cage"},
          "--exact");
  refused({"farm", "bench", "-o", out()}, "name the scenes");
  refused({"farm", "bench", quick_scene()}, "-o");
  refused({"farm", "bench", "barriers7", "-o", out()}, "barriers7");
  refused({"farm", "bench", quick_scene(), quick_scene(), "-o", out()}, "named twice");
  refused({"farm", "bench", quick_scene(), "-o", out(), "--seeds", "3-1"}, "3-1");
  refused({"farm", "bench", quick_scene(), "-o", out(), "--presets", "quick"}, "quick");
  refused({"farm", "bench", quick_scene(), "-o", out(), "--set", "planner.sed=1"}, "sed");
  refused({"farm", "bench", quick_scene(), "-o", out(), "--runs-per-task", "0"}, "--runs-per-task");
  refused({"farm", "submit", "-o", out()}, "nothing was submitted");
  refused({"farm", "submit", "barriers7", "-o", out()}, "barriers7");
  refused(submit("out", {"--camera", "left"}), "there are: main");
  refused(submit("out", {"--size", "3"}), "3");
  refused(submit("out", {"--chunks", "4"}), "leave one out");
  refused(submit("out", {"--sbatch=--time=1"}), "--sbatch is for Slurm");
  refused(submit("out", {"--set", "planner.sed=1"}), "sed");
  refused(submit("out", {"--workers", "0"}), "--workers");
  refused(submit("out", {"--until", "fim"}), "--until");
  refused(scene_without_goal(), "goal");
  EXPECT_THAT(limber_program({"farm", "submit", "-o", out(), "--seed", "3"}).err, HasSubstr("none is named"));
  const Result dry = limber_program(submit("out", {"--dry-run"}));
  EXPECT_EQ(dry.code, exit_done) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("bodies: 3 units"));
  EXPECT_FALSE(fs::exists(out()));
}

// `none` is never what is taken by itself.
TEST_F(Farm, WhatGoesOnKeepsItsEngine) {
  ASSERT_EQ(limber_program(submit_none()).code, exit_done);
  const Result goes_on = limber_program({"farm", "submit", "-o", out()});
  EXPECT_EQ(goes_on.code, exit_done) << goes_on.err;
  EXPECT_THAT(goes_on.out, HasSubstr("ready: limber farm work " + out()));
}

// Each key of farm.json, of its result too, is asked for.
void expect_a_sentence_of_each_key(const fs::path& work) {
  const fs::path file = work / "farm" / "farm.json";
  const std::string good = read_file(file);
  const Json json = Json::parse(good);
  const auto told = [&](const Json& damaged, const std::string& key) {
    std::ofstream(file) << damaged;
    const Result status = limber_program({"farm", "status", work.string()});
    EXPECT_EQ(status.code, exit_bad_input) << key << status.err;
    EXPECT_THAT(status.err, HasSubstr("submit anew")) << key;
  };
  const Json wrong = Json::array({Json::object()});
  for (const auto& [key, value] : json.items()) {
    Json damaged = json;
    damaged[key] = wrong, told(damaged, key);
  }
  for (const auto& [key, value] : json.at("result").items()) {
    Json damaged = json;
    damaged["result"][key] = wrong, told(damaged, key);
  }
  std::ofstream(file) << good;
}

TEST_F(Farm, ADamagedFolderIsASentence) {
  ASSERT_EQ(limber_program({"farm", "bench", quick_scene(), "-o", out("runs"), "--engine", "none",
                            "--iterations", "9", "--time-limit", "9"})
                .code,
            exit_done);
  expect_a_sentence_of_each_key(out("runs"));
  ASSERT_EQ(
      limber_program({"farm", "prepare", box_models(2), "-o", out("models-out"), "--engine", "none"}).code,
      exit_done);
  expect_a_sentence_of_each_key(out("models-out"));
  ASSERT_EQ(limber_program(submit_none()).code, exit_done);
  expect_a_sentence_of_each_key(out());
  const fs::path file = fs::path(out()) / "farm" / "farm.json";
  const std::string good = read_file(file);
  std::ofstream(file) << good.substr(0, good.size() / 2);
  EXPECT_EQ(limber_program({"farm", "work", out()}).code, exit_bad_input);
  EXPECT_EQ(limber_program(submit_none()).code, exit_done);  // makes it anew
  EXPECT_EQ(read_file(file), good);
  std::ofstream(fs::path(out()) / "farm" / "jobs.json") << R"({"jobs": ["1; rm", 7, "8"], "rounds": "x"})";
  std::ofstream(fs::path(out()) / "farm" / "done" / "plan.json") << R"({"frame_hashes": 3, "solved": []})";
  std::ofstream(fs::path(out()) / "farm" / "failed" / "beside.json") << "[";
  const Json status = limber_program({"farm", "status", out(), "--json"}).json();
  EXPECT_EQ(status.at("state"), "failed");
}

TEST_F(Farm, SlurmAndOthersGetOneWorkerATask) {
  FarmOptions options;
  options.plan.scene.scene = quick_scene(), options.plan.out = out(), options.plan.portfolio = 3;
  options.engine = "slurm", options.workers = 2, options.sbatch = {"--partition=long"};
  const FarmSpec spec = spec_of(options);
  const FarmFolder farm = FarmFolder::begin(spec);
  const auto commands = slurm_commands(farm);
  ASSERT_EQ(commands.size(), 4u);
  std::vector<std::string> arrays;
  for (const auto& words : commands) {
    EXPECT_THAT(words, testing::Contains("--partition=long"));
    for (const std::string& word : words)
      if (word.starts_with("--array")) arrays.push_back(word);
  }
  EXPECT_EQ(arrays, (std::vector<std::string>{"--array=1-2", "--array=1-2", "--array=1-2", "--array=1-1"}));
  EXPECT_THAT(commands[0], testing::Not(testing::Contains(HasSubstr("--dependency"))));
  write_file(folder / "worker.sh", slurm_script(farm));
  EXPECT_EQ(std::system(("bash -n '" + (folder / "worker.sh").string() + "'").c_str()), 0);
  const std::string jobs = openjd_template(farm);
  for (const char* words : {"jobtemplate-2023-09", "range: \"1-2\"", "dependsOn: Frames", "--until, report"})
    EXPECT_THAT(jobs, HasSubstr(words));
}

std::vector<std::string> arrays_and_stages(const FarmFolder& farm) {
  std::vector<std::string> told;
  for (const auto& words : slurm_commands(farm))
    for (const std::string& word : words)
      if (word.starts_with("--array") || std::count(stage_names.begin(), stage_names.end(), word) > 0)
        told.push_back(word);
  return told;
}

TEST_F(Farm, SlurmGetsABenchmarkAsBodiesRunsAndTable) {
  FarmOptions options;
  options.bench.emplace();
  options.bench->scenes = {quick_scene()}, options.bench->out = out(), options.bench->seeds = "1-5";
  options.bench->presets = {"paper", "fast"};
  options.engine = "slurm", options.workers = 3, options.runs_per_task = 4;
  const FarmFolder farm = FarmFolder::begin(spec_of(options));
  EXPECT_EQ(arrays_and_stages(farm), (std::vector<std::string>{"--array=1-1", "bodies", "--array=1-3", "runs",
                                                               "--array=1-1", "table"}));
  std::vector<std::size_t> runs;
  for (const Unit& unit : farm.units(Stage::runs))
    runs.insert(runs.end(), unit.runs.begin(), unit.runs.end());
  EXPECT_EQ(runs, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_THAT(openjd_template(farm), HasSubstr("--until, runs"));
}

TEST_F(Farm, SlurmGetsManyModelsAsModelsAndPage) {
  FarmOptions options;
  options.batch.emplace();
  options.batch->models = {box_models(11)}, options.batch->each.out = out();
  options.engine = "slurm", options.workers = 8, options.models_per_task = 3;
  const FarmFolder farm = FarmFolder::begin(spec_of(options));
  EXPECT_EQ(arrays_and_stages(farm),
            (std::vector<std::string>{"--array=1-4", "models", "--array=1-1", "page"}));
  std::vector<std::size_t> models;
  for (const Unit& unit : farm.units(Stage::models)) {
    EXPECT_LE(unit.models.size(), 3u);
    models.insert(models.end(), unit.models.begin(), unit.models.end());
  }
  std::sort(models.begin(), models.end());
  EXPECT_EQ(models, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_THAT(openjd_template(farm), HasSubstr("--until, models"));

  // What was kept is what was submitted.
  EXPECT_EQ(json_of(read_spec(out())), json_of(farm.spec()));
}

TEST_F(Farm, AUnitIsOnes) {
  constexpr int workers = 8, units = 40;
  std::atomic<int> taken{0}, rounds{0};
  std::vector<std::thread> threads;
  std::array<std::atomic<int>, units> at{};
  std::atomic<bool> two{false};
  for (int w = 0; w < workers; ++w)
    threads.emplace_back([&] {
      Leases leases(folder.path());
      for (int u = 0; u < units; ++u)
        if (const auto lease = leases.take(fmt::format("unit-{}", u))) {
          ++taken;
          if (++at[std::size_t(u)] > 1) two = true;
          ::usleep(200);
          --at[std::size_t(u)];
        }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(two);
  EXPECT_GE(taken, units);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST_F(Farm, ALostLeaseIsTakenOver) {
  Leases leases(folder.path());
  const auto mine = leases.take("unit");
  ASSERT_TRUE(mine);
  EXPECT_FALSE(leases.take("unit"));
  ASSERT_FALSE(leases.look().at("unit").lost);

  const pid_t child = ::fork();
  if (child == 0) {
    Leases of_child(folder.path());
    const auto lease = of_child.take("of-child");
    ::_exit(lease ? 0 : 1);  // as one that is killed: nothing is given back
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(WEXITSTATUS(status), 0);
  const auto seen = leases.look();
  EXPECT_TRUE(seen.at("of-child").lost);  // at once: it was a process of this machine
  const auto after = leases.take("of-child", &seen.at("of-child"));
  ASSERT_TRUE(after);
  EXPECT_FALSE(leases.take("of-child", &seen.at("of-child")));
  EXPECT_EQ(leases.look().at("of-child").taken, 2);

  // Of another machine nothing is known but that its number does not change.
  Leases at_once(folder.path(), 0), never(folder.path(), 1e9);
  const auto beat = [&](int number) {
    std::ofstream(folder / "far.1") << Json{
        {"owner", "far"}, {"place", "00000000"}, {"pid", 1}, {"began", 1}, {"beat", number}};
  };
  for (const int number : {1, 2, 3}) {
    beat(number);
    EXPECT_FALSE(at_once.look().at("far").lost);
    never.look();
  }
  EXPECT_TRUE(at_once.look().at("far").lost);
  EXPECT_FALSE(never.look().at("far").lost);
}

}  // namespace
}  // namespace limber::detail
