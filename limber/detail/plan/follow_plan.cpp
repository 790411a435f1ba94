#include "limber/detail/plan/follow_plan.h"

#include <algorithm>

#include "core/error.h"
#include "core/hash.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/scene_world.h"
#include "plan/control_rollout.h"
#include "plan/expansion.h"

namespace limber::detail {

namespace {

void require_same_robot(const fs::path& folder, const fem::World& there, const scenes::Scene& scene,
                        const fem::World& world) {
  const fem::Body &theirs = there.bodies[std::size_t(there.robot)],
                  &ours = world.bodies[std::size_t(world.robot)];
  if (theirs.name != ours.name || hash_of(theirs.cage) != hash_of(ours.cage))
    throw InputError(
        fmt::format("{}: its robot is {}, and {} here has another name, place or cage; follow the plan of a "
                    "scene with the same robot, or carry it to another cage with limber refine",
                    folder.string(), theirs.name, scene.bodies[std::size_t(scene.robot)].where));
}

}  // namespace

FollowedPlan::FollowedPlan(const fs::path& folder, const scenes::Scene& scene, const fem::World& world)
    : folder_(folder) {
  scenes::require_plannable(scene);
  const PlanFolder planned = read_folder_from_the_start(folder, "--follow");
  if (!planned.plan.solved())
    throw InputError(fmt::format(
        "{0}: its plan does not reach the goal, so there is no path to follow; plan on with limber "
        "plan SCENE -o {0} --resume",
        folder.string()));
  const fem::World there = read_world_of(planned, folder).world;
  require_same_robot(folder, there, scene, world);
  const FemSystem system(there, goal_rules_of(planned.scene));
  const plan::Trajectory& path = planned.plan.trajectory;
  trajectory_hash_ = hex(plan::hash_of(path));
  duration_s_ = double(path.end.step - system.start().step) * there.dt_s;
  settings_ = settings_of(scene, {});
  system_ = std::make_unique<FemSystem>(world, goal_rules_of(scene));
  follower_ = std::make_unique<plan::Follower>(*system_, settings_,
                                               plan::guide_of(system, planned.plan.settings, path));
}

FollowingTold FollowedPlan::facts(const plan::Plan& simulation, const fs::path& from) const {
  const plan::Guide& guide = follower_->guide();
  double farthest = 0, largest = 0;
  for (int node = 0; node < simulation.tree.size(); ++node)
    if (const auto piece = std::size_t(node); piece < guide.centers.size())
      farthest = std::max(
          farthest, (system_->robot_center(simulation.tree.states[piece]) - guide.centers[piece]).norm());
  for (const Control& control : simulation.trajectory.controls)
    largest = std::max(largest, double(largest_force(control)));
  const State& end = simulation.trajectory.end;
  const Vec3 center = system_->robot_center(end) - system_->goal_shift(end);
  const bool rests = plan::rests(*system_, settings_.settle, end, plan::settle_control(settings_, 0));
  return {.folder = fs::relative(folder_, from).generic_string(),
          .trajectory_hash = trajectory_hash_,
          .farthest_from_path_m = farthest,
          .largest_force_n = largest,
          .distance_m = (center - settings_.goal.center_of_mass_m).norm(),
          .speed_m_s = system_->mean_speed(end),
          .reaches = rests && plan::holds(settings_.goal, center) && system_->goal_holds(end)};
}

}  // namespace limber::detail
