// The program as a user meets it, called from a test, and a scene small enough to be planned in a moment.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "cli/command_line.h"
#include "core/error.h"
#include "core/json.h"
#include "limber/exit_codes.h"
#include "tests/core/temporary_folder.h"

namespace limber::detail {

struct Result {
  int code;
  std::string out, err;
  Json json() const { return Json::parse(out); }
};

inline Result limber_program(std::vector<std::string> arguments) {
  std::vector<const char*> argv{"limber"};
  for (const std::string& a : arguments) argv.push_back(a.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const int code = cli::run_command_line(int(argv.size()), argv.data());
  const std::string out = testing::internal::GetCapturedStdout();
  return {code, out, testing::internal::GetCapturedStderr()};
}

// LIMBER_MUTANTS=K/N leaves to this process every Nth row of a list of mutants, from the Kth on (K from 0):
// so N processes take the list between them.
inline bool mine(std::size_t row) {
  const char* share = std::getenv("LIMBER_MUTANTS");
  unsigned k = 0, n = 1;
  if (share && (std::sscanf(share, "%u/%u", &k, &n) != 2 || k >= n))
    throw InputError(std::string("LIMBER_MUTANTS is no K/N: ") + share);
  return row % n == k;
}

// A soft cube of 40 tets pushes itself past a soft block that leaves half the way free.
inline constexpr const char* small_scene = R"(name = "small"
[world]
bounds_m = [[0, 0, 0], [4, 2, 2]]
gravity_m_s2 = [0, 0, 0]
[[bodies]]
name = "robot"
role = "robot"
kind = "deformable"
model = { box = { size_m = [0.6, 0.6, 0.6] } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [0.6, 1, 1.3] }
color = "#c0392b"
[[bodies]]
name = "block"
role = "obstacle"
kind = "deformable"
model = { box = { size_m = [0.4, 2, 0.9] } }
cage = { cells = [2, 4, 2] }
material = { youngs_modulus_pa = 5e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [2, 1, 0.45] }
fixed = "walls"
color = "#2980b9"
[goal]
center_of_mass_m = [3.2, 1, 1]
radius_m = 0.3
[planner]
preset = "paper"
seed = 1
iterations = 400
max_force_n = 100
[film]
size_px = [96, 64]
frames_per_second = 5
)";

class Program : public testing::Test {
 protected:
  std::string scene(std::string text = small_scene) const {
    const fs::path path = folder / "scene.toml";
    std::ofstream(path) << text;
    return path.string();
  }
  static std::string replaced(const std::string& from, const std::string& to) {
    std::string text = small_scene;
    const auto at = text.find(from);
    LIMBER_CHECK(at != text.npos, from);
    return text.replace(at, from.size(), to);
  }
  std::string out(const std::string& name = "out") const { return (folder / name).string(); }
  TemporaryFolder folder;
};
using Program_slow = Program;  // stays out of the sanitizer runs

inline std::vector<std::pair<std::string, std::string>> contents(const fs::path& folder) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files.emplace_back(fs::relative(entry.path(), folder).string(), read_file(entry.path()));
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace limber::detail
