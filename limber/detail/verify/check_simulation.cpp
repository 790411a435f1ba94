// A simulation, on which nothing is searched: it is replayed, from the start that it says, under no control
// or under those of a follower, and must last as long as was asked for. Rows: docs/verify.md, "Of the plan",
// at its end.
#include <optional>

#include "core/error.h"
#include "core/hash.h"
#include "core/same_bits.h"
#include "limber/detail/plan/follow_plan.h"
#include "limber/detail/verify/plan_checks.h"
#include "limber/detail/verify/verify_plan.h"
#include "plan/simulation.h"

namespace limber::detail {

namespace {

// Of a plan that must be here, as it was then: each control is the follower's, and what is told of it is so.
// The follower chooses from the state alone (plan/follow.h), so each choice is made again from the node
// before. The last may have been cut short by the end of the simulation.
void check_following(const fs::path& folder, const PlanFolder& planned, const fem::World& world,
                     Promises& table) {
  const plan::Plan& plan = planned.plan;
  const FollowingTold told = planned.told.follows.value_or(FollowingTold{});
  const fs::path other = folder / told.folder;
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
    if (followed->facts(plan, folder).trajectory_hash != told.trajectory_hash) why = "holds another plan";
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
  table.row("what it tells of following is so",
            json_of_fields(followed->facts(plan, folder)) == planned.summary.value("follows", Json()), "");
}

// Every figure of the summary worked out again. `from` and `follows` tell of other motions, and are checked
// where these are read.
void check_claims_of_simulation(const PlanFolder& planned, const fem::World& world, const FemSystem& system,
                                const MotionFigures& figures, Promises& table) {
  const Json told = kept_summary(planned);
  Json facts = facts_of(planned.plan, world, system, figures);
  if (!told.contains("stiffness_shares")) facts.erase("stiffness_shares");  // of before
  for (const char* key : {"from", "follows"})
    if (told.contains(key)) facts[key] = told.at(key);
  const std::string other = first_difference(facts, told);
  table.row("what the simulation tells of itself is so", other.empty(),
            other.empty() ? "" : "summary." + other + " is not");
}

}  // namespace

// Of the settings of a plan only the rate of frames counts here. What acts is one control that does nothing,
// over all of the time, or the follower's. The time asked for is whole steps.
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
    table.row("nothing acts but what the scene says", plan.trajectory.controls == std::vector{nothing},
              planned.scene.script.text.empty() ? "" : "and its control file");
  const std::int64_t asked = plan::steps_of_simulation(system, simulation.duration_s);
  table.row("it lasts as long as was asked for",
            simulation.ending == plan::Simulation::whole && nothing.steps == asked,
            fmt::format("{:.4g} of {:.4g} s", nothing.steps * world.dt_s, simulation.duration_s));
  figures = measure_motion(
      world, bodies, {plan.trajectory.controls, 0, settings.frames_per_second, course.frames, course.end});
  check_shapes(figures, world, table);
  check_claims_of_simulation(planned, world, system, figures, table);
}

}  // namespace limber::detail
