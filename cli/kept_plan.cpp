#include "cli/kept_plan.h"

#include <fmt/format.h>

namespace limber::cli {

namespace {

// Each of what the summary tells of it.

std::string text_of_portfolio(const Json& report, const Json& summary) {
  const Json& searches = report.at("searches");
  return fmt::format(
      "  portfolio    seeds {} to {}, {} iterations in all, {:.2f} CPU s, {:.2f} s; {} seed {}\n",
      searches.front().at("seed").get<std::uint64_t>(), searches.back().at("seed").get<std::uint64_t>(),
      report.at("iterations").get<std::int64_t>(), report.at("cpu_s").get<double>(),
      report.at("wall_s").get<double>(),
      summary.at("solved").get<bool>() ? "the quickest is" : "none solves it, the nearest is",
      summary.at("seed").get<std::uint64_t>());
}

std::string text_of_shortcut(const Json& report) {
  const auto before_and_after = [&](const char* cost, double factor = 1) {
    return fmt::format("{:.3g} → {:.3g}", factor * report.at("before").at(cost).get<double>(),
                       factor * report.at("after").at(cost).get<double>());
  };
  return fmt::format(
      "  shortcut     {} changes accepted in {} rounds, {:.2f} CPU s: {} s, effort {} N s, elastic energy "
      "{} J, volume change {} %\n",
      report.at("accepted").get<int>(), report.at("rounds").get<int>(), report.at("cpu_s").get<double>(),
      before_and_after("duration_s"), before_and_after("effort_n_s"), before_and_after("strain_energy_j"),
      before_and_after("volume_change", 100));
}

std::string text_of_improve(const Json& report) {
  const std::string cost = report.at("cost").get<std::string>();
  const char* const key = cost == "duration" ? "duration_s"
                          : cost == "effort" ? "effort_n_s"
                          : cost == "strain" ? "strain_energy_j"
                                             : "volume_change";
  std::string text = fmt::format(
      "  improve      {} searches, {} of them reached the goal, {} iterations in all; {:.2f} CPU s, {:.2f} "
      "s\n",
      report.at("searches").get<std::int64_t>(), report.at("solved").get<std::int64_t>(),
      report.at("iterations").get<std::int64_t>(), report.at("cpu_s").get<double>(),
      report.at("wall_s").get<double>());
  for (const Json& i : report.at("improvements"))
    text += fmt::format("               {} {:.4g} after {:.2f} s and {} iterations\n", cost,
                        i.at("costs").at(key).get<double>(), i.at("wall_s").get<double>(),
                        i.at("iterations").get<std::int64_t>());
  return text;
}

std::string text_of_refine(const Json& report) {
  const auto number = [&](const char* key) { return report.at(key).get<double>(); };
  return fmt::format(
      "  refine       {}; replayed for {:.2f} s to {:.3f} m from the goal ({}), at most {:.3f} m off; "
      "followed "
      "for {:.2f} s, at most {:.3f} m off; {} iterations; CPU s: replay {:.2f}, following {:.2f}, search "
      "{:.2f}\n",
      report.at("how").get<std::string>(), number("replay_s"), number("replay_distance_m"),
      report.at("replay_ends").get<std::string>(), number("replay_largest_error_m"), number("tracked_s"),
      number("largest_error_m"), report.at("iterations").get<std::int64_t>(), number("replay_cpu_s"),
      number("track_cpu_s"), number("search_cpu_s"));
}

std::string text_of_done(const std::string& what, const Json& summary) {
  const Json& report = summary.at(what);
  return what == "portfolio"  ? text_of_portfolio(report, summary)
         : what == "shortcut" ? text_of_shortcut(report)
         : what == "improve"  ? text_of_improve(report)
                              : text_of_refine(report);
}

std::string text_of_legs(const Json& legs) {
  std::string text;
  for (const Json& leg : legs)
    text += fmt::format("{}{} {} after {} iterations", text.empty() ? "  legs         " : ", ",
                        leg.at("goal").get<std::string>(),
                        leg.at("reached").get<bool>() ? "reached" : "not reached",
                        leg.at("iterations").get<std::int64_t>());
  return text + "\n";
}

std::string text_of_parting(const Json& s) {
  std::string text;
  const Json& parted = s.at("parted");
  const auto mm = [](const Json& m) { return 1e3 * m.get<double>(); };
  for (const Json& pair : parted.at("pairs"))
    text += fmt::format(
        "  start        {} and {} overlapped by {:.3g} mm: parted by {:.3g} and {:.3g} mm, {:.2g} mm apart "
        "now\n",
        pair.at("bodies").at(0).get<std::string>(), pair.at("bodies").at(1).get<std::string>(),
        mm(pair.at("depth_m")), mm(pair.at("moved_m").at(0)), mm(pair.at("moved_m").at(1)),
        mm(pair.at("gap_m")));
  return text +
         fmt::format(
             "               in {} steps{}; no node was moved by more than {:.2f} % of the robot's size\n",
             parted.at("steps").get<int>(),
             s.contains("dynamics") && s.at("dynamics").contains("parting_cpu_s")
                 ? fmt::format(", {:.2f} CPU s", s.at("dynamics").at("parting_cpu_s").get<double>())
                 : "",
             100 * parted.at("largest_move_of_robot_size").get<double>());
}

// Of the motion: what a plan and a simulation tell alike.
std::string text_of_motion(const Json& s) {
  std::string volumes;
  for (const auto& [name, percent] : s.at("largest_volume_change_percent").items())
    volumes += fmt::format("{}{} {:.2f} %", volumes.empty() ? "" : ", ", name, percent.get<double>());
  const int substeps = s.value("substeps", 1);  // plans of before had one
  return fmt::format(
      "  motion       {:.2f} s in {} frames, time step {:.3g} ms{}\n"
      "  volume       changes at most: {}\n"
      "  cages        in one another by at most {:.4f} m, {:.2f} % of the robot's size ({}); they are larger "
      "than "
      "what is seen\n"
      "  surfaces     overlap at most {:.2f} % ({}), in themselves {:.2f} % ({}), gap where they press "
      "{:.2f} % "
      "in the median\n"
      "  strain       at most {:.3f} ({})\n"
      "  contact      at most {:.1f} N ({})\n",
      s.at("motion_s").get<double>(), s.at("frames").get<int>(), 1e3 * s.at("dt_s").get<double>(),
      substeps > 1 ? fmt::format(" in {} substeps", substeps) : "", volumes,
      s.at("deepest_penetration_m").get<double>(),
      100 * s.at("deepest_penetration_of_robot_size").get<double>(),
      s.at("penetration_between").get<std::string>(),
      100 * s.at("deepest_overlap_of_robot_size").get<double>(), s.at("overlap_between").get<std::string>(),
      100 * s.at("deepest_self_overlap_of_robot_size").get<double>(),
      s.at("self_overlap_of").get<std::string>(),
      100 * s.at("gap_at_contact").at("median_of_robot_size").get<double>(),
      s.at("largest_strain").get<double>(), s.at("largest_strain_of").get<std::string>(),
      s.at("largest_contact_force_n").get<double>(), s.at("contact_between").get<std::string>());
}

std::string text_of_simulation(const Json& s, const std::string& extra, const fs::path& file) {
  return fmt::format("{}\n{}{}{}  hashes       trajectory {}\n  file         {}\n",
                     s.at("explanation").get<std::string>(), s.contains("parted") ? text_of_parting(s) : "",
                     text_of_motion(s), extra, s.at("trajectory_hash").get<std::string>(), file.string());
}

std::string text_of_search(const Json& s, const std::string& extra, const fs::path& file) {
  const Json &t = s.at("statistics"), d = s.value("dynamics", Json::object());
  // Not known where the folder came without timings.json.
  const std::string seconds =
      t.contains("wall_s") && t.contains("cpu_s")
          ? fmt::format("; {:.2f} CPU s, {:.2f} s", t.at("cpu_s").get<double>(), t.at("wall_s").get<double>())
          : "";
  const std::string dynamics =
      d.contains("contact_of_force_step")
          ? fmt::format(
                "  dynamics     contact {:.2f} × the force step; a lane takes {:.1f} µs to load, {:.1f} "
                "µs to store\n",
                d.at("contact_of_force_step").get<double>(), d.value("load_us", 0.0),
                d.value("store_us", 0.0))
          : "";
  return fmt::format(
      "{}\n"
      "{}{}"
      "  search       {} iterations, {} nodes{}, {} diverged, {} rejected, {} ways refused{}\n"
      "  memory       {:.1f} kB a node, {:.1f} where nothing is shared with the parent\n"
      "{}{}{}"
      "  hashes       tree {}, trajectory {}\n"
      "  file         {}\n",
      s.at("explanation").get<std::string>(), s.contains("parted") ? text_of_parting(s) : "",
      s.contains("legs") ? text_of_legs(s.at("legs")) : "", t.at("iterations").get<std::int64_t>(),
      s.at("nodes").get<int>(),
      s.contains("nodes_kept") ? fmt::format(" (kept: the {} of the path)", s.at("nodes_kept").get<int>())
                               : "",
      t.at("diverged").get<std::int64_t>(), t.at("rejected").get<std::int64_t>(),
      t.at("refused").get<std::int64_t>(), seconds, 1e-3 * s.at("node_bytes").get<double>(),
      1e-3 * s.at("node_bytes_unshared").get<double>(), dynamics, text_of_motion(s), extra,
      s.at("tree_hash").get<std::string>(), s.at("trajectory_hash").get<std::string>(), file.string());
}

}  // namespace

std::string text_of_beginning(const Json& summary, const fs::path& from) {
  if (from.empty()) return "";
  return fmt::format("  from         frame {} of {}\n", summary.at("from").at("frame").get<int>(),
                     from.string());
}

Outcome outcome_of(const KeptPlan& kept, const std::function<std::string(const Json&)>& more) {
  const Json summary = parse_json(kept.summary_json, kept.file.string());
  Outcome outcome{kept.reached ? exit_done : exit_no_plan, summary, ""};
  if (!kept.measured) return outcome;
  std::string lines = more ? more(summary) : "";
  for (const std::string& what : kept.also_done) lines += text_of_done(what, summary);
  outcome.text = kept.is_simulation ? text_of_simulation(summary, lines, kept.file)
                                    : text_of_search(summary, lines, kept.file);
  return outcome;
}

}  // namespace limber::cli
