// What a plan says of itself in words: how near it came, what ended it, what to try.
#include "core/error.h"
#include "plan/search.h"

namespace limber::plan {

std::string name_of_goal(const Settings& settings, int leg) {
  return leg < int(settings.via.size()) ? fmt::format("via {} of {}", leg + 1, settings.via.size())
                                        : "the goal";
}

namespace {

std::string explain_simulation(const Plan& plan) {
  const Simulation& s = *plan.simulation;
  const std::string asked = fmt::format("{:g} s", s.duration_s);
  switch (s.ending) {
    case Simulation::whole:
      return "simulated " + asked;
    case Simulation::stopped:
      return fmt::format("a signal ended the simulation before its {}; {}", asked,
                         s.steered ? "simulate anew" : "resume it to go on");
    case Simulation::diverged:
      return fmt::format(
          "the dynamics diverged before the {} were over; try a smaller world.max_dt_s, or weaker "
          "forces and slower motions",
          asked);
  }
  return "";
}

}  // namespace

// First how near it came, then what ended it and what to try, then what was in the way.
std::string explain(const Plan& plan) {
  if (plan.simulation) return explain_simulation(plan);
  const Settings s = settings_of_leg(plan.settings, plan.leg());
  const Statistics& statistics = plan.statistics;
  const std::string goal = name_of_goal(plan.settings, plan.leg());
  const int best_node = plan.left_out ? plan.left_out->numbers.back() : plan.best_node;
  const std::string where = fmt::format("node {} of {}, {:.3g} m from {} (radius {:.3g} m)", best_node,
                                        nodes_of(plan), plan.best_distance_m, goal, s.goal.radius_m);
  if (plan.solved())
    return fmt::format(
        "reached {}{} after {} iterations: {}", goal,
        s.via.empty() ? ""
                      : fmt::format(" by way of {} via point{}", s.via.size(), s.via.size() == 1 ? "" : "s"),
        statistics.iterations, where);
  std::string text;
  if (plan.leg() > 0)
    text = fmt::format("{} of {} goals are reached; from there ", plan.leg(), s.via.size() + 1);
  text += plan.best_distance_m <= s.goal.radius_m
              ? fmt::format(
                    "the robot got into {}, but {}not as the goal asks (turn, shape, above, below, clear of "
                    "or through a body): ",
                    goal,
                    s.settle.max_duration_s > 0 ? fmt::format("did not come to rest there within {:g} s, or ",
                                                              s.settle.max_duration_s)
                                                : "") +
                    where + ". "
              : fmt::format("no node reached {}; the nearest is {}. ", goal, where);
  switch (plan.ending) {
    case Ending::goal:
      break;
    case Ending::iterations:
      text += fmt::format(
          "The limit of {} iterations ended the search; try more iterations, a larger max_force_n or "
          "goal_bias.",
          s.max_iterations);
      break;
    case Ending::time:
      text += fmt::format(
          "The time limit of {:g} s ended the search after {} of {} iterations; resume it with a larger one.",
          s.time_limit_s, statistics.iterations, s.max_iterations);
      break;
    case Ending::stopped:
      text += fmt::format("It was stopped after {} of {} iterations; resume it to go on.",
                          statistics.iterations, s.max_iterations);
      break;
  }
  if (statistics.diverged + statistics.rejected > 0)
    text += fmt::format(" {} rollouts diverged and {} ended in states that are not acceptable.",
                        statistics.diverged, statistics.rejected);
  if (statistics.refused > 0)
    text +=
        fmt::format(" {} ways to {} were refused, each for a frame that breaks what limber promises of it{}.",
                    statistics.refused, goal,
                    statistics.last_refusal.empty() ? "" : "; on the last, " + statistics.last_refusal);
  return text;
}

}  // namespace limber::plan
