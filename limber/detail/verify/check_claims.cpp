// What a plan's summary tells of itself.
//
// Figures that follow from the plan are worked out again and must be equal. Others cannot be made again
// without doing everything again (rounds of shortcuts, further searches, the searches of a portfolio that did
// not win): of those it is checked that they could be so, and that they end in what the path costs now. A key
// that limber does not write there is a fault as well: so nobody can hide a claim beside those that are
// checked. What the plan cost is no claim.
#include <optional>

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

// Whether the table holds what was read from it, and nothing else.
template <class T>
bool holds_just(const Json& table, const T& told) {
  return first_difference(json_of_fields(told), table).empty();
}

// In the kind that the shortcuts were asked to make less of.
double cost_of(const CostsTold& told, const std::string& kind) {
  return plan::cost_in(told.costs, plan::cost_kind_from(kind));
}

bool same_costs(const CostsTold& a, const std::optional<plan::Costs>& b) {
  return b && json_of_fields(a) == json_of_fields(CostsTold{*b});
}

// "" or what of it could not be so: costs must fall from one improvement to the next, and counts must not
// exceed those of which they are a part.
std::string wrong_in(const ImproveTold& s) {
  CostsTold last = s.first;
  for (const ImproveTold::Improvement& better : s.improvements) {
    if (cost_of(better.costs, s.cost) >= cost_of(last, s.cost) || better.iterations > s.iterations ||
        better.search > s.searches)
      return "improve.improvements";
    last = better.costs;
  }
  return s.solved > s.searches || s.solved < std::ssize(s.improvements) ? "improve.solved" : "";
}

// A chain of nodes, each an iteration of no search, before those that came later.
bool is_carried_chain(const plan::Plan& plan, const RefineTold& told) {
  plan::Statistics none;
  none.iterations = plan.statistics.iterations;
  if (plan::without_timings(plan::json_of(none)) != plan::without_timings(plan::json_of(plan.statistics)) ||
      told.iterations != 0)
    return false;
  const std::vector<std::int64_t>& of = plan.tree.iterations;
  for (std::size_t n = 1; n < of.size(); ++n)
    if (of[n] != (std::int64_t(n) <= none.iterations ? std::int64_t(n) - 1 : -1)) return false;
  return true;
}

// Of a path in `tets`, that came after the search: whether what is told of it could be so, and ends with what
// the path costs now. "" or the table that does not.
std::string wrong_of_later(const Json& summary, const PlanTold& told, const plan::Plan& plan,
                           const std::optional<plan::Costs>& costs_now, std::int64_t tets) {
  bool now = false;
  if (const auto& s = told.shortcut) {
    if (!holds_just(summary["shortcut"], *s) || cost_of(s->after, s->cost) > cost_of(s->before, s->cost))
      return "shortcut";
    now = same_costs(s->after, costs_now);
  }
  if (const auto& s = told.improve) {
    if (!holds_just(summary["improve"], *s)) return "improve";
    if (const std::string wrong = wrong_in(*s); !wrong.empty()) return wrong;
    now = now || same_costs(s->improvements.empty() ? s->first : s->improvements.back().costs, costs_now);
  }
  if ((told.shortcut || told.improve) && plan.solved() && !now)
    return told.improve ? "improve" : "shortcut.after";
  if (!told.refine) return "";
  const RefineTold& s = *told.refine;
  if (!holds_just(summary["refine"], s) || s.tets != tets) return "refine";
  if (s.how == "replanned" || s.how == "failed") return "";
  if (s.how != "replayed" && s.how != "tracked") return "refine.how";
  return is_carried_chain(plan, s) ? "" : "refine";
}

// That a portfolio tells of this plan, and of no search that would have won instead. The others are not done
// again. Seeds follow one another; the fewest iterations win, of equals the first.
bool is_quickest(const plan::Plan& plan, const PortfolioTold& portfolio) {
  bool own = false;
  if (portfolio.searches.empty()) return false;
  std::uint64_t seed = portfolio.searches[0].seed;
  std::int64_t sum = 0;
  for (const PortfolioTold::Search& search : portfolio.searches) {
    const bool earlier = seed < plan.settings.seed;
    if (search.seed != seed) return false;
    if (seed++ == plan.settings.seed) {
      own = search.solved == plan.solved() && search.iterations == plan.statistics.iterations;
    } else if (search.solved && (!plan.solved() || search.iterations < plan.statistics.iterations ||
                                 (earlier && search.iterations == plan.statistics.iterations))) {
      return false;
    }
    sum += search.iterations;
  }
  return own && portfolio.iterations == sum;
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
  if (planned.told.portfolio && !is_quickest(plan, *planned.told.portfolio)) wrong = "summary.portfolio";
  std::vector<Control> controls = plan.trajectory.controls;
  if (plan.trajectory.settle_steps > 0) controls.pop_back();
  std::int64_t tets = 0;
  for (const fem::Body& body : world.bodies) tets += body.cage.tets.rows();
  std::optional<plan::Costs> costs;
  if (planned.told.shortcut || planned.told.improve) costs = plan::path_of(system, settings, controls).costs;
  try {
    const std::string later = wrong_of_later(told, planned.told, plan, costs, tets);
    if (!later.empty()) wrong = "summary." + later;
  } catch (const InputError& error) {
    wrong = fmt::format("its summary ({})", error.what());
  }
  if (!planned.told.wrong.empty()) wrong = fmt::format("its summary ({})", planned.told.wrong);
  table.row("what the plan tells of itself is so", wrong.empty(), wrong.empty() ? "" : wrong + " is not");
}

}  // namespace limber::detail
