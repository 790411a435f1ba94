// OMPL's planners with controls (Şucan, Moll, Kavraki, The Open Motion Planning Library, IEEE RAM 2012) on
// limber's propagator, beside limber's own search: same scene, same manipulations, same forces and durations,
// same goal. docs/planning.md, "Beside OMPL".
//
//   ompl_bench SCENE -o DIR [--seeds 1-30] [--time-limit S] [--only RRT,paper] [--json]
//
// A run leaves a record in DIR/runs as those of `limber bench` are, so the same command goes on where it was
// stopped, and `limber bench --merge DIR… -o OUT` makes curves of all.
//
// OMPL asks for one rollout at a time, in pieces of `step_s`, after each of which the state is checked; so a
// rollout is one lane (a Batch of one). What is drawn is what limber draws: the manipulation by its weight,
// the magnitude, the duration. Where OMPL has a state to go to (RRT, EST, PDST) the push is towards its
// centre of mass, as in limber; else (KPIECE1, SST) its direction is random. Goal: the centre of mass in the
// ball, and coming to rest there, by limber's own test. Where the goal moves with a body, OMPL's places are
// those seen from it. What frames show beyond that a state is sound is not asked of OMPL's ways.
#include <fmt/format.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/goals/GoalSampleableRegion.h>
#include <ompl/control/DirectedControlSampler.h>
#include <ompl/control/PathControl.h>
#include <ompl/control/SpaceInformation.h>
#include <ompl/control/planners/est/EST.h>
#include <ompl/control/planners/kpiece/KPIECE1.h>
#include <ompl/control/planners/pdst/PDST.h>
#include <ompl/control/planners/rrt/RRT.h>
#include <ompl/control/planners/sst/SST.h>
#include <ompl/util/Console.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/threads.h"
#include "limber/detail/bench/bench.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/scene_world.h"

namespace limber::detail {
namespace {

namespace ob = ompl::base;
namespace oc = ompl::control;

constexpr double step_s = 0.1;  // durations are whole multiples, as OMPL has them

// One problem, and what its solving has cost so far.
struct Problem {
  const FemSystem& system;
  const plan::Settings& settings;
  std::unique_ptr<plan::Propagator> propagator;
  int steps = plan::steps_of(step_s, system.dt_s());  // of the dynamics, a piece
  mutable std::int64_t controls = 0;                  // drawn: limber's iterations
  mutable bool reached = false;                       // SST would go on, to better the path

  unsigned pieces(double duration_s) const {
    return unsigned(std::max(1L, std::lround(duration_s / step_s)));
  }
};

// limber's state as OMPL handles it. Sampled states are only a place: `state` is empty.
class NodeSpace final : public ob::StateSpace {
 public:
  struct StateType : ob::State {
    limber::State state;
    Vec3 center = Vec3::Zero();  // of the robot, seen from a goal that moves
    Vec3 shift = Vec3::Zero();   // by which the goal has moved
    bool good = true;
  };
  static StateType& of(ob::State* s) { return *static_cast<StateType*>(s); }
  static const StateType& of(const ob::State* s) { return *static_cast<const StateType*>(s); }

  explicit NodeSpace(const Box& bounds) : bounds_(bounds) { setName("limber"); }
  const Box& bounds() const { return bounds_; }

  unsigned getDimension() const override { return 3; }
  double getMaximumExtent() const override { return bounds_.size().norm(); }
  double getMeasure() const override { return bounds_.size().prod(); }
  void enforceBounds(ob::State* s) const override {
    of(s).center = of(s).center.cwiseMax(bounds_.lower).cwiseMin(bounds_.upper);
  }
  bool satisfiesBounds(const ob::State*) const override { return true; }  // walls see to it
  void copyState(ob::State* to, const ob::State* from) const override {
    StateType& a = of(to);
    const StateType& b = of(from);
    a.state = b.state, a.center = b.center, a.shift = b.shift, a.good = b.good;
  }
  double distance(const ob::State* a, const ob::State* b) const override {
    return (of(a).center - of(b).center).norm();
  }
  bool equalStates(const ob::State* a, const ob::State* b) const override {
    return of(a).state == of(b).state && of(a).center == of(b).center;
  }
  void interpolate(const ob::State* a, const ob::State* b, double t, ob::State* s) const override {
    const Vec3 center = of(a).center + t * (of(b).center - of(a).center);
    of(s).state = limber::State(), of(s).center = center, of(s).shift.setZero(), of(s).good = true;
  }
  ob::State* allocState() const override { return new StateType; }
  void freeState(ob::State* s) const override { delete &of(s); }
  ob::StateSamplerPtr allocDefaultStateSampler() const override;
  void registerProjections() override;

 private:
  Box bounds_;
};

class PlaceSampler final : public ob::StateSampler {
 public:
  using ob::StateSampler::StateSampler;
  void sampleUniform(ob::State* s) override {
    const Box& b = static_cast<const NodeSpace*>(space_)->bounds();
    set(s, [&](int axis) { return rng_.uniformReal(b.lower[axis], b.upper[axis]); });
  }
  void sampleUniformNear(ob::State* s, const ob::State* near, double distance) override {
    const Vec3 center = NodeSpace::of(near).center;
    set(s, [&](int axis) { return rng_.uniformReal(center[axis] - distance, center[axis] + distance); });
  }
  void sampleGaussian(ob::State* s, const ob::State* mean, double deviation) override {
    const Vec3 center = NodeSpace::of(mean).center;
    set(s, [&](int axis) { return rng_.gaussian(center[axis], deviation); });
  }

 private:
  template <class Coordinate>
  void set(ob::State* s, const Coordinate& coordinate) {
    auto& place = NodeSpace::of(s);
    place.state = limber::State(), place.shift.setZero(), place.good = true;
    for (int axis = 0; axis < 3; ++axis) place.center[axis] = coordinate(axis);
    space_->enforceBounds(s);
  }
};

ob::StateSamplerPtr NodeSpace::allocDefaultStateSampler() const {
  return std::make_shared<PlaceSampler>(this);
}

class CenterProjection final : public ob::ProjectionEvaluator {
 public:
  CenterProjection(const ob::StateSpace* space, const Box& bounds) : ob::ProjectionEvaluator(space) {
    constexpr double cells_an_axis = 10;
    ob::RealVectorBounds b(3);
    std::vector<double> cells;
    for (int axis = 0; axis < 3; ++axis) {
      b.setLow(unsigned(axis), bounds.lower[axis]), b.setHigh(unsigned(axis), bounds.upper[axis]);
      cells.push_back(bounds.size()[axis] / cells_an_axis);
    }
    setBounds(b);
    setCellSizes(cells);
  }
  unsigned getDimension() const override { return 3; }
  void project(const ob::State* s, Eigen::Ref<Eigen::VectorXd> out) const override {
    out = NodeSpace::of(s).center;
  }
};

void NodeSpace::registerProjections() {
  registerDefaultProjection(std::make_shared<CenterProjection>(this, bounds_));
}

class ControlSpace final : public oc::ControlSpace {
 public:
  struct ControlType : oc::Control {
    limber::Control control;
  };
  static limber::Control& of(oc::Control* c) { return static_cast<ControlType*>(c)->control; }
  static const limber::Control& of(const oc::Control* c) {
    return static_cast<const ControlType*>(c)->control;
  }

  ControlSpace(const ob::StateSpacePtr& states, const Problem& problem)
      : oc::ControlSpace(states), problem_(problem) {}
  const Problem& problem() const { return problem_; }

  unsigned getDimension() const override { return 3; }
  oc::Control* allocControl() const override { return new ControlType; }
  void freeControl(oc::Control* c) const override { delete static_cast<ControlType*>(c); }
  void copyControl(oc::Control* to, const oc::Control* from) const override { of(to) = of(from); }
  bool equalControls(const oc::Control* a, const oc::Control* b) const override { return of(a) == of(b); }
  void nullControl(oc::Control* c) const override { of(c) = limber::Control(); }
  oc::ControlSamplerPtr allocDefaultControlSampler() const override;

 private:
  const Problem& problem_;
};

// What limber draws for an expansion from `center` towards `point`, both seen from the goal, with OMPL's
// random numbers.
limber::Control draw_towards(const Problem& problem, ompl::RNG& rng, const Vec3& point, const Vec3& center,
                             const Vec3& shift) {
  const plan::Settings& s = problem.settings;
  plan::Sample d;
  d.towards_goal = (point - s.goal.center_of_mass_m).norm() < 1e-9;
  d.point = d.towards_goal ? point : Vec3(point + shift);
  const double interpolation = d.towards_goal ? s.weights.interpolation : 0;
  const double pick = rng.uniform01() * (s.weights.body + s.weights.control_point + interpolation);
  d.manipulation = pick < s.weights.body                             ? Manipulation::body
                   : pick < s.weights.body + s.weights.control_point ? Manipulation::control_point
                                                                     : Manipulation::interpolation;
  d.force_n = s.max_force_n * rng.uniformReal(s.min_force_share, s.max_force_share);
  d.robot_node = problem.system.control_node(rng.uniformInt(0, problem.system.robot_nodes() - 1));
  d.steps = problem.steps;
  return plan::control_of(d, s, center + shift, shift);
}

// For planners that have no state to go to: towards the goal as often as goal_bias says, else anywhere.
class UndirectedSampler final : public oc::ControlSampler {
 public:
  using oc::ControlSampler::ControlSampler;
  void sample(oc::Control* c) override { sample(c, nullptr); }
  void sample(oc::Control* c, const ob::State* from) override {
    const Problem& problem = static_cast<const ControlSpace*>(space_)->problem();
    const plan::Settings& s = problem.settings;
    ++problem.controls;
    const Vec3 center = from ? NodeSpace::of(from).center : problem.system.sample_bounds().center();
    const Vec3 shift = from ? NodeSpace::of(from).shift : Vec3::Zero();
    Vec3 point = s.goal.center_of_mass_m;
    if (rng_.uniform01() >= s.goal_bias) {
      Vec3 direction;
      do direction = Vec3(rng_.uniformReal(-1, 1), rng_.uniformReal(-1, 1), rng_.uniformReal(-1, 1));
      while (direction.norm() > 1 || direction.norm() < 1e-3);
      point = center + direction;
    }
    ControlSpace::of(c) = draw_towards(problem, rng_, point, center, shift);
  }
  void sampleNext(oc::Control* c, const oc::Control*) override { sample(c); }
  void sampleNext(oc::Control* c, const oc::Control*, const ob::State* from) override { sample(c, from); }
};

oc::ControlSamplerPtr ControlSpace::allocDefaultControlSampler() const {
  return std::make_shared<UndirectedSampler>(this);
}

class TowardsSampler final : public oc::DirectedControlSampler {
 public:
  TowardsSampler(const oc::SpaceInformation* si, const Problem& problem)
      : oc::DirectedControlSampler(si), problem_(problem) {}
  unsigned sampleTo(oc::Control* c, const ob::State* from, ob::State* to) override {
    const plan::Settings& s = problem_.settings;
    ++problem_.controls;
    const auto& at = NodeSpace::of(from);
    ControlSpace::of(c) = draw_towards(problem_, rng_, NodeSpace::of(to).center, at.center, at.shift);
    const unsigned pieces = problem_.pieces(rng_.uniformReal(s.min_duration_s, s.max_duration_s));
    return si_->propagateWhileValid(from, c, int(pieces), to);
  }
  unsigned sampleTo(oc::Control* c, const oc::Control*, const ob::State* from, ob::State* to) override {
    return sampleTo(c, from, to);
  }

 private:
  const Problem& problem_;
  ompl::RNG rng_;
};

class SoftPropagator final : public oc::StatePropagator {
 public:
  SoftPropagator(const oc::SpaceInformationPtr& si, const Problem& problem)
      : oc::StatePropagator(si), problem_(problem) {}
  void propagate(const ob::State* from, const oc::Control* c, double, ob::State* to) const override {
    plan::Rollout rollout;
    const limber::State start = NodeSpace::of(from).state;  // OMPL propagates in place
    rollout.from = &start;
    rollout.control = ControlSpace::of(c);
    rollout.control.steps = problem_.steps;
    problem_.propagator->propagate({&rollout, 1});
    auto& result = NodeSpace::of(to);
    result.good = rollout.ok && problem_.system.acceptable(rollout.to);
    if (!result.good) return;
    result.shift = problem_.system.goal_shift(rollout.to);
    result.center = problem_.system.robot_center(rollout.to) - result.shift;
    result.state = std::move(rollout.to);
  }
  bool canPropagateBackward() const override { return false; }

 private:
  const Problem& problem_;
};

class BallGoal final : public ob::GoalSampleableRegion {
 public:
  BallGoal(const ob::SpaceInformationPtr& si, const Problem& problem)
      : ob::GoalSampleableRegion(si), problem_(problem) {
    setThreshold(problem.settings.goal.radius_m);
  }
  double distanceGoal(const ob::State* s) const override {
    return (NodeSpace::of(s).center - problem_.settings.goal.center_of_mass_m).norm();
  }
  bool isSatisfied(const ob::State* s, double* distance) const override {
    const double d = distanceGoal(s);
    if (distance) *distance = d;
    const bool reached =
        d <= threshold_ && plan::comes_to_rest(problem_.system, problem_.settings, NodeSpace::of(s).state);
    problem_.reached = problem_.reached || reached;
    return reached;
  }
  bool isSatisfied(const ob::State* s) const override { return isSatisfied(s, nullptr); }
  void sampleGoal(ob::State* s) const override {
    NodeSpace::of(s).state = limber::State();
    NodeSpace::of(s).center = problem_.settings.goal.center_of_mass_m;
    NodeSpace::of(s).good = true;
  }
  unsigned maxSampleCount() const override { return 1u << 30; }

 private:
  const Problem& problem_;
};

struct Run {
  bool solved = false;
  std::int64_t iterations = 0, nodes = 0;
  double distance_m = 0, cpu_s = 0, wall_s = 0;
  plan::Trajectory
      motion;  // to the goal and the rest there; of one that is not solved limber's best, or the start
};

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The controls of OMPL's path, replayed by limber, must lead through OMPL's states, and then to rest.
plan::Trajectory replayed(const Problem& problem, const oc::PathControl& path) {
  plan::Tree chain;
  const auto add = [&](unsigned state, const limber::Control& control) {
    const auto& at = NodeSpace::of(path.getState(state));
    chain.add(at.state, chain.size() - 1, control, std::int64_t(state) - 1,
              (at.center + at.shift).cast<float>());
  };
  add(0, limber::Control());
  for (unsigned i = 0; i < unsigned(path.getControlCount()); ++i) {
    limber::Control control = ControlSpace::of(path.getControl(i));
    control.steps = problem.steps * int(std::lround(path.getControlDuration(i) / step_s));
    add(i + 1, control);
  }
  return plan::trajectory_to(problem.system, problem.settings, chain, chain.size() - 1,
                             problem.settings.settle.max_duration_s > 0);
}

using MakePlanner = ob::PlannerPtr (*)(const oc::SpaceInformationPtr&);

Run run_ompl(const FemSystem& system, const plan::Settings& settings, MakePlanner make, double time_limit_s) {
  ompl::RNG::setSeed(settings.seed);  // before anything that draws
  const Problem problem{system, settings, system.make_propagator()};
  const auto states = std::make_shared<NodeSpace>(system.sample_bounds());
  const auto si =
      std::make_shared<oc::SpaceInformation>(states, std::make_shared<ControlSpace>(states, problem));
  si->setStateValidityChecker([](const ob::State* s) { return NodeSpace::of(s).good; });
  si->setStatePropagator(std::make_shared<SoftPropagator>(si, problem));
  si->setPropagationStepSize(step_s);
  si->setMinMaxControlDuration(problem.pieces(settings.min_duration_s),
                               problem.pieces(settings.max_duration_s));
  si->setDirectedControlSamplerAllocator(
      [&](const oc::SpaceInformation* of) { return std::make_shared<TowardsSampler>(of, problem); });
  si->setup();

  const auto definition = std::make_shared<ob::ProblemDefinition>(si);
  ob::State* start = si->allocState();
  NodeSpace::of(start).state = system.start();
  NodeSpace::of(start).shift = system.goal_shift(NodeSpace::of(start).state);
  NodeSpace::of(start).center = system.robot_center(NodeSpace::of(start).state) - NodeSpace::of(start).shift;
  definition->addStartState(start);
  si->freeState(start);
  definition->setGoal(std::make_shared<BallGoal>(si, problem));

  const ob::PlannerPtr planner = make(si);
  planner->setProblemDefinition(definition);
  planner->setup();
  const double cpu = cpu_seconds(), wall = wall_seconds();
  planner->solve(ob::PlannerTerminationCondition([&] {
    return problem.controls >= settings.max_iterations || wall_seconds() - wall >= time_limit_s ||
           stop_signal() != 0 || problem.reached;
  }));
  Run run{.solved = definition->hasExactSolution(),
          .iterations = problem.controls,
          .cpu_s = cpu_seconds() - cpu,
          .wall_s = wall_seconds() - wall,
          .motion = {}};
  throw_if_stopped();
  ob::PlannerData nodes(si);
  planner->getPlannerData(nodes);
  run.nodes = nodes.numVertices();
  if (run.solved) {
    run.motion = replayed(problem, *definition->getSolutionPath()->as<oc::PathControl>());
  } else {
    run.distance_m = definition->getSolutionDifference();
    run.motion = plan::simulate(system, {}, settings.frames_per_second);
  }
  return run;
}

Run run_limber(const FemSystem& system, const plan::Settings& settings) {
  const plan::Plan plan = plan::plan(system, settings);
  throw_if_stopped();
  const plan::Statistics& search = plan.statistics;
  return {plan.solved(), search.iterations, plan.tree.size(), plan.best_distance_m,
          search.cpu_s,  search.wall_s,     plan.trajectory};
}

template <class Planner>
ob::PlannerPtr make_planner(const oc::SpaceInformationPtr& si) {
  return std::make_shared<Planner>(si);
}
template <class Planner>
ob::PlannerPtr make_biased(const oc::SpaceInformationPtr& si) {
  const auto planner = std::make_shared<Planner>(si);
  planner->setGoalBias(0.1);  // of the scenes, and of preset paper
  return planner;
}

Json report_of(const std::string& name, const std::vector<RunRecord>& runs) {
  std::vector<double> iterations, cpu, wall, motion;
  for (const RunRecord& run : runs) {
    iterations.push_back(double(run.iterations)), cpu.push_back(run.cpu_s), wall.push_back(run.wall_s);
    if (run.solved) motion.push_back(run.motion_s);
  }
  const auto spread = [](const std::vector<double>& values) {
    if (values.empty()) return Json();
    return Json(quartiles(values));
  };
  return {{"planner", name},           {"solved", motion.size()},
          {"runs", runs.size()},       {"iterations", spread(iterations)},
          {"cpu_s", spread(cpu)},      {"wall_s", spread(wall)},
          {"motion_s", spread(motion)}};
}

std::string spread_text(const Json& q, int digits) {
  if (q.is_null()) return "-";
  return fmt::format("{:.{}f} {:.{}f} {:.{}f}", q[0].get<double>(), digits, q[1].get<double>(), digits,
                     q[2].get<double>(), digits);
}

fs::path record_file(const fs::path& folder, const std::string& scene, std::string planner, int seed) {
  std::erase(planner, ',');
  std::replace(planner.begin(), planner.end(), ' ', '_');
  return folder / "runs" / fmt::format("{}.{}.{}.json", scene, planner, seed);
}

int compare(int argc, char** argv) {
  CLI::App program{"OMPL's planners on limber's propagator, beside limber's"};
  PlanOptions options;
  std::string seeds = "1-30";
  double time_limit_s = 120;
  bool json = false;
  std::vector<std::string> only;
  std::vector<fs::path> data;
  program.add_option("SCENE", options.scene.scene, "a scene file, or a shipped scene's name")->required();
  program.add_option("-o,--out", options.out, "folder of the prepared bodies and the records")->required();
  program.add_option("--data", data, "folders of models, as of limber plan");
  program.add_option("--seeds", seeds)->capture_default_str();
  program.add_option("--time-limit", time_limit_s, "wall seconds of a run of OMPL")->capture_default_str();
  program.add_option("--iterations", options.iterations, "controls drawn in a run; default: the scene's");
  program.add_option("--set", options.scene.sets, "KEY=VALUE, as of limber plan")->allow_extra_args(false);
  program.add_option("--only", only, "planners whose name has one of these words; default: all")
      ->delimiter(',');
  program.add_flag("--json", json, "the table as one JSON document");
  CLI11_PARSE(program, argc, argv);
  if (!(time_limit_s > 0))
    throw InputError(fmt::format("ompl_bench: --time-limit {} is no time", time_limit_s));
  if (options.iterations && *options.iterations < 1)
    throw InputError(fmt::format("ompl_bench: --iterations {}; one control at least", *options.iterations));
  log::set_up(0);
  set_progress_enabled(false);
  install_stop_signals();
  ompl::msg::noOutputHandler();
  set_thread_count(1);  // OMPL's planners have one

  const auto plan_settings = [&](const char* preset, int seed, scenes::Scene* scene) {
    PlanOptions with = options;
    with.preset = preset, with.seed = seed;
    *scene = read_scene(with);
    return settings_of(*scene, with);
  };
  scenes::Scene scene;
  plan_settings("paper", 1, &scene);
  const std::vector<PreparedBody> bodies = prepare_bodies(scene, data, options.out);
  const fem::World world = build_world(scene, bodies);
  const GoalRules rules = goal_rules_of(scene);
  if (!scene.via.empty()) throw InputError("ompl_bench: OMPL knows no goals on the way; take another scene");
  if (!rules.patches_m.empty() || !rules.through.empty() || rules.turn_tolerance_deg ||
      rules.shape_tolerance_m || rules.volume > 0 || rules.above >= 0 || rules.below >= 0 ||
      rules.clear_of >= 0 || scene.planner.max_pressure_pa > 0)
    throw InputError(
        "ompl_bench: OMPL's planners are asked for a place of the robot's centre of mass, and pushed at any "
        "node; this scene asks for more (patches, a shape, holes, a volume, above, below or clear_of), so "
        "nothing could be compared; take another scene");
  const FemSystem system(world, bodies, rules);

  struct Row {
    std::string name;
    const char* preset;
    std::function<Run(plan::Settings)> run;
  };
  const auto ours = [&](int in_flight) {
    return [&, in_flight](plan::Settings settings) {
      settings.in_flight = in_flight;
      return run_limber(system, settings);
    };
  };
  const auto theirs = [&](MakePlanner make) {
    return
        [&, make](const plan::Settings& settings) { return run_ompl(system, settings, make, time_limit_s); };
  };
  std::vector<Row> rows{{"limber fast, 16 lanes", "fast", ours(0)},
                        {"limber paper, 16 lanes", "paper", ours(0)},
                        {"limber paper, one lane", "paper", ours(1)},
                        {"OMPL RRT", "paper", theirs(make_biased<oc::RRT>)},
                        {"OMPL EST", "paper", theirs(make_biased<oc::EST>)},
                        {"OMPL KPIECE1", "paper", theirs(make_biased<oc::KPIECE1>)},
                        {"OMPL PDST", "paper", theirs(make_biased<oc::PDST>)},
                        {"OMPL SST", "paper", theirs(make_biased<oc::SST>)}};
  std::erase_if(rows, [&](const Row& row) {
    return !only.empty() && std::none_of(only.begin(), only.end(), [&](const std::string& word) {
      return row.name.find(word) != std::string::npos;
    });
  });
  if (rows.empty())
    throw InputError(
        "ompl_bench: --only names none of the planners; write one of fast, paper, RRT, EST, KPIECE1, "
        "PDST, SST");
  std::vector<std::vector<RunRecord>> runs(rows.size());
  // Seed after seed, so that what else the machine does falls on all alike.
  for (const int seed : parse_seeds(seeds)) {
    if (seed < 1) throw InputError("ompl_bench: OMPL has no seed 0; begin with 1");
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const Row& row = rows[r];
      scenes::Scene own;
      const plan::Settings settings = plan_settings(row.preset, seed, &own);
      RunIdentity identity = identity_of_run(scene, system, settings);
      identity.settings["planner"] = row.name, identity.settings["time_limit_s"] = time_limit_s;
      const fs::path file = record_file(options.out, scene.name, row.name, seed);
      if (!is_done(file, identity)) {
        const Run run = row.run(settings);
        Json record{{"scene", scene.name},          {"preset", row.name}, {"seed", seed},
                    {"solved", run.solved},         {"nodes", run.nodes}, {"iterations", run.iterations},
                    {"distance_m", run.distance_m}, {"cpu_s", run.cpu_s}, {"wall_s", run.wall_s}};
        record.update(record_of_motion(world, bodies, system, run.motion));
        record["identity"] = json_of_fields(identity);
        make_folder(file.parent_path());
        write_file(file, text_of(record) + "\n");
      }
      runs[r].push_back(run_record_of(read_json(file), file.string()));
      log::info("seed {}: {}: {} after {} iterations, {:.2f} CPU s", seed, row.name,
                runs[r].back().solved ? "solved" : "not solved", runs[r].back().iterations,
                runs[r].back().cpu_s);
    }
  }

  Json report{{"scene", scene.name}, {"seeds", seeds}, {"planners", Json::array()}};
  std::string text = fmt::format("{}, one thread\n{:24}{:>8}{:>18}{:>20}{:>18}\n", scene.name, "planner",
                                 "solved", "iterations", "CPU s", "motion s");
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Json row = report_of(rows[r].name, runs[r]);
    report["planners"].push_back(row);
    text += fmt::format("{:24}{:>8}{:>18}{:>20}{:>18}\n", rows[r].name,
                        fmt::format("{}/{}", row.at("solved").get<int>(), row.at("runs").get<int>()),
                        spread_text(row.at("iterations"), 0), spread_text(row.at("cpu_s"), 2),
                        spread_text(row.at("motion_s"), 1));
  }
  fmt::print("{}", json ? report.dump(2) + "\n" : text);
  return 0;
}

}  // namespace
}  // namespace limber::detail

int main(int argc, char** argv) try {
  return limber::detail::compare(argc, argv);
} catch (const limber::InputError& error) {
  limber::log::warn("{}", error.what());
  return 2;
} catch (const std::exception& error) {
  limber::log::warn("{}", error.what());
  return 1;
}
