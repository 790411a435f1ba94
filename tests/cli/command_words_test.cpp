// Manual and completion tell all that --help tells.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "core/file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

class CommandWords : public Program {
 protected:
  // "", "plan", "scene new": those that --help names.
  std::vector<std::vector<std::string>> commands() const {
    std::vector<std::vector<std::string>> all{{}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      std::vector<std::string> words = all[i];
      words.push_back("--help");
      std::istringstream help(limber_program(words).out);
      bool listed = false;
      for (std::string line; std::getline(help, line);) {
        if (line == "Subcommands:") {
          listed = true;
        } else if (listed && line.starts_with("  ") && line[2] != ' ') {
          std::vector<std::string> below = all[i];
          below.push_back(line.substr(2, line.find(' ', 2) - 2));
          all.push_back(below);
        }
      }
    }
    return all;
  }
  // Long options that --help of a command names at the beginning of a line.
  std::set<std::string> options(std::vector<std::string> words) const {
    words.push_back("--help");
    std::istringstream help(limber_program(words).out);
    std::set<std::string> found;
    for (std::string line; std::getline(help, line);) {
      if (!line.starts_with("  -")) continue;
      std::istringstream names(line.substr(0, line.find(' ', 2)));
      for (std::string name; std::getline(names, name, ',');)
        if (name.find("--") != name.npos) found.insert(name.substr(name.find("--")));
    }
    return found;
  }
  // What bash offers for the last of the words.
  std::set<std::string> offered(const std::string& script, const std::vector<std::string>& words) const {
    std::string list = "limber";
    for (const std::string& word : words) list += " '" + word + "'";
    const fs::path out = folder / "offered", run = folder / "run.sh";
    std::ofstream(run) << "source '" << script << "'\nCOMP_WORDS=(" << list
                       << ")\nCOMP_CWORD=" << words.size()
                       << "\n_limber\nprintf '%s\\n' \"${COMPREPLY[@]}\" > '" << out.string() << "'\n";
    EXPECT_EQ(std::system(("bash '" + run.string() + "'").c_str()), 0);
    std::istringstream lines(read_file(out));
    std::set<std::string> found;
    for (std::string line; std::getline(lines, line);)
      if (!line.empty()) found.insert(line);
    return found;
  }
};

TEST_F(CommandWords, TheManualHasAllCommandsAndOptionsOfTheHelp) {
  ASSERT_EQ(limber_program({"man", "-o", out("man")}).code, exit_done);
  const auto all = commands();
  EXPECT_GT(all.size(), 15u);
  for (const auto& words : all) {
    std::string name = "limber";
    for (const std::string& word : words) name += "-" + word;
    const std::string page = read_file(fs::path(out("man")) / (name + ".1"));
    std::vector<std::string> asked{"man"};
    asked.insert(asked.end(), words.begin(), words.end());
    EXPECT_EQ(limber_program(asked).out, page);
    const std::set<std::string> known = options(words);
    EXPECT_TRUE(known.contains("--help")) << name;
    for (std::string option : known) {
      std::string dashed;
      for (const char c : option) dashed += c == '-' ? "\\-" : std::string(1, c);
      EXPECT_NE(page.find(dashed), page.npos) << option << " of " << name;
    }
  }
  const Result wrong = limber_program({"man", "plam"});
  EXPECT_EQ(wrong.code, exit_bad_input);
  EXPECT_NE(wrong.err.find("did you mean limber plan?"), std::string::npos) << wrong.err;
}

TEST_F(CommandWords, BashOffersCommandsOptionsAndTheWordsThatTheyTake) {
  const std::string script = out("limber.bash");
  std::ofstream(script) << limber_program({"completion", "bash"}).out;
  for (const auto& words : commands()) {
    std::vector<std::string> typed = words;
    typed.push_back("--");
    EXPECT_EQ(offered(script, typed), options(words)) << words.size();
  }
  EXPECT_EQ(offered(script, {"pl"}), std::set<std::string>{"plan"});
  EXPECT_EQ(offered(script, {"scene", "ch"}), std::set<std::string>{"check"});
  EXPECT_EQ(offered(script, {"plan", "barriers1", "--preset", ""}), (std::set<std::string>{"fast", "paper"}));
  EXPECT_EQ(offered(script, {"prepare", "--mode", "la"}), std::set<std::string>{"lattice"});
  EXPECT_EQ(offered(script, {"plan", "barriers1", "-o", ""}), std::set<std::string>{});  // files, of its own
  EXPECT_EQ(limber_program({"completion", "tcsh"}).code, exit_bad_input);
}

TEST_F(CommandWords, ZshAndFishHaveThemToo) {
  const std::string zsh = limber_program({"completion", "zsh"}).out;
  const std::string fish = limber_program({"completion", "fish"}).out;
  for (const auto& words : commands()) {
    std::string function = "_limber";
    for (const std::string& word : words) function += "_" + word;
    const std::size_t begin = zsh.find("\n" + function + "() {\n"), end = zsh.find("\n}\n", begin);
    ASSERT_NE(begin, zsh.npos) << function;
    const std::string body = zsh.substr(begin, end - begin);
    for (const std::string& option : options(words)) {
      EXPECT_NE(body.find("'*" + option + "["), body.npos) << option << " of " << function;
      EXPECT_NE(fish.find(" -l " + option.substr(2) + " "), fish.npos) << option;
    }
  }
}

}  // namespace
}  // namespace limber::detail
