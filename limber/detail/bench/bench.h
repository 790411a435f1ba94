// What a benchmark of many runs says: records, their quartiles, a table, OMPL's benchmark log. docs/bench.md.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "core/json.h"

namespace limber::detail {

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
