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
const Json statistics_like{{"rollouts", 1}, {"rollouts_wrong", 1}, {"cpu_s", 0.5}, {"wall_s", 0.5}};
const Json dynamics_like{{"elastic_cpu_s", 0.5},     {"contact_cpu_s", 0.5}, {"controls_cpu_s", 0.5},
                         {"integration_cpu_s", 0.5}, {"parting_cpu_s", 0.5}, {"contact_of_force_step", 0.5},
                         {"load_us", 0.5},           {"store_us", 0.5}};
const Json timings_like{{"statistics", statistics_like},
                        {"dynamics", dynamics_like},
                        {"shortcut", cpu_and_wall},
                        {"improve", cpu_and_wall},
                        {"portfolio", cpu_and_wall},
                        {"refine", {{"replay_cpu_s", 0.5}, {"track_cpu_s", 0.5}, {"search_cpu_s", 0.5}}}};

// What plan.npz holds beside the plan.
struct Given {
  struct Script {
    std::string text, name;
    template <class Fields>
    void fields(Fields& f) {
      f("text", text), f("name", name);
    }
  };
  std::string version, scene;
  std::vector<std::string> sets;
  InOrder<std::string> cage_hashes;  // by body, in the scene's order
  Json summary;
  std::optional<Script> script;
  template <class Fields>
  void fields(Fields& f) {
    f("version", version), f("scene", scene), f("sets", sets), f("cage_hashes", cage_hashes);
    f("summary", summary), f.if_there("script", script);
  }
};

Json given_of(const std::string& by_version, const scenes::Scene& scene,
              const std::vector<PreparedBody>& bodies, const Json& summary) {
  Given given{by_version, scene.text, scene.sets, {}, summary, {}};
  for (std::size_t b = 0; b < bodies.size(); ++b)
    given.cage_hashes.emplace_back(scene.bodies[b].name, hex(hash_of(bodies[b].cage)));
  const scenes::ScriptText& script = scene.script;
  if (!script.text.empty()) given.script = {script.text, script.name_for_messages};
  return json_of_fields(given);
}

// Which motion the costs are of: a file that was left from another tells nothing of this one.
std::vector<std::string> motion_of(const plan::Plan& plan) {
  return {hex(plan::tree_hash_of(plan)), hex(plan::hash_of(plan.trajectory))};
}

struct Timings {
  std::vector<std::string> of;  // motion_of
  Json summary;                 // its costs
  template <class Fields>
  void fields(Fields& f) {
    f("of", of), f("summary", summary);
  }
};

// Of a summary's statistics.
struct RolloutsTold {
  plan::Statistics& of;
  template <class Fields>
  void fields(Fields& f) {
    f.if_there("rollouts", of.rollouts), f.if_there("rollouts_wrong", of.rollouts_wrong);
    f.if_there("cpu_s", of.cpu_s), f.if_there("wall_s", of.wall_s);
  }
};

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
  const Timings timings = read_fields<Timings>(read, file.string(), remedy);
  require_like(read, {{"summary", Json::object()}}, Keys::all, file.string(), remedy);
  require_like(timings.summary, timings_like, Keys::those_there, file.string() + ": summary", remedy);
  if (timings.of != motion_of(planned.plan)) return;
  planned.summary = plan::with_timings(std::move(planned.summary), timings.summary);
  RolloutsTold told{planned.plan.statistics};
  if (planned.summary.contains("statistics"))
    FieldReader::read(planned.summary["statistics"], told, {file.string(), "summary.statistics", remedy});
}

template <class T>
void read_later(const Json& summary, const char* key, std::optional<T>& told, const JsonPlace& place,
                std::string& wrong) {
  if (summary.contains(key)) try {
      FieldReader::read(summary[key], told.emplace(), place.under(key));
    } catch (const InputError& error) {
      told.reset(), wrong = error.what();
    }
}

// Of the summary of a plan or a simulation what others go by, each number in its range.
PlanTold told_in(const Json& summary, const JsonPlace& given) {
  PlanTold told;
  const JsonPlace place = given.under("summary");
  FieldReader::read(summary, told, place);
  read_later(summary, "improve", told.improve, place, told.wrong);
  read_later(summary, "refine", told.refine, place, told.wrong);
  read_later(summary, "portfolio", told.portfolio, place, told.wrong);
  require_like(summary, {{"statistics", statistics_like}, {"dynamics", dynamics_like}}, Keys::those_there,
               fmt::format("{}: {}", place.what, place.path), place.remedy);
  for (const auto& [body, share] : told.stiffness_shares)
    if (!(share >= fem::min_stiffness_share && share <= fem::max_stiffness_share))
      place.under("stiffness_shares")
          .under(body)
          .refuse_range(share, fem::min_stiffness_share, fem::max_stiffness_share);
  return told;
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
    write_json(folder / timings_file, json_of_fields(Timings{motion_of(plan), std::move(timings)}));
}

Json kept_summary(const PlanFolder& planned) {
  return planned.edition < plan::first_without_timings ? planned.summary
                                                       : plan::without_timings(planned.summary);
}

namespace {

bool holds(const NpzReader& now, const std::string& name, const NpyRows& rows) {
  const NpyArray head = now.head(name);
  if (head.dtype != rows.dtype || head.shape != rows.shape) return false;
  bool same = true;
  std::vector<std::byte> again;
  now.read(name, [&](std::int64_t from, std::span<const std::byte> there) {
    again.resize(there.size());
    rows.fill(from, from + std::int64_t(there.size() / rows.row_bytes()), again.data());
    same = same && std::equal(there.begin(), there.end(), again.begin());
  });
  return same;
}

}  // namespace

std::string odd_entry(const fs::path& folder, const PlanFolder& planned,
                      const std::vector<PreparedBody>& bodies) {
  const NpzReader now(folder / "plan.npz");
  const NpzRows again = plan::rows_of(
      planned.plan, given_of(planned.version, planned.scene, bodies, kept_summary(planned)), planned.edition);
  for (const std::string& name : now.arrays())
    if (!again.arrays.contains(name) || !holds(now, name, again.arrays.at(name))) return name + ".npy";
  for (const std::string& name : now.texts())
    if (!again.texts.contains(name) || again.texts.at(name) != now.text(name)) return name;
  return now.bare()
             ? ""
             : "the way its entries lie in it (packed, or more beside them)";  // what lacks was not read
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
  const JsonPlace place{
      file.string(), "given",
      result.plan.simulation ? "simulate anew with limber simulate" : "plan anew with limber plan"};
  Given given;
  FieldReader::read(read.given, given, place);
  scenes::ScriptText script;
  if (given.script) script.text = given.script->text, script.name_for_messages = given.script->name;
  result.scene = scenes::read_scene(given.scene, file.string() + " (scene)", given.sets, script);
  if (!result.plan.simulation) scenes::require_plannable(result.scene);
  result.told = told_in(given.summary, place);
  result.summary = std::move(given.summary);
  result.cage_hashes.insert(given.cage_hashes.begin(), given.cage_hashes.end());
  result.version = given.version;
  add_timings(folder, result);
  result.file_hash = hash_of_file(file);
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
                    folder.string(), planned.told.from->frame, what));
  return planned;
}

bool begins_elsewhere(const PlanFolder& planned) { return planned.told.from.has_value(); }

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
  if (which == StiffnessShares::told) shares = planned.told.stiffness_shares;
  const State start = planned.plan.tree.states[0];
  return build_world(planned.scene, bodies,
                     begins_elsewhere(planned) ? std::vector<float>() : start.positions, shares);
}

std::vector<PreparedBody> read_caged_bodies_of(const PlanFolder& planned, const fs::path& folder) {
  std::vector<PreparedBody> bodies = read_bodies(planned.scene, folder);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const std::string& name = planned.scene.bodies[b].name;
    if (const auto told = planned.cage_hashes.find(name);
        told == planned.cage_hashes.end() || told->second != hex(hash_of(bodies[b].cage)))
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

}  // namespace limber::detail
