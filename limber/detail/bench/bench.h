// Benchmarks of many runs, and what they say: records, their quartiles, a table, OMPL's benchmark log.
// docs/bench.md.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/json_fields.h"
#include "limber/bench.h"
#include "limber/detail/world/fem_system.h"
#include "plan/trajectory.h"
#include "scenes/scene.h"

namespace limber::detail {

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
  double min_stretch = 1, largest_stretch = 1, largest_force_n = 0;
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
    f("gap_at_contact", gap_at_contact), f("least_stretch", min_stretch);
    f("largest_stretch", largest_stretch), f("inverted_tets", inverted_tets);
    f("largest_force_n", largest_force_n), f("threads", threads), f("host", host);
    f("identity", identity);
  }
};
// Throws InputError naming the key that is missing or of another kind.
RunRecord run_record_of(Json, const std::string& file);

// Of a record of RunRecord's keys what a motion is and shows over all its frames, from motion_s to
// trajectory_hash, and which machine measured it.
Json record_of_motion(const fem::World&, const std::vector<PreparedBody>&, const FemSystem&,
                      const plan::Trajectory&);

// What all records of a scene's text have in common.
RunIdentity identity_of_run(const scenes::Scene&, const FemSystem&, const plan::Settings&);

// Whether the record is there, of the same run; throws InputError where it is of another.
bool is_done(const fs::path& record, const RunIdentity&);

// Ordered by scene, preset and seed, each of these once.
using RunRecords = std::vector<RunRecord>;

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

// For each scene two plots in SVG, the share of its runs that are solved over iterations and over CPU time,
// by names of files, as "windows.cpu_s.svg".
std::map<std::string, std::string> curves_of_bench(const RunRecords&);
// One page in HTML: the tables, and these curves.
std::string page_of_bench(const RunRecords&, const BenchReport&);

Expected expected_iterations(const std::vector<const RunRecord*>& of_one_group);

// The log that ompl_benchmark_statistics.py and Planner Arena read, of one scene, its presets as planners.
// `date` as in "2026-01-31 12:00:00".
std::string ompl_log(const RunRecords& of_one_scene, const std::string& date);

}  // namespace limber::detail
