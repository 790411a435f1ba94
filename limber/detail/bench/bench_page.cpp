#include <algorithm>
#include <map>

#include "core/version.h"
#include "limber/detail/bench/bench.h"
#include "limber/detail/report/page.h"
#include "render/plot.h"

namespace limber::detail {

namespace {

// Of the presets in their order, and again from the first.
const Vec3 colors[] = {{0.12, 0.40, 0.66}, {0.79, 0.33, 0.10}, {0.18, 0.52, 0.28}, {0.55, 0.24, 0.60}};

using Runs = std::vector<const Json*>;

// The share of all runs that were solved with so much of `key`, in per cent: a stair of the solved ones'
// values.
render::Curve share_solved(const std::string& name, const Vec3& color, const Runs& runs, const char* key,
                           double until) {
  std::vector<double> values;
  for (const Json* run : runs)
    if (run->at("solved").get<bool>()) values.push_back(run->at(key).get<double>());
  std::sort(values.begin(), values.end());
  render::Curve curve{name, color, {0}, {0}};
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

std::string plot_of(const std::map<std::string, Runs>& presets, const char* key, const char* words) {
  double until = 0;
  for (const auto& [name, runs] : presets)
    for (const Json* run : runs) until = std::max(until, run->at(key).get<double>());
  std::vector<render::Curve> curves;
  for (const auto& [name, runs] : presets)
    curves.push_back(share_solved(name, colors[curves.size() % std::size(colors)], runs, key, until));
  return render::plot_svg(
      curves,
      {.x_label = words, .y_label = "solved (%)", .width_px = 560, .height_px = 320, .limits = {100}});
}

std::string number(const Json& value, int digits) {
  return value.is_null() ? "–" : fmt::format("{:.{}f}", value.get<double>(), digits);
}
std::string middle(const Json& quartiles, int digits) {
  return quartiles.is_null() ? "–"
                             : fmt::format("{} ({} … {})", number(quartiles.at(1), digits),
                                           number(quartiles.at(0), digits), number(quartiles.at(2), digits));
}

}  // namespace

std::string page_of_bench(const RunRecords& records, const Json& report) {
  std::map<std::string, std::map<std::string, Runs>> scenes;
  for (const Json& record : records)
    scenes[record.at("scene").get<std::string>()][record.at("preset").get<std::string>()].push_back(&record);

  Page page;
  page.begin("limber bench", "limber bench",
             fmt::format("{} runs; medians, in brackets first and third quartile; of the solved runs the "
                         "motion, of all the search",
                         records.size()));
  std::vector<std::vector<std::string>> rows, estimates;
  for (const Json& g : report.at("groups")) {
    const std::string scene = g.at("scene"), preset = g.at("preset");
    rows.push_back({scene, preset,
                    fmt::format("{} of {}", g.at("solved").get<int>(), g.at("runs").get<int>()),
                    middle(g.at("iterations"), 0), middle(g.at("cpu_s"), 2), middle(g.at("motion_s"), 1),
                    number(g.at("largest_overlap_percent"), 2), number(g.at("median_gap_percent"), 2)});
    const Json& e = g.at("expected");
    estimates.push_back({scene, preset, number(e.at("one_search"), 0), number(e.at("restart_after"), 0),
                         number(e.at("with_restarts"), 0), number(e.at("quickest_of_8"), 0)});
  }
  page.table({"scene", "preset", "solved", "iterations", "CPU s", "motion s", "overlap at most, %", "gap, %"},
             rows);
  page.add(
      "<h2>Restarts and portfolios</h2>\n<p class=\"note\">Iterations to a solution, as the runs have it: "
      "of one search after the other until one is solved; of searches given up after so many iterations "
      "(the best such number for these runs, in hindsight); and of the quickest of eight (limber plan "
      "--portfolio 8), each of which goes that far and up to twice as far.</p>\n");
  page.table({"scene", "preset", "one search", "given up after", "takes", "quickest of 8"}, estimates);
  for (const auto& [scene, presets] : scenes) {
    page.add("<h2>{}</h2>\n<div class=\"plots\">\n", escaped(scene));
    for (const auto& [key, words] :
         {std::pair("iterations", "iterations"), std::pair("cpu_s", "CPU s of the search")})
      page.add("<figure class=\"card\">{}</figure>\n", inlined(plot_of(presets, key, words)));
    page.add("</div>\n");
  }
  page.add("<p class=\"note\">Made by limber {}.</p>\n</main>\n</body>\n</html>\n", version);
  return page.html();
}

}  // namespace limber::detail
