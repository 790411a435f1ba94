#include "limber/detail/plan/simulate.h"

#include "core/error.h"
#include "core/events.h"
#include "core/hash.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/temporary_files.h"
#include "fem/observe.h"
#include "limber/detail/plan/follow_plan.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/scene_world.h"
#include "limber/detail/world/script_doubts.h"
#include "plan/simulation.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

// Of a body's size: a kinematic body's keyframes must have it there, or it would be thrown.
constexpr double same_place = 1e-4;

void require_same_place(const Points& there, const Points& now, const fem::Body& body, double time_s,
                        const std::string& what) {
  const double farthest = (there - now).rowwise().norm().maxCoeff();
  if (farthest > same_place * bounding_box(body.cage.positions).size().maxCoeff())
    throw InputError(
        fmt::format("{}: body {} is {:.3g} m from where its keyframes have it at {:.4g} s; give "
                    "keyframes that pass there then",
                    what, body.name, farthest, time_s));
}

void require_bodies_of(const fem::World& there, const fem::World& world, const std::string& what) {
  std::vector<std::string> theirs, ours;
  for (const fem::Body& body : there.bodies)
    if (body.pushed()) theirs.push_back(body.name);
  for (const fem::Body& body : world.bodies)
    if (body.pushed()) ours.push_back(body.name);
  const bool any = std::any_of(ours.begin(), ours.end(), [&](const std::string& name) {
    return std::find(theirs.begin(), theirs.end(), name) != theirs.end();
  });
  if (!any)
    throw InputError(fmt::format(
        "{}: is of another scene: there {} can be pushed, and here {}; name a folder in which one "
        "of these moves",
        what, fmt::join(theirs, ", "), fmt::join(ours, ", ")));
}

void require_options(const SimulateOptions& options) {
  if (options.duration_s && !(*options.duration_s > 0))
    throw InputError(fmt::format("--duration is {} s; it must be above 0, for example --duration 5s",
                                 *options.duration_s));
  if (options.follow.empty()) return;
  if (!options.from.empty())
    throw InputError("--follow begins where the plan begins, and --from elsewhere; leave one of the two out");
  if (options.resume) throw InputError("--resume does not go with --follow; simulate anew, without --resume");
  if (fs::exists(options.out) && fs::exists(options.follow) && fs::equivalent(options.follow, options.out))
    throw InputError(fmt::format("{}: is the folder of the plan that is followed; name another with -o",
                                 options.out.string()));
}

void require_frame(const fs::path& folder, const PlanFolder& other, int frame) {
  const std::size_t frames = other.plan.trajectory.frames.size();
  if (frame < 0 || std::size_t(frame) >= frames)
    throw InputError(fmt::format("{}: frame {}: there is none; its frames are 0 … {}", folder.string(), frame,
                                 frames - 1));
}

}  // namespace

std::optional<OtherMotion> read_other_motion(const fs::path& from, std::optional<int> frame) {
  if (frame && from.empty())
    throw InputError("--frame goes with --from DIR: it is a frame of the motion in that folder");
  if (from.empty()) return std::nullopt;
  OtherMotion other{from, read_plan_folder(from), 0};
  other.frame = frame.value_or(int(other.planned.plan.trajectory.frames.size()) - 1);
  require_frame(from, other.planned, other.frame);
  return other;
}

Beginning beginning_of(const std::optional<OtherMotion>& other, const fs::path& out,
                       const scenes::Scene& scene, const fem::World& world) {
  if (!other) return {};
  return {start_from(other->folder, other->planned, other->frame, scene, world),
          BeginningTold{fs::relative(other->folder, out).generic_string(), other->frame,
                        hex(plan::hash_of(other->planned.plan.trajectory))}};
}

void require_other_folder(const fs::path& from, const fs::path& out) {
  if (!from.empty() && fs::exists(out) && fs::exists(from) && fs::equivalent(from, out))
    throw InputError(
        fmt::format("{}: is the folder that this motion begins from; name another with -o", out.string()));
}

State start_from(const fs::path& folder, const PlanFolder& other, int frame, const scenes::Scene& scene,
                 const fem::World& world) {
  const std::string what = fmt::format("{}: frame {}", folder.string(), frame);
  require_frame(folder, other, frame);
  const State& there = other.plan.trajectory.frames[std::size_t(frame)];
  const fem::World world_there = read_world_of(other, folder).world;
  require_bodies_of(world_there, world, what);
  State start = fem::start_state(world);
  start.step = std::llround(double(there.step) * world_there.dt_s / world.dt_s);
  fem::follow_keyframes(world, start);
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const fem::Body& body = world.bodies[b];
    const auto same = std::find_if(world_there.bodies.begin(), world_there.bodies.end(),
                                   [&](const fem::Body& one) { return one.name == body.name; });
    if (!body.moving || same == world_there.bodies.end()) continue;
    if (hash_of(same->cage) != hash_of(body.cage))
      throw InputError(
          fmt::format("{}: body {} has another cage there; simulate from a folder of the same cages, "
                      "or call it otherwise",
                      scene.bodies[b].where, body.name));
    if (body.kind == fem::BodyKind::kinematic)
      require_same_place(fem::body_positions(world_there, there, int(same - world_there.bodies.begin())),
                         fem::body_positions(world, start, int(b)), body, fem::time_s(world, start), what);
    if (!same->moving) continue;
    const auto from = std::ptrdiff_t(3 * same->first_node), to = std::ptrdiff_t(3 * body.first_node),
               count = std::ptrdiff_t(3 * body.node_count());
    std::copy_n(there.positions.begin() + from, count, start.positions.begin() + to);
    std::copy_n(there.velocities.begin() + from, count, start.velocities.begin() + to);
  }
  return start;
}

KeptPlan simulate(const SimulateOptions& options) {
  require_options(options);
  require_other_folder(options.from, options.out);
  const scenes::Scene scene =
      scenes::read_scene_file(scenes::find_scene(options.scene.scene), options.scene.sets, options.script);
  const std::optional<OtherMotion> other = read_other_motion(options.from, options.frame);
  make_folder(options.out);
  const FolderLock lock(options.out, FolderLock::alone);
  if (!options.resume) tell_what_is_replaced(options.out);
  remove_abandoned(options.out);
  const std::vector<PreparedBody> bodies =
      prepare_bodies(scene, options.scene.data, options.out, options.scene.store,
                     options.from.empty() ? options.follow : options.from);
  const fem::World world = build_world_in(options.out, options.scene.store, scene, bodies);
  const Beginning beginning = beginning_of(other, options.out, scene, world);
  const FemSystem system(world, {}, beginning.start);
  const Surfaces surfaces(world, bodies);
  surfaces.require_apart(system.start(), false);
  std::optional<FollowedPlan> followed;
  if (!options.follow.empty()) followed.emplace(options.follow, scene, world);
  const double duration_s = options.duration_s.value_or(followed ? followed->duration_s() : 5);
  const double begins_s = fem::time_s(world, system.start());
  for (const std::string& doubt : doubts_of_script(scene, world, begins_s, begins_s + duration_s))
    log::warn("{}", doubt);
  const fs::path file = options.out / "plan.npz";

  std::optional<plan::Plan> earlier;
  if (options.resume) {
    if (!fs::exists(file))
      throw InputError(fmt::format("{}: there is none to go on from; leave --resume out", file.string()));
    earlier = read_plan_folder(options.out).plan;
    if (earlier->system_hash == system.hash()) require_of_world(*earlier, world, options.out);
  }
  plan::Plan plan;
  try {
    Progress progress("simulating", std::int64_t(1000 * duration_s));
    const double frames_per_second = scene.film.frames_per_second / scene.film.speed;
    plan = plan::simulate_for(
        system, duration_s, frames_per_second, std::move(earlier),
        [&](double now_s) { progress.update(std::int64_t(1000 * now_s), fmt::format("{:.2f} s", now_s)); },
        followed ? [&](const State& state) { return followed->next(state); } : plan::Steer());
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", options.resume ? file.string() : "--duration", error.what()));
  }
  MotionFigures figures;
  try {
    const NothingToKeep nothing_to_keep;
    if (!is_unmeasured(plan)) figures = measure_motion(world, bodies, plan.trajectory, &surfaces);
  } catch (const Interrupted&) {
    plan.simulation->ending = plan::Simulation::stopped;
  }
  Json extra;
  if (beginning.from) extra["from"] = json_of_fields(*beginning.from);
  if (followed) extra["follows"] = json_of_fields(followed->facts(plan, options.out));
  KeptPlan kept = keep_measured_plan(options.out, scene, bodies, world, system, plan, figures, extra);
  if (stop_signal() != 0) {
    log::info("{}: what was simulated is kept; {}", file.string(),
              followed ? "simulate anew for the rest" : "go on with --resume");
    throw_if_stopped();
  }
  return kept;
}

}  // namespace limber::detail
