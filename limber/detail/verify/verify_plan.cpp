// The checks of a plan against its scene, in their order.
//
// The path is replayed first, for nearly all else is asked of the replay and not of the frames that are
// stored: goals, forces, shapes, what is seen. Then the search is done again. The checks are files of their
// own, listed in plan_checks.h; every row of the table is explained in docs/verify.md, and
// tests/cli/mutation_test.cpp lists what an adversary who knows limber may change and which row must say so.
#include "limber/detail/verify/verify_plan.h"

#include <algorithm>

#include "core/error.h"
#include "core/hash.h"
#include "core/same_bits.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/plan/tree_plot.h"
#include "limber/detail/verify/plan_checks.h"
#include "limber/detail/world/goal_terms.h"
#include "plan/expansion.h"

namespace limber::detail {

namespace {

// The settings that the scene asks for, with what a command line may choose besides: the seed and the limits.
plan::Settings settings_for(const scenes::Scene& scene, const plan::Settings& given) {
  plan::Settings settings = settings_of(scene, {});
  settings.seed = given.seed, settings.max_iterations = given.max_iterations;
  settings.in_flight = given.in_flight, settings.time_limit_s = given.time_limit_s;
  return settings;
}

// A row for each term, named after the goal.
void add_terms(const std::string& goal, const std::vector<GoalTerm>& terms, Promises& table) {
  for (const GoalTerm& term : terms) table.row(goal + ": " + term.asked, term.met, term.found);
}

// What the scene asks of each goal, of the states in which the plan says that they are reached: for a goal on
// the way the root of the leg behind it, for the last one the end of the path. Terms are measured in the
// world by code of their own (goal_terms.h), not by the planner's test of a goal. Where the robot is brought
// to rest, it must also have been in the goal when that began; and a goal that can be lost must be there at
// every frame.
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
    if (via.rest && scene.planner.settle_time_s > 0) {
      terms.push_back(rest_term(scene, world, state));
      const Control& last = plan.tree.controls[std::size_t(plan.legs[v + 1].root)];
      const bool settled =
          same_bits(last, plan::settle_control(plan::settings_of_leg(plan.settings, int(v)), last.steps));
      terms.push_back(stay_term(scene, world, state, settled ? last : Control()));
    }
    add_terms(name, terms, table);
  }

  const std::string name = "the goal";
  const State& end = replay.course().end;
  std::vector<GoalTerm> terms = terms_of(scene, scene.goal, world, end);
  if (scene.planner.settle_time_s > 0) {
    terms.push_back(rest_term(scene, world, end));
    terms.push_back(stay_term(
        scene, world, end, plan.trajectory.settle_steps > 0 ? plan.trajectory.controls.back() : Control()));
  } else {
    table.measured("speed at the end, where no rest is asked for", rest_term(scene, world, end).found);
  }
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

// Of all controls of path and tree, as vectors of float32; of the settle at most its own share.
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
            fmt::format("{:.1f} of {:.1f} N{}", largest, settings.max_force_n,
                        plan.left_out ? ", on the path, which alone is kept" : ""));
  double pressure = 0;
  for (const auto* controls : {&plan.tree.controls, &path.controls})
    for (const Control& control : *controls) pressure = std::max(pressure, double(control.pressure_pa));
  if (settings.max_pressure_pa > 0 || pressure > 0)
    table.row("no pressure is above the maximum", pressure <= settings.max_pressure_pa * rounding_factor,
              fmt::format("{:.4g} of {:.4g} Pa", pressure, settings.max_pressure_pa));
}

}  // namespace

void check_plan(const fs::path& folder, const PlanFolder& planned, const std::vector<PreparedBody>& bodies,
                const fem::World& world, MotionFigures& figures, Promises& table) {
  const plan::Plan& plan = planned.plan;
  table.row("one hash stands over all of plan.npz", planned.sealed(),
            planned.sealed() ? "" : "it is of an older limber, and has none; plan anew");
  const std::string odd = planned.sealed() ? odd_entry(folder, planned, bodies) : "";
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

// Made again from plan and figures, byte for byte.
void check_pictures(const fs::path& folder, const PlanFolder& planned, const fem::World& world,
                    const MotionFigures& figures, Promises& table) {
  const Json manifest = read_manifest(folder);
  for (const auto& [key, entry] : manifest.items())
    if (key != "version" && key != "plan" && key != "export" && key != "render" &&
        !key.starts_with("render-"))
      table.row("manifest.json holds what limber writes, and no more", false, key + " is not limber's");
  const Json entry = manifest.value("plan", Json());
  const std::string other = first_difference(kept_summary(planned), entry);
  const std::string what = planned.plan.simulation ? "simulation" : "plan";
  table.row("manifest.json tells of this " + what, other.empty(),
            other.empty()     ? ""
            : entry.is_null() ? "it does not tell of one, or is missing"
                              : (other == "." ? "plan" : "plan." + other) + " is another's");
  for (const auto& [name, content] : pictures_of(planned.scene, world, planned.plan, figures)) {
    const bool there = fs::exists(folder / name);
    table.row(name + " shows this " + what, there && read_file(folder / name) == content,
              there ? "" : "it is missing");
  }
}

}  // namespace limber::detail
