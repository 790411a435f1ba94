// What is done with a plan once it is found.
#include <gmock/gmock.h>

#include "plan/plan_file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

using ::testing::HasSubstr;

TEST_F(Program_slow, AShortenedPathIsAPlanLikeAnyOther) {
  const Json plain = limber_program({"plan", scene(), "-o", out(), "--json"}).json();
  EXPECT_FALSE(plain.contains("shortcut"));
  const Json two = limber_program({"plan", scene(), "-o", out(), "--shortcut", "2", "--json"}).json();
  const Json& report = two.at("shortcut");
  EXPECT_EQ(report.at("rounds"), 2);
  EXPECT_EQ(report.at("before").at("duration_s"), plain.at("motion_s"));
  EXPECT_EQ(report.at("after").at("duration_s"), two.at("motion_s"));
  EXPECT_LT(two.at("motion_s").get<double>(), plain.at("motion_s").get<double>());
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);

  // Two rounds and then two are four.
  const Json resumed =
      limber_program({"plan", scene(), "-o", out(), "--resume", "--shortcut", "4", "--json"}).json();
  EXPECT_EQ(resumed.at("shortcut").at("rounds"), 4);
  const Json four = limber_program({"plan", scene(), "-o", out("four"), "--shortcut", "4", "--json"}).json();
  EXPECT_EQ(resumed.at("trajectory_hash"), four.at("trajectory_hash"));

  const Json effort =
      limber_program({"plan", scene(), "-o", out(), "--shortcut", "2", "--cost", "effort", "--json"}).json();
  EXPECT_LT(effort.at("shortcut").at("after").at("effort_n_s").get<double>(),
            effort.at("shortcut").at("before").at("effort_n_s").get<double>());
}

TEST_F(Program_slow, ImprovingKeepsTheBestPathWithinItsIterations) {
  const Json plain = limber_program({"plan", scene(), "-o", out(), "--seed", "4", "--json"}).json();
  const Result improved = limber_program(
      {"plan", scene(), "-o", out("more"), "--seed", "4", "--improve", "--iterations", "400", "--json"});
  ASSERT_EQ(improved.code, exit_done) << improved.err;
  const Json report = improved.json().at("improve");
  EXPECT_EQ(report.at("iterations"), 400);
  ASSERT_GT(report.at("improvements").size(), 0u);
  EXPECT_EQ(report.at("first").at("duration_s"), plain.at("motion_s"));
  EXPECT_EQ(report.at("improvements").back().at("costs").at("duration_s"), improved.json().at("motion_s"));
  EXPECT_LT(improved.json().at("motion_s").get<double>(), plain.at("motion_s").get<double>());
  EXPECT_EQ(limber_program({"verify", out("more")}).code, exit_done);
}

// The path's nodes alone, and what the whole tree was; each command works with that, or says what is missing.
TEST_F(Program_slow, APathIsKeptAlone) {
  const std::string file = scene(replaced("seed = 1", "seed = 6"));
  const Json all = limber_program({"plan", file, "-o", out("all"), "--json"}).json();
  const auto plan_path = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"plan", file, "-o", out(), "--keep-tree", "path"});
    return limber_program(more);
  };
  const Result kept = plan_path({"--json"});
  ASSERT_EQ(kept.code, exit_done) << kept.err;
  for (const char* same : {"explanation", "nodes", "tree_hash", "trajectory_hash", "motion_s"})
    EXPECT_EQ(kept.json().at(same), all.at(same)) << same;
  EXPECT_LT(kept.json().at("nodes_kept").get<int>(), all.at("nodes").get<int>());
  EXPECT_LT(fs::file_size(fs::path(out()) / "plan.npz"), fs::file_size(fs::path(out("all")) / "plan.npz"));
  const Result verified = limber_program({"verify", out()});
  EXPECT_EQ(verified.code, exit_done) << verified.out << verified.err;
  EXPECT_THAT(verified.out, HasSubstr("nodes of the tree that are not kept"));
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"info", out()},
        {"report", out()},
        {"export", out(), "--format", "gltf"},
        {"robust", out(), "-n", "2"},
        {"plan", file, "-o", out("from"), "--from", out(), "--frame", "1"}})
    EXPECT_EQ(limber_program(words).code, exit_done) << words[0];
  const Result resumed = plan_path({"--resume"});
  EXPECT_EQ(resumed.code, exit_bad_input);
  EXPECT_THAT(resumed.err, HasSubstr("holds the path alone"));
  const Result tree = limber_program({"render", out(), "--set", "film.tree=true", "--as", "tree"});
  EXPECT_EQ(tree.code, exit_bad_input);
  EXPECT_THAT(tree.err, HasSubstr("film.tree"));
  EXPECT_THAT(plan_path({}).err, HasSubstr("up to date"));
  EXPECT_EQ(limber_program({"plan", file, "-o", out(), "--keep-tree", "foo"}).code, exit_bad_input);
}

// What is told of the tree that is not kept is asked of the search that is done again.
TEST_F(Program_slow, WhatAPathSaysOfItsTreeIsVerified) {
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out(), "--keep-tree", "path"}).code, exit_done);
  const fs::path file = fs::path(out()) / "plan.npz";
  const plan::PlanFile good = plan::read_plan(file);
  for (const auto& edit : std::vector<std::function<void(plan::LeftOut&)>>{
           [](plan::LeftOut& of) { ++of.nodes; }, [](plan::LeftOut& of) { ++of.tree_hash; },
           [](plan::LeftOut& of) { ++of.search_hash; }, [](plan::LeftOut& of) { --of.numbers.back(); }}) {
    plan::Plan bad = good.plan;
    edit(*bad.left_out);
    plan::write_plan(file, bad, good.given);
    const Result verified = limber_program({"verify", out(), "--json"});
    EXPECT_EQ(verified.code, exit_defect);
    const Json told = verified.json();
    const bool broken = std::ranges::any_of(told.at("promises"), [](const Json& row) {
      return row.at("promise") == "searched again from the scene: the same tree" && row.at("kept") == false;
    });
    EXPECT_TRUE(broken) << verified.out;
  }
  const std::string whole = read_file(file);
  write_file(file, whole.substr(0, whole.size() / 2));
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_bad_input);
}

// What no iteration made is replayed; branches that better paths left behind are told.
TEST_F(Program_slow, APathThatWasMadeBetterIsKeptAlone) {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--shortcut", "2"}, {"--improve", "--iterations", "400", "--seed", "4"}}) {
    std::vector<std::string> words{"plan", scene(), "-o", out(), "--keep-tree", "path"};
    words.insert(words.end(), more.begin(), more.end());
    ASSERT_EQ(limber_program(words).code, exit_done);
    const Result verified = limber_program({"verify", out()});
    EXPECT_EQ(verified.code, exit_done) << verified.out << verified.err;
  }
}

TEST_F(Program_slow, AnUnfinishedSearchKeepsItsTreeToGoOn) {
  const std::vector<std::string> words{"plan", scene(), "-o", out(), "--keep-tree", "path"};
  auto cut = words, resumed = words;
  cut.insert(cut.end(), {"--time-limit", "0"}), resumed.push_back("--resume");
  EXPECT_THAT(limber_program(cut).err, HasSubstr("the whole tree is kept"));
  ASSERT_EQ(limber_program(resumed).code, exit_done);
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out("one"), "--keep-tree", "path"}).code, exit_done);
  EXPECT_EQ(read_file(fs::path(out()) / "plan.npz"), read_file(fs::path(out("one")) / "plan.npz"));
}

TEST_F(Program_slow, APortfolioIsThePlanOfItsQuickestSeed) {
  const Result several = limber_program({"run", scene(), "-o", out(), "--portfolio", "3", "--json"});
  ASSERT_EQ(several.code, exit_done) << several.err;
  const Json report = several.json().at("plan").at("portfolio");
  int quickest = 0;
  std::int64_t fewest = 1000000;
  std::vector<std::string> trajectories;
  for (int seed = 1; seed <= 3; ++seed) {
    const Json one =
        limber_program({"plan", scene(), "-o", out("one"), "--seed", std::to_string(seed), "--json"}).json();
    trajectories.push_back(one.at("trajectory_hash"));
    const std::int64_t iterations = one.at("statistics").at("iterations");
    if (iterations < fewest) quickest = seed, fewest = iterations;
  }
  EXPECT_EQ(several.json().at("plan").at("seed"), quickest);
  EXPECT_EQ(several.json().at("plan").at("trajectory_hash"), trajectories[std::size_t(quickest - 1)]);
  EXPECT_EQ(report.at("searches").size(), 3u);
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_done);

  // It is there already; with one search more it is another.
  const std::string before = read_file(fs::path(out()) / "plan.npz");
  const Result again = limber_program({"run", scene(), "-o", out(), "--portfolio", "3"});
  EXPECT_EQ(again.code, exit_done);
  EXPECT_EQ(read_file(fs::path(out()) / "plan.npz"), before);
  EXPECT_EQ(again.err.find("search"), std::string::npos) << again.err;
  EXPECT_EQ(limber_program({"plan", scene(), "-o", out(), "--portfolio", "3", "--resume"}).code,
            exit_bad_input);
  EXPECT_EQ(limber_program({"plan", scene(), "-o", out(), "--portfolio", "1"}).code, exit_bad_input);
}

TEST_F(Program_slow, APlanThatIsNotPerturbedIsItself) {
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
  const Json exact = limber_program({"robust", out(), "-n", "5", "--materials", "0", "--forces", "0",
                                     "--turn", "0", "--json"})
                         .json();
  EXPECT_EQ(exact.at("reached"), 5);
  EXPECT_EQ(exact.at("end_farthest_m"), 0);
  for (const Json& replay : exact.at("replays"))
    for (const char* key : {"distance_m", "speed_m_s", "duration_s", "end_center_m", "deepest_penetration_m"})
      EXPECT_EQ(replay.at(key), exact.at("replays")[0].at(key)) << key;

  std::vector<Json> reports;
  for (const char* threads : {"1", "2"}) {
    reports.push_back(limber_program({"robust", out(), "-n", "6", "--threads", threads, "--json"}).json());
    fs::remove_all(fs::path(out()) / "robust");  // or nothing is replayed again
  }
  EXPECT_EQ(reports[0], reports[1]);
  EXPECT_GT(reports[0].at("end_farthest_m"), 0);
  EXPECT_NE(reports[0], limber_program({"robust", out(), "-n", "6", "--seed", "2", "--json"}).json());
}

TEST_F(Program_slow, AFollowedPlanIsItselfWhereNothingIsPerturbed) {
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
  const Json exact = limber_program({"robust", out(), "--follow", "--replan", "0.2", "-n", "2", "--materials",
                                     "0", "--forces", "0", "--turn", "0", "--json"})
                         .json();
  for (const char* how : {"followed", "replanned"}) {
    const Json& of = exact.at(how);
    EXPECT_EQ(of.at("reached"), 2) << how;
    EXPECT_EQ(of.at("end_farthest_m"), 0) << how;
    EXPECT_EQ(of.at("replays"), exact.at("replays")) << how;
    EXPECT_EQ(of.at("keep_all_promises"), exact.at("keep_all_promises")) << how;
  }
  EXPECT_EQ(exact.at("replanned").at("searches"), 0);
}

// Pushes that are 40 % too strong or too weak and turned by up to 30 degrees miss; who looks where it is does
// not. Both are told of the same worlds and errors, and open loop as it is without --follow.
TEST_F(Program_slow, FollowingReachesWhatOpenLoopMisses) {
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out(), "--seed", "11"}).code, exit_done);
  std::vector<std::string> words{"robust", out(), "-n", "8", "--forces", "0.4", "--turn", "30", "--json"};
  Json open_loop = limber_program(words).json();
  words.insert(words.end(), {"--follow", "--replan", "0.3"});
  std::vector<Json> reports;
  for (const char* threads : {"1", "2"}) {
    fs::remove_all(fs::path(out()) / "robust");
    std::vector<std::string> with_threads = words;
    with_threads.insert(with_threads.end(), {"--threads", threads});
    reports.push_back(limber_program(with_threads).json());
  }
  EXPECT_EQ(reports[0], reports[1]);
  const Json followed = reports[0].at("followed");
  EXPECT_EQ(reports[0].at("replanned").at("reached"), 8);
  reports[0].erase("followed"), reports[0].erase("replanned");
  EXPECT_EQ(reports[0], open_loop);
  EXPECT_LT(open_loop.at("reached"), 8);
  EXPECT_EQ(followed.at("reached"), 8);
  EXPECT_LT(followed.at("end_spread_m"), open_loop.at("end_spread_m"));
  const double most = open_loop.at("max_force_n");
  for (const Json& report : {open_loop, followed}) {
    int kept = 0;
    for (const Json& replay : report.at("replays")) {
      EXPECT_LE(replay.at("largest_force_asked_n").get<double>(), most);
      EXPECT_LE(replay.at("largest_force_n").get<double>(), 1.4 * most * (1 + 1e-6));
      kept += replay.at("broken_promises").empty();
    }
    EXPECT_EQ(report.at("keep_all_promises"), kept);
  }
  words.erase(std::find(words.begin(), words.end(), "--json"));
  const std::string text = limber_program(words).out;
  EXPECT_NE(text.find("open loop\n"), text.npos);
  EXPECT_NE(text.find("followed\n"), text.npos);
  EXPECT_NE(text.find("8 of 8 come to rest in the goal"), text.npos) << text;
}

// Perturbed much and given little time to settle, some rest and some do not.
TEST_F(Program_slow, RobustCallsAtRestWhatIsSlowAtItsEndAndNothingElse) {
  constexpr double slow_m_s = 0.02;  // planner.settle_speed_m_s
  const std::string hasty =
      scene(replaced("seed = 1\niterations = 400\nmax_force_n = 100",
                     "seed = 12\niterations = 400\nmax_force_n = 100\nsettle_time_s = 1.2"));
  ASSERT_EQ(limber_program({"plan", hasty, "-o", out()}).code, exit_done);
  const std::vector<std::string> words{"robust", out(), "-n", "12", "--forces", "0.4", "--turn", "30"};
  std::vector<std::string> as_json = words;
  as_json.push_back("--json");
  const Json json = limber_program(as_json).json();
  int rest = 0;
  for (const Json& replay : json.at("replays")) {
    const bool said = replay.at("end") == "at rest in the goal";
    rest += said;
    EXPECT_EQ(said, replay.at("reaches").get<bool>());
    EXPECT_TRUE(!said || replay.at("speed_m_s") < slow_m_s) << replay;
    EXPECT_TRUE(said || replay.at("speed_m_s") >= slow_m_s || replay.at("distance_m") > 0.3) << replay;
  }
  EXPECT_GT(rest, 0);
  EXPECT_LT(rest, 12);
  EXPECT_NE(limber_program(words).out.find(fmt::format("{} of 12 come to rest in the goal", rest)),
            std::string::npos);
}

TEST_F(Program_slow, APlanIsCarriedToFinerCages) {
  const Json coarse = limber_program({"plan", scene(), "-o", out(), "--json"}).json();
  const Json same =
      limber_program({"refine", out(), "-o", out("same"), "--tets-factor", "1", "--json"}).json();
  EXPECT_EQ(same.at("refine").at("how"), "replayed");
  EXPECT_EQ(same.at("trajectory_hash"), coarse.at("trajectory_hash"));

  const Result fine = limber_program({"refine", out(), "-o", out("fine"), "--tets-factor", "3", "--json"});
  ASSERT_EQ(fine.code, exit_done) << fine.err;
  const Json report = fine.json().at("refine");
  EXPECT_GT(report.at("tets").get<double>(), 2 * report.at("coarse_tets").get<double>());
  EXPECT_EQ(limber_program({"verify", out("fine")}).code, exit_done);
  EXPECT_EQ(limber_program({"render", out("fine"), "--frames", "0"}).code, exit_done);

  EXPECT_EQ(limber_program({"refine", out(), "-o", out()}).code, exit_bad_input);
  limber_program({"plan", scene(), "-o", out("few"), "--iterations", "1"});
  EXPECT_EQ(limber_program({"refine", out("few"), "-o", out("fine")}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"robust", out("few")}).code, exit_bad_input);
}

}  // namespace
}  // namespace limber::detail
