#include "limber/detail/plan/plan_folder.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/json_shape.h"
#include "core/version.h"
#include "limber/detail/world/scene_world.h"
#include "plan/plan_file.h"

namespace limber::detail {

namespace {

Json given_of(const std::string& by_version, const scenes::Scene& scene,
              const std::vector<PreparedBody>& bodies, const Json& summary) {
  Json cages;
  for (std::size_t b = 0; b < bodies.size(); ++b) cages[scene.bodies[b].name] = hex(hash_of(bodies[b].cage));
  Json given{{"version", by_version},
             {"scene", scene.text},
             {"sets", scene.sets},
             {"cage_hashes", cages},
             {"summary", summary}};
  if (!scene.script.text.empty())
    given["script"] = {{"text", scene.script.text}, {"name", scene.script.name_for_messages}};
  return given;
}

void require_summary(const PlanFolder& planned, const fs::path& file) {
  constexpr const char* remedy = "plan anew with limber plan";
  const auto kinds_of = [&](const Json& value, const Json& example, const char* name) {
    require_like(value, example, Keys::those_there, fmt::format("{}: given.{}", file.string(), name), remedy);
  };
  const Json costs{
      {"duration_s", 0.5}, {"effort_n_s", 0.5}, {"strain_energy_j", 0.5}, {"volume_change", 0.5}};
  kinds_of(planned.summary,
           {{"explanation", ""},
            {"dynamics",
             {{"elastic_cpu_s", 0.5},
              {"contact_cpu_s", 0.5},
              {"controls_cpu_s", 0.5},
              {"integration_cpu_s", 0.5}}},
            {"improve", Json::object()}},
           "summary");
  if (planned.summary.contains("shortcut"))
    require_like(
        planned.summary.at("shortcut"),
        {{"cost", ""}, {"rounds", -1}, {"accepted", -1}, {"cpu_s", 0.5}, {"before", costs}, {"after", costs}},
        Keys::all, file.string() + ": given.summary.shortcut", remedy);
  if (planned.summary.contains("stiffness_shares")) {
    const Json& shares = planned.summary.at("stiffness_shares");
    kinds_of(shares, Json::object(), "summary.stiffness_shares");
    for (const auto& [body, share] : shares.items()) {
      kinds_of(share, 0.5, "summary.stiffness_shares");
      const double value = share.get<double>();
      if (!(value >= fem::min_stiffness_share && value <= fem::max_stiffness_share))
        throw InputError(fmt::format(
            "{}: given.summary.stiffness_shares.{} is {}; it must be in [{}, {}]; {}", file.string(), body,
            share.dump(), fem::min_stiffness_share, fem::max_stiffness_share, remedy));
    }
  }
  if (begins_elsewhere(planned))
    require_like(planned.summary.at("from"), {{"folder", ""}, {"frame", -1}, {"trajectory_hash", ""}},
                 Keys::all, file.string() + ": given.summary.from",
                 planned.plan.simulation ? "simulate anew with limber simulate" : remedy);
  if (planned.summary.contains("follows"))
    require_like(planned.summary.at("follows"),
                 {{"folder", ""},
                  {"trajectory_hash", ""},
                  {"farthest_from_path_m", 0.5},
                  {"largest_force_n", 0.5},
                  {"distance_m", 0.5},
                  {"speed_m_s", 0.5},
                  {"reaches", true}},
                 Keys::all, file.string() + ": given.summary.follows", "simulate anew with limber simulate");
  kinds_of(planned.cage_hashes, Json::object(), "cage_hashes");
  for (const auto& [body, hash] : planned.cage_hashes.items()) kinds_of(hash, "", "cage_hashes");
}

}  // namespace

void write_plan_folder(const fs::path& folder, const plan::Plan& plan, const scenes::Scene& scene,
                       const std::vector<PreparedBody>& bodies, const Json& summary) {
  plan::write_plan(folder / "plan.npz", plan, given_of(version, scene, bodies, summary));
}

std::string odd_entry(const fs::path& folder, const PlanFolder& planned,
                      const std::vector<PreparedBody>& bodies) {
  const Npz now = read_npz(folder / "plan.npz"),
            again =
                plan::npz_of(planned.plan, given_of(planned.version, planned.scene, bodies, planned.summary));
  for (const auto& [name, array] : now.arrays)
    if (!again.arrays.contains(name) || again.arrays.at(name) != array) return name + ".npy";
  for (const auto& [name, text] : now.texts)
    if (!again.texts.contains(name) || again.texts.at(name) != text) return name;
  return "";  // what lacks was not read
}

PlanFolder read_plan_folder(const fs::path& folder) {
  const fs::path file = folder / "plan.npz";
  if (!fs::exists(file))
    throw InputError(fmt::format("{}: there is no such file; make it with limber plan SCENE -o {}",
                                 file.string(), folder.string()));
  PlanFolder result;
  plan::PlanFile read = plan::read_plan(file);
  result.plan = std::move(read.plan);
  result.sealed = read.sealed;
  const Json& extra = read.given;
  try {
    scenes::ScriptText script;
    if (extra.contains("script"))
      extra.at("script").at("text").get_to(script.text),
          extra.at("script").at("name").get_to(script.name_for_messages);
    result.scene = scenes::read_scene(extra.at("scene").get<std::string>(), file.string() + " (scene)",
                                      extra.at("sets").get<std::vector<std::string>>(), script);
    if (!result.plan.simulation) scenes::require_plannable(result.scene);
    result.summary = extra.at("summary");
    result.cage_hashes = extra.at("cage_hashes");
    result.version = extra.at("version").get<std::string>();
    require_summary(result, file);
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: its meta.json is not limber's ({}); plan anew with limber plan",
                                 file.string(), error.what()));
  }
  result.file_hash = hash_of(std::string_view(read_file(file)));
  return result;
}

PlanFolder read_searched_folder(const fs::path& folder) {
  PlanFolder planned = read_plan_folder(folder);
  if (planned.plan.simulation)
    throw InputError(
        fmt::format("{}: holds a simulation, which has no goal and no search; name the folder of a "
                    "plan, or make one with limber plan",
                    folder.string()));
  return planned;
}

PlanFolder read_folder_from_the_start(const fs::path& folder, const std::string& what) {
  PlanFolder planned = read_searched_folder(folder);
  if (begins_elsewhere(planned))
    throw InputError(
        fmt::format("{}: begins as frame {} of another motion, and {} takes plans from their scene's start "
                    "alone; name the folder of one",
                    folder.string(), planned.summary.at("from").at("frame").get<int>(), what));
  return planned;
}

bool begins_elsewhere(const PlanFolder& planned) { return planned.summary.contains("from"); }

FemSystem system_of(const PlanFolder& planned, const fem::World& world,
                    const std::vector<PreparedBody>& bodies) {
  std::optional<State> start;
  if (begins_elsewhere(planned)) start = planned.plan.tree.states[0];
  if (planned.plan.simulation) return FemSystem(world, {}, std::move(start));
  return FemSystem(world, bodies, goal_rules_of(planned.scene), std::move(start));
}

void require_of_world(const plan::Plan& plan, const fem::World& world, const fs::path& folder) {
  const std::string file = (folder / "plan.npz").string();
  const std::size_t numbers = fem::rest_state(world).positions.size();
  if (plan.tree.states.numbers() != numbers)
    throw InputError(fmt::format(
        "{}: its states hold {} numbers, and the bodies of its scene have {}; plan anew with limber plan",
        file, plan.tree.states.numbers(), numbers));
  const int nodes = world.bodies[std::size_t(world.robot)].node_count();
  for (const auto& [name, controls] :
       {std::pair("path", &plan.trajectory.controls), {"tree", &plan.tree.controls}})
    for (std::size_t i = 0; i < controls->size(); ++i)
      if (const int node = (*controls)[i].node; node >= nodes)
        throw InputError(fmt::format(
            "{}: {}_node[{}] is {}, and the robot has the nodes 0 … {}; plan anew with limber plan", file,
            name, i, node, nodes - 1));
  plan::require_frame_times(plan.trajectory, world.dt_s, file);
}

fem::World world_of(const PlanFolder& planned, const std::vector<PreparedBody>& bodies,
                    StiffnessShares which) {
  std::map<std::string, double> shares;
  if (which == StiffnessShares::told && planned.summary.contains("stiffness_shares"))
    planned.summary.at("stiffness_shares").get_to(shares);
  const State start = planned.plan.tree.states[0];
  return build_world(planned.scene, bodies,
                     begins_elsewhere(planned) ? std::vector<float>() : start.positions, shares);
}

std::vector<PreparedBody> read_caged_bodies_of(const PlanFolder& planned, const fs::path& folder) {
  std::vector<PreparedBody> bodies = read_bodies(planned.scene, folder);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const std::string& name = planned.scene.bodies[b].name;
    if (planned.cage_hashes.value(name, "") != hex(hash_of(bodies[b].cage)))
      throw InputError(
          fmt::format("{}: the cage has changed since the plan was made; plan anew with limber plan",
                      body_folder(folder, planned.scene.bodies[b]).string()));
  }
  return bodies;
}

BodiesAndWorld read_world_of(const PlanFolder& planned, const fs::path& folder) {
  std::vector<PreparedBody> bodies = read_caged_bodies_of(planned, folder);
  fem::World world = world_of(planned, bodies);
  require_of_world(planned.plan, world, folder);
  return {std::move(bodies), std::move(world)};
}

std::vector<PreparedBody> read_bodies_of(const PlanFolder& planned, const fs::path& folder) {
  return read_world_of(planned, folder).bodies;
}

}  // namespace limber::detail
