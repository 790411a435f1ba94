// What `limber robust` keeps, and what of it it takes.
#include <sstream>

#include "core/hash.h"
#include "core/json_text.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

class Robust_slow : public Program {
 protected:
  Robust_slow() { plan("1"); }
  void plan(const std::string& seed) const {
    ASSERT_EQ(limber_program({"plan", scene(), "-o", out(), "--seed", seed}).code, exit_done);
  }
  Json robust(std::vector<std::string> more = {}, const std::string& threads = "1") const {
    more.insert(more.begin(), {"robust", out(), "-n", "3", "--worlds", "3", "--threads", threads, "--json"});
    const Result result = limber_program(more);
    EXPECT_EQ(result.code, exit_done) << result.err;
    return result.json();
  }
  std::vector<fs::path> kept() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(fs::path(out()) / "robust"))
      files.push_back(entry.path());
    return files;
  }
};

TEST_F(Robust_slow, WhatIsReplayedIsNotReplayedAgain) {
  const Json whole = robust({"--follow"});
  ASSERT_EQ(kept().size(), 1u);
  const fs::path file = kept()[0];
  const std::string text = read_file(file);
  EXPECT_EQ(robust({"--follow"}), whole);
  EXPECT_EQ(read_file(file), text);
  fs::remove(file);
  EXPECT_EQ(robust({"--follow"}, "2"), whole);
  EXPECT_EQ(read_file(file), text);

  // A process that was killed: of six lines the first, told apart from what is found again, is whole.
  std::istringstream lines(text);
  std::string first, second;
  std::getline(lines, first), std::getline(lines, second);
  Json told = Json::parse(first);
  ASSERT_EQ(told.at("by"), "open loop");
  told["fates"][0]["end"] = "kept";
  told.erase("hash");
  told["hash"] = hex(hash_of(std::string_view(text_of(told))));
  std::ofstream(file) << text_of(told) << "\n" << second.substr(0, second.size() / 2);
  Json expected = whole;
  expected["replays"][0]["end"] = "kept";
  EXPECT_EQ(robust({"--follow"}), expected);
  EXPECT_EQ(read_file(file), text_of(told) + text.substr(first.size()));

  // Of fewer ways the others' lines stay.
  robust();
  const std::string after = read_file(file);
  EXPECT_EQ(after.size(), text_of(told).size() + text.size() - first.size());
  expected.erase("followed");
  EXPECT_EQ(robust(), expected);

  // A line that was changed is not taken, and goes.
  told["fates"][0]["distance_m"] = 7.0;
  std::ofstream(file) << text_of(told) << "\n";
  EXPECT_EQ(robust({"--follow"}), whole);
  EXPECT_EQ(read_file(file), text);
}

TEST_F(Robust_slow, OtherErrorsAndOtherPlansHaveOtherReplays) {
  const Json whole = robust();
  const fs::path file = kept().at(0);
  std::ofstream(file.parent_path() / "notes.jsonl") << "the user's\n";
  EXPECT_NE(robust({"--forces", "0.2"}), whole);
  EXPECT_EQ(kept().size(), 3u);
  plan("2");
  EXPECT_NE(robust(), whole);
  EXPECT_EQ(kept().size(), 2u);
  EXPECT_FALSE(fs::exists(file));
  plan("1");
  EXPECT_EQ(robust(), whole);
  EXPECT_EQ(kept().size(), 2u);
  EXPECT_TRUE(fs::exists(file));
  EXPECT_TRUE(fs::exists(file.parent_path() / "notes.jsonl"));
}

TEST_F(Robust_slow, WhereNothingCanBeKeptItIsToldAllTheSame) {
  const Json whole = robust();
  fs::remove_all(fs::path(out()) / "robust");
  std::ofstream(fs::path(out()) / "robust") << "a file where the folder belongs";
  const Result result =
      limber_program({"robust", out(), "-n", "3", "--worlds", "3", "--threads", "1", "--json"});
  EXPECT_EQ(result.code, exit_done);
  EXPECT_EQ(result.json(), whole);
  EXPECT_NE(result.err.find("not kept"), result.err.npos) << result.err;
}

}  // namespace
}  // namespace limber::detail
