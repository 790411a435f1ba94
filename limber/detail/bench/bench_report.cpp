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

std::string within_key(double percent) { return fmt::format("within_{:g}_percent", percent); }

namespace {

auto key_of(const Json& record) {
  return std::tuple(record.at("scene").get<std::string>(), record.at("preset").get<std::string>(),
                    record.at("seed").get<std::uint64_t>());
}

Json json_of(const Quartiles& q) { return {q.first, q.median, q.third}; }

// Of the frames of all solved runs.
Json volumes_of(const std::vector<const Json*>& solved) {
  Json bodies = Json::object();
  for (const Json* run : solved)
    for (const auto& [name, body] : run->at("volume").items()) {
      Json& sum = bodies[name];
      if (sum.is_null()) {
        sum = {{"largest_percent", 0.0}, {"frames", 0}};
        for (const double limit : volume_limits_percent) sum[within_key(limit)] = 0;
      }
      sum["largest_percent"] =
          std::max(sum.at("largest_percent").get<double>(), body.at("largest_percent").get<double>());
      for (auto& [key, count] : sum.items())
        if (key != "largest_percent") count = count.get<std::int64_t>() + body.at(key).get<std::int64_t>();
    }
  return bodies;
}

Json report_of_group(const std::vector<const Json*>& runs) {
  std::vector<const Json*> solved;
  Json unsolved = Json::array();
  std::set<std::string> programs;
  for (const Json* run : runs) {
    programs.insert(run->at("identity").at("program").get<std::string>());
    if (run->at("solved").get<bool>())
      solved.push_back(run);
    else
      unsolved.push_back(run->at("seed"));
  }
  const auto spread = [](const std::vector<const Json*>& of, const char* key) {
    std::vector<double> values;
    for (const Json* run : of) values.push_back(run->at(key).get<double>());
    return values.empty() ? Json() : json_of(quartiles(values));
  };
  const auto largest = [&](const char* key) {
    double value = 0;
    for (const Json* run : solved) value = std::max(value, run->at(key).get<double>());
    return value;
  };
  const auto largest_share = [&](const char* key) { return 100 * largest(key); };
  // Of the runs' medians the median; null where nothing presses in any.
  std::vector<double> medians;
  double gap_worst = 0, min_stretch = 1;
  for (const Json* run : solved) {
    const Json& gap = run->at("gap_at_contact");
    if (gap.at("pairs_and_frames").get<int>() > 0)
      medians.push_back(100 * gap.at("median_of_robot_size").get<double>());
    gap_worst = std::max(gap_worst, 100 * gap.at("worst_of_robot_size").get<double>());
    min_stretch = std::min(min_stretch, run->at("least_stretch").get<double>());
  }
  const Json gap_median = medians.empty() ? Json() : Json(quartiles(medians).median);
  std::int64_t inverted = 0;
  for (const Json* run : solved) inverted += run->at("inverted_tets").get<std::int64_t>();
  RunRecords own;
  for (const Json* run : runs) own.push_back(*run);
  const Expected expected = expected_iterations(own);
  const auto or_null = [](double value) { return std::isfinite(value) ? Json(value) : Json(); };
  return {{"scene", runs.front()->at("scene")},
          {"preset", runs.front()->at("preset")},
          {"runs", runs.size()},
          {"solved", solved.size()},
          {"unsolved_seeds", unsolved},
          {"iterations", spread(runs, "iterations")},
          {"expected",
           {{"one_search", or_null(expected.one_search)},
            {"restart_after", or_null(expected.restart_after)},
            {"with_restarts", or_null(expected.with_restarts)},
            {"quickest_of_8", or_null(expected.quickest_of_8)}}},
          {"cpu_s", spread(runs, "cpu_s")},
          {"wall_s", spread(runs, "wall_s")},
          {"motion_s", spread(solved, "motion_s")},
          {"largest_penetration_percent", largest("deepest_penetration_percent")},
          {"largest_overlap_percent", largest_share("deepest_overlap_of_robot_size")},
          {"largest_self_overlap_percent", largest_share("deepest_self_overlap_of_robot_size")},
          {"median_gap_percent", gap_median},
          {"largest_gap_percent", gap_worst},
          {"least_stretch", min_stretch},
          {"largest_stretch", largest("largest_stretch")},
          {"inverted_tets", inverted},
          {"largest_force_n", largest("largest_force_n")},
          {"volume", volumes_of(solved)},
          {"programs", programs}};
}

}  // namespace

RunRecords read_records(const std::vector<fs::path>& folders) {
  std::map<std::tuple<std::string, std::string, std::uint64_t>, std::pair<Json, fs::path>> records;
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
      Json record = read_json(file);
      try {
        const auto key = key_of(record);
        const auto [at, fresh] = records.try_emplace(key, record, file);
        if (!fresh && at->second.first != record)
          throw InputError(fmt::format("{} and {}: are records of the same run and differ; merge one of them",
                                       at->second.second.string(), file.string()));
        report_of_group({&record});  // has all that the tables need
      } catch (const Json::exception& error) {
        throw InputError(fmt::format("{}: is not a record of limber bench ({}); remove it and run it again",
                                     file.string(), error.what()));
      }
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

Expected expected_iterations(const RunRecords& runs) {
  struct Run {
    double iterations;
    bool solved;
  };
  std::vector<Run> ordered;
  for (const Json& run : runs)
    ordered.push_back({run.at("iterations").get<double>(), run.at("solved").get<bool>()});
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
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  Expected expected{none, none, none, none};
  if (std::none_of(ordered.begin(), ordered.end(), [](const Run& run) { return run.solved; }))
    return expected;
  expected.one_search = with_limit(std::numeric_limits<double>::infinity());
  for (const Run& run : ordered)
    if (const double takes = with_limit(run.iterations); run.solved && !(takes >= expected.with_restarts))
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

Json report_of(const RunRecords& records) {
  std::map<std::pair<std::string, std::string>, std::vector<const Json*>> groups;
  for (const Json& record : records)
    groups[{record.at("scene").get<std::string>(), record.at("preset").get<std::string>()}].push_back(
        &record);
  Json list = Json::array();
  for (const auto& [key, runs] : groups) list.push_back(report_of_group(runs));
  return {{"groups", list}};
}

std::string ompl_log(const RunRecords& records, const std::string& date) {
  // Of ompl::base::PlannerStatus, version 1.5.
  enum Status { timeout = 4, exact_solution = 6 };
  std::map<std::string, std::vector<const Json*>> planners;
  double total_s = 0;
  for (const Json& record : records) {
    planners[record.at("preset").get<std::string>()].push_back(&record);
    total_s += record.at("wall_s").get<double>();
  }
  std::size_t max_runs = 0;
  for (const auto& [name, runs] : planners) max_runs = std::max(max_runs, runs.size());
  const Json& first = records.front();
  const Json& limit = first.at("identity").at("settings").at("time_limit_s");

  std::string text = fmt::format("limber version {}\n", version);
  text += fmt::format("Experiment {}\nRunning on {}\nStarting at {}\n", first.at("scene").get<std::string>(),
                      first.at("host").get<std::string>(), date);
  text += fmt::format("<<<|\nscene {} (hash {}), world {}; each run has a seed of its own\n|>>>\n",
                      first.at("scene").get<std::string>(),
                      first.at("identity").at("scene_hash").get<std::string>(),
                      first.at("identity").at("system_hash").get<std::string>());
  text += fmt::format("<<<|\n{} threads\n|>>>\n", first.at("threads").get<int>());
  text += fmt::format("{} is the random seed\n", first.at("seed").get<std::uint64_t>());
  text += fmt::format("{} seconds per run\n0 MB per run\n{} runs per planner\n",
                      limit.is_null() ? 1e9 : limit.get<double>(), max_runs);
  text += fmt::format("{} seconds spent to collect the data\n1 enum type\n", total_s);
  text +=
      "status|Unknown status|Invalid start|Invalid goal|Unrecognized goal type|Timeout|Approximate solution|"
      "Exact solution|Crash|Abort\n";
  text += fmt::format("{} planners\n", planners.size());
  for (const auto& [name, runs] : planners) {
    text += name + "\n";
    Json settings = runs.front()->at("identity").at("settings");
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
    for (const Json* run : runs) {
      const bool solved = run->at("solved").get<bool>();
      double volume = 0;
      for (const auto& [body, figures] : run->at("volume").items())
        volume = std::max(volume, figures.at("largest_percent").get<double>());
      text += fmt::format("{}; {}; {}; {}; {}; {}; {}; {}; {}; {}; {}; \n",
                          run->at("seed").get<std::uint64_t>(), solved ? int(exact_solution) : int(timeout),
                          int(solved), run->at("wall_s").get<double>(), run->at("cpu_s").get<double>(),
                          run->at("iterations").get<std::int64_t>(), run->at("nodes").get<std::int64_t>(),
                          run->at("distance_m").get<double>(),
                          solved ? fmt::format("{}", run->at("motion_s").get<double>()) : std::string(),
                          run->at("deepest_penetration_percent").get<double>(), volume);
    }
    text += ".\n";
  }
  return text;
}

}  // namespace limber::detail
