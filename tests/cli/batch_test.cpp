// Many models: one that fails fails alone, and what comes out has the same bytes however often it was
// stopped.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "core/random.h"
#include "core/temporary_files.h"
#include "tests/cli/program.h"
#include "tests/places.h"

namespace limber::detail {
namespace {

using testing::HasSubstr;

class Batch_slow : public Program {
 protected:
  // A ball of radius ½ about (at, 0, 0).
  std::string ball(const std::string& name, double at, int rings = 8) const {
    const int sectors = 2 * rings;
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
    const auto vertex = [&](int r, int s) { return 3 + (r - 1) * sectors + s % sectors; };
    for (int s = 0; s < sectors; ++s) {
      file << fmt::format("f 1 {} {}\n", vertex(1, s), vertex(1, s + 1));
      for (int r = 1; r + 1 < rings; ++r)
        file << fmt::format("f {} {} {} {}\n", vertex(r, s), vertex(r + 1, s), vertex(r + 1, s + 1),
                            vertex(r, s + 1));
      file << fmt::format("f 2 {} {}\n", vertex(rings - 1, s + 1), vertex(rings - 1, s));
    }
    return path.string();
  }
  std::string broken(const std::string& name) const {
    fs::create_directories((folder / "models" / name).parent_path());
    std::ofstream(folder / "models" / name) << "v 0 0 0\nf 1 2 3\n";
    return (folder / "models" / name).string();
  }
  std::string models() const { return (folder / "models").string(); }

  struct Ended {
    int code;
    Json json;
  };
  // In a process of its own, since a batch starts the program that it is part of; `signal_number` after
  // `seconds`.
  Ended run(std::vector<std::string> words, double seconds = 1e9, int signal_number = SIGKILL,
            const std::string& on_stdin = "") const {
    const std::string program = std::string(limber_binary_dir) + "/cli/limber";
    words.insert(words.end(), {"--json", "-q"});
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    const std::string said = (folder / "said").string(), given = (folder / "given").string();
    std::ofstream(given, std::ios::binary) << on_stdin;
    const pid_t child = ::fork();
    if (child == 0) {
      ::dup2(::open(given.c_str(), O_RDONLY), 0);
      ::dup2(::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), 1),
          ::dup2(::open("/dev/null", O_WRONLY), 2);
      ::execv(program.c_str(), argv.data());
      ::_exit(127);
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    int status = 0;
    for (bool sent = false; ::waitpid(child, &status, WNOHANG) == 0; ::usleep(500))
      if (!sent && std::chrono::steady_clock::now() >= end) ::kill(child, signal_number), sent = true;
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, Json::parse(read_file(said), nullptr, false)};
  }
  Ended prepare(const std::string& what, const std::string& out_name, std::vector<std::string> more = {},
                double seconds = 1e9, int signal_number = SIGKILL) const {
    more.insert(more.begin(), {"prepare", what, "-o", out(out_name), "--tets", "60"});
    return run(more, seconds, signal_number);
  }

  // Less what tells of its making.
  std::map<std::string, std::string> result(const std::string& out_name) const {
    std::map<std::string, std::string> files;
    for (const auto& [name, bytes] : contents(out(out_name)))
      if (name != "seconds.csv" && name != "journal.jsonl") files[name] = bytes;
    return files;
  }
  void expect_same(const std::string& a, const std::string& b) const {
    const auto files = result(a), others = result(b);
    for (const auto& [name, bytes] : files)
      EXPECT_TRUE(others.contains(name) && others.at(name) == bytes) << name;
    for (const auto& [name, bytes] : others) EXPECT_TRUE(files.contains(name)) << name;
  }
  std::map<std::string, Json> rows(const std::string& out_name) const {
    std::map<std::string, Json> all;
    std::istringstream lines(read_file(fs::path(out(out_name)) / "manifest.jsonl"));
    for (std::string line; std::getline(lines, line);) {
      const Json row = Json::parse(line);
      all[row.at("name").get<std::string>()] = row;
    }
    return all;
  }
};

TEST_F(Batch_slow, OneThatFailsFailsAloneAndTheSecondTimeNothingIsDone) {
  ball("a.obj", 0), ball("in/a.obj", 1), broken("bad.obj");
  const Ended first = prepare(models(), "out");
  EXPECT_EQ(first.code, exit_models_failed);
  EXPECT_EQ(first.json.at("made"), 2);
  EXPECT_EQ(first.json.at("reasons"), (Json{{"refused", 1}}));
  const auto row = rows("out");
  ASSERT_EQ(row.size(), 3u);
  EXPECT_EQ(row.at("bad.obj").at("reason"), "refused");
  EXPECT_NE(row.at("bad.obj").at("message").get<std::string>().find("names vertex 1"), std::string::npos);
  EXPECT_NE(read_file(fs::path(out()) / "failed" / "bad.obj.txt").find("names vertex 1"), std::string::npos);
  for (const char* name : {"a.obj", "in_a.obj"}) {
    EXPECT_TRUE(row.at(name).at("certificate_holds").get<bool>());
    const fs::path body = fs::path(out()) / row.at(name).at("folder").get<std::string>();
    EXPECT_EQ(limber_program({"verify", body.string()}).code, exit_done);
  }
  const std::string page = read_file(fs::path(out()) / "index.html");
  EXPECT_LT(page.find("bad.obj"), page.find("in_a.obj"));  // failures first
  EXPECT_NE(page.find("src=\"data:image/png"), std::string::npos);

  const auto before = result("out");
  // As a process leaves it that was killed while another already looked at the folder.
  const pid_t ended = ::fork();
  if (ended == 0) {
    std::ofstream(
        temporary_name(fs::path(out()) / row.at("a.obj").at("folder").get<std::string>() / "report.json"));
    ::_exit(0);
  }
  ::waitpid(ended, nullptr, 0);
  ASSERT_NE(result("out"), before);
  const Ended second = prepare(models(), "out");
  EXPECT_EQ(second.code, exit_models_failed);
  EXPECT_EQ(second.json.at("up_to_date"), 2);
  EXPECT_EQ(second.json.at("failed_before"), 1);
  EXPECT_EQ(result("out"), before);

  std::ofstream(folder / "models" / "bad.obj") << read_file(folder / "models" / "a.obj") << "\n";
  const Ended mended = prepare(models(), "out");
  EXPECT_EQ(mended.code, exit_done);
  EXPECT_EQ(mended.json.at("made"), 1);
  EXPECT_TRUE(fs::is_empty(fs::path(out()) / "failed"));
}

TEST_F(Batch_slow, JobsOrderAndTheStoreDoNotChangeAByte) {
  for (int i = 0; i < 4; ++i) ball(fmt::format("{}.obj", i), i);
  fs::copy(folder / "models" / "3.obj", folder / "models" / "twin.obj");
  broken("bad.obj");
  const std::string store = out("store");
  const Ended one = prepare(models(), "one", {"--jobs", "1", "--store", store});
  EXPECT_EQ(one.json.at("made"), 5) << one.json;  // the twin's process finds its body in the store
  EXPECT_EQ(prepare(models(), "three", {"--jobs", "3", "--store", out("another")}).json.at("made"), 5);
  expect_same("one", "three");
  expect_same("store", "another");
  const Ended from_store = prepare(models(), "again", {"--store", store});
  EXPECT_EQ(from_store.json.at("in_store"), 5);
  expect_same("one", "again");
}

TEST_F(Batch_slow, KilledAtAnyTimeItEndsWithTheSameBytes) {
  for (int i = 0; i < 5; ++i) ball(fmt::format("{}.obj", i), i);
  broken("bad.obj");
  const auto began = std::chrono::steady_clock::now();
  ASSERT_EQ(prepare(models(), "whole").code, exit_models_failed);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  Rng rng(20261124, 0);
  for (int kill = 0; kill < 4; ++kill) {
    SCOPED_TRACE(kill);
    fs::remove_all(out("cut"));
    for (int again = 0; again < 2; ++again) prepare(models(), "cut", {}, rng.uniform(0.01, 0.7) * seconds);
    ASSERT_EQ(prepare(models(), "cut").code, exit_models_failed);
    expect_same("whole", "cut");
  }
}

TEST_F(Batch_slow, ASignalEndsItAndAllItsProcessesAndWaitsForNone) {
  for (int i = 0; i < 4; ++i) ball(fmt::format("{}.obj", i), i, 100);
  EXPECT_EQ(prepare(models(), "cut", {"--jobs", "4"}, 0.7, SIGTERM).code, 128 + SIGTERM);
  for (int i = 0; i < 4; ++i)  // which take seconds each
    EXPECT_FALSE(fs::exists(fs::path(out("cut")) / "bodies" / fmt::format("{}.obj", i) / "report.json"));
  EXPECT_EQ(prepare(models(), "cut", {"--only", "shells"}).code, exit_done);  // nobody holds a folder
}

TEST_F(Batch_slow, WhatIsOverALimitFailsAloneAndIsTriedAgainWithAHigherOne) {
  ball("small.obj", 0), ball("large.obj", 0, 200);
  const Ended slow = prepare(models(), "out", {"--only", "shells", "--time-limit", "1"});
  EXPECT_EQ(slow.code, exit_models_failed);
  EXPECT_EQ(rows("out").at("large.obj").at("reason"), "time");
  EXPECT_EQ(rows("out").at("small.obj").at("status"), "done");
  EXPECT_EQ(prepare(models(), "out", {"--only", "shells", "--time-limit", "1"}).json.at("failed_before"), 1);

  EXPECT_EQ(prepare(models(), "out", {"--only", "shells", "--memory-limit", "100"}).code, exit_models_failed);
  EXPECT_EQ(rows("out").at("large.obj").at("reason"), "memory");
  const Ended enough = prepare(models(), "out", {"--only", "shells"});
  EXPECT_EQ(enough.code, exit_done);
  EXPECT_EQ(enough.json.at("made"), 1);
}

TEST_F(Batch_slow, AnEntryThatWasChangedIsMadeAnew) {
  ball("a.obj", 0), ball("b.obj", 1);
  const std::string store = out("store");
  ASSERT_EQ(prepare(models(), "one", {"--only", "cage", "--store", store}).code, exit_done);
  for (const auto& entry : fs::recursive_directory_iterator(store))
    if (entry.path().filename() == "cage.msh") {
      const std::string bytes = read_file(entry.path());
      write_file(entry.path(), bytes + " ");
      break;
    }
  const Ended again = prepare(models(), "two", {"--only", "cage", "--store", store});
  EXPECT_EQ(again.json.at("made"), 1);
  EXPECT_EQ(again.json.at("in_store"), 1);
  expect_same("one", "two");
}

// A file lies wherever an entry would: nothing can be kept, and nothing else is different.
TEST_F(Batch_slow, AStoreThatCannotBeWrittenIsDoneWithout) {
  ball("a.obj", 0);
  ASSERT_EQ(prepare(models(), "one", {"--only", "cage", "--store", out("elsewhere")}).code, exit_done);
  make_folder(folder / "store");
  for (int i = 0; i < 256; ++i) write_file(folder / "store" / fmt::format("{:02x}", i), "");
  const Ended ended = prepare(models(), "two", {"--only", "cage", "--store", out("store")});
  EXPECT_EQ(ended.code, exit_done) << ended.json;
  EXPECT_EQ(ended.json.at("made"), 1);
  expect_same("one", "two");
}

// All of a batch's bodies by one command; each false word is named, and so is the model.
TEST_F(Batch_slow, AllAreVerifiedAtOnce) {
  ball("a.obj", 0), ball("b.obj", 1), broken("c.obj");
  ASSERT_EQ(prepare(models(), "out").code, exit_models_failed);
  const fs::path batch = out("out");
  const Result good = limber_program({"verify", batch.string()});
  EXPECT_EQ(good.code, exit_done) << good.out << good.err;
  EXPECT_THAT(good.out, HasSubstr("b.obj: all that is promised of a body"));
  EXPECT_THAT(good.out, HasSubstr("c.obj: failed"));
  EXPECT_EQ(limber_program({"verify", batch.string(), "--film"}).code, exit_bad_input);
  const Json info = limber_program({"info", batch.string(), "--json"}).json();
  EXPECT_EQ(info.at("prepared"), 2) << info;
  EXPECT_EQ(info.at("certificates_that_hold"), 2) << info;
  EXPECT_EQ(info.at("failed"), Json({{"c.obj", "refused"}})) << info;

  const auto named = [&](const std::string& words, const fs::path& file, const std::string& from,
                         const std::string& to) {
    const std::string bytes = read_file(batch / file);
    ASSERT_NE(bytes.find(from), std::string::npos) << file << " " << from;
    std::string other = bytes;
    write_file(batch / file, other.replace(other.find(from), from.size(), to));
    const Result result = limber_program({"verify", batch.string()});
    write_file(batch / file, bytes);
    EXPECT_EQ(result.code, exit_defect) << file << " " << to;
    std::istringstream lines(result.out);
    bool is_named = false;
    for (std::string line; std::getline(lines, line);)
      is_named = is_named || (line.starts_with("  BROKEN") && line.find(words) != std::string::npos);
    EXPECT_TRUE(is_named) << file << " " << to << '\n' << result.out;
  };
  named("a.obj: all", "bodies/a.obj/report.json", "\"vertices_outside\": 0", "\"vertices_outside\": 1");
  named("b.obj: all", "bodies/b.obj/cage.msh", "$Nodes", "$nodes");
  const std::string tells = "manifest.jsonl tells", same = "manifest.csv says";
  named(tells, "manifest.jsonl", "\"certificate_holds\":true", "\"certificate_holds\":false");
  named(tells, "manifest.jsonl", "\"name\":\"a.obj\"", "\"name\":\"b.obj\"");
  named(tells, "manifest.jsonl", "\"name\":\"a.obj\"", "\"name\":\"../bodies/a.obj\"");
  named(tells, "manifest.jsonl", "{", "{\"best\":true,");
  named(tells, "manifest.jsonl", "refused", "time");
  named(tells, "manifest.jsonl", "}\n", "}\nall is well\n");
  named(tells, "failed/c.obj.txt", "refused", "time");
  named(same, "manifest.csv", "refused", "done");
  fs::rename(batch / "bodies/a.obj", batch / "bodies/z.obj");
  const Result moved = limber_program({"verify", batch.string()});
  EXPECT_EQ(moved.code, exit_defect);
  EXPECT_THAT(moved.out, HasSubstr("bodies/z.obj"));
}

TEST_F(Batch_slow, OnlyAPartIsMadeAndSaidSo) {
  const std::string model = ball("a.obj", 0);
  ASSERT_EQ(run({"prepare", model, "-o", out("body"), "--tets", "60"}).code, exit_done);
  for (const auto& [only, files] :
       {std::pair<std::string, std::vector<std::string>>{"shells", {"shells.obj", "surface.ply"}},
        {"cage", {"cage.msh", "surface.ply"}}}) {
    SCOPED_TRACE(only);
    ASSERT_EQ(run({"prepare", model, "-o", out(only), "--tets", "60", "--only", only}).code, exit_done);
    std::vector<std::string> there;
    for (const auto& [name, bytes] : contents(out(only)))
      if (name != "report.json") there.push_back(name);
    EXPECT_EQ(there, files);
    // Long edges are cut for cages alone.
    constexpr int triangles_of_model = 224;
    const Json made = read_json(fs::path(out(only)) / "report.json"),
               whole = read_json(fs::path(out("body")) / "report.json");
    if (only == "shells")
      EXPECT_EQ(made.at("surface").at("triangles"), triangles_of_model);
    else
      EXPECT_EQ(made.at("surface"), whole.at("surface"));
    EXPECT_GT(whole.at("surface").at("triangles"), triangles_of_model);
    const Result info = limber_program({"info", out(only)});
    EXPECT_EQ(info.code, exit_done) << info.err;
    EXPECT_NE(info.out.find("made with --only " + only), std::string::npos) << info.out;
    const Result exported = limber_program({"export", out(only), "--format", "urdf"});
    EXPECT_EQ(exported.code, exit_bad_input) << exported.out;
    EXPECT_NE(exported.err.find("without --only"), std::string::npos) << exported.err;
    // It keeps what a part promises; a figure of a file that is there, and of one that is not, is a false
    // word.
    const Result verified = limber_program({"verify", out(only), "--model", model});
    EXPECT_EQ(verified.code, exit_done) << verified.out << verified.err;
    EXPECT_NE(verified.out.find(only == "cage" ? "no vertex outside the cage" : "shells are convex"),
              std::string::npos)
        << verified.out;
    const fs::path report = fs::path(out(only)) / "report.json";
    const Json told = read_json(report);
    for (const auto& [pointer, value] :
         {std::pair<std::string, Json>{only == "cage" ? "/cage/tets" : "/shells/count", 7},
          {"/contact", {{"usable", true}}},
          {"/files/binding.npz", std::string(16, '0')}}) {
      Json other = told;
      other[Json::json_pointer(pointer)] = value;
      write_json(report, other);
      EXPECT_EQ(limber_program({"verify", out(only)}).code, exit_defect) << pointer;
    }
    write_json(report, told);
    // and the same folder can become a whole body
    ASSERT_EQ(run({"prepare", model, "-o", out(only), "--tets", "60"}).code, exit_done);
    EXPECT_EQ(limber_program({"verify", out(only)}).code, exit_done);
  }
}

TEST_F(Batch_slow, ListsAndModelsComeOnStdin) {
  const std::string a = ball("a.obj", 0);
  ASSERT_EQ(
      run({"prepare", "@-", "-o", out("list"), "--only", "shells"}, 1e9, SIGKILL, a + "\nmissing.obj\n").code,
      exit_models_failed);
  EXPECT_EQ(rows("list").at("a.obj").at("status"), "done");
  EXPECT_EQ(rows("list").at("missing.obj").at("reason"), "refused");
  ASSERT_EQ(run({"prepare", "-", "-o", out("one"), "--only", "shells", "--format", "obj"}, 1e9, SIGKILL,
                read_file(a))
                .code,
            exit_done);
  EXPECT_EQ(read_file(fs::path(out("one")) / "surface.ply"),
            read_file(fs::path(out("list")) / "bodies" / "a.obj" / "surface.ply"));
  EXPECT_EQ(run({"prepare", "-", "-o", out("none")}).code, exit_bad_input);  // nothing comes
  EXPECT_EQ(run({"prepare", "@-", "-o", out("none")}).code, exit_bad_input);
}

}  // namespace
}  // namespace limber::detail
