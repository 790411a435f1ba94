// What a plan's summary tells of itself.
//
// Figures that follow from the plan are worked out again and must be equal. Others cannot be made again
// without doing everything again (rounds of shortcuts, further searches, the searches of a portfolio that did
// not win): of those it is checked that they could be so, and that they end in what the path costs now. A key
// that limber does not write there is a fault as well: so nobody can hide a claim beside those that are
// checked. What the plan cost is no claim.
#include <set>

#include "core/error.h"
#include "limber/detail/verify/plan_checks.h"
#include "plan/shortcut.h"
#include "plan/timings.h"

namespace limber::detail {

// A key within a table is told as "table.key". Inside, "." stands for two values that are no tables and
// differ.
std::string first_difference(const Json& a, const Json& b) {
  if (a.is_object() && b.is_object()) {
    for (const auto& [key, value] : a.items()) {
      if (!b.contains(key)) return key;
      if (const std::string within = first_difference(value, b.at(key)); within == ".")
        return key;
      else if (!within.empty())
        return key + "." + within;
    }
    for (const auto& [key, value] : b.items())
      if (!a.contains(key)) return key;
    return "";
  }
  return a == b ? "" : ".";
}

namespace {

bool has_just(const Json& table, const std::set<std::string>& keys) {
  if (!table.is_object() || table.size() != keys.size()) return false;
  return std::all_of(keys.begin(), keys.end(), [&](const std::string& key) { return table.contains(key); });
}

// In the kind that the shortcuts were asked to make less of.
double cost_of(const Json& costs, const std::string& kind) {
  plan::Costs c;
  costs.at("duration_s").get_to(c.duration_s), costs.at("effort_n_s").get_to(c.effort_n_s);
  costs.at("strain_energy_j").get_to(c.strain_energy_j), costs.at("volume_change").get_to(c.volume_change);
  return plan::cost_in(c, plan::cost_kind_from(kind));
}

// Of a path in `tets`, that came after the search: whether what is told of it could be so, and ends with what
// the path costs now. "" or the table that does not. Costs must fall from one improvement to the next, and
// counts must not exceed those of which they are a part.
std::string wrong_of_later(const Json& summary, const plan::Plan& plan, const Json& costs_now,
                           std::int64_t tets) {
  bool told = false, now = false;
  if (summary.contains("shortcut")) {
    const Json& s = summary.at("shortcut");
    if (!has_just(s, {"rounds", "cost", "accepted", "before", "after"}) ||
        cost_of(s.at("after"), s.at("cost")) > cost_of(s.at("before"), s.at("cost")))
      return "shortcut";
    told = true, now = now || s.at("after") == costs_now;
  }
  if (summary.contains("improve")) {
    const Json& s = summary.at("improve");
    if (!has_just(s, {"cost", "first", "improvements", "searches", "solved", "iterations"})) return "improve";
    Json last = s.at("first");
    for (const Json& better : s.at("improvements")) {
      if (!has_just(better, {"iterations", "search", "costs"}) ||
          cost_of(better.at("costs"), s.at("cost")) >= cost_of(last, s.at("cost")) ||
          better.at("iterations") > s.at("iterations") || better.at("search") > s.at("searches"))
        return "improve.improvements";
      last = better.at("costs");
    }
    if (s.at("solved") > s.at("searches") || s.at("solved") < s.at("improvements").size())
      return "improve.solved";
    told = true, now = now || last == costs_now;
  }
  if (told && plan.solved() && !now) return summary.contains("improve") ? "improve" : "shortcut.after";
  if (!summary.contains("refine")) return "";
  const Json& s = summary.at("refine");
  std::set<std::string> keys{"how", "tracked_s", "largest_error_m", "iterations", "coarse_tets", "tets"};
  if (s.contains("replay_distance_m")) keys.insert("replay_distance_m");  // not told by older limbers
  if (!has_just(s, keys) || s.at("tets") != tets) return "refine";
  const std::string how = s.at("how");
  if (how == "replanned" || how == "failed") return "";
  if (how != "replayed" && how != "tracked") return "refine.how";
  // A chain of nodes, each an iteration of no search, before those that came later.
  plan::Statistics none;
  none.iterations = plan.statistics.iterations;
  if (plan::without_timings(plan::json_of(none)) != plan::without_timings(plan::json_of(plan.statistics)) ||
      s.at("iterations") != 0)
    return "refine";
  const std::vector<std::int64_t>& of = plan.tree.iterations;
  for (std::size_t n = 1; n < of.size(); ++n)
    if (of[n] != (std::int64_t(n) <= none.iterations ? std::int64_t(n) - 1 : -1)) return "refine";
  return "";
}

// That a portfolio tells of this plan, and of no search that would have won instead. The others are not done
// again. Seeds follow one another; the fewest iterations win, of equals the first.
bool is_quickest(const plan::Plan& plan, const Json& portfolio) try {
  const Json& searches = portfolio.at("searches");
  bool own = false;
  std::uint64_t seed = searches.at(0).at("seed").get<std::uint64_t>();
  std::int64_t sum = 0;
  for (const Json& search : searches) {
    const std::int64_t iterations = search.at("iterations").get<std::int64_t>();
    const bool solved = search.at("solved").get<bool>(), earlier = seed < plan.settings.seed;
    if (search.at("seed") != seed) return false;
    if (seed++ == plan.settings.seed) {
      own = solved == plan.solved() && iterations == plan.statistics.iterations;
    } else if (solved && (!plan.solved() || iterations < plan.statistics.iterations ||
                          (earlier && iterations == plan.statistics.iterations))) {
      return false;
    }
    sum += iterations;
  }
  return own && portfolio.at("iterations") == sum;
} catch (const Json::exception&) {
  return false;
}

}  // namespace

// Its outcome, its figures and what its summary tells, worked out anew.
void check_claims(const PlanFolder& planned, const fem::World& world, const FemSystem& system,
                  const plan::Settings& settings, const MotionFigures& figures, Promises& table) {
  const plan::Plan& plan = planned.plan;
  const plan::System& on_leg = system.on_leg(plan.leg());
  const State best = plan.tree.states[std::size_t(plan.best_node)];
  const double distance = (system.robot_center(best) - on_leg.goal_shift(best) -
                           plan::settings_of_leg(settings, plan.leg()).goal.center_of_mass_m)
                              .norm();
  std::string wrong;
  if (distance != plan.best_distance_m) wrong = "best_distance_m";
  if (plan.solved() != (plan.ending == plan::Ending::goal) ||
      (plan.ending == plan::Ending::iterations && plan.statistics.iterations < settings.max_iterations))
    wrong = "ending";
  const Json told = plan::without_timings(planned.summary);
  Json facts = plan::without_timings(facts_of(plan, world, system, figures));
  if (!told.contains("stiffness_shares")) facts.erase("stiffness_shares");  // plans of before
  for (const auto& [key, value] : facts.items())
    if (const std::string within = first_difference(value, told.value(key, Json())); !within.empty())
      wrong = "summary." + key + (within == "." ? "" : "." + within);
  for (const auto& [key, value] : told.items())
    if (!facts.contains(key) && key != "shortcut" && key != "improve" && key != "refine" &&
        key != "portfolio" && key != "from")
      wrong = "summary." + key;
  if (told.contains("portfolio") && !is_quickest(plan, told.at("portfolio"))) wrong = "summary.portfolio";
  std::vector<Control> controls = plan.trajectory.controls;
  if (plan.trajectory.settle_steps > 0) controls.pop_back();
  std::int64_t tets = 0;
  for (const fem::Body& body : world.bodies) tets += body.cage.tets.rows();
  const bool came_later = told.contains("shortcut") || told.contains("improve");
  const Json costs = came_later ? plan::json_of(plan::path_of(system, settings, controls).costs) : Json();
  try {
    const std::string later = wrong_of_later(told, plan, costs, tets);
    if (!later.empty()) wrong = "summary." + later;
  } catch (const Json::exception& error) {
    wrong = fmt::format("its summary ({})", error.what());
  } catch (const InputError& error) {
    wrong = fmt::format("its summary ({})", error.what());
  }
  table.row("what the plan tells of itself is so", wrong.empty(), wrong.empty() ? "" : wrong + " is not");
}

}  // namespace limber::detail
