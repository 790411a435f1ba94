#include "limber/detail/plan/plan_folder.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/json_shape.h"
#include "core/log.h"
#include "core/version.h"
#include "limber/detail/world/scene_world.h"
#include "plan/plan_file.h"
#include "plan/timings.h"

namespace limber::detail {

namespace {

constexpr const char* timings_file = "timings.json";
const Json cpu_and_wall{{"cpu_s", 0.5}, {"wall_s", 0.5}};
const Json timings_like{
    {"statistics", {{"rollouts", 1}, {"rollouts_wrong", 1}, {"cpu_s", 0.5}, {"wall_s", 0.5}}},
    {"dynamics",
     {{"elastic_cpu_s", 0.5},
      {"contact_cpu_s", 0.5},
      {"controls_cpu_s", 0.5},
      {"integration_cpu_s", 0.5},
      {"parting_cpu_s", 0.5},
      {"contact_of_force_step", 0.5},
      {"load_us", 0.5},
      {"store_us", 0.5}}},
    {"shortcut", cpu_and_wall},
    {"improve", cpu_and_wall},
    {"portfolio", cpu_and_wall},
    {"refine", {{"replay_cpu_s", 0.5}, {"track_cpu_s", 0.5}, {"search_cpu_s", 0.5}}}};

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

// Which motion the costs are of: a file that was left from another tells nothing of this one.
Json motion_of(const plan::Plan& plan) {
  return {hex(plan::hash_of(plan.tree)), hex(plan::hash_of(plan.trajectory))};
}

// Nothing depends on them: a damaged file is as none. Throws InputError where a text stands for a number and
// the like.
void add_timings(const fs::path& folder, PlanFolder& planned) {
  const fs::path file = folder / timings_file;
  if (planned.edition < plan::first_without_timings || !fs::exists(file)) return;
  Json read;
  try {
    read = read_json(file);
  } catch (const InputError& error) {
    log::warn("{}; what the motion cost is not known", error.what());
    return;
  }
  constexpr const char* remedy = "remove the file";
  require_like(read, {{"of", Json::array({""})}, {"summary", Json::object()}}, Keys::all, file.string(),
               remedy);
  require_like(read.at("summary"), timings_like, Keys::those_there, file.string() + ": summary", remedy);
  if (read.at("of") != motion_of(planned.plan)) return;
  planned.summary = plan::with_timings(std::move(planned.summary), read.at("summary"));
  const Json statistics = planned.summary.value("statistics", Json::object());
  plan::Statistics& s = planned.plan.statistics;
  s.rollouts = statistics.value("rollouts", s.rollouts);
  s.rollouts_wrong = statistics.value("rollouts_wrong", s.rollouts_wrong);
  s.cpu_s = statistics.value("cpu_s", s.cpu_s), s.wall_s = statistics.value("wall_s", s.wall_s);
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
            {"statistics", timings_like.at("statistics")},
            {"dynamics", timings_like.at("dynamics")},
            {"improve", Json::object()}},
           "summary");
  if (planned.summary.contains("shortcut"))
    require_like(planned.summary.at("shortcut"),
                 {{"cost", ""}, {"rounds", -1}, {"accepted", -1}, {"before", costs}, {"after", costs}},
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
  plan::write_plan(folder / "plan.npz", plan,
                   given_of(version, scene, bodies, plan::without_timings(summary)));
  Json timings = plan::timings_of(summary);
  if (std::error_code ignored; timings.is_null())
    fs::remove(folder / timings_file, ignored);
  else
    write_json(folder / timings_file, {{"of", motion_of(plan)}, {"summary", std::move(timings)}});
}

Json kept_summary(const PlanFolder& planned) {
  return planned.edition < plan::first_without_timings ? planned.summary
                                                       : plan::without_timings(planned.summary);
}

std::string odd_entry(const fs::path& folder, const PlanFolder& planned,
                      const std::vector<PreparedBody>& bodies) {
  const Npz now = read_npz(folder / "plan.npz"),
            again = plan::npz_of(planned.plan,
                                 given_of(planned.version, planned.scene, bodies, kept_summary(planned)),
                                 planned.edition);
  for (const auto& [name, array] : now.arrays)
    if (!again.arrays.contains(name) || again.arrays.at(name) != array) return name + ".npy";
  for (const auto& [name, text] : now.texts)
    if (!again.texts.contains(name) || again.texts.at(name) != text) return name;
  return "";  // what lacks was not read
}

PlanFolder read_plan_folder(const fs::path& folder) {
  const fs::path file = folder / "plan.npz";
  if (folder.filename() == "plan.npz" && fs::is_regular_file(folder))
    throw InputError(fmt::format("{}: is a file; name the folder that it lies in", folder.string()));
  if (!fs::exists(file))
    throw InputError(fmt::format("{}: there is no such file; make it with limber plan SCENE -o {}",
                                 file.string(), folder.string()));
  PlanFolder result;
  plan::PlanFile read = plan::read_plan(file);
  result.plan = std::move(read.plan);
  result.edition = read.edition;
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
    add_timings(folder, result);
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
      for (const auto& [key, node] :
           {std::pair("node", (*controls)[i].node), {"second_node", (*controls)[i].second_node}})
        if (node >= nodes)
          throw InputError(fmt::format(
              "{}: {}_{}[{}] is {}, and the robot has the nodes 0 … {}; plan anew with limber plan", file,
              name, key, i, node, nodes - 1));
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
