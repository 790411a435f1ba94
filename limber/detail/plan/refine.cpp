#include "limber/detail/plan/refine.h"

#include <cmath>

#include "core/error.h"
#include "core/lock.h"
#include "core/progress.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "plan/refine.h"

namespace limber::detail {

namespace {

// --set that gives every cage about `factor` times its tets; none where the factor is 1.
std::vector<std::string> finer_cages(const scenes::Scene& scene, double factor) {
  std::vector<std::string> sets;
  if (factor == 1) return sets;
  const double along_edge = std::cbrt(factor);
  for (const scenes::BodySpec& body : scene.bodies) {
    const scenes::CageSpec& cage = body.cage;
    const std::string key = fmt::format("bodies.{}.cage.", body.name);
    const Eigen::Vector3i cells = (cage.cells.cast<double>() * along_edge).array().round().max(1).cast<int>();
    if (cage.cell_m > 0)
      sets.push_back(fmt::format("{}cell_m={:.9g}", key, cage.cell_m / along_edge));
    else if (cage.tets > 0)
      sets.push_back(fmt::format("{}tets={}", key, std::lround(cage.tets * factor)));
    else
      sets.push_back(fmt::format("{}cells=[{}, {}, {}]", key, cells.x(), cells.y(), cells.z()));
  }
  return sets;
}

std::int64_t tets_of(const std::vector<PreparedBody>& bodies) {
  std::int64_t sum = 0;
  for (const PreparedBody& body : bodies) sum += body.cage.tets.rows();
  return sum;
}

// The fine cage's node that is nearest to where the coarse one's is in the rest shape.
int same_node(const TetMesh& coarse, int node, const TetMesh& fine) {
  Eigen::Index nearest = 0;
  (fine.positions.rowwise() - coarse.positions.row(node)).rowwise().squaredNorm().minCoeff(&nearest);
  return int(nearest);
}

}  // namespace

KeptPlan refine(const RefineOptions& options) {
  const PlanFolder planned = read_folder_from_the_start(options.folder, "limber refine");
  if (!planned.plan.solved())
    throw InputError(fmt::format(
        "{0}: its plan does not reach the goal, so there is no path to carry; plan on with limber "
        "plan SCENE -o {0} --resume",
        options.folder.string()));
  if (fs::exists(options.out) && fs::equivalent(options.folder, options.out))
    throw InputError(
        fmt::format("{}: is the folder of the plan itself; name another with -o", options.out.string()));
  const auto [coarse_bodies, coarse_world] = read_world_of(planned, options.folder);
  std::vector<std::string> sets = planned.scene.sets;
  const std::vector<std::string> finer = finer_cages(planned.scene, options.tets_factor);
  sets.insert(sets.end(), finer.begin(), finer.end());
  sets.insert(sets.end(), options.sets.begin(), options.sets.end());
  const scenes::Scene scene = scenes::read_scene(
      planned.scene.text, fmt::format("{} (scene)", (options.folder / "plan.npz").string()), sets,
      planned.scene.script);
  make_folder(options.out);
  const FolderLock lock(options.out, FolderLock::alone);
  const std::vector<PreparedBody> bodies =
      prepare_bodies(scene, options.data, options.out, options.store, options.folder);

  const fem::World world = build_world_in(options.out, options.store, scene, bodies);
  const FemSystem coarse(coarse_world, goal_rules_of(planned.scene)),
      system(world, bodies, goal_rules_of(scene));
  plan::Reference reference = plan::reference_of(coarse, planned.plan.trajectory);
  const auto robot = std::size_t(scene.robot);
  for (Control& control : reference.controls)
    if (control.manipulation == Manipulation::control_point)
      for (std::int32_t* node : {&control.node, &control.second_node})
        if (*node >= 0) *node = same_node(coarse_bodies[robot].cage, *node, bodies[robot].cage);

  plan::Settings settings = settings_of(scene, {});
  settings.seed = planned.plan.settings.seed;
  settings.max_iterations = options.iterations.value_or(planned.plan.settings.max_iterations);
  settings.time_limit_s = options.time_limit_s, settings.in_flight = options.in_flight;
  plan::RefineReport report;
  plan::Plan plan = plan::refine(system, settings, reference, report);
  Json json = plan::json_of(report);
  json["coarse_tets"] = tets_of(coarse_bodies);
  json["tets"] = tets_of(bodies);
  KeptPlan kept = keep_plan(options.out, scene, bodies, world, system, plan, {{"refine", json}});
  throw_if_stopped();
  kept.also_done = {"refine"};
  return kept;
}

}  // namespace limber::detail
