#include "cli/bench_table.h"

#include <fmt/ranges.h>

#include <algorithm>

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

std::string text_of_quartiles(const std::optional<Quartiles>& q, int digits) {
  if (!q) return "-";
  return fmt::format("{:.{}f} {:.{}f} {:.{}f}", (*q)[0], digits, (*q)[1], digits, (*q)[2], digits);
}

}  // namespace

std::string text_of_benchmark(const BenchReport& report) {
  std::vector<std::vector<std::string>> runs{{"scene", "preset", "solved", "iterations", "CPU s", "wall s",
                                              "motion s", "penetration %", "overlap %", "in itself %",
                                              "gap %", "stretch", "inverted", "force N"}},
      volumes{{"scene", "preset", "body", "change at most %"}};
  for (const int limit : volume_limits_percent) volumes[0].push_back(fmt::format("≤ {} %", limit));
  std::string notes;
  for (const BenchGroup& g : report.groups) {
    const auto of_solved = [&](const char* format, double value) {
      return g.solved ? fmt::format(fmt::runtime(format), value) : "-";
    };
    runs.push_back(
        {g.scene, g.preset, fmt::format("{}/{}", g.solved, g.runs), text_of_quartiles(g.iterations, 0),
         text_of_quartiles(g.cpu_s, 2), text_of_quartiles(g.wall_s, 2), text_of_quartiles(g.motion_s, 1),
         of_solved("{:.2f}", g.largest_penetration_percent), of_solved("{:.2f}", g.largest_overlap_percent),
         of_solved("{:.2f}", g.largest_self_overlap_percent),
         g.median_gap_percent ? fmt::format("{:.2f} {:.2f}", *g.median_gap_percent, g.largest_gap_percent)
                              : "-",
         g.solved ? fmt::format("{:.2f} {:.2f}", g.min_stretch, g.largest_stretch) : "-",
         of_solved("{:.0f}", double(g.inverted_tets)), of_solved("{:.1f}", g.largest_force_n)});
    for (const auto& [name, body] : g.volume) {
      volumes.push_back({g.scene, g.preset, name, fmt::format("{:.2f}", body.largest_percent)});
      for (const std::int64_t within : body.within)
        volumes.back().push_back(fmt::format("{:.2f}", 100 * double(within) / double(body.frames)));
    }
    if (!g.unsolved_seeds.empty())
      notes += fmt::format("{}, {}: not solved with seed{} {}\n", g.scene, g.preset,
                           g.unsolved_seeds.size() == 1 ? "" : "s", fmt::join(g.unsolved_seeds, ", "));
    if (g.programs.size() > 1)
      notes +=
          fmt::format("{}, {}: the runs are of {} different builds of limber; their times do not compare\n",
                      g.scene, g.preset, g.programs.size());
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
