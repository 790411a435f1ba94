#include "limber/detail/verify/robustness.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "core/error.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/random.h"
#include "core/threads.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/verify/kept_replays.h"
#include "limber/detail/verify/promises.h"
#include "limber/detail/verify/verify_plan.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "plan/control_rollout.h"
#include "plan/replan.h"
#include "plan/shortcut.h"

namespace limber::detail {

namespace {

// Streams of random numbers: worlds, and after them perturbations of forces.
constexpr std::uint64_t first_world_stream = std::uint64_t(1) << 61;

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

// What acts is not what a control asks for.
struct Error {
  double by = 1, angle = 0;
  Vec3 direction = Vec3::UnitX();
};

// One for each control, and one for what comes after them.
std::vector<Error> errors(std::size_t controls, const RobustOptions& options, Rng rng) {
  std::vector<Error> all(controls + 1);
  for (Error& error : all) {
    error.by = factor(rng, options.force_share);
    error.angle = rng.uniform(0, options.force_deg) * M_PI / 180;
    error.direction = rng.direction();
  }
  return all;
}

Vec3f turned(const Vec3f& force, double angle, const Vec3& random) {
  const Vec3 f = force.cast<double>();
  Vec3 across = random - f * (random.dot(f) / std::max(f.squaredNorm(), 1e-300));
  if (across.norm() > 0) across.normalize();
  return (f * std::cos(angle) + across * (f.norm() * std::sin(angle))).cast<float>();
}

Control with(const Error& error, Control control) {
  control.force_n = turned(control.force_n, error.angle, error.direction) * float(error.by);
  control.max_force_n *= float(error.by);
  return control;
}

// Without a settle nobody looks whether the robot rests.
const char* name_of(plan::ControlRollout::Result result, bool settles) {
  switch (result) {
    case plan::ControlRollout::rests_in_goal:
      return settles ? "at rest in the goal" : "in the goal";
    case plan::ControlRollout::diverged:
      return "the dynamics diverged";
    default:
      return settles ? "not at rest in the goal" : "not in the goal";
  }
}

// Whether each leg ended in its goal; how fast the robot was there is not asked.
bool reaches_all_via(const plan::Plan& plan, const FemSystem& system, const plan::ControlRollout& course,
                     const plan::Guide& guide, const std::vector<int>& before_legs) {
  for (std::size_t leg = 1; leg < before_legs.size(); ++leg) {
    const auto count =
        std::size_t(std::lower_bound(guide.control.begin(), guide.control.end(), before_legs[leg]) -
                    guide.control.begin());
    if (count > course.states.size()) return false;
    const State& state = count == 0 ? course.from : course.states[count - 1];
    const Vec3 shift = system.on_leg(int(leg) - 1).goal_shift(state);
    if (!plan::holds(plan.settings.via[leg - 1].goal, system.robot_center(state) - shift)) return false;
  }
  return true;
}

// The plan in its own world, as the perturbed ones are given it.
struct Planned {
  const PlanFolder& folder;
  const std::vector<PreparedBody>& bodies;
  const fem::World& world;
  plan::Guide guide;
};

// The perturbations [first, last) in one world, in lanes.
std::vector<Fate> replay(const Planned& planned, const RobustOptions& options, By by,
                         const scenes::Scene& scene, int world_number, int first, int last) {
  const plan::Plan& plan = planned.folder.plan;
  const fem::World world = build_world(scene, planned.bodies, State(plan.tree.states[0]).positions);
  const FemSystem system(world, goal_rules_of(scene));
  const plan::Follower follower(system, plan.settings, planned.guide);
  const plan::Guide& guide = follower.guide();
  const auto from = [&](const fem::World& in) -> plan::Replanner::From {
    return [&](const State& state) {
      return std::make_unique<FemSystem>(in, planned.bodies, goal_rules_of(planned.folder.scene), state);
    };
  };
  std::vector<std::unique_ptr<plan::Replanner>> replanners;
  std::vector<plan::ControlRollout> courses;
  std::vector<double> asked(std::size_t(last - first));
  for (int i = first; i < last; ++i) {
    const std::size_t controls = guide.control.empty() ? 0 : std::size_t(guide.control.back()) + 1;
    const std::vector<Error> of_control = errors(controls, options, Rng(options.seed, std::uint64_t(i)));
    plan::ControlRollout& course = courses.emplace_back();
    course.from = system.start();
    double& most = asked[std::size_t(i - first)];
    const auto acting = [&guide, of_control, &most](std::size_t piece, const Control& control) {
      most = std::max(most, double(largest_force(control)));
      return with(
          piece < guide.control.size() ? of_control[std::size_t(guide.control[piece])] : of_control.back(),
          control);
    };
    if (by == By::replanning) {
      // Where a new plan is followed controls are not the old ones': the error of the last is theirs.
      plan::Replanner& replanner = *replanners.emplace_back(
          std::make_unique<plan::Replanner>(from(planned.world), from(world), course.from, plan.settings,
                                            planned.guide, plan::ReplanOptions{.every_s = options.replan_s}));
      course.next = [&replanner, &guide, &follower, acting](const State& state) -> std::optional<Control> {
        const std::optional<Control> control = replanner.next(state);
        if (!control) return std::nullopt;
        return acting(replanner.plans_found() > 0 ? guide.control.size() : follower.piece_at(state),
                      *control);
      };
    } else if (by == By::following)
      course.next = [&follower, acting](const State& state) -> std::optional<Control> {
        if (follower.is_over(state)) return std::nullopt;
        return acting(follower.piece_at(state), follower.next(state));
      };
    else
      for (std::size_t piece = 0; piece < guide.pieces.size(); ++piece)
        course.controls.push_back(acting(piece, guide.pieces[piece]));
  }
  plan::run(system, plan.settings, courses,
            {.settle = plan::ControlRolloutOptions::anywhere, .keep_frames = true, .ask_acceptable = false});
  const std::vector<int> before_legs = plan::controls_before_legs(plan);
  std::vector<Fate> fates;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    plan::ControlRollout& course = courses[i];
    const bool goes_by = reaches_all_via(plan, system, course, guide, before_legs);
    const plan::Trajectory path{course.controls, 0, plan.settings.frames_per_second, std::move(course.frames),
                                course.end};
    const MotionFigures figures = measure_motion(world, planned.bodies, path);
    Fate& fate = fates.emplace_back();
    fate.world = world_number;
    fate.reaches = course.result == plan::ControlRollout::rests_in_goal && goes_by;
    if (by == By::replanning) fate.searches = replanners[i]->searches();
    fate.end = goes_by ? name_of(course.result, plan.settings.settle.max_duration_s > 0) : "a via is missed";
    const Vec3 center_m = system.robot_center(course.end);
    fate.end_center_m = {center_m.x(), center_m.y(), center_m.z()};
    fate.distance_m = (center_m - system.goal_shift(course.end) - plan.settings.goal.center_of_mass_m).norm();
    fate.speed_m_s = system.mean_speed(course.end);
    fate.duration_s = course.costs.duration_s;
    fate.volume_change =
        *std::max_element(figures.largest_volume_change.begin(), figures.largest_volume_change.end());
    fate.penetration_m = figures.deepest_penetration_m;
    fate.min_stretch = figures.min_stretch, fate.largest_stretch = figures.largest_stretch;
    fate.overlap_m = figures.deepest_overlap_m, fate.self_overlap_m = figures.deepest_self_overlap_m;
    fate.asked_n = asked[i], fate.force_n = figures.largest_force_n;
    Promises table;
    check_shapes(figures, world, table);
    for (const Promise& row : table.rows())
      if (!row.kept) fate.broken.push_back(row.name);
  }
  return fates;
}

Tally tally_of(std::vector<Fate> fates, const Vec3& planned_end) {
  Tally tally;
  Fate& worst = tally.worst;
  for (const Fate& f : fates) {
    tally.reached += f.reaches, tally.keep_all += f.broken.empty(), tally.searches += f.searches;
    const double apart = (Vec3(f.end_center_m.data()) - planned_end).norm();
    tally.spread_m += apart * apart / double(fates.size());
    tally.farthest_m = std::max(tally.farthest_m, apart);
    worst.volume_change = std::max(worst.volume_change, f.volume_change);
    worst.penetration_m = std::max(worst.penetration_m, f.penetration_m);
    worst.min_stretch = std::min(worst.min_stretch, f.min_stretch);
    worst.largest_stretch = std::max(worst.largest_stretch, f.largest_stretch);
    worst.overlap_m = std::max(worst.overlap_m, f.overlap_m);
    worst.self_overlap_m = std::max(worst.self_overlap_m, f.self_overlap_m);
    worst.asked_n = std::max(worst.asked_n, f.asked_n), worst.force_n = std::max(worst.force_n, f.force_n);
    for (const std::string& promise : f.broken) ++tally.broken[promise];
  }
  tally.spread_m = std::sqrt(tally.spread_m);
  tally.fates = std::move(fates);
  return tally;
}

// What an earlier run did is not done again.
void replay_all(const Planned& planned, const RobustOptions& options, std::vector<Replays>& parts) {
  KeptReplays done(planned.folder, options);
  done.look_up(parts);
  std::vector<Replays*> left;
  for (Replays& part : parts)
    if (!part.is_done()) left.push_back(&part);
  if (left.size() < parts.size())
    log::info("{}: {} of {} are there already", options.folder.string(), parts.size() - left.size(),
              parts.size());
  std::mutex mutex;
  std::int64_t count = 0;
  Progress progress("replays", std::int64_t(left.size()));
  try {
    side_by_side(int(left.size()), [&](int i) {
      throw_if_stopped();
      Replays& part = *left[std::size_t(i)];
      const scenes::Scene scene =
          with_other_materials(planned.folder.scene, options.material_share,
                               Rng(options.seed, first_world_stream + std::uint64_t(part.world)));
      part.fates = replay(planned, options, part.by, scene, part.world, part.first, part.last);
      done.add(part);
      const std::lock_guard lock(mutex);
      progress.update(++count, fmt::format("world {}, {}", part.world, words_for(part.by)));
    });
  } catch (const Interrupted&) {
    if (done.keeps() && count > 0)
      log::info("{}: what is replayed is kept; the same command goes on", options.folder.string());
    throw;
  }
  done.put_in_order(parts);
}

}  // namespace

Robustness robust(const RobustOptions& options) {
  const NothingToKeep nothing_to_keep;
  const PlanFolder planned = read_folder_from_the_start(options.folder, "limber robust");
  if (!planned.plan.solved())
    throw InputError(
        fmt::format("{0}: its plan does not reach the goal, so there is nothing to perturb; plan on with "
                    "limber plan SCENE -o {0} --resume",
                    options.folder.string()));
  if (options.replan_s > 0 && !planned.plan.settings.via.empty())
    throw InputError(fmt::format(
        "{}: its plan has goals on the way, and --replan is of plans with one goal; leave --replan out",
        options.folder.string()));
  const auto [bodies, world] = read_world_of(planned, options.folder);
  const FemSystem system(world, goal_rules_of(planned.scene));
  const plan::Trajectory& path = planned.plan.trajectory;
  const Planned own{planned, bodies, world, plan::guide_of(system, planned.plan.settings, path)};
  const Vec3 planned_end = system.robot_center(path.end);

  const int n = options.perturbations, worlds = std::min(n, options.worlds);
  std::vector<By> ways{By::open_loop};
  if (options.follow) ways.push_back(By::following);
  if (options.replan_s > 0) ways.push_back(By::replanning);
  std::vector<Replays> parts;
  for (int w = 0; w < worlds; ++w)
    for (const By by : ways) parts.push_back({by, w, w * n / worlds, (w + 1) * n / worlds});
  replay_all(own, options, parts);
  const auto tally = [&](By by) {
    std::vector<Fate> fates;
    for (const Replays& part : parts)
      if (part.by == by) fates.insert(fates.end(), part.fates.begin(), part.fates.end());
    return tally_of(std::move(fates), planned_end);
  };
  Robustness result{.open_loop = tally(By::open_loop),
                    .followed = {},
                    .replanned = {},
                    .max_force_n = planned.plan.settings.max_force_n,
                    .settles = planned.plan.settings.settle.max_duration_s > 0};
  if (options.follow) result.followed = tally(By::following);
  if (options.replan_s > 0) result.replanned = tally(By::replanning);
  return result;
}

}  // namespace limber::detail
