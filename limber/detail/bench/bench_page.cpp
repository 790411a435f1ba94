#include <algorithm>
#include <map>
#include <set>

#include "core/version.h"
#include "limber/detail/bench/bench.h"
#include "limber/detail/report/page.h"
#include "render/plot.h"

namespace limber::detail {

namespace {

// Of the presets in their order, and again from the first.
const Vec3 colors[] = {{0.12, 0.40, 0.66}, {0.79, 0.33, 0.10}, {0.18, 0.52, 0.28}, {0.55, 0.24, 0.60},
                       {0.85, 0.65, 0.13}, {0.30, 0.70, 0.75}, {0.45, 0.30, 0.20}, {0.90, 0.45, 0.65},
                       {0.45, 0.45, 0.45}, {0.55, 0.75, 0.20}};

using Group = std::vector<const RunRecord*>;
using Figure = double (*)(const RunRecord&);

// The share of all runs that were solved with so much of a figure, in per cent: a stair of the solved ones'
// values.
render::Curve share_solved(const std::string& name, const Vec3& color, const Group& runs, Figure figure,
                           double from, double until) {
  std::vector<double> values;
  for (const RunRecord* run : runs)
    if (run->solved) values.push_back(std::max(figure(*run), from));
  std::sort(values.begin(), values.end());
  render::Curve curve{name, color, {from}, {0}};
  double share = 0;
  const auto add = [&](double x, double y) { curve.x.push_back(x), curve.y.push_back(y); };
  for (const double value : values) {
    add(value, share);
    share += 100 / double(runs.size());
    add(value, share);
  }
  add(until, share);
  return curve;
}

std::string plot_of(const std::map<std::string, Group>& presets, Figure figure, const char* words) {
  double from = 1e300, until = 0;  // by its logarithm: some runs take a hundred times as long as others
  for (const auto& [name, runs] : presets)
    for (const RunRecord* run : runs) {
      const double value = std::max(figure(*run), 1e-3);
      from = std::min(from, value), until = std::max(until, value);
    }
  std::vector<render::Curve> curves;
  for (const auto& [name, runs] : presets)
    curves.push_back(
        share_solved(name, colors[curves.size() % std::size(colors)], runs, figure, from, until));
  return render::plot_svg(curves, {.x_label = words,
                                   .y_label = "solved (%)",
                                   .width_px = 560,
                                   .height_px = 320,
                                   .limits = {100},
                                   .log_x = true,
                                   .y_from_to = std::pair(0.0, 100.0)});
}

std::string number(std::optional<double> value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "–";
}
std::string middle(const std::optional<Quartiles>& q, int digits) {
  return q ? fmt::format("{} ({} … {})", number((*q)[1], digits), number((*q)[0], digits),
                         number((*q)[2], digits))
           : "–";
}

}  // namespace

std::map<std::string, std::string> curves_of_bench(const RunRecords& records) {
  std::map<std::string, std::map<std::string, Group>> scenes;
  for (const RunRecord& record : records) scenes[record.scene][record.preset].push_back(&record);
  std::map<std::string, std::string> curves;
  for (const auto& [scene, presets] : scenes) {
    curves[scene + ".iterations.svg"] = plot_of(
        presets, [](const RunRecord& run) { return double(run.iterations); }, "iterations");
    curves[scene + ".cpu_s.svg"] = plot_of(
        presets, [](const RunRecord& run) { return run.cpu_s; }, "CPU s of the search");
  }
  return curves;
}

std::string page_of_bench(const RunRecords& records, const BenchReport& report) {
  std::set<std::string> scenes;
  for (const RunRecord& record : records) scenes.insert(record.scene);
  const std::map<std::string, std::string> curves = curves_of_bench(records);

  Page page;
  page.begin("limber bench", "limber bench",
             fmt::format("{} runs; medians, in brackets first and third quartile; of the solved runs the "
                         "motion, of all the search",
                         records.size()));
  std::vector<std::vector<std::string>> rows, estimates;
  for (const BenchGroup& g : report.groups) {
    rows.push_back({g.scene, g.preset, fmt::format("{} of {}", g.solved, g.runs), middle(g.iterations, 0),
                    middle(g.cpu_s, 2), middle(g.motion_s, 1),
                    number(g.solved ? std::optional(g.largest_overlap_percent) : std::nullopt, 2),
                    number(g.median_gap_percent, 2)});
    const Expected& e = g.expected;
    estimates.push_back({g.scene, g.preset, number(e.one_search, 0), number(e.restart_after, 0),
                         number(e.with_restarts, 0), number(e.quickest_of_8, 0)});
  }
  page.table({"scene", "preset", "solved", "iterations", "CPU s", "motion s", "overlap at most, %", "gap, %"},
             rows);
  page.add(
      "<h2>Restarts and portfolios</h2>\n<p class=\"note\">Iterations to a solution, as the runs have it: "
      "of one search after the other until one is solved; of searches given up after so many iterations "
      "(the best such number for these runs, in hindsight); and of the quickest of eight (limber plan "
      "--portfolio 8), each of which goes that far and up to twice as far.</p>\n");
  page.table({"scene", "preset", "one search", "given up after", "takes", "quickest of 8"}, estimates);
  for (const std::string& scene : scenes) {
    page.add("<h2>{}</h2>\n<div class=\"plots\">\n", escaped(scene));
    for (const char* figure : {".iterations.svg", ".cpu_s.svg"})
      page.add("<figure class=\"card\">{}</figure>\n", inlined(curves.at(scene + figure)));
    page.add("</div>\n");
  }
  page.add("<p class=\"note\">Made by limber {}.</p>\n</main>\n</body>\n</html>\n", version);
  return page.html();
}

}  // namespace limber::detail
