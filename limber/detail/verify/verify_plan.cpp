#include "limber/detail/verify/verify_plan.h"

#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "core/same_bits.h"
#include "limber/detail/plan/follow_plan.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/simulate.h"
#include "limber/detail/plan/tree_plot.h"
#include "limber/detail/verify/verify.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/goal_terms.h"
#include "limber/detail/world/scene_world.h"
#include "plan/control_rollout.h"
#include "plan/shortcut.h"
#include "plan/simulation.h"

namespace limber::detail {

namespace {

// What limber promises on its own scenes, as a share of the robot's size.
constexpr double largest_penetration = 0.04;
// A force in float32 may be so much longer than its length in double.
constexpr double rounding_factor = 1 + 1e-6;

// The first key at which two JSON documents differ, "" where they are the same.
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

// The settings that the scene asks for, with what a command line may choose besides.
plan::Settings settings_for(const scenes::Scene& scene, const plan::Settings& given) {
  plan::Settings settings = settings_of(scene, {});
  settings.seed = given.seed, settings.max_iterations = given.max_iterations;
  settings.in_flight = given.in_flight, settings.time_limit_s = given.time_limit_s;
  return settings;
}

// The path as the world has it.
class Replay {
 public:
  Replay(const FemSystem& system, const plan::Plan& plan, const plan::Settings& settings) {
    course_.from = system.start();
    course_.controls = plan.trajectory.controls;
    plan::run(system, settings, {&course_, 1},
              {.settle = plan::ControlRolloutOptions::never,
               .keep_frames = true,
               .ask_acceptable = false,
               .stoppable = true});
  }
  bool whole() const { return course_.states.size() == course_.controls.size(); }
  const plan::ControlRollout& course() const { return course_; }
  // After so many controls; the last good state where the dynamics diverged before.
  const State& after(std::size_t controls) const {
    const std::size_t there = std::min(controls, course_.states.size());
    return there == 0 ? course_.from : course_.states[there - 1];
  }

 private:
  plan::ControlRollout course_;
};

void add_terms(const std::string& goal, const std::vector<GoalTerm>& terms, Promises& table) {
  for (const GoalTerm& term : terms) table.row(goal + ": " + term.asked, term.met, term.found);
}

// What the scene asks of each goal, of the states in which the plan says that they are reached.
void check_goals(const PlanFolder& planned, const fem::World& world, const Replay& replay, Promises& table) {
  const scenes::Scene& scene = planned.scene;
  const plan::Plan& plan = planned.plan;
  const std::vector<int> path = plan::path_to(plan.tree, plan.best_node);
  for (std::size_t v = 0; v < scene.via.size(); ++v) {
    const scenes::Via& via = scene.via[v];
    const std::string name = fmt::format("via {} of {}", v + 1, scene.via.size());
    if (v + 1 >= plan.legs.size()) {
      table.row(name + ": reached", false, "the path does not get so far");
      continue;
    }
    const auto before = std::find(path.begin(), path.end(), plan.legs[v + 1].root) - path.begin();
    const State& state = replay.after(std::size_t(before));
    std::vector<GoalTerm> terms = terms_of(scene, via.goal, world, state);
    if (via.rest && scene.planner.settle_time_s > 0) terms.push_back(rest_term(scene, world, state));
    add_terms(name, terms, table);
  }

  const std::string name = "the goal";
  const State& end = replay.course().end;
  std::vector<GoalTerm> terms = terms_of(scene, scene.goal, world, end);
  if (scene.planner.settle_time_s > 0)
    terms.push_back(rest_term(scene, world, end));
  else
    table.measured("speed at the end, where no rest is asked for", rest_term(scene, world, end).found);
  if (plan.trajectory.settle_steps > 0) {
    GoalTerm entered = terms_of(scene, scene.goal, world, replay.after(path.size() - 1)).front();
    entered.asked = "entered before the robot is brought to rest";
    terms.push_back(entered);
  }
  if (scene.goal.lost_below_m) {
    GoalTerm worst = loss_term(scene, world, end);
    for (const State& frame : replay.course().frames)
      if (const GoalTerm term = loss_term(scene, world, frame); worst.met && !term.met) worst = term;
    terms.push_back(worst);
  }
  if (plan.legs.size() <= scene.via.size())
    terms.push_back({"reached after all others", false, "the path does not get so far"});
  add_terms(name, terms, table);
  bool met = true;
  for (const Promise& row : table.rows())
    if (row.name.starts_with("via ") || row.name.starts_with(name + ":")) met = met && row.kept;
  table.row("the plan says that it is solved, and is", plan.solved() && met,
            plan.solved() ? "it says so" : plan::explain(plan));
}

// Where bodies overlap, `world` has parted them anew.
void check_start(const plan::Plan& plan, const fem::World& world, Promises& table) {
  const fem::Parting& parting = world.parting;
  if (parting.pairs.empty()) return;
  const auto deepest =
      std::max_element(parting.pairs.begin(), parting.pairs.end(),
                       [](const auto& one, const auto& other) { return one.depth_m < other.depth_m; });
  double least = std::numeric_limits<double>::infinity();
  for (const fem::Parting::Pair& pair : parting.pairs) least = std::min(least, pair.gap_m);
  const State start = plan.tree.states[0];
  table.row(
      "bodies that overlap at the start are parted again: the same start",
      same_bits(start, fem::start_state(world)),
      fmt::format("{} pairs, up to {:.2f} mm deep ({} and {}), now {:.2f} mm apart or more; {} steps",
                  parting.pairs.size(), 1e3 * deepest->depth_m, world.bodies[std::size_t(deepest->body)].name,
                  world.bodies[std::size_t(deepest->other)].name, 1e3 * least, parting.steps));
}

// The path, the way through the tree and the replay are one.
void check_path(const plan::Plan& plan, const plan::Settings& settings, const Replay& replay,
                Promises& table) {
  const plan::Trajectory& path = plan.trajectory;
  const plan::ControlRollout& course = replay.course();
  table.row("replay gives the same bits",
            replay.whole() && same_bits(course.end, path.end) &&
                std::equal(course.frames.begin(), course.frames.end(), path.frames.begin(), path.frames.end(),
                           [](const State& a, const State& b) { return same_bits(a, b); }),
            fmt::format("{} frames, end {}", course.frames.size(), hex(hash_of(course.end))));

  const std::vector<int> nodes = plan::path_to(plan.tree, plan.best_node);
  const bool settles = path.settle_steps > 0;
  bool same = path.controls.size() + 1 == nodes.size() + std::size_t(settles);
  for (std::size_t i = 1; same && i < nodes.size(); ++i)
    same = same_bits(path.controls[i - 1], plan.tree.controls[std::size_t(nodes[i])]) &&
           same_bits(replay.after(i), plan.tree.states[std::size_t(nodes[i])]);
  if (same && settles)
    same = same_bits(path.controls.back(), plan::settle_control(settings, path.settle_steps));
  table.row("the path is the way through the tree", same, fmt::format("{} nodes", nodes.size()));
}

bool same_nodes(const plan::Tree& a, const plan::Tree& b, int count) {
  for (int n = 0; n < count; ++n) {
    const auto i = std::size_t(n);
    if (a.parents[i] != b.parents[i] || a.iterations[i] != b.iterations[i] ||
        !same_bits(a.controls[i], b.controls[i]) || !same_bits(a.centers[n], b.centers[n]) ||
        !same_bits(a.states[i], b.states[i]))
      return false;
  }
  return true;
}

// Whether each node from `first` on is where its control leads from its parent.
bool nodes_follow(const FemSystem& system, const plan::Tree& tree, int first) {
  const std::unique_ptr<plan::Propagator> propagator = system.make_propagator();
  for (int from = first; from < tree.size();) {
    throw_if_stopped();
    const int to = std::min(tree.size(), from + system.lanes());
    std::vector<State> parents;
    for (int n = from; n < to; ++n) parents.push_back(tree.states[std::size_t(tree.parents[std::size_t(n)])]);
    std::vector<plan::Rollout> rollouts;
    for (int n = from; n < to; ++n)
      rollouts.push_back({&parents[std::size_t(n - from)], tree.controls[std::size_t(n)], {}, false});
    propagator->propagate(rollouts);
    for (int n = from; n < to; ++n) {
      const plan::Rollout& end = rollouts[std::size_t(n - from)];
      if (!end.ok || !same_bits(end.to, tree.states[std::size_t(n)]) ||
          !same_bits(tree.centers[n], system.robot_center(end.to).cast<float>()))
        return false;
    }
    from = to;
  }
  return true;
}

// Told by a search that has gone another way than the plan's: who made the file may ask for any number of
// iterations.
struct GoneAstray {};

plan::Plan searched_again(const FemSystem& system, plan::Settings settings, const plan::Plan& then) {
  settings.max_iterations = then.statistics.iterations;
  settings.time_limit_s = std::numeric_limits<double>::infinity();
  const plan::Plan found = plan::plan(system, settings, std::nullopt, [&](const plan::SearchProgress& now) {
    if (now.nodes > then.tree.size() || now.statistics.diverged > then.statistics.diverged ||
        now.statistics.rejected > then.statistics.rejected ||
        now.statistics.refused > then.statistics.refused)
      throw GoneAstray{};
  });
  throw_if_stopped();
  return found;
}

// The search once more, as far as the plan's went. What came after it, shortcuts and better paths, hangs on
// its tree as nodes of no iteration.
void check_search(const PlanFolder& planned, const FemSystem& system, const plan::Settings& settings,
                  Promises& table) {
  const plan::Plan& plan = planned.plan;
  const plan::Tree& tree = plan.tree;
  const bool carried = planned.summary.contains("refine");
  int searched = 1;  // the start is the world's
  bool same = same_bits(tree.states[0], system.start()) && tree.iterations[0] == -1 &&
              same_bits(tree.controls[0], Control{}) &&
              same_bits(tree.centers[0], system.robot_center(system.start()).cast<float>());
  if (!carried) {
    plan::Plan found;
    try {
      found = searched_again(system, settings, plan);
    } catch (const GoneAstray&) {
    }
    const plan::Statistics &now = found.statistics, &then = plan.statistics;
    const bool counted = now.iterations == then.iterations && now.diverged == then.diverged &&
                         now.rejected == then.rejected && now.refused == then.refused &&
                         now.rollout_steps == then.rollout_steps && then.rollouts >= then.iterations &&
                         then.rollouts_wrong <= then.rollouts &&
                         (settings.search_options.lag == 0 || then.rollouts_wrong == 0);
    searched = found.tree.size();  // none where it went astray
    const bool later = planned.summary.contains("shortcut") || planned.summary.contains("improve");
    same = searched > 0 && searched <= tree.size() && same_nodes(found.tree, tree, searched) &&
           found.legs.size() == plan.legs.size() && found.solved() == plan.solved();
    for (std::size_t leg = 0; same && leg < plan.legs.size(); ++leg)
      same = found.legs[leg].first_iteration == plan.legs[leg].first_iteration &&
             (later || found.legs[leg].root == plan.legs[leg].root);
    same = same && (later || (searched == tree.size() && found.best_node == plan.best_node &&
                              hash_of(found.trajectory) == hash_of(plan.trajectory)));
    table.row("searched again from the scene: the same tree", same,
              fmt::format("seed {}, {} nodes", settings.seed, searched));
    table.row("searched again from the scene: the same counts", counted,
              fmt::format("{} iterations, {} diverged, {} rejected, {} ways refused, {} steps",
                          now.iterations, now.diverged, now.rejected, now.refused, now.rollout_steps));
  } else {
    table.row("the tree starts where the world does", same, "");
  }
  if (!same || searched == tree.size()) return;
  bool later = true;
  for (int n = searched; n < tree.size() && !carried; ++n)
    later = later && tree.iterations[std::size_t(n)] == -1;
  table.row("each other node is where its control leads", later && nodes_follow(system, tree, searched),
            fmt::format("{} nodes", tree.size() - searched));
}

void check_forces(const plan::Plan& plan, const plan::Settings& settings, const MotionFigures& figures,
                  Promises& table) {
  const plan::Trajectory& path = plan.trajectory;
  double largest = figures.largest_force_n, settling = 0;
  for (const Control& control : plan.tree.controls)
    largest = std::max(largest, double(largest_force(control)));
  if (path.settle_steps > 0) settling = double(largest_force(path.controls.back()));
  table.row("no force is above the maximum",
            largest <= settings.max_force_n * rounding_factor &&
                settling <= settings.max_force_n * settings.settle.max_force_share * rounding_factor,
            fmt::format("{:.1f} of {:.1f} N", largest, settings.max_force_n));
}

bool has_just(const Json& table, const std::set<std::string>& keys) {
  if (!table.is_object() || table.size() != keys.size()) return false;
  return std::all_of(keys.begin(), keys.end(), [&](const std::string& key) { return table.contains(key); });
}

double cost_of(const Json& costs, const std::string& kind) {
  plan::Costs c;
  costs.at("duration_s").get_to(c.duration_s), costs.at("effort_n_s").get_to(c.effort_n_s);
  costs.at("strain_energy_j").get_to(c.strain_energy_j), costs.at("volume_change").get_to(c.volume_change);
  return plan::cost_in(c, plan::cost_kind_from(kind));
}

// Of a path in `tets`, that came after the search: whether what is told of it could be so, and ends with what
// the path costs now. "" or the table that does not.
std::string wrong_of_later(const Json& summary, const plan::Plan& plan, const Json& costs_now,
                           std::int64_t tets) {
  bool told = false, now = false;
  if (summary.contains("shortcut")) {
    const Json& s = summary.at("shortcut");
    if (!has_just(s, {"rounds", "cost", "accepted", "before", "after", "cpu_s", "wall_s"}) ||
        cost_of(s.at("after"), s.at("cost")) > cost_of(s.at("before"), s.at("cost")))
      return "shortcut";
    told = true, now = now || s.at("after") == costs_now;
  }
  if (summary.contains("improve")) {
    const Json& s = summary.at("improve");
    if (!has_just(s,
                  {"cost", "first", "improvements", "searches", "solved", "iterations", "cpu_s", "wall_s"}))
      return "improve";
    Json last = s.at("first");
    for (const Json& better : s.at("improvements")) {
      if (!has_just(better, {"wall_s", "iterations", "search", "costs"}) ||
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
  std::set<std::string> keys{"how",         "tracked_s",    "largest_error_m", "iterations", "replay_cpu_s",
                             "track_cpu_s", "search_cpu_s", "coarse_tets",     "tets"};
  if (s.contains("replay_distance_m")) keys.insert("replay_distance_m");  // not told by older limbers
  if (!has_just(s, keys) || s.at("tets") != tets) return "refine";
  const std::string how = s.at("how");
  if (how == "replanned" || how == "failed") return "";
  if (how != "replayed" && how != "tracked") return "refine.how";
  // A chain of nodes, each an iteration of no search, before those that came later.
  plan::Statistics none;
  none.iterations = plan.statistics.iterations;
  none.cpu_s = plan.statistics.cpu_s, none.wall_s = plan.statistics.wall_s;
  if (plan::json_of(none) != plan::json_of(plan.statistics) || s.at("iterations") != 0) return "refine";
  const std::vector<std::int64_t>& of = plan.tree.iterations;
  for (std::size_t n = 1; n < of.size(); ++n)
    if (of[n] != (std::int64_t(n) <= none.iterations ? std::int64_t(n) - 1 : -1)) return "refine";
  return "";
}

// That a portfolio tells of this plan, and of no search that would have won instead. The others are not done
// again.
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
  const Json facts = facts_of(plan, world, system, figures);
  for (const auto& [key, value] : facts.items())
    if (const std::string within = first_difference(value, planned.summary.value(key, Json()));
        !within.empty())
      wrong = "summary." + key + (within == "." ? "" : "." + within);
  for (const auto& [key, value] : planned.summary.items())
    if (!facts.contains(key) && key != "dynamics" && key != "shortcut" && key != "improve" &&
        key != "refine" && key != "portfolio" && key != "from")
      wrong = "summary." + key;
  if (planned.summary.contains("portfolio") && !is_quickest(plan, planned.summary.at("portfolio")))
    wrong = "summary.portfolio";
  std::vector<Control> controls = plan.trajectory.controls;
  if (plan.trajectory.settle_steps > 0) controls.pop_back();
  std::int64_t tets = 0;
  for (const fem::Body& body : world.bodies) tets += body.cage.tets.rows();
  const bool came_later = planned.summary.contains("shortcut") || planned.summary.contains("improve");
  const Json costs = came_later ? plan::json_of(plan::path_of(system, settings, controls).costs) : Json();
  try {
    const std::string later = wrong_of_later(planned.summary, plan, costs, tets);
    if (!later.empty()) wrong = "summary." + later;
  } catch (const Json::exception& error) {
    wrong = fmt::format("its summary ({})", error.what());
  } catch (const InputError& error) {
    wrong = fmt::format("its summary ({})", error.what());
  }
  table.row("what the plan tells of itself is so", wrong.empty(), wrong.empty() ? "" : wrong + " is not");
}

// Promises where contact is on the surfaces that are seen, findings where it is between cages.
void check_seen(const MotionFigures& figures, bool promised, Promises& table) {
  const SeenLimits limits;
  const auto row = [&](const std::string& what, const std::string& limit, bool kept,
                       const std::string& value) {
    promised ? table.row(what + ": " + limit, kept, value) : table.measured(what, value);
  };
  const double size = figures.robot_surface_size_m;
  const auto percent = [](double share) { return fmt::format("{:g} %", 100 * share); };
  const auto of_size = [&](double metres) { return fmt::format("{:.2f} %", 100 * metres / size); };
  row("what is seen: deepest overlap of two surfaces", "at most " + percent(limits.overlap),
      figures.deepest_overlap_m <= limits.overlap * size,
      fmt::format("{:.4f} m, {} ({})", figures.deepest_overlap_m, of_size(figures.deepest_overlap_m),
                  figures.overlap_between));
  const auto gap_row = [&](const std::string& what, const GapFigures& gap) {
    row("what is seen: " + what,
        fmt::format("in the median below {}, below {}", percent(limits.median_gap),
                    percent(limits.worst_gap)),
        gap.count == 0 || (gap.median_m < limits.median_gap * size && gap.worst_m < limits.worst_gap * size),
        gap.count == 0
            ? gap.worst_between
            : fmt::format("median {}, worst {} ({}), of {} pairs and frames", of_size(gap.median_m),
                          of_size(gap.worst_m), gap.worst_between, gap.count));
  };
  gap_row("gap between surfaces that press each other", figures.gap);
  gap_row("the same gap where the strongest force acts", figures.gap_at_contact);
  gap_row("gap between a surface and a wall that it presses", figures.gap_to_wall);
  row("what is seen: a body's overlap with itself", "at most " + percent(limits.self_overlap),
      figures.deepest_self_overlap_m <= limits.self_overlap * size,
      fmt::format("{:.4f} m, {} ({})", figures.deepest_self_overlap_m,
                  of_size(figures.deepest_self_overlap_m), figures.self_overlap_of));
  table.measured("what is seen: deepest overlap of a surface and a wall, beyond that at the start",
                 fmt::format("{:.4f} m, {} ({})", figures.deepest_wall_overlap_m,
                             of_size(figures.deepest_wall_overlap_m), figures.wall_overlap_of));
  table.measured("least and largest stretch of a tet",
                 fmt::format("{:.3f} ({}), {:.3f} ({})", figures.min_stretch, figures.min_stretch_of,
                             figures.largest_stretch, figures.largest_stretch_of));
}

// Of each body that promises it, at every frame.
void check_stretch(const MotionFigures& figures, const fem::World& world, Promises& table) {
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const double most = world.bodies[b].max_stretch;
    if (!world.bodies[b].moving || !std::isfinite(most)) continue;
    double least = 1, largest = 1;
    for (const FrameFigures& frame : figures.frames)
      least = std::min(least, frame.bodies[b].min_stretch),
      largest = std::max(largest, frame.bodies[b].largest_stretch);
    table.row(
        fmt::format("{}: tets are stretched within {:.3g} and {:.3g}", world.bodies[b].name, 1 / most, most),
        least >= 1 / most * (1 - 1e-6) && largest <= most * (1 + 1e-6),
        fmt::format("{:.3f}, {:.3f}", least, largest));
  }
}

}  // namespace

void check_shapes(const MotionFigures& figures, const fem::World& world, Promises& table) {
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    if (world.bodies[b].moving)
      table.row(fmt::format("{}: volume changes by at most {:g} %", world.bodies[b].name,
                            100 * world.bodies[b].max_volume_change),
                figures.largest_volume_change[b] <= world.bodies[b].max_volume_change,
                fmt::format("{:.2f} %", 100 * figures.largest_volume_change[b]));
  table.row("no tet is inverted at a frame", figures.inverted_tets == 0,
            fmt::format("{}", figures.inverted_tets));
  if (!world.touches_on_surfaces())
    table.row(
        "penetration of cages is at most 4 % of the robot's size",
        figures.deepest_penetration_m <= largest_penetration * figures.robot_size_m,
        fmt::format("{:.4f} m, {:.2f} % ({})", figures.deepest_penetration_m,
                    100 * figures.deepest_penetration_m / figures.robot_size_m, figures.penetration_between));
  check_stretch(figures, world, table);
  check_seen(figures, world.touches_on_surfaces(), table);
}

namespace {

// Also false where no motion could begin there.
bool starts_from(const fs::path& folder, const PlanFolder& other, int frame, const scenes::Scene& scene,
                 const fem::World& world, const State& start) {
  try {
    return start_from(folder, other, frame, scene, world) == start;
  } catch (const InputError&) {
    return false;
  }
}

// Where a motion begins. Of a frame of another motion the folder must be here, as it was then.
void check_beginning(const fs::path& folder, const PlanFolder& planned, const fem::World& world,
                     Promises& table) {
  const State start = planned.plan.tree.states[0];
  if (!begins_elsewhere(planned)) {
    table.row("it starts as the scene says", start == fem::start_state(world), "");
    return;
  }
  const Json& from = planned.summary.at("from");
  const fs::path other = folder / from.at("folder").get<std::string>();
  const int frame = from.at("frame").get<int>();
  const std::string promise = fmt::format("it starts as frame {} of another motion", frame),
                    name = other.lexically_normal().string();
  std::string why;
  try {
    const PlanFolder there = read_plan_folder(other);
    read_bodies_of(there, other);
    if (hex(plan::hash_of(there.plan.trajectory)) == from.at("trajectory_hash")) {
      table.row(promise, starts_from(other, there, frame, planned.scene, world, start),
                fmt::format("{}, of which limber verify tells apart", name));
      return;
    }
    why = "holds another motion";
  } catch (const InputError& error) {
    why = "is not here";
  }
  table.row(promise, false, fmt::format("{} {}, so nobody can tell; put back what it began from", name, why));
}

// Of a plan that must be here, as it was then: each control is the follower's, and what is told of it is so.
void check_following(const fs::path& folder, const PlanFolder& planned, const fem::World& world,
                     Promises& table) {
  const plan::Plan& plan = planned.plan;
  const Json told = planned.summary.value("follows", Json::object());
  const fs::path other = folder / told.value("folder", "");
  const std::string promise = "each control is the follower's of another plan",
                    name = other.lexically_normal().string();
  double largest = 0;
  for (const Control& control : plan.trajectory.controls)
    largest = std::max(largest, double(largest_force(control)));
  const double most = planned.scene.planner.max_force_n;
  table.row("no force is above the maximum", largest <= most * rounding_factor,
            fmt::format("{:.1f} of {:.1f} N", largest, most));
  std::optional<FollowedPlan> followed;
  std::string why;
  try {
    followed.emplace(other, planned.scene, world);
    if (followed->facts(plan, folder).at("trajectory_hash") != told.value("trajectory_hash", ""))
      why = "holds another plan";
  } catch (const InputError&) {
    why = "is not here";
  }
  if (!why.empty()) {
    table.row(promise, false, fmt::format("{} {}, so nobody can tell; put back what it followed", name, why));
    return;
  }
  bool same = true;
  for (int node = 1; same && node < plan.tree.size(); ++node) {
    Control control = followed->next(plan.tree.states[std::size_t(node - 1)]);
    const Control& there = plan.tree.controls[std::size_t(node)];
    const bool last = node + 1 == plan.tree.size();
    if (last && there.steps > 0) control.steps = std::min(control.steps, there.steps);
    same = same_bits(control, there);
  }
  table.row(promise, same, fmt::format("{}, of which limber verify tells apart", name));
  table.row("what it tells of following is so", followed->facts(plan, folder) == told, "");
}

void check_claims_of_simulation(const PlanFolder& planned, const fem::World& world, const FemSystem& system,
                                const MotionFigures& figures, Promises& table) {
  Json facts = facts_of(planned.plan, world, system, figures);
  for (const char* key : {"from", "follows"})
    if (planned.summary.contains(key)) facts[key] = planned.summary.at(key);
  const std::string other = first_difference(facts, planned.summary);
  table.row("what the simulation tells of itself is so", other.empty(),
            other.empty() ? "" : "summary." + other + " is not");
}

void check_simulation(const fs::path& folder, const PlanFolder& planned,
                      const std::vector<PreparedBody>& bodies, const fem::World& world,
                      MotionFigures& figures, Promises& table) {
  const plan::Plan& plan = planned.plan;
  const plan::Simulation& simulation = *plan.simulation;
  const FemSystem system = system_of(planned, world, bodies);
  plan::Settings settings;
  settings.frames_per_second = planned.scene.film.frames_per_second / planned.scene.film.speed;
  table.row("its frames are as many a second as the scene says",
            plan.trajectory.frames_per_second == settings.frames_per_second,
            fmt::format("{:g}", settings.frames_per_second));
  table.row("the simulation is of this world and its script", plan.system_hash == system.hash(),
            hex(system.hash()));
  if (!begins_elsewhere(planned)) check_start(plan, world, table);
  check_beginning(folder, planned, world, table);

  const Replay replay(system, plan, settings);
  const plan::ControlRollout& course = replay.course();
  check_path(plan, settings, replay, table);
  Control nothing;
  nothing.steps = std::int32_t(plan.trajectory.end.step - system.start().step);
  if (simulation.steered)
    check_following(folder, planned, world, table);
  else
    table.row("nothing acts but what the scene says", plan.trajectory.controls == std::vector{nothing}, "");
  const std::int64_t asked = plan::steps_of_simulation(system, simulation.duration_s);
  table.row("it lasts as long as was asked for",
            simulation.ending == plan::Simulation::whole && nothing.steps == asked,
            fmt::format("{:.4g} of {:.4g} s", nothing.steps * world.dt_s, simulation.duration_s));
  figures = measure_motion(
      world, bodies, {plan.trajectory.controls, 0, settings.frames_per_second, course.frames, course.end});
  check_shapes(figures, world, table);
  check_claims_of_simulation(planned, world, system, figures, table);
}

}  // namespace

void check_plan(const fs::path& folder, const PlanFolder& planned, const std::vector<PreparedBody>& bodies,
                const fem::World& world, MotionFigures& figures, Promises& table) {
  const plan::Plan& plan = planned.plan;
  table.row("one hash stands over all of plan.npz", planned.sealed,
            planned.sealed ? "" : "it is of an older limber, and has none; plan anew");
  const std::string odd = planned.sealed ? odd_entry(folder, planned, bodies) : "";
  table.row("plan.npz holds what limber writes, and no more", odd.empty(),
            odd.empty() ? "" : odd + " is not as limber writes it");
  if (plan.simulation) return check_simulation(folder, planned, bodies, world, figures, table);
  const FemSystem system = system_of(planned, world, bodies);
  const plan::Settings settings = settings_for(planned.scene, plan.settings);
  const std::string other = first_difference(plan::json_of(settings), plan::json_of(plan.settings));
  table.row("the plan's settings are the scene's", other.empty(), other.empty() ? "" : other + " is not");
  table.row("the plan is of this world", plan.system_hash == system.hash(), hex(system.hash()));

  if (begins_elsewhere(planned))
    check_beginning(folder, planned, world, table);
  else
    check_start(plan, world, table);

  const Replay replay(system, plan, settings);
  const plan::ControlRollout& course = replay.course();
  check_path(plan, settings, replay, table);
  figures = measure_motion(world, bodies,
                           {plan.trajectory.controls, plan.trajectory.settle_steps,
                            settings.frames_per_second, course.frames, course.end},
                           system.surfaces());
  check_goals(planned, world, replay, table);
  check_forces(plan, settings, figures, table);
  check_shapes(figures, world, table);
  check_search(planned, system, settings, table);
  check_claims(planned, world, system, settings, figures, table);
}

void check_pictures(const fs::path& folder, const PlanFolder& planned, const fem::World& world,
                    const MotionFigures& figures, Promises& table) {
  const Json manifest = read_manifest(folder);
  const Json entry = manifest.value("plan", Json());
  const std::string other = first_difference(planned.summary, entry);
  const std::string what = planned.plan.simulation ? "simulation" : "plan";
  table.row("manifest.json tells of this " + what, other.empty(),
            other.empty() ? "" : (other == "." ? "plan" : "plan." + other) + " is another's");
  for (const auto& [name, content] : pictures_of(planned.scene, world, planned.plan, figures)) {
    const bool there = fs::exists(folder / name);
    table.row(name + " shows this " + what, there && read_file(folder / name) == content,
              there ? "" : "it is missing");
  }
}

}  // namespace limber::detail
