// What a benchmark of many runs says: records, their quartiles, a table, OMPL's benchmark log. docs/bench.md.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "core/json.h"

namespace limber::app {

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
std::string text_of_report(const Json& report);

// The log that ompl_benchmark_statistics.py and Planner Arena read, of one scene, its presets as planners.
// `date` as in "2026-01-31 12:00:00".
std::string ompl_log(const RunRecords& of_one_scene, const std::string& date);

}  // namespace limber::app
