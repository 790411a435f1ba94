// Benchmarks of many runs, and what they say: records, their quartiles, a table, OMPL's benchmark log.
// docs/bench.md.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/json.h"

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
struct Benchmark {
  Json report;  // of all records, as report_of has it
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

// Of the frames of solved runs those within so many per cent of a body's volume are counted, under such a
// key.
inline constexpr double volume_limits_percent[] = {3, 5, 6, 10};
std::string within_key(double percent);

// Each is one run, as docs/bench.md describes it; ordered by scene, preset and seed, each of these once.
using RunRecords = std::vector<Json>;

// All runs/*.json of the folders. Throws InputError when a folder holds none, a record is damaged, or two
// folders have the same run with different results.
RunRecords read_records(const std::vector<fs::path>& folders);

struct Quartiles {
  double first = 0, median = 0, third = 0;
};
// By linear interpolation between the ordered values; at least one value.
Quartiles quartiles(std::vector<double> values);

// A group for each scene and preset. Iterations and times are of all its runs, an unsolved one with what it
// took; duration, volumes, penetration, inversions and forces are of the solved ones.
Json report_of(const RunRecords&);

// One page in HTML: the tables, and for each scene the share of its runs that are solved over iterations and
// over CPU time.
std::string page_of_bench(const RunRecords&, const Json& report);

// What searches would take on average that behave as these runs did, in iterations; an unsolved run is one
// that was given up after its own. NaN where none is solved.
struct Expected {
  double one_search = 0;     // and the next, until one is solved
  double restart_after = 0;  // the number after which to give one up, of those at which a run was solved, …
  double with_restarts = 0;  // … for which this is least
  double quickest_of_8 = 0;  // of 8 different runs the least; NaN with fewer runs, or fewer solved than would
                             // always have one among 8
};
Expected expected_iterations(const RunRecords& of_one_group);

// The log that ompl_benchmark_statistics.py and Planner Arena read, of one scene, its presets as planners.
// `date` as in "2026-01-31 12:00:00".
std::string ompl_log(const RunRecords& of_one_scene, const std::string& date);

}  // namespace limber::detail
