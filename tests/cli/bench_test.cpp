// Many runs as one table: what is kept, what is skipped, what the figures mean.
#include "limber/detail/bench/bench.h"

#include <signal.h>

#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "cli/bench_table.h"
#include "core/progress.h"
#include "plan/plan_file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

// A record with only what the tables read.
RunRecord record(const std::string& preset, int seed, bool solved, std::int64_t iterations,
                 double change_percent) {
  return run_record_of(
      {{"scene", "made"},
       {"preset", preset},
       {"seed", seed},
       {"solved", solved},
       {"iterations", iterations},
       {"nodes", iterations + 1},
       {"distance_m", 0.25},
       {"cpu_s", 2 * iterations},
       {"wall_s", iterations},
       {"motion_s", 10 * iterations},
       {"volume",
        {{"robot",
          {{"largest_percent", change_percent},
           {"frames", 100},
           {"within_3_percent", std::min(90 + seed, 100)},
           {"within_5_percent", 100},
           {"within_6_percent", 100},
           {"within_10_percent", 100}}}}},
       {"deepest_penetration_percent", change_percent / 2},
       {"deepest_overlap_of_robot_size", 1e-4 * change_percent},
       {"deepest_self_overlap_of_robot_size", 2e-4 * change_percent},
       {"gap_at_contact",
        {{"pairs_and_frames", seed == 2 ? 0 : 5},
         {"median_of_robot_size", 1e-3 * change_percent},
         {"worst_of_robot_size", 2e-3 * change_percent}}},
       {"least_stretch", 1 - change_percent / 10},
       {"largest_stretch", 1 + change_percent / 10},
       {"inverted_tets", 0},
       {"largest_force_n", 5},
       {"threads", 1},
       {"host", "machine"},
       {"identity",
        {{"program", "0"},
         {"scene_hash", "1"},
         {"system_hash", "2"},
         {"settings", {{"seed", seed}, {"goal", {{"radius_m", 0.5}}}, {"time_limit_s", nullptr}}}}}},
      "made");
}

TEST(BenchReport, QuartilesInterpolateBetweenOrderedValues) {
  const Quartiles of_five = quartiles({5, 1, 4, 2, 3});
  EXPECT_EQ(of_five[0], 2);
  EXPECT_EQ(of_five[1], 3);
  EXPECT_EQ(of_five[2], 4);
  const Quartiles of_four = quartiles({40, 10, 20, 30});
  EXPECT_EQ(of_four[0], 17.5);
  EXPECT_EQ(of_four[1], 25);
  EXPECT_EQ(of_four[2], 32.5);
  EXPECT_EQ(quartiles({7})[0], 7);
}

// Times and iterations are of all runs, the figures of motions of the solved ones alone.
TEST(BenchReport, UnsolvedRunsCountInTheSearchAndNotInTheMotion) {
  const BenchReport found = report_of({record("fast", 1, true, 10, 2), record("fast", 2, true, 20, 4),
                                       record("fast", 3, false, 100, 50), record("paper", 1, true, 30, 1)});
  const Json report = json_of_fields(found);
  ASSERT_EQ(report.at("groups").size(), 2u);
  const Json& fast = report.at("groups")[0];
  EXPECT_EQ(fast.at("preset"), "fast");
  EXPECT_EQ(fast.at("runs"), 3);
  EXPECT_EQ(fast.at("solved"), 2);
  EXPECT_EQ(fast.at("unsolved_seeds"), Json({3}));
  EXPECT_EQ(fast.at("iterations"), Json({15.0, 20.0, 60.0}));
  EXPECT_EQ(fast.at("cpu_s"), Json({30.0, 40.0, 120.0}));
  EXPECT_EQ(fast.at("motion_s"), Json({125.0, 150.0, 175.0}));
  EXPECT_EQ(fast.at("largest_penetration_percent"), 2);
  EXPECT_NEAR(fast.at("largest_overlap_percent").get<double>(), 0.04, 1e-12);
  EXPECT_NEAR(fast.at("largest_self_overlap_percent").get<double>(), 0.08, 1e-12);
  EXPECT_NEAR(fast.at("median_gap_percent").get<double>(), 0.2, 1e-12);  // the second run has none
  EXPECT_NEAR(fast.at("largest_gap_percent").get<double>(), 0.8, 1e-12);
  EXPECT_NEAR(fast.at("least_stretch").get<double>(), 0.6, 1e-12);
  EXPECT_NEAR(fast.at("largest_stretch").get<double>(), 1.4, 1e-12);
  const Json& robot = fast.at("volume").at("robot");
  EXPECT_EQ(robot.at("largest_percent"), 4);
  EXPECT_EQ(robot.at("frames"), 200);
  EXPECT_EQ(robot.at("within_3_percent"), 91 + 92);
  const std::string text = cli::text_of_benchmark(found);
  for (const char* words : {"2/3", "15 20 60", "91.50", "fast: not solved with seed 3"})
    EXPECT_NE(text.find(words), std::string::npos) << words << " in\n" << text;
}

// Names become those of files; figures are counted and drawn.
TEST(BenchReport, ARecordThatNoRunLeavesIsRefused) {
  const Json good = record("OMPL RRT, 2", 1, true, 10, 2).json;
  for (const auto& [key, value] : {std::pair<const char*, Json>("scene", "../evil"),
                                   {"scene", ""},
                                   {"scene", "a/b"},
                                   {"scene", std::string(65, 'x')},
                                   {"preset", "a/b"},
                                   {"preset", "<b>"},
                                   {"iterations", -5},
                                   {"iterations", 1'000'000'000'000'000'000},
                                   {"cpu_s", -1.5},
                                   {"wall_s", 1e300},
                                   {"nodes", -1},
                                   {"motion_s", -0.5}}) {
    Json bad = good;
    bad[key] = value;
    try {
      run_record_of(bad, "there.json");
      FAIL() << key << " " << value;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(fmt::format("there.json: {} is ", key)), std::string::npos)
          << error.what();
    }
  }
  Json bad = good;
  bad["volume"]["robot"]["within_6_percent"] = 101;
  EXPECT_THROW(run_record_of(bad, "there.json"), InputError);
}

// Where nothing is solved the line lies at 0 of 100 %, not in the middle of a plot around it.
TEST(BenchReport, CurvesGoFromNothingToAll) {
  for (const bool solved : {false, true})
    for (const auto& [name, svg] : curves_of_bench({record("fast", 1, solved, 10, 2)})) {
      EXPECT_NE(svg.find(">100<"), svg.npos) << name;
      EXPECT_NE(svg.find(">0<"), svg.npos) << name;
      EXPECT_EQ(svg.find(">−"), svg.npos) << name;
    }
}

Expected expected(const RunRecords& runs) {
  std::vector<const RunRecord*> all;
  for (const RunRecord& run : runs) all.push_back(&run);
  return expected_iterations(all);
}

// By hand: given up after 20, three of four runs are solved within 10 + 20 + 15 + 20 iterations.
TEST(BenchReport, RestartsAndPortfoliosAreReckonedFromTheRuns) {
  RunRecords runs{record("fast", 1, true, 10, 2), record("fast", 2, true, 20, 4),
                  record("fast", 3, false, 500, 50), record("fast", 4, true, 15, 4)};
  const Expected few = expected(runs);
  EXPECT_NEAR(*few.one_search, (10 + 20 + 500 + 15) / 3.0, 1e-12);
  EXPECT_EQ(*few.restart_after, 20);
  EXPECT_NEAR(*few.with_restarts, 65 / 3.0, 1e-12);
  EXPECT_FALSE(few.quickest_of_8);
  EXPECT_FALSE(expected({record("fast", 3, false, 500, 50)}).one_search);

  // Of twelve the quickest of all choices of eight; the choices are gone through one by one.
  runs.clear();
  const std::vector<int> took{31, 7, 90, 12, 55, 43, 18, 200, 77, 26, 140, 64};
  for (int k = 0; k < 12; ++k) runs.push_back(record("fast", k + 1, k != 7, took[std::size_t(k)], 1));
  double sum = 0;
  int choices = 0;
  for (unsigned choice = 0; choice < 1u << 12; ++choice) {
    if (std::popcount(choice) != 8) continue;
    int least = 1000;
    for (int k = 0; k < 12; ++k)
      if (choice >> k & 1 && k != 7) least = std::min(least, took[std::size_t(k)]);
    sum += least, ++choices;
  }
  EXPECT_NEAR(*expected(runs).quickest_of_8, sum / choices, 1e-9);
}

// The stairs end where the share of the solved runs is, and the page fetches nothing.
TEST(BenchReport, ThePageHasAPlotOfEachSceneAndAllItsTables) {
  const RunRecords runs{record("fast", 1, true, 10, 2), record("fast", 2, false, 20, 4),
                        record("paper", 1, true, 30, 1)};
  const std::string page = page_of_bench(runs, report_of(runs));
  for (const char* words : {"<h2>made</h2>", "1 of 2", "1 of 1", "iterations", "CPU s of the search",
                            ">fast<", ">paper<", "</html>"})
    EXPECT_NE(page.find(words), std::string::npos) << words;
  EXPECT_EQ(page.find("src="), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  std::size_t plots = 0;
  for (std::size_t at = page.find("<svg"); at != std::string::npos; at = page.find("<svg", at + 1)) ++plots;
  EXPECT_EQ(plots, 2u);
}

// Reads the log by the rules of OMPL's page "How to Benchmark Planners" and of its ompl_benchmark_statistics
// 1.5: each line's fixed words, counts before lists, "; " after every value, a point after every planner.
class OmplLogReader {
 public:
  explicit OmplLogReader(const std::string& text) : lines_(text) {}
  std::string line() {
    std::string text;
    EXPECT_TRUE(std::getline(lines_, text)) << "the log is cut short";
    return text;
  }
  // The words of a line that has `fixed` at its end (or at its beginning) and the value at the other side.
  std::string value_before(const std::string& fixed) {
    const std::string text = line();
    EXPECT_TRUE(text.size() > fixed.size() && text.substr(text.size() - fixed.size()) == fixed) << text;
    return text.substr(0, text.find(' '));
  }
  std::string value_after(const std::string& fixed) {
    const std::string text = line();
    EXPECT_EQ(text.substr(0, fixed.size()), fixed);
    return text.substr(fixed.size());
  }
  void block() {
    EXPECT_EQ(line(), "<<<|");
    while (line() != "|>>>") ASSERT_TRUE(lines_.good());
  }
  bool at_end() { return lines_.peek() == std::istringstream::traits_type::eof(); }

 private:
  std::istringstream lines_;
};

TEST(BenchReport, OmplsLogHoldsTheRunsByItsOwnGrammar) {
  const RunRecords records{record("fast", 1, true, 10, 2), record("fast", 2, false, 100, 4),
                           record("paper", 1, true, 30, 1)};
  OmplLogReader log(ompl_log(records, "2026-01-31 12:00:00"));
  log.value_after("limber version ");
  EXPECT_EQ(log.value_after("Experiment "), "made");
  EXPECT_EQ(log.value_after("Running on "), "machine");
  EXPECT_EQ(log.value_after("Starting at "), "2026-01-31 12:00:00");
  log.block(), log.block();
  log.value_before(" is the random seed");
  EXPECT_GT(std::stod(log.value_before(" seconds per run")), 0);
  log.value_before(" MB per run");
  EXPECT_EQ(log.value_before(" runs per planner"), "2");
  EXPECT_EQ(std::stod(log.value_before(" seconds spent to collect the data")), 140);
  EXPECT_EQ(log.value_before(" enum type"), "1");
  std::istringstream names(log.line());
  std::vector<std::string> statuses;
  for (std::string name; std::getline(names, name, '|');) statuses.push_back(name);
  ASSERT_EQ(statuses.at(0), "status");
  statuses.erase(statuses.begin());

  ASSERT_EQ(log.value_before(" planners"), "2");
  std::size_t next = 0;
  for (const char* planner : {"fast", "paper"}) {
    EXPECT_EQ(log.line(), planner);
    for (int n = std::stoi(log.value_before(" common properties")); n > 0; --n)
      EXPECT_NE(log.line().find(" = "), std::string::npos);
    std::vector<std::pair<std::string, std::string>> properties;  // name, type
    std::set<std::string> columns;
    for (int n = std::stoi(log.value_before(" properties for each run")); n > 0; --n) {
      const std::string text = log.line();
      const auto space = text.rfind(' ');
      properties.emplace_back(text.substr(0, space), text.substr(space + 1));
      EXPECT_TRUE(columns.insert(properties.back().first).second);
    }
    for (int n = std::stoi(log.value_before(" runs")); n > 0; --n) {
      const RunRecord& run = records.at(next++);
      EXPECT_EQ(run.preset, planner);
      std::string rest = log.line();
      std::map<std::string, std::string> cells;
      for (const auto& [name, type] : properties) {
        const auto end = rest.find("; ");
        ASSERT_NE(end, rest.npos) << name;
        cells[name] = rest.substr(0, end);
        rest = rest.substr(end + 2);
      }
      const bool solved = run.solved;
      EXPECT_EQ(std::stoull(cells.at("seed")), run.seed);
      EXPECT_EQ(std::stod(cells.at("time")), run.wall_s);
      EXPECT_EQ(std::stod(cells.at("cpu time")), run.cpu_s);
      EXPECT_EQ(cells.at("solved"), solved ? "1" : "0");
      EXPECT_EQ(statuses.at(std::size_t(std::stoi(cells.at("status")))),
                solved ? "Exact solution" : "Timeout");
      EXPECT_EQ(cells.at("solution length").empty(), !solved);
      EXPECT_EQ(rest, "");
    }
    EXPECT_EQ(log.line(), ".");
  }
  EXPECT_EQ(next, records.size());
  EXPECT_TRUE(log.at_end());
}

Json without_times(Json record) {
  for (const char* key : {"cpu_s", "wall_s", "rollouts", "rollouts_wrong", "threads"}) record.erase(key);
  return record;
}

std::vector<std::string> bench_of(const std::string& scene, const std::string& out,
                                  std::vector<std::string> more = {}) {
  std::vector<std::string> words{"bench", scene,       "-o",         out,     "--seeds",
                                 "1-2",   "--presets", "paper,fast", "--json"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// Two machines share the work; one table comes of it, the same as one machine's. Each run is what `plan`
// plans.
TEST_F(Program_slow, ChunksOfABenchmarkMergeToTheWholeAndARunIsWhatPlanPlans) {
  const Result whole = limber_program(bench_of(scene(), out("whole")));
  ASSERT_EQ(whole.code, exit_done) << whole.err;
  const Json groups = whole.json().at("groups");
  ASSERT_EQ(groups.size(), 2u);
  for (const Json& group : groups) EXPECT_EQ(group.at("runs"), 2);

  for (const char* chunk : {"1/2", "2/2"})
    ASSERT_EQ(limber_program(bench_of(scene(), out(std::string("part") + chunk[0]), {"--chunk", chunk})).code,
              exit_done);
  const Result merged = limber_program({"bench", "--merge", out("part1"), out("part2"), "-o", out("merged"),
                                        "--ompl-log", out("ompl.log"), "--json"});
  ASSERT_EQ(merged.code, exit_done) << merged.err;
  const RunRecords one = read_records({out("whole")}), two = read_records({out("part1"), out("part2")});
  ASSERT_EQ(one.size(), 4u);
  ASSERT_EQ(two.size(), one.size());
  for (std::size_t i = 0; i < one.size(); ++i)
    EXPECT_EQ(without_times(one[i].json), without_times(two[i].json));
  std::istringstream lines(read_file(fs::path(out("merged")) / "runs.jsonl"));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) EXPECT_EQ(Json::parse(line), two.at(count).json);
  EXPECT_EQ(count, two.size());
  EXPECT_NE(read_file(out("ompl.log")).find("2 planners\nfast\n"), std::string::npos);

  const Json planned = limber_program({"plan", scene(), "-o", out("plan"), "--seed", "2", "--json"}).json();
  const Json& run = one.at(3).json;
  EXPECT_EQ(run.at("preset"), "paper");
  EXPECT_EQ(run.at("seed"), 2);
  EXPECT_EQ(run.at("tree_hash"), planned.at("tree_hash"));
  EXPECT_EQ(run.at("trajectory_hash"), planned.at("trajectory_hash"));
  EXPECT_EQ(run.at("motion_s"), planned.at("motion_s"));

  // The scene stores 5 frames a second: each is a place of the way.
  const plan::PlanFile file = plan::read_plan(fs::path(out("plan")) / "plan.npz");
  const Json& way = run.at("robot_path_m");
  ASSERT_EQ(way.size(), file.plan.trajectory.frames.size());
  EXPECT_EQ(way.front(), Json({0.6, 1.0, 1.3})) << "where the scene puts it";
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(way.back()[std::size_t(axis)].get<double>(), (Vec3(3.2, 1, 1))[axis], 0.3 + 1e-3);
}

TEST_F(Program_slow, ABenchmarkStartedAgainRunsOnlyWhatIsMissing) {
  ASSERT_EQ(limber_program(bench_of(scene(), out())).code, exit_done);
  const auto before = contents(fs::path(out()) / "runs");
  ASSERT_EQ(before.size(), 4u);
  fs::remove(fs::path(out()) / "runs" / before[2].first);
  ASSERT_EQ(limber_program(bench_of(scene(), out())).code, exit_done);
  const auto after = contents(fs::path(out()) / "runs");
  ASSERT_EQ(after.size(), 4u);
  for (std::size_t i : {0, 1, 3}) EXPECT_EQ(after[i], before[i]);  // to the last digit of their times
  EXPECT_EQ(without_times(Json::parse(after[2].second)), without_times(Json::parse(before[2].second)));

  // What is there is not taken for something else.
  for (const std::vector<std::string>& other :
       {std::vector<std::string>{"--set", "planner.goal_bias=0.2"}, {"--iterations", "7"}}) {
    const Result refused = limber_program(bench_of(scene(), out(), other));
    EXPECT_EQ(refused.code, exit_bad_input);
    EXPECT_NE(refused.err.find("take another folder"), std::string::npos) << refused.err;
  }
  EXPECT_EQ(contents(fs::path(out()) / "runs"), after);
}

TEST_F(Program_slow, ASignalEndsABenchmarkAndKeepsWhatIsFinished) {
  ASSERT_EQ(limber_program(bench_of(scene(), out(), {"--chunk", "1/4"})).code, exit_done);
  request_stop(SIGTERM);
  const Result stopped = limber_program(bench_of(scene(), out()));
  request_stop(0);
  EXPECT_EQ(stopped.code, 143) << stopped.err;
  EXPECT_EQ(contents(fs::path(out()) / "runs").size(), 1u);
}

TEST_F(Program_slow, ARunThatMeetsItsTimeLimitIsNotSolved) {
  const Result limited =
      limber_program({"bench", scene(), "-o", out(), "--seeds", "5,7", "--time-limit", "0s", "--json"});
  ASSERT_EQ(limited.code, exit_done) << limited.err;
  const Json group = limited.json().at("groups").at(0);
  EXPECT_EQ(group.at("solved"), 0);
  EXPECT_EQ(group.at("unsolved_seeds"), Json({5, 7}));
  EXPECT_EQ(group.at("motion_s"), Json());
}

TEST_F(Program_slow, BadBenchmarksAreRefusedWithAWayOut) {
  ASSERT_EQ(limber_program(bench_of(scene(), out(), {"--chunk", "1/4"})).code, exit_done);
  const fs::path folder_of_runs = fs::path(out()) / "runs";
  fs::create_directories(out("empty"));
  fs::create_directories(fs::path(out("broken")) / "runs");
  std::ofstream(fs::path(out("broken")) / "runs" / "a.json") << "{\"scene\": \"small\"}";
  fs::create_directories(fs::path(out("twice")) / "runs");
  for (const auto& entry : fs::directory_iterator(folder_of_runs)) {
    Json changed = read_json(entry.path());
    changed["iterations"] = 1;
    write_json(fs::path(out("twice")) / "runs" / entry.path().filename(), changed);
  }
  struct Case {
    std::vector<std::string> words;
    std::string complaint;
  };
  const std::vector<Case> cases{
      {{"bench", "-o", out()}, "name one scene"},
      {{"bench", scene()}, "with -o"},
      {{"bench", scene(), scene(), "-o", out("new")}, "named twice"},
      {{"bench", scene(), "-o", out("new"), "--seeds", "3-1"}, "--seeds 3-1"},
      {{"bench", scene(), "-o", out("new"), "--seeds", ""}, "names no seed"},
      {{"bench", scene(), "-o", out("new"), "--chunk", "5/4"}, "--chunk 5/4"},
      {{"bench", scene(), "-o", out("new"), "--presets", "slow"}, "preset"},
      {{"bench", scene(), "--merge", out()}, "takes no scene"},
      {{"bench", "--merge", out("empty")}, "holds no record"},
      {{"bench", "--merge", out("broken")}, "is no record of limber bench"},
      {{"bench", "--merge", out(), out("twice")}, "differ"},
  };
  for (const Case& c : cases) {
    const Result refused = limber_program(c.words);
    EXPECT_EQ(refused.code, exit_bad_input) << c.complaint;
    EXPECT_NE(refused.err.find(c.complaint), std::string::npos) << c.complaint << " in: " << refused.err;
  }
}

}  // namespace
}  // namespace limber::detail
