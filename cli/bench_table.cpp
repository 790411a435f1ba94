#include "cli/bench_table.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "limber/detail/bench/bench.h"

namespace limber::cli {

namespace {

// Columns as wide as their widest cell, the first `left` ones flush left.
std::string table(const std::vector<std::vector<std::string>>& rows, std::size_t left) {
  const auto width_of = [](const std::string& s) {
    return std::size_t(std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xc0) != 0x80; }));
  };
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], width_of(row[c]));
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string pad(widths[c] - width_of(row[c]), ' ');
      line += (c ? "  " : "") + (c < left ? row[c] + pad : pad + row[c]);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string text_of_quartiles(const Json& q, const char* format) {
  if (q.is_null()) return "-";
  const auto one = [&](int i) {
    const double value = q.at(std::size_t(i)).get<double>();
    return fmt::format(fmt::runtime(format), value);
  };
  return fmt::format("{} {} {}", one(0), one(1), one(2));
}

}  // namespace

std::string text_of_benchmark(const Json& report) {
  std::vector<std::vector<std::string>> runs{{"scene", "preset", "solved", "iterations", "CPU s", "wall s",
                                              "motion s", "penetration %", "overlap %", "in itself %",
                                              "gap %", "stretch", "inverted", "force N"}},
      volumes{{"scene", "preset", "body", "change at most %"}};
  for (const double limit : detail::volume_limits_percent)
    volumes[0].push_back(fmt::format("≤ {:g} %", limit));
  std::string notes;
  for (const Json& g : report.at("groups")) {
    const std::string scene = g.at("scene"), preset = g.at("preset");
    runs.push_back({scene, preset, fmt::format("{}/{}", g.at("solved").get<int>(), g.at("runs").get<int>()),
                    text_of_quartiles(g.at("iterations"), "{:.0f}"),
                    text_of_quartiles(g.at("cpu_s"), "{:.2f}"), text_of_quartiles(g.at("wall_s"), "{:.2f}"),
                    text_of_quartiles(g.at("motion_s"), "{:.1f}"),
                    fmt::format("{:.2f}", g.at("largest_penetration_percent").get<double>()),
                    fmt::format("{:.2f}", g.at("largest_overlap_percent").get<double>()),
                    fmt::format("{:.2f}", g.at("largest_self_overlap_percent").get<double>()),
                    g.at("median_gap_percent").is_null()
                        ? std::string("-")
                        : fmt::format("{:.2f} {:.2f}", g.at("median_gap_percent").get<double>(),
                                      g.at("largest_gap_percent").get<double>()),
                    fmt::format("{:.2f} {:.2f}", g.at("least_stretch").get<double>(),
                                g.at("largest_stretch").get<double>()),
                    fmt::format("{}", g.at("inverted_tets").get<std::int64_t>()),
                    fmt::format("{:.1f}", g.at("largest_force_n").get<double>())});
    for (const auto& [name, body] : g.at("volume").items()) {
      volumes.push_back(
          {scene, preset, name, fmt::format("{:.2f}", body.at("largest_percent").get<double>())});
      for (const double limit : detail::volume_limits_percent)
        volumes.back().push_back(fmt::format(
            "{:.2f}",
            100 * body.at(detail::within_key(limit)).get<double>() / body.at("frames").get<double>()));
    }
    if (!g.at("unsolved_seeds").empty())
      notes += fmt::format("{}, {}: not solved with seeds {}\n", scene, preset,
                           fmt::join(g.at("unsolved_seeds").get<std::vector<std::uint64_t>>(), ", "));
    if (g.at("programs").size() > 1)
      notes +=
          fmt::format("{}, {}: the runs are of {} different builds of limber; their times do not compare\n",
                      scene, preset, g.at("programs").size());
  }
  std::string text = table(runs, 2);
  text +=
      "(quartiles: first, median, third; unsolved runs count with what they took; overlap, gap (median, "
      "worst) and stretch: docs/seen.md)\n";
  if (volumes.size() > 1)
    text += "\n" + table(volumes, 3) + "(share of the frames of all solved paths, in per cent)\n";
  return text + notes;
}

}  // namespace limber::cli
