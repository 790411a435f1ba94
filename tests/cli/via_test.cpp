// A scene with goals in a row, as a user meets it.
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

// Over the block and to rest above its far side, and back.
const std::string out_and_back = R"([[via]]
center_of_mass_m = [3.2, 1, 1]
radius_m = 0.3
rest = true
[goal]
center_of_mass_m = [0.6, 1, 1.3]
radius_m = 0.3
)";

class ViaProgram : public Program {
 protected:
  std::string with_goals(const std::string& goals) const {
    return scene(replaced("[goal]\ncenter_of_mass_m = [3.2, 1, 1]\nradius_m = 0.3\n", goals));
  }
  static const Json& promise(const Json& verified, const std::string& begins) {
    static const Json none = Json::object();
    for (const Json& row : verified.at("promises"))
      if (row.at("promise").get<std::string>().starts_with(begins)) return row;
    return none;
  }
};
using ViaProgram_slow = ViaProgram;  // stays out of the sanitizer runs

TEST_F(ViaProgram_slow, GoalsAreReachedInTheirOrderAndVerified) {
  const std::string file = with_goals(out_and_back);
  const Result planned = limber_program({"plan", file, "-o", out(), "--preset", "fast", "--json"});
  ASSERT_EQ(planned.code, exit_done) << planned.err;
  const Json plan = planned.json(), &legs = plan.at("legs");
  ASSERT_EQ(legs.size(), 2u);
  EXPECT_EQ(legs[0].at("goal"), "via 1 of 1");
  EXPECT_EQ(legs[1].at("goal"), "the goal");
  for (const Json& leg : legs) EXPECT_TRUE(leg.at("reached").get<bool>());
  EXPECT_EQ(legs[0].at("iterations").get<int>() + legs[1].at("iterations").get<int>(),
            plan.at("statistics").at("iterations"));
  EXPECT_NE(plan.at("explanation").get<std::string>().find("by way of 1 via point"), std::string::npos);

  const Json verified = limber_program({"verify", out(), "--json"}).json();
  for (const char* begins : {"replay gives the same bits", "via 1 of 1: centre of mass within",
                             "via 1 of 1: at rest", "the goal: centre of mass within", "the goal: at rest"})
    EXPECT_TRUE(promise(verified, begins).value("kept", false)) << begins;
  EXPECT_EQ(limber_program({"info", out(), "--json"}).json().at("legs"), legs);
  const std::string svg = read_file(fs::path(out()) / "tree.svg");
  EXPECT_NE(svg.find("class=\"via\""), std::string::npos);

  // A benchmark's run is the same plan; a replay with nothing changed comes by as planned, one with quite
  // other forces does not.
  const Result bench =
      limber_program({"bench", file, "-o", out("bench"), "--seeds", "1", "--presets", "fast", "-q"});
  ASSERT_EQ(bench.code, exit_done) << bench.err;
  const Json record = parse_json(read_file(fs::path(out("bench")) / "runs" / "small.fast.1.json"), "record");
  EXPECT_EQ(record.at("trajectory_hash"), plan.at("trajectory_hash"));
}

// The second goal cannot be reached: the way to the first is kept, and who fails is named.
TEST_F(ViaProgram_slow, TheLegThatFailsIsNamedAndTheFirstIsKept) {
  const std::string file =
      with_goals(out_and_back + "clear_of = \"block\"\nbelow = \"block\"\n");  // under the floor
  const std::vector<std::string> words{"plan",         file,  "-o",     out(), "--json",
                                       "--iterations", "120", "--seed", "4"};
  const Result planned = limber_program(words);
  ASSERT_EQ(planned.code, exit_no_plan) << planned.err;
  const Json plan = planned.json();
  const std::string why = plan.at("explanation");
  EXPECT_NE(why.find("1 of 2 goals are reached"), std::string::npos) << why;
  EXPECT_TRUE(plan.at("legs").at(0).at("reached").get<bool>());
  EXPECT_FALSE(plan.at("legs").at(1).at("reached").get<bool>());
  EXPECT_EQ(limber_program({"verify", out()}).code, exit_defect);
  const Json verified = limber_program({"verify", out(), "--json"}).json();
  EXPECT_TRUE(promise(verified, "via 1 of 1: centre of mass").at("kept").get<bool>());

  // Resumed with other goals it would be another search.
  with_goals("[goal]\ncenter_of_mass_m = [3.2, 1, 1]\nradius_m = 0.3\n");
  std::vector<std::string> resumed = words;
  resumed.push_back("--resume");
  EXPECT_EQ(limber_program(resumed).code, exit_bad_input);
}

// Replays with nothing changed pass the via, some with quite other forces do not and count as missed.
TEST_F(ViaProgram_slow, ReplaysThatMissTheViaAreCounted) {
  const std::string passed = std::string(out_and_back).replace(out_and_back.find("rest = true"), 11, "");
  ASSERT_EQ(limber_program({"plan", with_goals(passed), "-o", out(), "--preset", "fast", "-q"}).code,
            exit_done);
  const auto robust = [&](const std::string& forces, const std::string& turn) {
    return limber_program(
               {"robust", out(), "-n", "8", "--materials", "0", "--forces", forces, "--turn", turn, "--json"})
        .json();
  };
  EXPECT_EQ(robust("0", "0").at("reached"), 8);
  const Result replanned = limber_program({"robust", out(), "-n", "1", "--replan", "0.2"});
  EXPECT_EQ(replanned.code, exit_bad_input);
  EXPECT_NE(replanned.err.find("goals on the way"), std::string::npos) << replanned.err;
  const Json perturbed = robust("0.9", "90");
  int missed = 0;
  for (const Json& replay : perturbed.at("replays")) missed += replay.at("end") == "a via is missed";
  EXPECT_GT(missed, 0);
  EXPECT_LE(perturbed.at("reached").get<int>(), 8 - missed);
}

TEST_F(ViaProgram_slow, APathByWayOfViaPointsIsNotCarriedToFinerCages) {
  const std::string file = with_goals(out_and_back);
  ASSERT_EQ(limber_program({"plan", file, "-o", out(), "--preset", "fast", "-q"}).code, exit_done);
  const Result refined = limber_program({"refine", out(), "-o", out("fine"), "--tets-factor", "2"});
  EXPECT_EQ(refined.code, exit_bad_input);
  EXPECT_NE(refined.err.find("via points"), std::string::npos) << refined.err;
}

}  // namespace
}  // namespace limber::detail
