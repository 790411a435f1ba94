// Whatever writes can be killed (SIGKILL) at any time: what has its name then is whole, and the same command
// once more ends with the bytes of one that nobody killed.
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <set>

#include "core/random.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

// LIMBER_KILLS=N kills each as often.
int kills() {
  const char* given = std::getenv("LIMBER_KILLS");
  return given ? std::atoi(given) : 8;
}

// What no two runs have in common, nor a run and the rest of one that was killed.
bool is_cost(const std::string& key) {
  static const std::set<std::string> others{"cpu_seconds",
                                            "peak_memory_mb",
                                            "peak_memory_mb_after",
                                            "load_us",
                                            "store_us",
                                            "contact_of_force_step",
                                            "rollouts",
                                            "rollouts_wrong",
                                            "in_flight",
                                            "painted",
                                            "date"};
  return others.contains(key) || key.ends_with("cpu_s") || key.ends_with("wall_s");
}

void drop_costs(Json& json) {
  if (json.is_object())
    for (auto it = json.begin(); it != json.end();) it = is_cost(it.key()) ? json.erase(it) : std::next(it);
  if (json.is_structured())
    for (Json& child : json) drop_costs(child);
}

std::string without_costs(const std::string& text) {
  Json json = Json::parse(text);
  drop_costs(json);
  return json.dump();
}

// The bytes of a file, less what it says of its making.
std::string essence(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".json") return without_costs(read_file(path));
  if (extension == ".jsonl") {
    std::string text;
    std::istringstream lines(read_file(path));
    for (std::string line; std::getline(lines, line);) text += without_costs(line) + "\n";
    return text;
  }
  // Its tables and curves are of times: that it is whole is all there is to compare.
  if (path.filename() == "bench.html")
    if (const std::string page = read_file(path); page.ends_with("</html>\n")) return "a whole page";
  return read_file(path);
}

using Files = std::map<std::string, std::string>;
Files files_in(const fs::path& folder) {
  Files files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = essence(entry.path());
  return files;
}

// A manifest gets a table for each stage that ends: what is there is of one run or the other.
bool is_whole(const std::string& name, const std::string& bytes, const Files& before, const Files& after) {
  const auto is = [&](const Files& files) { return files.contains(name) && files.at(name) == bytes; };
  if (fs::path(name).filename() != "manifest.json" || !after.contains(name)) return is(before) || is(after);
  const Json then = Json::parse(before.contains(name) ? before.at(name) : "{}"),
             end = Json::parse(after.at(name));
  const Json now = Json::parse(bytes);
  for (const auto& [stage, entry] : now.items())
    if (entry != then.value(stage, Json()) && entry != end.value(stage, Json())) return false;
  return true;
}

bool is_temporary(const std::string& path) { return fs::path(path).filename().string()[0] == '.'; }

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += word + " ";
  return text;
}

class Killed : public Program {
 protected:
  // In a process of its own, killed when it is time; its exit code, −1 when it was killed.
  static int exit_code_after(const std::vector<std::string>& words, const std::function<bool()>& is_time) {
    const std::string program = std::string(limber_binary_dir) + "/cli/limber";
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
      const int nowhere = ::open("/dev/null", O_WRONLY);
      ::dup2(nowhere, 1), ::dup2(nowhere, 2);
      ::execv(program.c_str(), argv.data());
      ::_exit(127);
    }
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
      if (is_time()) ::kill(child, SIGKILL);
      ::usleep(200);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  static int run(const std::vector<std::string>& words, double seconds) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    return exit_code_after(words, [&] { return std::chrono::steady_clock::now() >= end; });
  }

  // `before` is copied to `work` for every run; the words name files in `work`.
  void expect_survives(const std::vector<std::string>& words, const std::vector<std::string>& again,
                       const fs::path& before, int seed) {
    SCOPED_TRACE(join(words));
    const fs::path work = folder / "work";
    const auto begin = [&] {
      fs::remove_all(work);
      if (before.empty())
        fs::create_directories(work);
      else
        fs::copy(before, work, fs::copy_options::recursive);
    };
    begin();
    const Files old = files_in(work);
    const auto began = std::chrono::steady_clock::now();
    ASSERT_EQ(run(words, 1e9), exit_done);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    const Files whole = files_in(work);
    ASSERT_NE(whole, old);
    Rng rng(20261123, std::uint64_t(seed));
    for (int kill = 0; kill < kills(); ++kill) {
      const double after = rng.uniform(0, 1.05) * seconds;
      SCOPED_TRACE(fmt::format("killed after {:.3f} of {:.3f} s", after, seconds));
      begin();
      const bool killed = run(words, after) < 0;
      for (const auto& [name, bytes] : files_in(work))
        EXPECT_TRUE(is_temporary(name) || is_whole(name, bytes, old, whole))
            << name << " is neither what it was nor what it is to be";
      ASSERT_TRUE(!killed || run(again, 1e9) == exit_done);
      const Files now = files_in(work);
      for (const auto& [name, bytes] : now) {
        EXPECT_TRUE(whole.contains(name)) << name << " is left";
        EXPECT_TRUE(!whole.contains(name) || whole.at(name) == bytes) << name << " differs";
      }
      for (const auto& [name, bytes] : whole) EXPECT_TRUE(now.contains(name)) << name << " is missing";
      if (HasFailure()) return;
    }
  }
  void expect_survives(const std::vector<std::string>& words, const fs::path& before, int seed) {
    expect_survives(words, words, before, seed);
  }

  std::string work(const std::string& name = "") const {
    return name.empty() ? (folder / "work").string() : (folder / "work" / name).string();
  }
  fs::path planned() {
    EXPECT_EQ(limber_program({"plan", quick_scene(), "-o", out("planned")}).code, exit_done);
    return folder / "planned";
  }
  static std::vector<std::string> with(std::vector<std::string> words, const std::string& more) {
    words.push_back(more);
    return words;
  }
  // Bevelled, which is prepared in a moment, and with something that is only seen.
  std::string quick_scene() const {
    std::string text = replaced("seed = 1\niterations = 400\nmax_force_n = 100",
                                "seed = 3\niterations = 400\nmax_force_n = 60");  // verify keeps it
    for (const std::string size : {"size_m = [0.6, 0.6, 0.6]", "size_m = [0.4, 2, 0.9]"})
      text.insert(text.find(size) + size.size(), ", bevel_m = 0.05, triangle_m = 0.1");
    text.insert(text.find("[goal]"),
                "[[bodies]]\nname = \"sign\"\nrole = \"scenery\"\nmodel = { sphere = { diameter_m = 0.2 } }\n"
                "pose = { position_m = [3.5, 1, 1.5] }\n");
    return scene(text);
  }
  // A ball of radius ½.
  std::string model(const std::string& name, double at) const {
    constexpr int rings = 8, sectors = 16;
    const fs::path path = folder / "models" / name;
    fs::create_directories(path.parent_path());
    std::ofstream file(path);
    file << fmt::format("v {} 0 0.5\nv {} 0 -0.5\n", at, at);
    for (int r = 1; r < rings; ++r)
      for (int s = 0; s < sectors; ++s) {
        const double polar = std::numbers::pi * r / rings, around = 2 * std::numbers::pi * s / sectors;
        file << fmt::format("v {} {} {}\n", at + 0.5 * std::sin(polar) * std::cos(around),
                            0.5 * std::sin(polar) * std::sin(around), 0.5 * std::cos(polar));
      }
    const auto vertex = [](int r, int s) { return 3 + (r - 1) * sectors + s % sectors; };
    for (int s = 0; s < sectors; ++s) {
      file << fmt::format("f 1 {} {}\n", vertex(1, s), vertex(1, s + 1));
      for (int r = 1; r + 1 < rings; ++r)
        file << fmt::format("f {} {} {} {}\n", vertex(r, s), vertex(r + 1, s), vertex(r + 1, s + 1),
                            vertex(r, s + 1));
      file << fmt::format("f 2 {} {}\n", vertex(rings - 1, s + 1), vertex(rings - 1, s));
    }
    return path.string();
  }
};

TEST_F(Killed, Prepare) {
  expect_survives({"prepare", model("a.obj", 0), "-o", work(), "--tets", "60", "--preview", "--export",
                   "vtu,node,interp"},
                  {}, 1);
}
TEST_F(Killed, Plan) { expect_survives({"plan", quick_scene(), "-o", work()}, {}, 2); }
TEST_F(Killed, PlanOverAnotherOne) {
  const fs::path before = planned();
  ASSERT_EQ(limber_program({"export", before.string(), "--format", "gltf"}).code, exit_done);
  expect_survives({"plan", quick_scene(), "-o", work(), "--seed", "9"}, before, 3);
}
TEST_F(Killed, Shortcuts) {
  expect_survives({"plan", quick_scene(), "-o", work(), "--resume", "--shortcut", "2"}, planned(), 4);
}
TEST_F(Killed, Render) {
  const std::vector<std::string> words{"render", work(), "--passes", "depth,object"};
  expect_survives(words, with(words, "--resume"), planned(), 5);
}
TEST_F(Killed, Run) { expect_survives({"run", quick_scene(), "-o", work()}, {}, 6); }
TEST_F(Killed, Export) { expect_survives({"export", work(), "--format", "gltf,pc2,usd,vtu"}, planned(), 7); }
TEST_F(Killed, Report) { expect_survives({"report", work()}, planned(), 8); }
TEST_F(Killed, Bench) {
  expect_survives({"bench", quick_scene(), "-o", work(), "--seeds", "1-2", "--iterations", "20"}, {}, 9);
}
TEST_F(Killed, Refine) {
  expect_survives({"refine", planned().string(), "-o", work(), "--tets-factor", "1", "--set",
                   "bodies.robot.cage.cells=[3,2,2]"},
                  {}, 10);
}
TEST_F(Killed, SceneNew) {
  model("a.obj", 0), model("b.obj", 1.1);
  expect_survives({"scene", "new", "--from", out("models"), "--robot", "a", "-o", work("new.toml"), "--tets",
                   "60", "--scale", "1"},
                  {}, 11);
}
TEST_F(Killed, Stills) {
  expect_survives({"render", quick_scene(), "--still", "-o", work("a.png")}, {}, 12);
  expect_survives({"scene", "check", quick_scene(), "--still", work("b.png"), "--work", work("bodies")}, {},
                  13);
}
TEST_F(Killed, Observables) {
  expect_survives({"verify", work(), "--observables", work("o.csv")}, planned(), 14);
}

// The pictures and the manifest of a plan come after it.
TEST_F(Killed, BetweenThePlanAndItsPicturesRunMakesThem) {
  const fs::path before = planned();
  const Files whole = files_in(before);
  fs::create_directories(work());
  fs::copy(before / "bodies", work("bodies"), fs::copy_options::recursive);
  fs::copy(before / "plan.npz", work("plan.npz"));
  ASSERT_EQ(limber_program({"run", quick_scene(), "-o", work()}).code, exit_done);
  const Files now = files_in(work());
  for (const char* name : {"volume.svg", "volume.png", "tree.svg", "plan.npz"})
    EXPECT_TRUE(now.contains(name) && now.at(name) == whole.at(name)) << name;
  EXPECT_EQ(Json::parse(now.at("manifest.json")).at("plan"),
            Json::parse(whole.at("manifest.json")).at("plan"));
}

// Else it would go on writing, and make its file anew after the next run had cleared it away.
TEST_F(Killed, TakesItsEncoderAlong) {
  const fs::path before = planned(), tools = folder / "tools", told = folder / "encoder";
  fs::create_directories(tools);
  std::ofstream(tools / "ffmpeg") << fmt::format(
      "#!/bin/sh\necho $$ > {0}.new && mv {0}.new {0}\nexec sleep 600\n", told.string());
  fs::permissions(tools / "ffmpeg", fs::perms::owner_all);
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", (tools.string() + ":" + path).c_str(), 1);
  EXPECT_EQ(exit_code_after({"render", before.string()}, [&] { return fs::exists(told); }), -1);
  ::setenv("PATH", path.c_str(), 1);
  ASSERT_TRUE(fs::exists(told));
  const pid_t encoder = pid_t(std::stol(read_file(told)));
  // Dead, or the shadow of one that nobody waits for.
  const auto lives = [&] {
    std::ifstream stat(fmt::format("/proc/{}/stat", encoder));
    std::string number, name, state;
    return bool(stat >> number >> name >> state) && state != "Z";
  };
  for (int wait = 0; wait < 1000 && lives(); ++wait) ::usleep(10000);
  EXPECT_FALSE(lives());
  ::kill(encoder, SIGKILL);
}

}  // namespace
}  // namespace limber::detail
