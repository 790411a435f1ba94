// Benchmarks of many runs: scenes × seeds × presets, a record a run, quartiles and counts of them.
// docs/bench.md.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "limber/error.h"
#include "limber/export.h"
#include "limber/watcher.h"

namespace limber {

// Each run is planned as `limber plan` would.
struct BenchOptions {
  std::vector<std::string> scenes = {};  // files, or names of scenes that come with limber
  std::vector<std::string> sets = {};    // "planner.settle_s=2": edits made before they are read
  std::vector<std::filesystem::path> data = {};
  std::filesystem::path store = {};       // as of SceneSource
  std::string seeds = "1-30";             // "1-30,40,50-90:10"
  std::vector<std::string> presets = {};  // empty: each scene's own
  std::optional<std::int64_t> iterations = {};
  double time_limit_s = std::numeric_limits<double>::infinity();  // of a run
  int in_flight = 0;                                              // as of PlanOptions
  std::string chunk = {};                              // "i/n": the i-th of n parts of the runs; empty: all
  std::vector<std::filesystem::path> merge = {};       // nothing is run: folders whose records make one table
  std::filesystem::path out = {};                      // may be empty with `merge`
  std::optional<std::filesystem::path> ompl_log = {};  // also OMPL's benchmark log
};

// Of the frames of solved runs those within so many per cent of a body's volume are counted.
inline constexpr std::array<int, 4> volume_limits_percent{3, 5, 6, 10};

// These tables tell their fields, by name and in order, to whoever asks: f("runs", runs).

// How a body's volume changed over frames.
struct VolumeFigures {
  double largest_percent = 0;
  std::int64_t frames = 0;
  std::array<std::int64_t, volume_limits_percent.size()> within{};  // frames, by volume_limits_percent
  template <class Fields>
  void fields(Fields& f) {
    f("largest_percent", largest_percent), f("frames", frames);
    for (std::size_t i = 0; i < within.size(); ++i)
      f(("within_" + std::to_string(volume_limits_percent[i]) + "_percent").c_str(), within[i]);
  }
};

using Quartiles = std::array<double, 3>;  // first, median, third

// What searches would take on average that behave as these runs did, in iterations; an unsolved run is one
// that was given up after its own. Nothing where none is solved.
struct Expected {
  std::optional<double> one_search;     // and the next, until one is solved
  std::optional<double> restart_after;  // the number after which to give one up, of those at which a run was
                                        // solved, …
  std::optional<double> with_restarts;  // … for which this is least
  std::optional<double> quickest_of_8;  // of 8 different runs the least; nothing with fewer runs, or fewer
                                        // solved than would always have one among 8
  template <class Fields>
  void fields(Fields& f) {
    f("one_search", one_search), f("restart_after", restart_after);
    f("with_restarts", with_restarts), f("quickest_of_8", quickest_of_8);
  }
};

// The runs of a scene and a preset. Iterations and times are of all of them, an unsolved one with what it
// took; duration, volumes, penetration, inversions and forces are of the solved ones.
struct BenchGroup {
  std::string scene, preset;
  std::int64_t runs = 0, solved = 0;
  std::vector<std::uint64_t> unsolved_seeds;
  Quartiles iterations{}, cpu_s{}, wall_s{};
  Expected expected;
  std::optional<Quartiles> motion_s;
  double largest_penetration_percent = 0, largest_overlap_percent = 0, largest_self_overlap_percent = 0;
  std::optional<double> median_gap_percent;  // of the runs' medians; nothing where nothing presses in any
  double largest_gap_percent = 0, min_stretch = 1, largest_stretch = 0;
  std::int64_t inverted_tets = 0;
  double largest_force_n = 0;
  std::vector<std::pair<std::string, VolumeFigures>> volume;  // by body
  std::vector<std::string> programs;                          // the builds of limber that ran them
  template <class Fields>
  void fields(Fields& f) {
    f("scene", scene), f("preset", preset), f("runs", runs), f("solved", solved);
    f("unsolved_seeds", unsolved_seeds), f("iterations", iterations), f("expected", expected);
    f("cpu_s", cpu_s), f("wall_s", wall_s), f("motion_s", motion_s);
    f("largest_penetration_percent", largest_penetration_percent);
    f("largest_overlap_percent", largest_overlap_percent);
    f("largest_self_overlap_percent", largest_self_overlap_percent);
    f("median_gap_percent", median_gap_percent), f("largest_gap_percent", largest_gap_percent);
    f("least_stretch", min_stretch), f("largest_stretch", largest_stretch);
    f("inverted_tets", inverted_tets), f("largest_force_n", largest_force_n), f("volume", volume);
    f("programs", programs);
  }
};
struct BenchReport {
  std::vector<BenchGroup> groups;
  template <class Fields>
  void fields(Fields& f) {
    f("groups", groups);
  }
};

struct Benchmark {
  BenchReport report;  // of all records
  std::size_t runs = 0;
  std::optional<std::filesystem::path> records, page;  // where this call wrote them
  std::vector<std::filesystem::path> ompl_logs;
};
// Runs what is missing. Throws InputError, DiskError, and Interrupted with the finished runs kept.
LIMBER_API Benchmark run_benchmark(const BenchOptions&, const Context& = {});

}  // namespace limber
