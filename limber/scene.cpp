#include "limber/scene.h"

#include <atomic>
#include <climits>
#include <limits>

#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/lock.h"
#include "core/progress.h"
#include "core/threads.h"
#include "fem/observe.h"
#include "limber/detail/interface/arrays.h"
#include "limber/detail/interface/body.h"
#include "limber/detail/interface/problem.h"
#include "limber/detail/interface/ranges.h"
#include "limber/detail/interface/working_for.h"
#include "plan/control_rollout.h"
#include "plan/settings.h"
#include "plan/simulation.h"
#include "scenes/library.h"

namespace limber {

using detail::working_for;

Scene::Scene(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
const std::string& Scene::name() const { return impl_->scene.name; }
const std::string& Scene::text() const { return impl_->scene.text; }
const std::string& Scene::robot() const { return impl_->scene.bodies[std::size_t(impl_->scene.robot)].name; }
std::optional<Scene::Goal> Scene::goal() const {
  if (!impl_->scene.lacks.empty()) return std::nullopt;
  const scenes::Goal& goal = impl_->scene.goal;
  const Vec3& at = goal.center_of_mass_m;
  return Goal{{at.x(), at.y(), at.z()}, goal.radius_m};
}
double Scene::max_force_n() const { return impl_->scene.planner.max_force_n; }
std::vector<std::string> Scene::bodies() const {
  std::vector<std::string> names;
  for (const scenes::BodySpec& body : impl_->scene.bodies) names.push_back(body.name);
  return names;
}

Scene read_scene(const std::string& file_or_name, const SceneOptions& options) {
  std::vector<std::string> sets = options.sets;
  if (!options.preset.empty()) sets.push_back("planner.preset=" + options.preset);
  for (const std::filesystem::path& folder : options.data)
    if (!std::filesystem::is_directory(folder))
      throw InputError(fmt::format("data: {} is no folder", folder.string()));
  return working_for({}, [&] {
    return Scene(std::make_shared<Scene::Impl>(
        Scene::Impl{scenes::read_scene_file(scenes::find_scene(file_or_name), sets), options.data}));
  });
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const scenes::KnownScene& known : scenes::known_scenes()) names.push_back(known.name);
  return names;
}

namespace {

State state_of(const States& states, int row) {
  const std::size_t numbers = 3 * std::size_t(states.nodes), first = std::size_t(row) * numbers;
  const auto part = [&](const std::vector<float>& all) {
    return std::vector<float>(all.begin() + std::ptrdiff_t(first),
                              all.begin() + std::ptrdiff_t(first + numbers));
  };
  return {states.steps[std::size_t(row)], part(states.positions), part(states.velocities)};
}

void append(States& states, const State& state, bool sound) {
  states.nodes = int(state.positions.size() / 3);
  ++states.count;
  states.steps.push_back(state.step);
  states.positions.insert(states.positions.end(), state.positions.begin(), state.positions.end());
  states.velocities.insert(states.velocities.end(), state.velocities.begin(), state.velocities.end());
  states.sound.push_back(sound);
}

constexpr std::int64_t largest_exact = std::int64_t{1}
                                       << 53;  // of a double, in which scenes and JSON have it

void require_states(const States& states, int nodes) {
  const std::size_t count = std::size_t(std::max(states.count, 0)), numbers = count * std::size_t(nodes) * 3;
  if (states.count < 0 || states.nodes != nodes || states.steps.size() != count ||
      states.positions.size() != numbers || states.velocities.size() != numbers)
    throw InputError(fmt::format(
        "states: {} of {} nodes, with {} steps, {} positions and {} velocities; a state of this world has "
        "{} nodes, one step, and three positions and velocities a node",
        states.count, states.nodes, states.steps.size(), states.positions.size(), states.velocities.size(),
        nodes));
  if (!states.sound.empty() && states.sound.size() != count)
    throw InputError(fmt::format("states: {} of {} are said to be sound or not; give one each, or none",
                                 states.sound.size(), count));
  for (std::size_t i = 0; i < count; ++i)
    if (states.steps[i] < 0 || states.steps[i] > largest_exact)
      throw InputError(
          fmt::format("state {}: its step is {}; it must be in [0, {}]", i, states.steps[i], largest_exact));
  for (const auto* all : {&states.positions, &states.velocities})
    for (const float x : *all)
      if (!std::isfinite(x)) throw InputError("states: a position or a velocity is not finite");
}

Control control_of(const Push& push, int row, const fem::Body& robot) {
  const int robot_nodes = robot.node_count();
  const auto require = [&](bool holds, const std::string& what) {
    if (!holds) throw InputError(fmt::format("push {}: {}", row, what));
  };
  const int kind = int(push.kind);
  require(kind >= 0 && kind <= 4, fmt::format("kind {} is none", kind));
  require(push.steps > 0, fmt::format("steps is {}; it must be above 0", push.steps));
  for (const float x : {push.force_n[0], push.force_n[1], push.force_n[2], push.target_m[0], push.target_m[1],
                        push.target_m[2], push.radius_m, push.max_force_n, push.second_force_n[0],
                        push.second_force_n[1], push.second_force_n[2], push.pressure_pa})
    require(std::isfinite(x), "a number of it is not finite");
  require(push.max_force_n >= 0 && push.radius_m >= 0, "max_force_n and radius_m must not be negative");
  require(push.pressure_pa >= 0, "pressure_pa must not be negative");
  require(push.pressure_pa == 0 || robot.kind == fem::BodyKind::deformable,
          "pressure_pa blows up soft robots alone, and this one is rigid; leave it 0");
  if (push.kind == Push::Kind::control_point)
    require(push.node >= 0 && push.node < robot_nodes,
            fmt::format("node is {}; the robot has the nodes 0 … {}", push.node, robot_nodes - 1));
  require(push.second_node >= -1 && push.second_node < robot_nodes &&
              (push.second_node < 0 || push.kind == Push::Kind::control_point),
          fmt::format("second_node is {}; it must be -1, or of a control_point a node in [0, {}]",
                      push.second_node, robot_nodes - 1));
  return {.manipulation = Manipulation(kind),
          .force_n = {push.force_n[0], push.force_n[1], push.force_n[2]},
          .node = push.node,
          .radius_m = push.radius_m,
          .target_m = {push.target_m[0], push.target_m[1], push.target_m[2]},
          .max_force_n = push.max_force_n,
          .steps = push.steps,
          .second_node = push.second_node,
          .second_force_n = {push.second_force_n[0], push.second_force_n[1], push.second_force_n[2]},
          .pressure_pa = push.pressure_pa};
}

Push push_of(const Control& c) {
  return {.kind = Push::Kind(int(c.manipulation)),
          .force_n = {c.force_n.x(), c.force_n.y(), c.force_n.z()},
          .node = c.node,
          .radius_m = c.radius_m,
          .target_m = {c.target_m.x(), c.target_m.y(), c.target_m.z()},
          .max_force_n = c.max_force_n,
          .steps = c.steps,
          .second_node = c.second_node,
          .second_force_n = {c.second_force_n.x(), c.second_force_n.y(), c.second_force_n.z()},
          .pressure_pa = c.pressure_pa};
}

detail::BodiesAndWorld prepare_world(const Scene::Impl& scene, const std::filesystem::path& folder) {
  make_folder(folder);
  const FolderLock lock(folder, FolderLock::alone);
  std::vector<detail::PreparedBody> bodies = detail::prepare_bodies(scene.scene, scene.data, folder);
  fem::World world = detail::build_world_in(folder, {}, scene.scene, bodies);
  return {std::move(bodies), std::move(world)};
}

}  // namespace

Problem::Impl::Impl(const Scene& of, const std::filesystem::path& work_folder,
                    const std::function<detail::BodiesAndWorld(const std::filesystem::path&)>& make)
    : scene(of),
      folder(work_folder),
      made(make(folder.path())),
      system(world),
      state_numbers(3 * std::size_t(world.moving_nodes)) {
  for (std::size_t b = 0; b < prepared.size(); ++b)
    bodies.push_back(
        detail::body_of(prepared[b], detail::body_folder(folder.path(), of.impl().scene.bodies[b])));
}

Problem::Impl::Impl(const Scene& of, const std::filesystem::path& work_folder)
    : Impl(of, work_folder, [&](const std::filesystem::path& in) { return prepare_world(of.impl(), in); }) {}

Problem::Impl::Impl(const detail::PlanFolder& planned, const std::filesystem::path& of_plan)
    : Impl(Scene(std::make_shared<Scene::Impl>(Scene::Impl{planned.scene, {}})), of_plan,
           [&](const std::filesystem::path& in) { return detail::read_world_of(planned, in); }) {}

Problem::Problem(const Scene& scene, const std::filesystem::path& work_folder, const Context& context)
    : impl_(working_for(context, [&] { return std::make_shared<const Impl>(scene, work_folder); })) {}
Problem::Problem(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

const Scene& Problem::scene() const { return impl_->scene; }
const std::vector<Body>& Problem::bodies() const { return impl_->bodies; }
double Problem::dt_s() const { return impl_->world.dt_s; }
int Problem::nodes() const { return impl_->world.moving_nodes; }

Problem::Range Problem::nodes_of(int body) const {
  if (body < 0 || body >= int(impl_->world.bodies.size()))
    throw InputError(
        fmt::format("there is no body {}; they are 0 … {}", body, impl_->world.bodies.size() - 1));
  const fem::Body& b = impl_->world.bodies[std::size_t(body)];
  return b.moving ? Range{b.first_node, b.node_count()} : Range{};
}

States Problem::start(int copies) const {
  constexpr double max_bytes = 16e9;
  const double bytes = double(copies) * 6 * sizeof(float) * nodes();
  if (copies < 0 || bytes > max_bytes)
    throw InputError(fmt::format("copies is {}; it must be in [0, {}], so that states take at most {:g} GB",
                                 copies, std::int64_t(max_bytes / (6 * sizeof(float) * std::max(1, nodes()))),
                                 1e-9 * max_bytes));
  States states;
  states.nodes = nodes();
  const State start = impl_->system.start();
  for (int i = 0; i < copies; ++i) append(states, start, true);
  return states;
}

namespace {

// Rollouts in the order of their numbers, to whichever thread asks.
class RolloutsInOrder final : public plan::RolloutSource {
 public:
  RolloutsInOrder(std::vector<plan::Rollout>& rollouts, std::atomic<std::size_t>& next, int at_once)
      : rollouts_(rollouts), next_(next), at_once_(at_once) {}
  int at_once() const override { return at_once_; }
  plan::Rollout* next() override {
    const std::size_t i = stop_signal() ? rollouts_.size() : next_++;
    return i < rollouts_.size() ? &rollouts_[i] : nullptr;
  }
  void done(plan::Rollout&) override {}
  bool wanted() override { return stop_signal() == 0; }

 private:
  std::vector<plan::Rollout>& rollouts_;
  std::atomic<std::size_t>& next_;
  int at_once_;
};

}  // namespace

States Problem::rollout(const States& states, const std::vector<Push>& pushes, const Context& context) const {
  require_states(states, nodes());
  if (int(pushes.size()) != states.count)
    throw InputError(
        fmt::format("{} pushes for {} states; there must be one a state", pushes.size(), states.count));
  const fem::World& world = impl_->world;
  const fem::Body& robot = world.bodies[std::size_t(world.robot)];
  std::vector<State> from;
  std::vector<plan::Rollout> rollouts(pushes.size());
  for (int i = 0; i < states.count; ++i) from.push_back(state_of(states, i));
  for (std::size_t i = 0; i < rollouts.size(); ++i)
    rollouts[i].from = &from[i], rollouts[i].control = control_of(pushes[i], int(i), robot);

  return working_for(context, [&] {
    const int lanes = std::max(1, impl_->system.lanes());
    const int threads = std::clamp((states.count + lanes - 1) / lanes, 1, thread_count());
    const int at_once = std::clamp((states.count + threads - 1) / threads, 1, lanes);
    std::atomic<std::size_t> next{0};
    parallel_for(threads, [&](int) {
      std::unique_ptr<plan::Propagator> propagator;
      {
        const std::lock_guard lock(impl_->mutex);
        if (!impl_->idle.empty()) propagator = std::move(impl_->idle.back()), impl_->idle.pop_back();
      }
      if (!propagator) propagator = impl_->system.make_propagator();
      RolloutsInOrder supply(rollouts, next, at_once);
      propagator->run(supply, INT_MAX);
      const std::lock_guard lock(impl_->mutex);
      impl_->idle.push_back(std::move(propagator));
    });
    throw_if_stopped();
    States ends;
    ends.nodes = nodes();
    for (std::size_t i = 0; i < rollouts.size(); ++i) {
      const bool was_sound =
          i >= states.sound.size() || states.sound[i];  // who makes states may leave it out
      append(ends, rollouts[i].to, was_sound && rollouts[i].ok);
    }
    return ends;
  });
}

std::vector<std::array<double, 3>> Problem::robot_centers(const States& states) const {
  require_states(states, nodes());
  std::vector<std::array<double, 3>> centers;
  for (int i = 0; i < states.count; ++i) {
    const Vec3 c = impl_->system.robot_center(state_of(states, i));
    centers.push_back({c.x(), c.y(), c.z()});
  }
  return centers;
}

namespace {

// Before the search, which would be lost.
void validate(const SolveOptions& options) {
  using detail::require_in;
  if (options.seed) require_in("seed", *options.seed, 0, largest_exact);
  if (options.iterations) require_in("iterations", *options.iterations, 0, plan::iteration_limit);
  require_in("time_limit_s", options.time_limit_s, 0, std::numeric_limits<double>::infinity());
  if (options.shortcut_rounds) require_in("shortcut_rounds", *options.shortcut_rounds, 0, 100'000);
  plan::cost_kind_from(options.cost);
}

Plan search(const Problem& problem, const Plan* earlier, const SolveOptions& options,
            const Context& context) {
  validate(options);
  return working_for(context, [&] {
    PlanOptions command;
    command.seed = options.seed, command.iterations = options.iterations;
    command.time_limit_s = options.time_limit_s;
    command.shortcut_rounds = options.shortcut_rounds;
    command.cost = options.cost;
    command.improve = options.improve;
    const Problem::Impl& p = problem.impl();
    const scenes::Scene& scene = p.scene.impl().scene;
    scenes::require_plannable(scene);
    const detail::FemSystem system(p.world, p.prepared, detail::goal_rules_of(scene));
    system.surfaces()->require_apart(system.start(), true);
    std::optional<plan::Plan> begun;
    Json summary;
    if (earlier) {
      begun = earlier->impl().plan;
      if (begun->simulation) throw InputError("the earlier plan is a simulation, and no search");
      if (begun->system_hash != system.hash())
        throw InputError("the earlier plan was made for another world than this scene's; solve anew");
      detail::require_of_world(*begun, p.world, "the earlier plan");
      summary = earlier->impl().summary.is_null() ? earlier->impl().extra : earlier->impl().summary;
    }
    detail::Found found = detail::find_plan(scene, system, command, std::move(begun), summary);
    return Plan(std::make_shared<Plan::Impl>(problem, std::move(found.plan), std::move(found.extra)));
  });
}

}  // namespace

Plan Problem::solve(const SolveOptions& options, const Context& context) const {
  return search(*this, nullptr, options, context);
}

Plan Problem::resume(const Plan& earlier, const SolveOptions& options, const Context& context) const {
  return search(*this, &earlier, options, context);
}

Plan Problem::simulate(double duration_s, const Context& context) const {
  return working_for(context, [&] {
    const scenes::FilmSpec& film = impl_->scene.impl().scene.film;
    detail::Surfaces(impl_->world, impl_->prepared).require_apart(impl_->system.start(), false);
    return Plan(std::make_shared<Plan::Impl>(
        *this, plan::simulate_for(impl_->system, duration_s, film.frames_per_second / film.speed)));
  });
}

const detail::MotionFigures& Plan::Impl::motion_figures() const {
  std::call_once(measured, [&] {
    const Problem::Impl& p = problem.impl();
    figures = detail::measure_motion(p.world, p.prepared, plan.trajectory);
  });
  return figures;
}

Plan::Plan(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Plan Plan::load(const std::filesystem::path& folder) {
  return working_for({}, [&] {
    detail::PlanFolder planned = detail::read_plan_folder(folder);
    const auto problem = std::make_shared<const Problem::Impl>(planned, folder);
    auto impl = std::make_shared<Plan::Impl>(Problem(problem), std::move(planned.plan));
    impl->summary = std::move(planned.summary);
    return Plan(std::move(impl));
  });
}

const Problem& Plan::problem() const { return impl_->problem; }
bool Plan::solved() const { return impl_->plan.solved(); }
std::string Plan::explanation() const { return plan::explain(impl_->plan); }
std::int64_t Plan::iterations() const { return impl_->plan.statistics.iterations; }
int Plan::nodes_in_tree() const { return plan::nodes_of(impl_->plan); }
double Plan::duration_s() const {
  return double(impl_->plan.trajectory.end.step - impl_->plan.tree.states.steps()[0]) * impl_->problem.dt_s();
}
double Plan::frames_per_second() const { return impl_->plan.settings.frames_per_second; }
int Plan::frame_count() const { return int(impl_->plan.trajectory.frames.size()); }
std::string Plan::tree_hash() const { return hex(plan::tree_hash_of(impl_->plan)); }
std::string Plan::trajectory_hash() const { return hex(plan::hash_of(impl_->plan.trajectory)); }

States Plan::frames() const {
  States states;
  states.nodes = impl_->problem.nodes();
  for (const State& frame : impl_->plan.trajectory.frames) append(states, frame, true);
  return states;
}

std::vector<Push> Plan::pushes() const {
  std::vector<Push> pushes;
  for (const Control& control : impl_->plan.trajectory.controls) pushes.push_back(push_of(control));
  return pushes;
}

Vertices Plan::surface(int body, int frame) const {
  const Problem::Impl& p = impl_->problem.impl();
  const std::vector<State>& frames = impl_->plan.trajectory.frames;
  impl_->problem.nodes_of(body);  // complains of one that is not there
  if (frame < 0 || frame >= int(frames.size()))
    throw InputError(fmt::format("there is no frame {}; they are 0 … {}", frame, frames.size() - 1));
  Points moved;
  detail::deform(p.prepared[std::size_t(body)],
                 fem::body_positions(p.world, frames[std::size_t(frame)], body), moved);
  return detail::vertices_of(moved);
}

namespace {

detail::FemSystem system_of(const Plan::Impl& plan) {
  const Problem::Impl& p = plan.problem.impl();
  if (plan.plan.simulation) return detail::FemSystem(p.world);
  return detail::FemSystem(p.world, p.prepared, detail::goal_rules_of(p.scene.impl().scene));
}

}  // namespace

std::string Plan::summary_json(const Context& context) const {
  if (!impl_->summary.is_null()) return text_of(impl_->summary, 2);
  return working_for(context, [&] {
    Json summary = detail::facts_of(impl_->plan, impl_->problem.impl().world, system_of(*impl_),
                                    impl_->motion_figures());
    if (!impl_->extra.is_null()) summary.update(impl_->extra);
    return text_of(summary, 2);
  });
}

void Plan::save(const std::filesystem::path& folder, const SaveOptions& options,
                const Context& context) const {
  detail::require_one_of("keep_tree", options.keep_tree, {"all", "path"});
  const bool path_alone = options.keep_tree == "path";
  working_for(context, [&] {
    const Problem::Impl& p = impl_->problem.impl();
    make_folder(folder);
    if (!impl_->summary.is_null()) {
      if (!std::filesystem::equivalent(folder, p.folder.path()))
        throw InputError(fmt::format("{}: the plan was read from {}, where it is; copy that folder",
                                     folder.string(), p.folder.path().string()));
      if (path_alone && !impl_->plan.left_out && !impl_->plan.simulation)
        throw InputError(fmt::format(
            "{}: holds the whole tree, and stays as it is; plan anew with keep_tree path", folder.string()));
      return;
    }
    const FolderLock lock(folder, FolderLock::alone);
    if (!std::filesystem::equivalent(folder, p.folder.path()))
      for (const char* part : {"bodies", "scenery"})
        if (std::error_code failed; std::filesystem::exists(p.folder.path() / part)) {
          std::filesystem::copy(
              p.folder.path() / part, folder / part,
              std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing,
              failed);
          if (failed)
            throw DiskError(
                fmt::format("{}: writing it failed: {}", (folder / part).string(), failed.message()));
        }
    plan::Plan plan = impl_->plan;
    const detail::MotionFigures figures = impl_->motion_figures();
    if (path_alone) detail::leave_path_alone(plan, impl_->extra, folder);
    detail::keep_measured_plan(folder, p.scene.impl().scene, p.prepared, p.world, system_of(*impl_), plan,
                               figures, impl_->extra);
  });
}

}  // namespace limber
