// What a tool owes its user on the way and at the end: statistics, and why there is no plan.
#include <array>
#include <sstream>

#include "tests/cli/program.h"

namespace limber::detail {
namespace {

std::vector<Json> lines_of(const fs::path& file) {
  std::vector<Json> lines;
  std::istringstream text(read_file(file));
  for (std::string line; std::getline(text, line);) lines.push_back(Json::parse(line));
  return lines;
}

class Habits : public Program {
 protected:
  // The goal is out of reach: every iteration is used.
  Result plan_weakly(const std::string& where, std::vector<std::string> more) {
    std::vector<std::string> words{"plan",  scene(), "-o", out(where), "--set", "planner.max_force_n=1",
                                   "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return limber_program(words);
  }
};
using Habits_slow = Habits;  // stays out of the sanitizer runs

// What a run cost stands in timings.json and, of bodies, in their reports; all else has the same bytes.
TEST_F(Habits_slow, TwoRunsWriteTheSameBytesOnAnyNumberOfThreads) {
  const auto files_of = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> words{"plan", scene(), "-o", out(name), "--shortcut", "2"};
    words.insert(words.end(), more.begin(), more.end());
    const Result planned = limber_program(words);
    EXPECT_EQ(planned.code, exit_done) << planned.err;
    auto files = contents(out(name));
    std::erase_if(files, [](const auto& file) {
      const std::string base = fs::path(file.first).filename().string();
      return base == "timings.json" || base == "report.json";
    });
    return files;
  };
  const auto one = files_of("one", {"--threads", "1", "--in-flight", "1"});
  const auto other = files_of("other", {"--threads", "2", "--in-flight", "40", "--time-limit", "10min"});
  ASSERT_EQ(one.size(), other.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].first, other[i].first);
    EXPECT_TRUE(one[i].second == other[i].second) << one[i].first;
  }
  // Costs are told all the same, also of a plan that is up to date.
  EXPECT_TRUE(fs::exists(fs::path(out("one")) / "timings.json"));
  const Result again = limber_program({"plan", scene(), "-o", out("one"), "--shortcut", "2", "--json"});
  EXPECT_NE(again.err.find("up to date"), std::string::npos) << again.err;
  for (const char* pointer :
       {"/statistics/cpu_s", "/statistics/rollouts", "/dynamics/load_us", "/shortcut/wall_s"})
    EXPECT_TRUE(again.json().contains(Json::json_pointer(pointer))) << pointer;
}

// Every tenth iteration and the last; nothing ever gets worse; the last line is what the plan says. Cut and
// resumed, the file tells the same search.
TEST_F(Habits_slow, StatisticsTellTheSearchInOrderAlsoWhenItIsResumed) {
  const std::string whole = out("whole.jsonl"), cut = out("cut.jsonl");
  const Result planned = plan_weakly("whole", {"--iterations", "47", "--stats", whole});
  ASSERT_EQ(planned.code, exit_no_plan) << planned.err;
  const std::vector<Json> lines = lines_of(whole);
  ASSERT_EQ(lines.size(), 5u);
  for (std::size_t i = 0; i < lines.size(); ++i)
    EXPECT_EQ(lines[i].at("iteration"), i < 4 ? std::int64_t(10 * (i + 1)) : 47);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    EXPECT_LE(lines[i].at("best_distance_m"), lines[i - 1].at("best_distance_m"));
    for (const char* key : {"nodes", "cpu_s", "wall_s", "rollouts", "rollouts_wrong"})
      EXPECT_GE(lines[i].at(key), lines[i - 1].at(key)) << key;
  }
  EXPECT_EQ(lines.back().at("nodes"), planned.json().at("nodes"));
  EXPECT_EQ(lines.back().at("best_distance_m"), planned.json().at("distance_m"));

  ASSERT_EQ(plan_weakly("cut", {"--iterations", "20", "--stats", cut}).code, exit_no_plan);
  ASSERT_EQ(plan_weakly("cut", {"--iterations", "47", "--stats", cut, "--resume"}).code, exit_no_plan);
  const std::vector<Json> resumed = lines_of(cut);
  ASSERT_EQ(resumed.size(), lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i)
    for (const char* key : {"iteration", "nodes", "best_distance_m", "rollout_steps"})
      EXPECT_EQ(resumed[i].at(key), lines[i].at(key)) << key;

  EXPECT_EQ(plan_weakly("new", {"--stats", "/dev/null/x.jsonl"}).code, exit_disk);
  std::ofstream(out("other.jsonl")) << "{}\n";
  EXPECT_EQ(plan_weakly("cut", {"--iterations", "50", "--stats", out("other.jsonl"), "--resume"}).code,
            exit_bad_input);
}

// Every node has its edge in both views, each from where its parent is to where it is; the path ends in the
// goal.
TEST_F(Habits, ThePictureOfTheTreeHasEveryEdgeAndThePathToTheGoal) {
  const Result planned = limber_program({"plan", scene(), "-o", out(), "--json"});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  EXPECT_TRUE(fs::exists(fs::path(out()) / "volume.png"));
  const std::string svg = read_file(fs::path(out()) / "tree.svg");
  const auto paths = [&](const std::string& kind) {
    std::vector<std::vector<std::array<double, 2>>> found;
    const std::string opening = "class=\"" + kind + "\" d=\"";
    for (auto at = svg.find(opening); at != svg.npos; at = svg.find(opening, at + 1)) {
      std::string d =
          svg.substr(at + opening.size(), svg.find('"', at + opening.size()) - at - opening.size());
      std::replace_if(
          d.begin(), d.end(), [](char c) { return c == 'M' || c == 'L'; }, ' ');
      std::istringstream numbers(d);
      found.emplace_back();
      for (double x, y; numbers >> x >> y;) found.back().push_back({x, y});
    }
    return found;
  };
  const std::size_t nodes = planned.json().at("nodes");
  const auto edges = paths("edges"), way = paths("path");
  ASSERT_EQ(edges.size(), 2u);
  for (const auto& view : edges) EXPECT_EQ(view.size(), 2 * (nodes - 1));
  ASSERT_EQ(way.size(), 2u);
  // The bounds are 4 m long and 900 px; the goal is at (3.2, 1, 1) and the settle ends within 0.3 m of it.
  constexpr double px_a_m = 900 / 4.0, left = 30;
  for (std::size_t view = 0; view < 2; ++view) {
    EXPECT_EQ(way[view].size(), planned.json().at("frames").get<std::size_t>());
    EXPECT_NEAR(way[view].front()[0], left + 0.6 * px_a_m, 0.06);
    EXPECT_NEAR(way[view].back()[0], left + 3.2 * px_a_m, 0.3 * px_a_m);
    // The tree starts where the path starts, and all edges stay in the bounds.
    EXPECT_NEAR(edges[view].front()[0], way[view].front()[0], 0.06);
    EXPECT_NEAR(edges[view].front()[1], way[view].front()[1], 0.06);
    for (const auto& p : edges[view]) EXPECT_TRUE(p[0] >= left && p[0] <= left + 900) << p[0];
  }
  EXPECT_EQ(svg.find("nan"), svg.npos);
}

// A rigid wall across the whole way forbids every plan, and the program says so and films the nearest state.
TEST_F(Habits_slow, ARigidWallIsFoundToForbidThePlanAndTheNearestIsFilmed) {
  const std::string walled =
      scene(replaced("kind = \"deformable\"\nmodel = { box = { size_m = [0.4, 2, 0.9] } }",
                     "kind = \"rigid\"\nmodel = { box = { size_m = [0.4, 2, 2] } }"));
  const Result run = limber_program({"run", walled, "-o", out(), "--iterations", "30", "--set",
                                     "bodies.block.pose.position_m=[2, 1, 1]", "--set",
                                     "bodies.block.material={ density_kg_m3 = 100 }", "--json"});
  ASSERT_EQ(run.code, exit_no_plan) << run.err;
  const Json plan = run.json().at("plan");
  EXPECT_LT(plan.at("diagnosis").at("widest_rigid_passage_m").get<double>(), 0);
  EXPECT_NE(plan.at("explanation").get<std::string>().find("leave no way to the goal even for a point"),
            std::string::npos);
  EXPECT_TRUE(fs::exists(fs::path(out()) / "film.mp4"));
  EXPECT_GT(plan.at("frames").get<int>(), 1);  // the nearest is not the start
}

// A robot whose volume must hardly change cannot be pushed at all, and the program says what refuses it.
TEST_F(Habits_slow, WhatRefusesMostPushesIsNamed) {
  const std::vector<std::string> words{"plan", scene(), "-o", out(), "--iterations", "30", "--json", "--set"};
  for (const auto& [most, named] : {std::pair("1e-6", true), {"1", false}}) {
    std::vector<std::string> limited = words;
    limited.push_back(std::string("bodies.robot.max_volume_change=") + most);
    const Json plan = limber_program(limited).json();
    EXPECT_EQ(plan.at("explanation").get<std::string>().find("its max_volume_change") != std::string::npos,
              named)
        << most;
  }
}

// A soft block that fills the way stands in it: it is named, and geometry is not to blame.
TEST_F(Habits_slow, TheBodyThatBlocksIsNamed) {
  const Result planned = limber_program(
      {"plan", scene(replaced("size_m = [0.4, 2, 0.9]", "size_m = [0.4, 2, 2]")), "-o", out(), "--iterations",
       "60", "--set", "bodies.block.pose.position_m=[2, 1, 1]", "--set", "planner.goal_bias=1", "--set",
       "bodies.block.material.youngs_modulus_pa=5e4", "--json"});
  ASSERT_EQ(planned.code, exit_no_plan) << planned.err;
  const Json diagnosis = planned.json().at("diagnosis");
  EXPECT_EQ(diagnosis.at("blocked_by"), "block");
  EXPECT_GT(diagnosis.at("blocking_force_n").get<double>(), 1);
  EXPECT_GT(diagnosis.at("widest_rigid_passage_m").get<double>(),
            diagnosis.at("robot_inner_radius_m").get<double>());
  EXPECT_NE(planned.json().at("explanation").get<std::string>().find("There block pushes the robot back"),
            std::string::npos);
}

}  // namespace
}  // namespace limber::detail
