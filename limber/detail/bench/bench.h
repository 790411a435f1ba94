// Benchmarks of many runs, and what they say: records, their quartiles, a table, OMPL's benchmark log.
// docs/bench.md.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/json_fields.h"

namespace limber::detail {

// Scenes × seeds × presets, each planned as `plan` would, one record a run. docs/bench.md.
struct BenchOptions {
  std::vector<std::string> scenes;  // files, or names of scenes that come with limber
  std::vector<std::string> sets;
  std::vector<fs::path> data;
  fs::path store;  // as of SceneOptions
  std::string seeds = "1-30";
  std::vector<std::string> presets;  // empty: each scene's own
  std::optional<std::int64_t> iterations;
  double time_limit_s = std::numeric_limits<double>::infinity();  // of a run
  int in_flight = 0;
  std::string chunk;                 // "i/n": the i-th of n parts of the runs; empty: all
  std::vector<fs::path> merge;       // nothing is run: folders whose records make one table
  fs::path out;                      // may be empty with `merge`
  std::optional<fs::path> ompl_log;  // also OMPL's benchmark log
};

// Of the frames of solved runs those within so many per cent of a body's volume are counted.
inline constexpr std::array<int, 4> volume_limits_percent{3, 5, 6, 10};

// How a body's volume changed over frames.
struct VolumeFigures {
  double largest_percent = 0;
  std::int64_t frames = 0;
  std::array<std::int64_t, volume_limits_percent.size()> within{};  // frames, by volume_limits_percent
  template <class Fields>
  void fields(Fields& f) {
    f("largest_percent", largest_percent), f("frames", frames);
    for (std::size_t i = 0; i < within.size(); ++i)
      f(fmt::format("within_{}_percent", volume_limits_percent[i]).c_str(), within[i]);
  }
};

// All that a run's result depends on.
struct RunIdentity {
  std::string version, program, scene_hash, system_hash;
  Json settings;  // of the planner
  template <class Fields>
  void fields(Fields& f) {
    f.if_there("version", version), f("program", program), f.if_there("scene_hash", scene_hash);
    f.if_there("system_hash", system_hash), f.if_there("settings", settings);
  }
};

// One run, as docs/bench.md describes it.
struct RunRecord {
  struct Gap {
    int pairs_and_frames = 0;
    std::optional<double> median_of_robot_size;  // of no pairs there is none
    double worst_of_robot_size = 0;
    template <class Fields>
    void fields(Fields& f) {
      f("pairs_and_frames", pairs_and_frames), f("median_of_robot_size", median_of_robot_size);
      f("worst_of_robot_size", worst_of_robot_size);
    }
  };
  std::string scene, preset;
  std::uint64_t seed = 0;
  bool solved = false;
  std::int64_t iterations = 0, nodes = 0, inverted_tets = 0;
  double distance_m = 0, cpu_s = 0, wall_s = 0, motion_s = 0;
  InOrder<VolumeFigures> volume;  // by body
  double deepest_penetration_percent = 0;
  double deepest_overlap_of_robot_size = 0, deepest_self_overlap_of_robot_size = 0;
  Gap gap_at_contact;
  double least_stretch = 1, largest_stretch = 1, largest_force_n = 0;
  int threads = 1;
  std::string host;
  RunIdentity identity;
  Json json;  // as it is written
  template <class Fields>
  void fields(Fields& f) {
    f("scene", scene), f("preset", preset), f("seed", seed), f("solved", solved);
    f("iterations", iterations), f("nodes", nodes), f("distance_m", distance_m), f("cpu_s", cpu_s);
    f("wall_s", wall_s), f("motion_s", motion_s), f("volume", volume);
    f("deepest_penetration_percent", deepest_penetration_percent);
    f("deepest_overlap_of_robot_size", deepest_overlap_of_robot_size);
    f("deepest_self_overlap_of_robot_size", deepest_self_overlap_of_robot_size);
    f("gap_at_contact", gap_at_contact), f("least_stretch", least_stretch);
    f("largest_stretch", largest_stretch), f("inverted_tets", inverted_tets);
    f("largest_force_n", largest_force_n), f("threads", threads), f("host", host);
    f("identity", identity);
  }
};
// Throws InputError naming the key that is missing or of another kind.
RunRecord run_record_of(Json, const std::string& file);

// Ordered by scene, preset and seed, each of these once.
using RunRecords = std::vector<RunRecord>;

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
  double largest_gap_percent = 0, least_stretch = 1, largest_stretch = 0;
  std::int64_t inverted_tets = 0;
  double largest_force_n = 0;
  InOrder<VolumeFigures> volume;      // by body
  std::vector<std::string> programs;  // the builds of limber that ran them
  template <class Fields>
  void fields(Fields& f) {
    f("scene", scene), f("preset", preset), f("runs", runs), f("solved", solved);
    f("unsolved_seeds", unsolved_seeds), f("iterations", iterations), f("expected", expected);
    f("cpu_s", cpu_s), f("wall_s", wall_s), f("motion_s", motion_s);
    f("largest_penetration_percent", largest_penetration_percent);
    f("largest_overlap_percent", largest_overlap_percent);
    f("largest_self_overlap_percent", largest_self_overlap_percent);
    f("median_gap_percent", median_gap_percent), f("largest_gap_percent", largest_gap_percent);
    f("least_stretch", least_stretch), f("largest_stretch", largest_stretch);
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
  std::optional<fs::path> records, page;  // where this call wrote them
  std::vector<fs::path> ompl_logs;
};
// Runs what is missing. Throws InputError, DiskError, and Interrupted with the finished runs kept.
Benchmark bench(const BenchOptions&);

// Its runs one by one, seed after seed, so that any part of them has all scenes and presets in it. What runs
// of a scene share is made once. Throws InputError for options that name no runs.
class BenchRuns {
 public:
  struct Setup;  // what runs of a scene and preset share
  explicit BenchRuns(BenchOptions);
  ~BenchRuns();
  std::size_t count() const;
  // The bodies of a scene, 0 ≤ scene < scenes, in a folder of its name in options.out.
  void prepare(std::size_t scene);
  // Of the run, 0 ≤ run < count, its record's name in options.out/runs: it is there now. Throws InputError
  // also where such a record is of other options, scenes or builds; Interrupted.
  std::string run(std::size_t run);

 private:
  Setup& setup_of(std::size_t scene, std::size_t preset);
  BenchOptions options_;
  std::vector<int> seeds_;
  std::map<std::size_t, std::unique_ptr<Setup>> setups_;  // by scene and preset
  std::map<std::string, std::string> scene_from_name_;
};

// All runs/*.json of the folders. Throws InputError when a folder holds none, a record is damaged, or two
// folders have the same run with different results.
RunRecords read_records(const std::vector<fs::path>& folders);

// By linear interpolation between the ordered values; at least one value.
Quartiles quartiles(std::vector<double> values);

// A group for each scene and preset.
BenchReport report_of(const RunRecords&);

// One page in HTML: the tables, and for each scene the share of its runs that are solved over iterations and
// over CPU time.
std::string page_of_bench(const RunRecords&, const BenchReport&);

Expected expected_iterations(const std::vector<const RunRecord*>& of_one_group);

// The log that ompl_benchmark_statistics.py and Planner Arena read, of one scene, its presets as planners.
// `date` as in "2026-01-31 12:00:00".
std::string ompl_log(const RunRecords& of_one_scene, const std::string& date);

}  // namespace limber::detail
