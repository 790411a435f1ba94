// An interrupted search goes on to the bytes of an uninterrupted one: cut by its limit, and by signals to a
// process of its own.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

#include "core/npz.h"
#include "core/random.h"
#include "render/png_file.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

Json plan_json(const std::string& scene, const std::string& out, std::vector<std::string> more) {
  // Few frames: what is measured in them is not the matter here.
  std::vector<std::string> words{"plan", scene, "-o", out, "--json", "--set", "film.frames_per_second=2"};
  words.insert(words.end(), more.begin(), more.end());
  const Result result = limber_program(words);
  EXPECT_TRUE(result.code == exit_done || result.code == exit_no_plan) << result.err;
  return result.json();
}

void expect_same_plan(const Json& resumed, const Json& whole) {
  EXPECT_EQ(resumed.at("tree_hash"), whole.at("tree_hash"));
  EXPECT_EQ(resumed.at("trajectory_hash"), whole.at("trajectory_hash"));
  EXPECT_EQ(resumed.at("nodes"), whole.at("nodes"));
  EXPECT_EQ(resumed.at("statistics").at("iterations"), whole.at("statistics").at("iterations"));
  EXPECT_EQ(resumed.at("solved"), whole.at("solved"));
}

// Once in one go; then in three searches of their own, each cut at an iteration drawn from `seed` and
// resumed.
void expect_resumes_at_three_points(const std::string& scene, const fs::path& folder,
                                    const std::vector<std::string>& settings, std::int64_t limit,
                                    std::uint64_t seed) {
  const auto until = [&](std::int64_t iteration) {
    std::vector<std::string> words = settings;
    words.insert(words.end(), {"--iterations", std::to_string(iteration)});
    return words;
  };
  const Json whole = plan_json(scene, (folder / "whole").string(), until(limit));
  const std::int64_t iterations = whole.at("statistics").at("iterations");
  ASSERT_GE(iterations, 3);
  Rng rng(seed, 0);
  for (int point = 0; point < 3; ++point) {
    const std::int64_t cut = 1 + rng.below(int(iterations - 1));
    SCOPED_TRACE(fmt::format("{}, cut at iteration {} of {}", scene, cut, iterations));
    fs::create_directories(folder / "cut");
    fs::copy(folder / "whole" / "bodies", folder / "cut" / "bodies",
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    const std::string out = (folder / "cut").string();
    EXPECT_EQ(plan_json(scene, out, until(cut)).at("statistics").at("iterations"), cut);
    std::vector<std::string> to_the_end = until(limit);
    to_the_end.push_back("--resume");
    expect_same_plan(plan_json(scene, out, to_the_end), whole);
    fs::remove_all(folder / "cut");
  }
}

// Starts the program, sends it the signal as soon as `is_time`, and returns its exit code.
int exit_code_after_signal(const std::vector<std::string>& arguments, int signal_number,
                           const std::function<bool()>& is_time,
                           const std::string& program = std::string(limber_binary_dir) + "/cli/limber") {
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    ::execv(program.c_str(), argv.data());
    ::_exit(127);
  }
  int status = 0;
  while (!is_time() && ::waitpid(child, &status, WNOHANG) == 0) ::usleep(2000);
  if (::kill(child, signal_number) == 0) ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// What is told of a plan's motion was worked out, and is in its folder.
bool is_measured(const fs::path& folder) {
  const Json meta = Json::parse(read_npz(folder / "plan.npz").texts.at("meta.json"));
  return meta.value("measured", true) && fs::exists(folder / "volume.svg");
}

class Interrupt : public Program {};

class InterruptedScene : public Program, public ::testing::WithParamInterface<const char*> {};

TEST_P(InterruptedScene, CutAtThreePointsGoesOnToTheSameBytes) {
  for (const char* preset : {"paper", "fast"}) {
    SCOPED_TRACE(preset);
    expect_resumes_at_three_points(GetParam(), folder.path() / preset, {"--preset", preset, "--seed", "4"},
                                   60, 72);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, InterruptedScene,
                         ::testing::Values("barriers1", "barriers2", "windows", "falling_objects",
                                           "body_parts", "there_and_back"),
                         [](const auto& scene) { return std::string(scene.param); });

// The signal comes when the file of --stats shows so many iterations, wherever the process is then. Too weak
// to get to the goal, the search uses all its iterations.
TEST_F(Interrupt, SignalsToAProcessKeepAPlanThatGoesOnToTheSameBytes) {
  const std::vector<std::string> settings{"--set", "planner.max_force_n=20", "--iterations", "200"};
  const Json whole = plan_json("barriers1", out("whole"), settings);
  struct Case {
    int signal_number, lines;
  };
  for (const Case c : {Case{SIGINT, 1}, {SIGTERM, 4}, {SIGINT, 8}}) {
    SCOPED_TRACE(fmt::format("signal {} after {} lines", c.signal_number, c.lines));
    const std::string cut = out("cut"), stats = out("stats.jsonl");
    fs::remove(stats);
    std::vector<std::string> words{
        "plan", "barriers1", "-o", cut, "-q", "--stats", stats, "--set", "film.frames_per_second=2"};
    words.insert(words.end(), settings.begin(), settings.end());
    const int code = exit_code_after_signal(words, c.signal_number, [&] {
      if (!fs::exists(stats)) return false;
      const std::string text = read_file(stats);
      return std::count(text.begin(), text.end(), '\n') >= c.lines;
    });
    ASSERT_EQ(code, 128 + c.signal_number);
    EXPECT_FALSE(is_measured(cut));  // which would take longer than who stops it waits
    std::vector<std::string> rest = settings;
    rest.push_back("--resume");
    const Json resumed = plan_json("barriers1", cut, rest);
    expect_same_plan(resumed, whole);
    EXPECT_TRUE(is_measured(cut));
    fs::remove_all(cut);
  }
}

// Each edit in another way; what is wrong with one is told, and the next is waited for.
TEST_F(Interrupt, AWatchedStillFollowsItsSceneUntilTheSignal) {
  const fs::path picture = folder / "still.png", errors = folder / "errors.txt", file = scene();
  const auto hash = [&] { return render::frame_hash(picture); };
  std::optional<std::string> before;
  std::vector<std::function<void()>> edits{
      [&] { write_file(file, replaced("#c0392b", "#00ff00")); },
      [&] { write_file(file, "no scene"); },
      [&] {
        write_file(folder / "new.toml", replaced("#c0392b", "#0000ff"));
        fs::rename(folder / "new.toml", file);
      },
  };
  std::size_t made = 0;
  const std::string program = std::string(limber_binary_dir) + "/cli/limber";
  const int code = exit_code_after_signal(
      {"-c", "exec \"$0\" \"$@\" 2> '" + errors.string() + "'", program, "render", file.string(), "--still",
       "--watch", "-o", picture.string(), "--size", "64x48"},
      SIGINT,
      [&] {
        const bool broken = made == 2;  // by the edit before
        if (broken ? read_file(errors).find("scene.toml:1") == std::string::npos
                   : !hash() || hash() == before)
          return false;
        before = hash();
        if (made == edits.size()) return true;
        edits[made++]();
        return false;
      },
      "/bin/sh");
  EXPECT_EQ(code, 128 + SIGINT);
  EXPECT_EQ(made, edits.size());
}

// Killed at twenty points: whatever has a frame's name then is a whole picture, and a resumed run ends with
// the frames of an uninterrupted one.
TEST_F(Interrupt, KilledWhileRenderingItGoesOnToTheSameFrames) {
  const std::string text = replaced("frames_per_second = 5\n", "frames_per_second = 15\n");
  const Result planned = limber_program({"plan", scene(text), "-o", out(), "--json"});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  const int frames = planned.json().at("frames");
  ASSERT_GE(frames, 20);
  ASSERT_EQ(limber_program({"render", out(), "--as", "whole"}).code, exit_done);
  const auto whole = contents(fs::path(out()) / "frames-whole");
  ASSERT_EQ(int(whole.size()), frames);

  const fs::path folder_cut = fs::path(out()) / "frames-cut";
  const auto finished = [&] {
    int count = 0;
    if (fs::exists(folder_cut))
      for (const auto& entry : fs::directory_iterator(folder_cut))
        count += entry.path().extension() == ".png" && entry.path().filename().string()[0] != '.';
    return count;
  };
  Rng rng(73, 0);
  for (int point = 0; point < 20; ++point) {
    const int after = 1 + rng.below(frames - 2);
    SCOPED_TRACE(fmt::format("killed after {} of {} frames", after, frames));
    fs::remove_all(folder_cut);
    exit_code_after_signal({"render", out(), "--as", "cut", "-q"}, SIGKILL,
                           [&] { return finished() >= after; });
    for (const auto& [name, bytes] : whole)
      EXPECT_TRUE(!fs::exists(folder_cut / name) || render::frame_hash(folder_cut / name)) << name;
    ASSERT_EQ(limber_program({"render", out(), "--as", "cut", "--resume"}).code, exit_done);
    EXPECT_EQ(contents(folder_cut), whole);  // and nothing else: no temporary file of the one that was killed
  }
}

// A benchmark stopped in the middle of its second run keeps the first, and ends what is missing.
TEST_F(Interrupt, ABenchmarkStoppedInARunKeepsTheFinishedOnes) {
  const std::vector<std::string> words{
      "bench",        "barriers1", "-o", out(), "-q", "--seeds", "1-3", "--set", "planner.max_force_n=20",
      "--iterations", "60"};
  const fs::path runs = fs::path(out()) / "runs";
  const auto records = [&] {
    std::size_t count = 0;
    if (fs::exists(runs))
      for (const auto& entry : fs::directory_iterator(runs))
        count += entry.path().filename().string()[0] != '.';
    return count;
  };
  ASSERT_EQ(exit_code_after_signal(words, SIGINT, [&] { return records() >= 1; }), 128 + SIGINT);
  const std::size_t kept = records();
  EXPECT_GE(kept, 1u);
  EXPECT_LT(kept, 3u);
  for (const auto& [name, text] : contents(runs)) EXPECT_EQ(Json::parse(text).at("iterations"), 60) << name;
}

}  // namespace
}  // namespace limber::detail
