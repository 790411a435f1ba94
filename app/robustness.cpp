#include <algorithm>
#include <cmath>

#include "app/analysis.h"
#include "app/commands.h"
#include "app/fem_system.h"
#include "app/plan_folder.h"
#include "app/scene_world.h"
#include "core/error.h"
#include "core/progress.h"
#include "core/random.h"
#include "plan/course.h"
#include "plan/refine.h"
#include "plan/shortcut.h"

namespace limber::app {

namespace {

constexpr int most_worlds = 4;
// Streams of random numbers: worlds, and after them perturbations of forces.
constexpr std::uint64_t first_world_stream = std::uint64_t(1) << 61;

// What became of one perturbed replay.
struct Fate {
  int world = 0;
  bool reaches = false;
  const char* end = "";
  double distance_m = 0, speed_m_s = 0, duration_s = 0;
  Vec3 end_center_m = Vec3::Zero();
  double volume_change = 0, penetration_m = 0;
};

double factor(Rng& rng, double share) { return 1 + share * rng.uniform(-1, 1); }

// Every body with its own factors; a part keeps its ratio to the rest of its body.
scenes::Scene with_other_materials(scenes::Scene scene, double share, Rng rng) {
  for (scenes::BodySpec& body : scene.bodies) {
    const double stiffness = factor(rng, share), density = factor(rng, share), friction = factor(rng, share);
    body.material.youngs_modulus_pa *= stiffness;
    body.material.density_kg_m3 *= density;
    body.material.friction = std::min(2.0, body.material.friction * friction);
    for (scenes::PartSpec& part : body.parts) {
      if (part.youngs_modulus_pa) *part.youngs_modulus_pa *= stiffness;
      if (part.density_kg_m3) *part.density_kg_m3 *= density;
    }
  }
  return scene;
}

Vec3f turned(const Vec3f& force, double angle, const Vec3& random) {
  const Vec3 f = force.cast<double>();
  Vec3 across = random - f * (random.dot(f) / std::max(f.squaredNorm(), 1e-300));
  if (across.norm() > 0) across.normalize();
  return (f * std::cos(angle) + across * (f.norm() * std::sin(angle))).cast<float>();
}

std::vector<Control> with_other_forces(std::vector<Control> controls, const RobustOptions& options, Rng rng) {
  for (Control& control : controls) {
    const double by = factor(rng, options.force_share);
    const double angle = rng.uniform(0, options.force_deg) * M_PI / 180;
    control.force_n = turned(control.force_n, angle, rng.direction()) * float(by);
    control.max_force_n *= float(by);
  }
  return controls;
}

// Without a settle nobody looks whether the robot rests.
const char* name_of(plan::Course::Result result, bool settles) {
  switch (result) {
    case plan::Course::rests_in_goal:
      return settles ? "at rest in the goal" : "in the goal";
    case plan::Course::diverged:
      return "the dynamics diverged";
    default:
      return settles ? "not at rest in the goal" : "not in the goal";
  }
}

// Whether each leg ended in its goal; how fast the robot was there is not asked.
bool reaches_all_via(const plan::Plan& plan, const FemSystem& system, const plan::Course& course,
                     const std::vector<int>& before_legs) {
  for (std::size_t leg = 1; leg < before_legs.size(); ++leg) {
    const auto count = std::size_t(before_legs[leg]);
    if (count > course.states.size()) return false;
    const State& state = count == 0 ? course.from : course.states[count - 1];
    const Vec3 shift = system.on_leg(int(leg) - 1).goal_shift(state);
    if (!plan::holds(plan.settings.via[leg - 1].goal, system.robot_center(state) - shift)) return false;
  }
  return true;
}

// The perturbations [first, last) in one world, in lanes.
std::vector<Fate> replay(const plan::Plan& plan, const plan::Reference& reference,
                         const RobustOptions& options, const scenes::Scene& scene,
                         const std::vector<PreparedBody>& bodies, int world_number, int first, int last) {
  const fem::World world = build_world(scene, bodies, State(plan.tree.states[0]).positions);
  const FemSystem system(world, goal_rules_of(scene));
  const std::vector<Control> controls = plan::in_steps_of(system.dt_s(), reference.controls, reference.dt_s);
  std::vector<plan::Course> courses;
  for (int i = first; i < last; ++i) {
    plan::Course& course = courses.emplace_back();
    course.from = system.start();
    course.controls = with_other_forces(controls, options, Rng(options.seed, std::uint64_t(i)));
  }
  plan::run(system, plan.settings, courses,
            {.settle = plan::CourseOptions::anywhere, .keep_frames = true, .ask_acceptable = false});
  const std::vector<int> before_legs = plan::controls_before_legs(plan);
  std::vector<Fate> fates;
  for (plan::Course& course : courses) {
    const bool goes_by = reaches_all_via(plan, system, course, before_legs);
    const plan::Trajectory path{{}, 0, plan.settings.frames_per_second, std::move(course.frames), course.end};
    const MotionFigures figures = measure_motion(world, path);
    Fate& fate = fates.emplace_back();
    fate.world = world_number;
    fate.reaches = course.result == plan::Course::rests_in_goal && goes_by;
    fate.end = goes_by ? name_of(course.result, plan.settings.settle.max_duration_s > 0) : "a via is missed";
    fate.end_center_m = system.robot_center(course.end);
    fate.distance_m =
        (fate.end_center_m - system.goal_shift(course.end) - plan.settings.goal.center_of_mass_m).norm();
    fate.speed_m_s = system.mean_speed(course.end);
    fate.duration_s = course.costs.duration_s;
    fate.volume_change =
        *std::max_element(figures.largest_volume_change.begin(), figures.largest_volume_change.end());
    fate.penetration_m = figures.deepest_penetration_m;
  }
  return fates;
}

Json json_of(const Fate& f) {
  return {{"world", f.world},
          {"reaches", f.reaches},
          {"end", f.end},
          {"distance_m", f.distance_m},
          {"speed_m_s", f.speed_m_s},
          {"duration_s", f.duration_s},
          {"end_center_m", {f.end_center_m.x(), f.end_center_m.y(), f.end_center_m.z()}},
          {"largest_volume_change_percent", 100 * f.volume_change},
          {"deepest_penetration_m", f.penetration_m}};
}

}  // namespace

Outcome robust(const RobustOptions& options) {
  const NothingToKeep nothing_to_keep;
  const PlanFolder planned = read_folder_from_the_start(options.folder, "limber robust");
  if (!planned.plan.solved())
    throw InputError(
        fmt::format("{}: its plan does not reach the goal, so there is nothing to perturb; plan on with "
                    "limber plan --resume",
                    options.folder.string()));
  const std::vector<PreparedBody> bodies = read_bodies_of(planned, options.folder);
  const fem::World world = world_of(planned, bodies);
  const FemSystem system(world, goal_rules_of(planned.scene));
  const plan::Reference reference = plan::reference_of(system, planned.plan.trajectory);
  const Vec3 planned_end = system.robot_center(planned.plan.trajectory.end);

  const int n = options.perturbations, worlds = std::min(n, most_worlds);
  std::vector<Fate> fates;
  for (int w = 0; w < worlds; ++w) {
    throw_if_stopped();
    const scenes::Scene scene = with_other_materials(
        planned.scene, options.material_share, Rng(options.seed, first_world_stream + std::uint64_t(w)));
    const std::vector<Fate> of_world =
        replay(planned.plan, reference, options, scene, bodies, w, w * n / worlds, (w + 1) * n / worlds);
    fates.insert(fates.end(), of_world.begin(), of_world.end());
  }

  int reached = 0;
  double spread = 0, farthest = 0, volume = 0, penetration = 0;
  Json rows = Json::array();
  std::string text =
      "  world  end                      from the goal  speed       lasts   volume   penetration\n";
  for (const Fate& f : fates) {
    reached += f.reaches;
    const double apart = (f.end_center_m - planned_end).norm();
    spread += apart * apart / n, farthest = std::max(farthest, apart);
    volume = std::max(volume, f.volume_change), penetration = std::max(penetration, f.penetration_m);
    rows.push_back(json_of(f));
    text +=
        fmt::format("  {:5}  {:23}  {:8.3f} m     {:.4f} m/s  {:5.2f} s  {:5.2f} %  {:.4f} m\n", f.world,
                    f.end, f.distance_m, f.speed_m_s, f.duration_s, 100 * f.volume_change, f.penetration_m);
  }
  spread = std::sqrt(spread);
  text += fmt::format(
      "{} of {} {} in the goal (materials ± {:g} %, forces ± {:g} %, turned by up to {:g} degrees, "
      "seed "
      "{})\n"
      "  end          {:.3f} m from the plan's (root mean square), at most {:.3f} m\n"
      "  volume       changes by at most {:.2f} %\n"
      "  penetration  at most {:.4f} m\n",
      reached, n, planned.plan.settings.settle.max_duration_s > 0 ? "come to rest" : "end",
      100 * options.material_share, 100 * options.force_share, options.force_deg, options.seed, spread,
      farthest, 100 * volume, penetration);
  const Json json{{"perturbations", n},
                  {"seed", options.seed},
                  {"material_share", options.material_share},
                  {"force_share", options.force_share},
                  {"force_deg", options.force_deg},
                  {"reached", reached},
                  {"share_reached", double(reached) / n},
                  {"end_spread_m", spread},
                  {"end_farthest_m", farthest},
                  {"largest_volume_change_percent", 100 * volume},
                  {"deepest_penetration_m", penetration},
                  {"replays", rows}};
  return {exit_done, json, text};
}

}  // namespace limber::app
