#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

#include "core/error.h"
#include "core/file.h"
#include "core/json.h"
#include "core/mesh_files.h"
#include "core/npz.h"
#include "core/process.h"
#include "core/random.h"
#include "core/temporary_files.h"
#include "tests/core/temporary_folder.h"

namespace limber {
namespace {

TetMesh glued_tets() {
  TetMesh mesh;
  mesh.positions.resize(5, 3);
  mesh.positions << 0, 0, 0, 1.0 / 3, 0, 0, 0, M_PI, 0, 0, 0, 1e-7, 0.1, 0.2, -1e5;
  mesh.tets.resize(2, 4);
  mesh.tets << 0, 1, 2, 3, 0, 2, 1, 4;
  return mesh;
}

SurfaceMesh glued_surface() { return {glued_tets().positions, boundary_triangles(glued_tets().tets)}; }

std::vector<ConvexShell> shells() {
  const TetMesh mesh = glued_tets();
  std::vector<ConvexShell> result(2);
  for (int s = 0; s < 2; ++s) {
    TetMesh one{Points(4, 3), Tets(1, 4)};
    for (int i = 0; i < 4; ++i) one.positions.row(i) = mesh.positions.row(mesh.tets(s, i));
    one.tets << 0, 1, 2, 3;
    result[std::size_t(s)] = {one.positions, boundary_triangles(one.tets)};
  }
  return result;
}

Npz arrays() {
  Npz npz;
  const std::vector<float> f{1.5f, -0.0f, 3e-40f, 7, 8, 9};
  const std::vector<std::int64_t> i{1, -2, std::int64_t(1) << 60};
  npz.arrays["states"] = NpyArray::of(std::span<const float>(f), {2, 3});
  npz.arrays["steps"] = NpyArray::of(std::span<const std::int64_t>(i), {3});
  npz.arrays["none"] = NpyArray::of(std::span<const double>(), {0, 4});
  npz.texts["meta.json"] = R"({"seed": 7})";
  return npz;
}

TEST(Files, EachFormatReadsBackWhatItWrote) {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", glued_surface());
  EXPECT_EQ(read_ply(folder / "a.ply").positions, glued_surface().positions);
  EXPECT_EQ(read_ply(folder / "a.ply").triangles, glued_surface().triangles);

  write_msh(folder / "a.msh", glued_tets(), {3, 9});
  std::vector<int> label;
  EXPECT_EQ(read_msh(folder / "a.msh", &label).positions, glued_tets().positions);
  EXPECT_EQ(read_msh(folder / "a.msh").tets, glued_tets().tets);
  EXPECT_EQ(label, (std::vector<int>{3, 9}));

  write_obj(folder / "a.obj", shells());
  const auto read = read_obj_shells(folder / "a.obj");
  ASSERT_EQ(read.size(), 2u);
  for (std::size_t s = 0; s < 2; ++s) {
    EXPECT_EQ(read[s].vertices, shells()[s].vertices);
    EXPECT_EQ(read[s].triangles, shells()[s].triangles);
  }

  write_npz(folder / "a.npz", arrays());
  const Npz npz = read_npz(folder / "a.npz");
  EXPECT_EQ(npz.text("meta.json"), arrays().text("meta.json"));
  for (const auto& [name, array] : arrays().arrays) {
    EXPECT_EQ(npz.array(name).dtype, array.dtype);
    EXPECT_EQ(npz.array(name).shape, array.shape);
    EXPECT_EQ(npz.array(name).bytes, array.bytes);
  }
  EXPECT_EQ(npz.array("steps").as<std::int64_t>("steps")[2], std::int64_t(1) << 60);
  EXPECT_THROW(npz.array("steps").as<float>("steps"), InputError);
  EXPECT_THROW(npz.array("absent"), InputError);
}

TEST(Files, SameArraysGiveTheSameBytes) {
  const TemporaryFolder folder;
  write_npz(folder / "a.npz", arrays());
  write_npz(folder / "b.npz", arrays());
  EXPECT_EQ(read_file(folder / "a.npz"), read_file(folder / "b.npz"));
}

TEST(Files, WhatAnArchiveHoldsBesideItsEntriesIsSeen) {
  const TemporaryFolder folder;
  write_npz(folder / "a.npz", arrays());
  EXPECT_TRUE(NpzReader(folder / "a.npz").bare());
  std::string bytes = read_file(folder / "a.npz");
  bytes[bytes.size() - 2] = 4;  // so long is the archive's comment
  write_file(folder / "a.npz", bytes + "more");
  EXPECT_EQ(read_npz(folder / "a.npz").text("meta.json"), arrays().text("meta.json"));
  EXPECT_FALSE(NpzReader(folder / "a.npz").bare());
}

// A file that lost its end is never taken for a smaller file.
TEST(Files, EveryTruncatedPrefixIsAnInputError) {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", glued_surface());
  write_msh(folder / "a.msh", glued_tets());
  write_obj(folder / "a.obj", shells());
  write_npz(folder / "a.npz", arrays());
  write_json(folder / "a.json", Json{{"a", {1, 2, 3}}});
  const std::vector<std::pair<std::string, std::function<void(const fs::path&)>>> readers{
      {"a.ply", [](const fs::path& p) { read_ply(p); }},
      {"a.msh", [](const fs::path& p) { read_msh(p); }},
      {"a.obj", [](const fs::path& p) { read_obj_shells(p); }},
      {"a.npz", [](const fs::path& p) { read_npz(p); }},
      {"a.json", [](const fs::path& p) { read_json(p); }}};
  for (const auto& [name, read] : readers) {
    SCOPED_TRACE(name);
    const std::string whole = read_file(folder / name);
    EXPECT_NO_THROW(read(folder / name));
    const std::size_t last =
        whole.size() -
        (whole.ends_with('\n') && name != "a.ply" ? 1 : 0);  // a lost final line end harms nobody
    for (std::size_t size = 0; size < last; ++size) {
      std::ofstream(folder / "cut", std::ios::binary) << whole.substr(0, size);
      EXPECT_THROW(read(folder / "cut"), InputError) << size << " of " << whole.size() << " bytes";
    }
  }
}

// Any single changed byte: an InputError or another valid value, never anything else.
TEST(Files, ChangedBytesNeverEscapeAsAnythingButInputError) {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", glued_surface());
  write_msh(folder / "a.msh", glued_tets());
  write_obj(folder / "a.obj", shells());
  write_npz(folder / "a.npz", arrays());
  const std::vector<std::pair<std::string, std::function<void(const fs::path&)>>> readers{
      {"a.ply", [](const fs::path& p) { read_ply(p); }},
      {"a.msh", [](const fs::path& p) { read_msh(p); }},
      {"a.obj", [](const fs::path& p) { read_obj_shells(p); }},
      {"a.npz", [](const fs::path& p) { read_npz(p); }}};
  Rng rng(20060515, 1);
  for (const auto& [name, read] : readers) {
    const std::string whole = read_file(folder / name);
    for (int trial = 0; trial < 1000; ++trial) {
      std::string changed = whole;
      changed[std::size_t(rng.below(int(whole.size())))] = char(rng.below(256));
      std::ofstream(folder / "changed", std::ios::binary) << changed;
      try {
        read(folder / "changed");
      } catch (const InputError&) {
      }
    }
  }
}

TEST(Files, MissingFileAndFolderAreInputErrors) {
  const TemporaryFolder folder;
  EXPECT_THROW(read_file(folder / "absent"), InputError);
  EXPECT_THROW(read_file(folder.path()), InputError);
}

TEST(Files, AFailedWriteIsADiskErrorAndLeavesTheOldFile) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_file(folder / "absent" / "file", "x"), DiskError);
  EXPECT_THROW(make_folder("/dev/null/x"), DiskError);
  write_file(folder / "kept", "old");
  {
    PendingFile pending(folder / "kept");
    std::ofstream(pending.temporary()) << "half";
  }  // never committed, as when the writer throws
  EXPECT_EQ(read_file(folder / "kept"), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

// The file is finished, but cannot get its name: nothing may stay behind.
TEST(Files, ANameThatIsTakenByAFolderIsADiskError) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "taken");
  EXPECT_THROW(write_file(folder / "taken", "x"), DiskError);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

// A shell less at the end, with the end mark in place: only the counts can tell.
TEST(Files, ALinkStaysAndAPipeIsNotReplaced) {
  const TemporaryFolder folder;
  write_file(folder / "real", "old");
  fs::create_symlink("real", folder / "link");
  write_file(folder / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(read_file(folder / "real"), "new");
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THROW(write_file(folder / "pipe", "x"), DiskError);
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
}

TEST(Files, ShellsAreCountedByTheFirstLine) {
  const TemporaryFolder folder;
  write_obj(folder / "a.obj", shells());
  const std::string whole = read_file(folder / "a.obj");
  const std::size_t second = whole.find("g shell_1"), end = whole.find("# end");
  std::ofstream(folder / "less.obj") << whole.substr(0, second) << whole.substr(end);
  EXPECT_THROW(read_obj_shells(folder / "less.obj"), InputError);
  std::ofstream(folder / "uncounted.obj") << whole.substr(whole.find('\n') + 1);
  EXPECT_THROW(read_obj_shells(folder / "uncounted.obj"), InputError);
}

// From the fuzzer's kind of input: a number beyond any double is no parse error to the library.
TEST(Json, ANumberTooLargeIsAnInputError) {
  EXPECT_THROW(parse_json("{\"a\": 1e999}", "report.json"), InputError);
}

TEST(Json, ComplaintNamesTheLine) {
  try {
    parse_json("{\n\"a\": 1,\n}", "report.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("report.json:3: is not valid JSON: syntax error"),
              std::string::npos)
        << error.what();
  }
}

// A process that writes, and waits to be killed in the middle of it.
struct Writer {
  explicit Writer(const fs::path& file) {
    int ready[2];
    LIMBER_CHECK(::pipe(ready) == 0, errno);
    process = ::fork();
    if (process == 0) {
      PendingFile pending(file);
      std::ofstream(pending.temporary()) << "half";
      [[maybe_unused]] const auto told = ::write(ready[1], "!", 1);
      ::pause();
    }
    char byte;
    LIMBER_CHECK(::read(ready[0], &byte, 1) == 1, errno);
    ::close(ready[0]), ::close(ready[1]);
  }
  void kill() const { end(), ::waitpid(process, nullptr, 0); }
  // Nobody asks how it ended, as where a container's first process does not.
  void end() const {
    ::kill(process, SIGKILL);
    siginfo_t how;
    ::waitid(P_PID, id_t(process), &how, WEXITED | WNOWAIT);
  }
  pid_t process;
};

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  return files;
}

// Also of a command that writes one file and cleans up nothing.
TEST(File, TheFirstWriteBesideRemovesWhatKilledProcessesLeft) {
  const TemporaryFolder folder;
  const Writer writer(folder / "0007.png");
  writer.kill();
  ASSERT_EQ(files_in(folder.path()).size(), 1u);
  write_file(folder / "new.txt", "whole");
  EXPECT_EQ(files_in(folder.path()), std::vector<fs::path>{folder / "new.txt"});
}

TEST(File, AProcessThatNobodyBuriedHasEnded) {
  const TemporaryFolder folder;
  const Writer writer(folder / "0007.png");
  EXPECT_FALSE(has_ended(writer.process));
  EXPECT_EQ(remove_abandoned(folder.path()), 0);
  writer.end();
  EXPECT_TRUE(has_ended(writer.process));
  EXPECT_EQ(remove_abandoned(folder.path()), 1);
  writer.kill();
  EXPECT_TRUE(has_ended(writer.process));
}

TEST(File, OnlyWhatKilledProcessesLeftIsRemoved) {
  const TemporaryFolder folder;
  const Writer writer(folder / "0007.png");
  PendingFile ours(folder / "0008.png");
  std::ofstream(ours.temporary()) << "half";
  for (const char* name : {".notes.tmp", ".0007.12.0.tmp.png", "0007.png", ".x.00c0ffee.tmp.png"})
    std::ofstream(folder / name) << "the user's";
  EXPECT_EQ(remove_abandoned(folder.path()), 0);
  writer.kill();
  const fs::path left = [&] {
    for (const fs::path& file : files_in(folder.path()))
      if (file.filename().string().starts_with(".0007.") && file != folder / ".0007.12.0.tmp.png")
        return file;
    return fs::path();
  }();
  ASSERT_FALSE(left.empty());

  // As a process of another machine would have left it: only its age tells.
  std::string name = left.filename().string();
  const auto place = std::string(".0007.").size();
  name.replace(place, 8, name.substr(place, 8) == "00000000" ? "00000001" : "00000000");
  fs::copy(left, folder / name);
  EXPECT_EQ(remove_abandoned(folder.path()), 1);
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(folder / name));
  fs::last_write_time(folder / name, fs::last_write_time(folder / name) - std::chrono::hours(25));
  EXPECT_EQ(remove_abandoned(folder.path()), 1);
  EXPECT_EQ(files_in(folder.path()).size(), 5u);
  EXPECT_TRUE(fs::exists(ours.temporary()));
  EXPECT_EQ(remove_abandoned(folder / "missing"), 0);
}

}  // namespace
}  // namespace limber
