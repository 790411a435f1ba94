#include "limber/detail/verify/verify.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/progress.h"
#include "core/threads.h"
#include "limber/detail/verify/check_films.h"
#include "limber/detail/verify/verify_body.h"
#include "limber/detail/verify/verify_plan.h"
#include "limber/detail/world/body_source.h"
#include "limber/detail/world/scene_world.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

// Each body by itself, in its own frame, and whether it is the scene's.
void check_bodies(const fs::path& folder, const scenes::Scene& scene, const VerifyDepth& depth,
                  Promises& table) {
  const bool is_trusted = depth.trusted.has_value();
  const std::vector<fs::path> data = is_trusted ? depth.trusted->data : std::vector<fs::path>{};
  std::vector<Promises> of_body(scene.bodies.size());
  side_by_side(int(scene.bodies.size()), [&](int i) {
    const std::size_t b = std::size_t(i);
    const scenes::BodySpec& body = scene.bodies[b];
    const ProgressOf progress(body.name);
    const fs::path of_files = body_folder(folder, body);
    const PreparedBody prepared = read_body(of_files);
    const Origin origin = origin_of(scene, body, data, prepared);
    check_origin(body.name, origin, is_trusted, of_body[b]);
    const bool hangs_on_shells =
        std::any_of(body.parts.begin(), body.parts.end(),
                    [](const scenes::PartSpec& part) { return part.shell.has_value(); });
    check_body(body.name, prepared, of_files, origin.made_cage, depth.remake || hangs_on_shells, of_body[b]);
  });
  for (Promises& of_one : of_body) table.add(std::move(of_one));
}

// What lies where bodies and scenery do and is of none of them: nothing reads it, but people may.
std::vector<std::string> of_nobody(const fs::path& folder, const scenes::Scene& scene) {
  std::set<fs::path> known;
  std::set<std::string> odd;
  const auto look = [&](const fs::path& within) {
    std::error_code missing;
    for (fs::directory_iterator at(within, missing), end; !missing && at != end; at.increment(missing))
      if (!known.contains(at->path())) odd.insert(at->path().lexically_relative(folder).string());
  };
  for (int b = 0; b < int(scene.bodies.size()); ++b) {
    const fs::path of_body = body_folder(folder, scene.bodies[std::size_t(b)]), goal = of_body / "goal.msh";
    known.insert(of_body);
    if (fs::exists(goal) && !(b == scene.robot && has_goal_cage(scene)))
      odd.insert(goal.lexically_relative(folder).string());
  }
  for (const scenes::BodySpec& body : scene.scenery)
    for (const char* extension : {".ply", ".json"}) known.insert(scenery_file(folder, body, extension));
  look(folder / "bodies"), look(folder / "scenery");
  return {odd.begin(), odd.end()};
}

// A stiffness that is none of its bodies' changes the step, and with it the times of all frames: that is to
// be said, not that these are odd.
void require_of_found_world(const PlanFolder& planned, const fem::World& world, const fs::path& folder) {
  try {
    require_of_world(planned.plan, world, folder);
  } catch (const InputError& error) {
    const auto &told = planned.told.stiffness_shares, found = stiffness_shares_of(world);
    if (told.empty() || told == found) throw;
    throw InputError(
        fmt::format("{}; it was planned with shares of stiffness {}, and those of its bodies are {}: remove "
                    "bodies/NAME/stiffness.json",
                    error.what(), text_of(told), text_of(found)));
  }
}

}  // namespace

Verified verify_plan(const fs::path& folder, const PlanFolder& planned,
                     const std::vector<PreparedBody>& bodies, const fem::World& world, MotionFigures& figures,
                     const VerifyDepth& depth) {
  const std::optional<TrustedScene>& trusted = depth.trusted;
  const NothingToKeep nothing_to_keep;
  Promises table;
  scenes::Scene scene = planned.scene;
  if (trusted) {
    const auto edits = [](const scenes::Scene& of) {
      return of.sets.empty() ? "none" : fmt::format("{}", fmt::join(of.sets, ", "));
    };
    const std::string wrong = scene.text != trusted->scene.text ? "its text is another"
                              : !scenes::say_the_same(scene, trusted->scene)
                                  ? fmt::format("its edits by --set are others: {}; asked for were {}",
                                                edits(scene), edits(trusted->scene))
                                  : "";
    table.row("the plan is of the scene " + trusted->name, wrong.empty(), wrong);
    scene.folder = trusted->scene.folder;
  }
  const std::vector<fs::path> data = trusted ? trusted->data : std::vector<fs::path>{};
  if (const scenes::ScriptText& script = scene.script; !script.text.empty())
    table.measured("acts beside what the scene says",
                   fmt::format("the control file {} (hash of its text {}); limber report shows it",
                               script.name_for_messages, hex(hash_of(std::string_view(script.text)))));
  check_bodies(folder, scene, depth, table);
  for (const scenes::BodySpec& body : scene.scenery)
    check_origin(body.name, origin_of_scenery(scene, body, data, folder), trusted.has_value(), table);
  check_goal_cage(goal_cage_of(scene, data, bodies), trusted.has_value(), table);
  check_plan(folder, planned, bodies, world, figures, table);
  check_pictures(folder, planned, world, figures, table);
  return {std::move(table), figures,
          Verdict::Scene{scene.name, hex(hash_of(std::string_view(scene.text))), scene.sets}};
}

Verified verify(const VerifyOptions& options, std::optional<TrustedScene> trusted) {
  const fs::path& folder = options.folder;
  if (!fs::is_directory(folder))
    throw InputError(fmt::format("{}: is not a folder; name a work folder of limber", folder.string()));
  const bool scene_is_named = trusted || !options.scene.scene.empty();
  if (!scene_is_named && !(options.scene.sets.empty() && options.scene.data.empty()))
    throw InputError("--set and --data are of the scene that --scene names, and none is named");
  if (const auto& csv = options.observables;
      csv && !csv->parent_path().empty() && !fs::is_directory(csv->parent_path()))
    throw InputError(
        fmt::format("{}: there is no folder {}; make it first", csv->string(), csv->parent_path().string()));
  if (fs::exists(folder / "plan.npz")) {
    if (options.model)
      throw InputError(
          "--model is of a body's folder; the models of a plan's bodies are its scene's: name that "
          "with --scene");
    if (scene_is_named && !trusted)
      trusted = {options.scene.scene,
                 scenes::read_scene_file(scenes::find_scene(options.scene.scene), options.scene.sets),
                 options.scene.data};
    const PlanFolder planned = read_plan_folder(folder);
    const std::vector<PreparedBody> bodies = read_caged_bodies_of(planned, folder);
    const VerifyDepth depth{trusted, options.remake};
    std::map<std::string, double> shares;  // found once, for both worlds
    try {
      const fem::World begun = world_of(planned, bodies, StiffnessShares::found);
      shares = stiffness_shares_of(begun);
      require_of_found_world(planned, begun, folder);
    } catch (const InputError&) {
      // A body that is not the scene's weighs something else, and then nothing of the plan fits: what is to
      // be named is the body.
      Promises table;
      scenes::Scene scene = planned.scene;
      if (trusted) scene.folder = trusted->scene.folder;
      check_bodies(folder, scene, depth, table);
      if (table.all_kept()) throw;
      return {std::move(table), {}, {}};
    }
    const fem::World world = build_world(planned.scene, bodies, {}, shares);
    MotionFigures figures;
    Verified verified = verify_plan(folder, planned, bodies, world, figures, depth);
    if (const auto odd = of_nobody(folder, planned.scene); !odd.empty())
      verified.promises.measured("of no body of this plan, and not looked at",
                                 fmt::format("{}", fmt::join(odd, ", ")));
    if (options.film) check_films(folder, options.repaint, verified.promises);
    if (options.observables) write_observables(*options.observables, world, figures);
    return verified;
  }
  if (fs::exists(folder / "report.json")) {
    if (options.observables || options.film || scene_is_named)
      throw InputError(
          fmt::format("{}: holds no plan, so there is nothing to observe, no film and no scene; leave "
                      "--observables, --film and --scene out",
                      folder.string()));
    Promises table;
    const PreparedBody body = read_made(folder);
    if (options.model) check_model("body", body, *options.model, table);
    check_body("body", body, folder, std::nullopt, options.remake, table);
    return {std::move(table), {}, {}};
  }
  throw InputError(
      fmt::format("{}: holds neither plan.npz nor report.json; make them with limber run or limber prepare",
                  folder.string()));
}

}  // namespace limber::detail
