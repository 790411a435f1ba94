#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/error.h"
#include "core/json_text.h"
#include "core/version.h"
#include "limber/detail/bench/bench.h"

namespace limber::detail {

namespace {

// Names become those of files, and figures are counted and drawn.
void require_sane(const RunRecord& record, const std::string& file) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(
        fmt::format("{}: {}; no run of limber bench is so: remove it and run it again", file, what));
  };
  const auto require_name = [&](const char* key, const std::string& name, std::string_view also) {
    const bool good =
        !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [&](char c) {
          return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
                 c == '-' || also.find(c) != also.npos;
        });
    if (!good) refuse(fmt::format("{} is {}", key, text_of(Json(name))));
  };
  require_name("scene", record.scene, ""), require_name("preset", record.preset, " ,");
  constexpr double most = 1e12;
  for (const auto& [key, value] : {std::pair("iterations", double(record.iterations)),
                                   {"nodes", double(record.nodes)},
                                   {"cpu_s", record.cpu_s},
                                   {"wall_s", record.wall_s},
                                   {"motion_s", record.motion_s},
                                   {"distance_m", record.distance_m}})
    if (!(0 <= value && value <= most)) refuse(fmt::format("{} is {:g}", key, value));
  for (const auto& [body, figures] : record.volume)
    for (const std::int64_t within : figures.within)
      if (within < 0 || within > figures.frames)
        refuse(fmt::format("of {}'s {} frames {} are within a limit", body, figures.frames, within));
}

}  // namespace

RunRecord run_record_of(Json json, const std::string& file) {
  RunRecord record =
      read_fields<RunRecord>(json, file, "it is no record of limber bench: remove it and run it again");
  require_sane(record, file);
  record.json = std::move(json);
  return record;
}

namespace {

using Runs = std::vector<const RunRecord*>;

auto key_of(const RunRecord& record) { return std::tuple(record.scene, record.preset, record.seed); }

// Of the frames of all solved runs.
InOrder<VolumeFigures> volumes_of(const Runs& solved) {
  InOrder<VolumeFigures> bodies;
  for (const RunRecord* run : solved)
    for (const auto& [name, body] : run->volume) {
      auto sum = std::find_if(bodies.begin(), bodies.end(), [&](const auto& b) { return b.first == name; });
      if (sum == bodies.end()) sum = bodies.insert(sum, {name, {}});
      VolumeFigures& of = sum->second;
      of.largest_percent = std::max(of.largest_percent, body.largest_percent);
      of.frames += body.frames;
      for (std::size_t i = 0; i < of.within.size(); ++i) of.within[i] += body.within[i];
    }
  return bodies;
}

template <class Number>
std::optional<Quartiles> spread(const Runs& runs, Number RunRecord::*figure) {
  std::vector<double> values;
  for (const RunRecord* run : runs) values.push_back(double(run->*figure));
  return values.empty() ? std::nullopt : std::optional(quartiles(values));
}

double largest(const Runs& runs, double RunRecord::*figure) {
  double value = 0;
  for (const RunRecord* run : runs) value = std::max(value, run->*figure);
  return value;
}

BenchGroup report_of_group(const Runs& runs) {
  BenchGroup group{.scene = runs.front()->scene,
                   .preset = runs.front()->preset,
                   .runs = std::ssize(runs),
                   .unsolved_seeds = {},
                   .expected = expected_iterations(runs),
                   .motion_s = {},
                   .median_gap_percent = {},
                   .volume = {},
                   .programs = {}};
  Runs solved;
  std::set<std::string> programs;
  for (const RunRecord* run : runs) {
    programs.insert(run->identity.program);
    if (run->solved)
      solved.push_back(run);
    else
      group.unsolved_seeds.push_back(run->seed);
  }
  group.solved = std::ssize(solved);
  group.iterations = *spread(runs, &RunRecord::iterations);
  group.cpu_s = *spread(runs, &RunRecord::cpu_s), group.wall_s = *spread(runs, &RunRecord::wall_s);
  group.motion_s = spread(solved, &RunRecord::motion_s);
  group.largest_penetration_percent = largest(solved, &RunRecord::deepest_penetration_percent);
  group.largest_overlap_percent = 100 * largest(solved, &RunRecord::deepest_overlap_of_robot_size);
  group.largest_self_overlap_percent = 100 * largest(solved, &RunRecord::deepest_self_overlap_of_robot_size);
  std::vector<double> medians;
  for (const RunRecord* run : solved) {
    const RunRecord::Gap& gap = run->gap_at_contact;
    if (gap.pairs_and_frames > 0) medians.push_back(100 * gap.median_of_robot_size.value_or(0));
    group.largest_gap_percent = std::max(group.largest_gap_percent, 100 * gap.worst_of_robot_size);
    group.min_stretch = std::min(group.min_stretch, run->min_stretch);
    group.inverted_tets += run->inverted_tets;
  }
  if (!medians.empty()) group.median_gap_percent = quartiles(medians)[1];
  group.largest_stretch = largest(solved, &RunRecord::largest_stretch);
  group.largest_force_n = largest(solved, &RunRecord::largest_force_n);
  group.volume = volumes_of(solved);
  group.programs.assign(programs.begin(), programs.end());
  return group;
}

}  // namespace

RunRecords read_records(const std::vector<fs::path>& folders) {
  std::map<std::tuple<std::string, std::string, std::uint64_t>, std::pair<RunRecord, fs::path>> records;
  for (const fs::path& folder : folders) {
    std::vector<fs::path> files;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder / "runs", none))
      if (entry.path().extension() == ".json" && entry.path().filename().string()[0] != '.')
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    if (files.empty())
      throw InputError(
          fmt::format("{}: holds no record of a run (runs/*.json); name a folder that limber "
                      "bench -o has written",
                      folder.string()));
    for (const fs::path& file : files) {
      RunRecord record = run_record_of(read_json(file), file.string());
      const auto key = key_of(record);
      const auto [at, fresh] = records.try_emplace(key, record, file);
      if (!fresh && at->second.first.json != record.json)
        throw InputError(fmt::format("{} and {}: are records of the same run and differ; merge one of them",
                                     at->second.second.string(), file.string()));
    }
  }
  RunRecords all;
  for (auto& [key, record] : records) all.push_back(std::move(record.first));
  return all;
}

Quartiles quartiles(std::vector<double> values) {
  LIMBER_CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    const double place = share * double(values.size() - 1);
    const std::size_t below = std::size_t(place), above = std::min(below + 1, values.size() - 1);
    return values[below] + (place - double(below)) * (values[above] - values[below]);
  };
  return {at(0.25), at(0.5), at(0.75)};
}

Expected expected_iterations(const std::vector<const RunRecord*>& runs) {
  struct Run {
    double iterations;
    bool solved;
  };
  std::vector<Run> ordered;
  for (const RunRecord* run : runs) ordered.push_back({double(run->iterations), run->solved});
  std::sort(ordered.begin(), ordered.end(),
            [](const Run& a, const Run& b) { return a.iterations < b.iterations; });
  const auto with_limit = [&](double limit) {
    double sum = 0, solved = 0;
    for (const Run& run : ordered) {
      sum += std::min(run.iterations, limit);
      solved += run.solved && run.iterations <= limit ? 1 : 0;
    }
    return sum / solved;
  };
  Expected expected;
  if (std::none_of(ordered.begin(), ordered.end(), [](const Run& run) { return run.solved; }))
    return expected;
  expected.one_search = with_limit(std::numeric_limits<double>::infinity());
  for (const Run& run : ordered)
    if (const double takes = with_limit(run.iterations);
        run.solved && !(expected.with_restarts && takes >= *expected.with_restarts))
      expected.restart_after = run.iterations, expected.with_restarts = takes;

  // That the k-th of n is the least of 8 has the probability C(n − 1 − k, 7) / C(n, 8).
  std::vector<double> solved;
  for (const Run& run : ordered)
    if (run.solved) solved.push_back(run.iterations);
  const double n = double(ordered.size());
  if (n < 8 || n - double(solved.size()) >= 8) return expected;
  double sum = 0, before_none = 1;  // the probability that none of the k first is among the 8
  for (std::size_t k = 0; k < solved.size(); ++k) {
    const double here = before_none * std::min(1.0, 8 / (n - double(k)));
    sum += here * solved[k];
    before_none -= here;
  }
  expected.quickest_of_8 = sum;
  return expected;
}

BenchReport report_of(const RunRecords& records) {
  std::map<std::pair<std::string, std::string>, Runs> groups;
  for (const RunRecord& record : records) groups[{record.scene, record.preset}].push_back(&record);
  BenchReport report;
  for (const auto& [key, runs] : groups) report.groups.push_back(report_of_group(runs));
  return report;
}

namespace {

struct LimitTold {
  std::optional<double> time_limit_s;
  template <class Fields>
  void fields(Fields& f) {
    f("time_limit_s", time_limit_s);
  }
};

}  // namespace

std::string ompl_log(const RunRecords& records, const std::string& date) {
  // Of ompl::base::PlannerStatus, version 1.5.
  enum Status { timeout = 4, exact_solution = 6 };
  std::map<std::string, Runs> planners;
  double total_s = 0;
  for (const RunRecord& record : records) {
    planners[record.preset].push_back(&record);
    total_s += record.wall_s;
  }
  std::size_t max_runs = 0;
  for (const auto& [name, runs] : planners) max_runs = std::max(max_runs, runs.size());
  const RunRecord& first = records.front();
  const auto limit = fields_or_nothing<LimitTold>(first.identity.settings).value_or(LimitTold{});

  std::string text = fmt::format("limber version {}\n", version);
  text += fmt::format("Experiment {}\nRunning on {}\nStarting at {}\n", first.scene, first.host, date);
  text += fmt::format("<<<|\nscene {} (hash {}), world {}; each run has a seed of its own\n|>>>\n",
                      first.scene, first.identity.scene_hash, first.identity.system_hash);
  text += fmt::format("<<<|\n{} threads\n|>>>\n", first.threads);
  text += fmt::format("{} is the random seed\n", first.seed);
  text += fmt::format("{} seconds per run\n0 MB per run\n{} runs per planner\n",
                      limit.time_limit_s.value_or(1e9), max_runs);
  text += fmt::format("{} seconds spent to collect the data\n1 enum type\n", total_s);
  text +=
      "status|Unknown status|Invalid start|Invalid goal|Unrecognized goal type|Timeout|Approximate solution|"
      "Exact solution|Crash|Abort\n";
  text += fmt::format("{} planners\n", planners.size());
  for (const auto& [name, runs] : planners) {
    text += name + "\n";
    Json settings = runs.front()->identity.settings;
    settings.erase("seed");  // differs from run to run
    settings = settings.flatten();
    text += fmt::format("{} common properties\n", settings.size());
    for (const auto& [key, value] : settings.items()) {
      std::string words = key.substr(1);
      std::replace(words.begin(), words.end(), '/', '.');
      text += fmt::format("{} = {}\n", words, text_of(value));
    }
    static constexpr const char* properties[] = {"seed INTEGER",
                                                 "status ENUM",
                                                 "solved BOOLEAN",
                                                 "time REAL",
                                                 "cpu time REAL",
                                                 "iterations INTEGER",
                                                 "graph states INTEGER",
                                                 "solution difference REAL",
                                                 "solution length REAL",
                                                 "penetration percent REAL",
                                                 "volume change percent REAL"};
    text += fmt::format("{} properties for each run\n", std::size(properties));
    for (const char* property : properties) text += fmt::format("{}\n", property);
    text += fmt::format("{} runs\n", runs.size());
    for (const RunRecord* run : runs) {
      double volume = 0;
      for (const auto& [body, figures] : run->volume) volume = std::max(volume, figures.largest_percent);
      text += fmt::format("{}; {}; {}; {}; {}; {}; {}; {}; {}; {}; {}; \n", run->seed,
                          run->solved ? int(exact_solution) : int(timeout), int(run->solved), run->wall_s,
                          run->cpu_s, run->iterations, run->nodes, run->distance_m,
                          run->solved ? fmt::format("{}", run->motion_s) : std::string(),
                          run->deepest_penetration_percent, volume);
    }
    text += ".\n";
  }
  return text;
}

}  // namespace limber::detail
