#include "limber/detail/plan/plan.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/temporary_files.h"
#include "core/threads.h"
#include "limber/detail/plan/diagnosis.h"
#include "limber/detail/plan/exported_files.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/search_log.h"
#include "limber/detail/plan/simulate.h"
#include "limber/detail/plan/tree_plot.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "limber/detail/world/script_doubts.h"
#include "plan/timings.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

// Of the dynamics in this run, searching and replaying.
Json json_of(const fem::Cost& cost) {
  const auto per = [](double seconds, std::int64_t count) {
    return count ? 1e6 * seconds / double(count) : 0;
  };
  return {{"contact_cpu_s", cost.contact_s},
          {"controls_cpu_s", cost.controls_s},
          {"elastic_cpu_s", cost.elastic_s},
          {"integration_cpu_s", cost.integration_s},
          {"contact_of_force_step", cost.force_step_s() > 0 ? cost.contact_s / cost.force_step_s() : 0},
          {"load_us", per(cost.load_s, cost.loads)},
          {"store_us", per(cost.store_s, cost.stores)}};
}

// Of several goals in a row: how far each leg of the search got.
Json legs_of(const plan::Plan& plan) {
  Json legs = Json::array();
  for (std::size_t leg = 0; leg < plan.legs.size(); ++leg) {
    const bool last = leg + 1 == plan.legs.size();
    const auto root = std::size_t(plan.legs[leg].root);
    const std::int64_t end = last ? plan.statistics.iterations : plan.legs[leg + 1].first_iteration;
    legs.push_back({{"goal", plan::name_of_goal(plan.settings, int(leg))},
                    {"reached", !last || plan.solved()},
                    {"root", plan.left_out ? plan.left_out->numbers[root] : plan.legs[leg].root},
                    {"iterations", end - plan.legs[leg].first_iteration}});
  }
  return legs;
}

// What was done where bodies overlap at the start.
Json json_of(const fem::Parting& parting, const fem::World& world, const MotionFigures& figures) {
  const auto name = [&](int body) { return world.bodies[std::size_t(body)].name; };
  Json json{{"pairs", Json::array()}, {"largest_move_m", Json::object()}, {"steps", parting.steps}};
  for (const fem::Parting::Pair& pair : parting.pairs)
    json["pairs"].push_back({{"bodies", {name(pair.body), name(pair.other)}},
                             {"depth_m", pair.depth_m},
                             {"gap_m", pair.gap_m},
                             {"moved_m", {pair.moved_m[0], pair.moved_m[1]}}});
  const auto largest = std::max_element(parting.largest_move_m.begin(), parting.largest_move_m.end());
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    if (world.bodies[b].moving) json["largest_move_m"][name(int(b))] = parting.largest_move_m[b];
  json["largest_move_of_robot_size"] = *largest / figures.robot_surface_size_m;
  return json;
}

// `earlier` is told by the plan that this one goes on from: a solved one has its rounds behind it.
plan::ShortcutSettings shortcuts_of(const scenes::Scene& scene, const PlanOptions& options,
                                    const std::optional<ShortcutTold>& earlier) {
  plan::ShortcutSettings s;
  s.rounds = options.shortcut_rounds.value_or(scene.planner.shortcut_rounds);
  s.cost = plan::cost_kind_from(options.cost);
  if (earlier && earlier->cost == options.cost) s.rounds_done = earlier->rounds;
  return s;
}

// Whether nothing is left to do for a plan that tells this.
bool shortened(const std::optional<ShortcutTold>& told, const plan::ShortcutSettings& wanted) {
  return told ? told->cost == plan::name_of(wanted.cost) && told->rounds == wanted.rounds
              : wanted.rounds == 0;
}

bool finished(const plan::Plan& plan) { return plan.solved() || plan.ending == plan::Ending::iterations; }

}  // namespace

namespace {

// What a plan and a simulation tell alike.
Json facts_of_motion(const plan::Plan& plan, const fem::World& world, const MotionFigures& figures) {
  const plan::Trajectory& path = plan.trajectory;
  Json json{{"explanation", plan::explain(plan)},
            {"dt_s", world.dt_s},
            {"substeps", world.substeps},
            {"motion_s", double(path.end.step - plan.tree.states.steps()[0]) * world.dt_s},
            {"frames", path.frames.size()},
            {"tree_hash", hex(plan::tree_hash_of(plan))},
            {"trajectory_hash", hex(plan::hash_of(path))}};
  if (const auto shares = stiffness_shares_of(world); !shares.empty()) json["stiffness_shares"] = shares;
  if (is_unmeasured(plan)) return json;
  Json volumes;
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    volumes[world.bodies[b].name] = std::round(1e4 * 100 * figures.largest_volume_change[b]) / 1e4;
  json["largest_volume_change_percent"] = volumes;
  if (!world.parting.pairs.empty()) json["parted"] = json_of(world.parting, world, figures);
  json.update(json_of(figures));
  return json;
}

Json facts_of_simulation(const plan::Plan& plan, const fem::World& world, const MotionFigures& figures) {
  Json json = facts_of_motion(plan, world, figures);
  if (!plan.simulation->steered) json.erase("largest_force_n");  // of controls, and there are none
  json["simulation"] = {{"duration_s", plan.simulation->duration_s},
                        {"starts_at_s", double(plan.tree.states.steps()[0]) * world.dt_s},
                        {"forces", world.forces.size()},
                        {"pressures", world.pressures.size()},
                        {"whole", plan.simulation->ending == plan::Simulation::whole}};
  return json;
}

}  // namespace

Json facts_of(const plan::Plan& plan, const fem::World& world, const FemSystem& system,
              const MotionFigures& figures) {
  if (plan.simulation) return facts_of_simulation(plan, world, figures);
  Json json = facts_of_motion(plan, world, figures);
  json.update({{"solved", plan.solved()},
               {"seed", plan.settings.seed},
               {"nodes", plan::nodes_of(plan)},
               {"node_bytes", plan.tree.states.bytes() / std::size_t(plan.tree.size())},
               {"node_bytes_unshared", plan.tree.states.bytes_unshared() / std::size_t(plan.tree.size())},
               {"distance_m", plan.best_distance_m},
               {"statistics", plan::json_of(plan.statistics)}});
  if (plan.left_out) json["nodes_kept"] = plan.tree.size();
  if (!plan.settings.via.empty()) json["legs"] = legs_of(plan);
  if (plan.solved() || is_unmeasured(plan)) return json;
  const Diagnosis diagnosis = diagnose(world, system, plan);
  json["explanation"] = json["explanation"].get<std::string>() + " " + diagnosis.text;
  json["diagnosis"] = diagnosis.json;
  return json;
}

std::map<std::string, std::string> pictures_of(const scenes::Scene& scene, const fem::World& world,
                                               const plan::Plan& plan, const MotionFigures& figures) {
  if (is_unmeasured(plan)) return {};
  VolumePlot volume = volume_plot(scene, world, figures, plan.settings.frames_per_second);
  std::map<std::string, std::string> pictures{{"volume.svg", std::move(volume.svg)},
                                              {"volume.png", std::move(volume.png)}};
  if (!plan.simulation) pictures["tree.svg"] = tree_svg(scene, world, plan);
  return pictures;
}

plan::Settings settings_of(const scenes::Scene& scene, const PlanOptions& options) {
  const scenes::PlannerSpec& p = scene.planner;
  plan::Settings s;
  s.seed = std::uint64_t(options.seed.value_or(p.seed));
  s.max_iterations = options.iterations.value_or(p.iterations);
  const auto goal_of = [](const scenes::Goal& goal) {
    return plan::Goal{goal.center_of_mass_m, goal.radius_m, goal.box_m};
  };
  s.goal = goal_of(scene.goal);
  for (const scenes::Via& via : scene.via) s.via.push_back({goal_of(via.goal), via.rest});
  s.goal_bias = p.goal_bias;
  s.weights = {p.weight_body, p.weight_control_point, p.weight_interpolation};
  s.max_force_n = p.max_force_n, s.max_pressure_pa = p.max_pressure_pa;
  s.min_force_share = p.min_force_share, s.max_force_share = p.max_force_share;
  s.min_duration_s = p.min_duration_s, s.max_duration_s = p.max_duration_s;
  s.control_point_radius_m = p.control_point_radius_m;
  s.settle = {.max_duration_s = p.settle_time_s,
              .mean_speed_m_s = p.settle_speed_m_s,
              .max_force_share = p.settle_force_share,
              .pressure_pa = scene.goal.volume > 0 ? p.max_pressure_pa : 0,
              .hold = p.settle_hold && !scene.goal.shape};  // which holding would leave alone
  s.search_options = {.lag = p.lag,
                      .metric = p.metric == "distance" ? plan::Metric::distance : plan::Metric::time_to_go,
                      .time_weight = p.time_weight,
                      .guidance = p.guidance,
                      .soft_price = p.soft_price,
                      .learn_prices = p.learn_prices,
                      .density_price = p.density_price,
                      .steer = p.steer,
                      .look_s = p.look_s,
                      .stop_in_goal = p.stop_in_goal,
                      .hold = p.hold && !scene.goal.shape,
                      .end_hopeless = p.end_hopeless};
  s.frames_per_second = scene.film.frames_per_second / scene.film.speed;
  s.in_flight = options.in_flight;
  s.time_limit_s = options.time_limit_s;
  return s;
}

scenes::Scene read_scene(const PlanOptions& options) {
  std::vector<std::string> sets = options.scene.sets;
  if (!options.preset.empty()) sets.push_back("planner.preset=" + options.preset);
  scenes::Scene scene = scenes::read_scene_file(scenes::find_scene(options.scene.scene), sets);
  scenes::require_plannable(scene);
  return scene;
}

namespace {

constexpr std::uint64_t largest_seed = std::uint64_t(1) << 53;  // whole numbers of JSON

}  // namespace

// Early enough to stop it.
void tell_what_is_replaced(const fs::path& folder) {
  const fs::path file = folder / "plan.npz";
  if (fs::is_directory(file))
    throw InputError(
        fmt::format("{}: is a folder, and the motion is to be written there; remove it, or name another work "
                    "folder",
                    file.string()));
  if (!fs::exists(file)) return;
  try {
    const PlanFolder there = read_plan_folder(folder);
    log::info("{}: is replaced when this ends: a {} of {}{}", file.string(),
              there.plan.simulation ? "simulation" : "plan", there.scene.name,
              there.plan.simulation ? fmt::format(", {:.4g} s asked for", there.plan.simulation->duration_s)
                                    : fmt::format(", seed {}", there.plan.settings.seed));
  } catch (const InputError&) {  // it is no plan
  }
}

KeptPlan plan(const PlanOptions& options) {
  const scenes::Scene scene = read_scene(options);
  require_other_folder(options.from, options.out);
  make_folder(options.out);
  const FolderLock lock(options.out, FolderLock::alone);
  if (options.from.empty() && !options.resume && !options.stats && plan_is_up_to_date(options, scene)) {
    const fs::path file = options.out / "plan.npz";
    const PlanFolder kept = read_plan_folder(options.out);
    // What a film shows otherwise is told by the text alone.
    if (kept.scene.text == scene.text && kept.scene.sets == scene.sets) {
      log::info("{}: up to date", file.string());
      return {.file = file,
              .summary_json = text_of(kept.summary, 2),
              .reached = kept.plan.solved(),
              .up_to_date = true};
    }
  }
  return plan(options, scene);
}

Found find_plan(const scenes::Scene& scene, const FemSystem& system, const PlanOptions& options,
                std::optional<plan::Plan> earlier, const Json& earlier_summary) {
  const plan::Settings settings = settings_of(scene, options);
  if (options.portfolio > 1 && settings.seed > largest_seed - std::uint64_t(options.portfolio - 1))
    throw InputError(
        fmt::format("--portfolio {} with --seed {}: its last seed would be beyond {}; take a smaller one",
                    options.portfolio, settings.seed, largest_seed));
  std::optional<SearchLog> search_log;
  if (options.stats) search_log.emplace(*options.stats, earlier ? earlier->statistics.iterations : 0);
  std::optional<plan::PortfolioReport> searches;
  if (options.portfolio > 1) searches.emplace();
  plan::Plan searched =
      searches ? plan::portfolio(system, settings, options.portfolio, &*searches)
               : plan::plan(system, settings, std::move(earlier), [&](const plan::SearchProgress& progress) {
                   if (search_log) search_log->add(progress);
                 });
  if (search_log) search_log->finish();
  return make_better(scene, system, options, std::move(searched), searches, earlier_summary);
}

Found make_better(const scenes::Scene& scene, const FemSystem& system, const PlanOptions& options,
                  plan::Plan searched, const std::optional<plan::PortfolioReport>& searches,
                  const Json& earlier_summary) {
  Found found{.plan = std::move(searched), .extra = {}, .also_done = {}};
  plan::Plan& plan = found.plan;
  const PlanTold told = earlier_summary.is_null()
                            ? PlanTold{}
                            : read_fields<PlanTold>(earlier_summary, "summary", "plan anew with limber plan");
  const plan::ShortcutSettings shortcuts = shortcuts_of(scene, options, told.shortcut);
  for (const char* later : {"shortcut", "improve", "refine"})
    if (earlier_summary.contains(later)) found.extra[later] = earlier_summary.at(later);
  const auto tell = [&](const char* what, const auto& report) {
    found.extra[what] = plan::json_of(report);
    found.also_done.push_back(what);
  };
  if (searches) tell("portfolio", *searches);
  if (plan.solved() && shortcuts.rounds > shortcuts.rounds_done)
    tell("shortcut", plan::shorten(system, plan, shortcuts));
  if (plan.solved() && options.improve)
    tell("improve",
         plan::improve(system, plan, {.cost = shortcuts.cost, .shortcut_rounds = shortcuts.rounds}));
  return found;
}

KeptPlan plan(const PlanOptions& options, const scenes::Scene& scene) {
  const std::optional<OtherMotion> other = read_other_motion(options.from, options.frame);
  make_folder(options.out);
  if (!options.resume) tell_what_is_replaced(options.out);
  remove_abandoned(options.out);
  const std::vector<PreparedBody> bodies =
      prepare_bodies(scene, options.scene.data, options.out, options.scene.store, options.from);
  const fem::World world = build_world_in(options.out, options.scene.store, scene, bodies);
  const Beginning beginning = beginning_of(other, options.out, scene, world);
  const FemSystem system(world, bodies, goal_rules_of(scene), beginning.start);
  system.surfaces()->require_apart(system.start(), true);
  for (const std::string& doubt : doubts_of_script(scene, world)) log::warn("{}", doubt);
  const fs::path file = options.out / "plan.npz";
  if (options.portfolio > 1 && (options.resume || options.stats))
    throw InputError(fmt::format("--portfolio is of several searches, {} of one; leave one of the two out",
                                 options.resume ? "--resume" : "--stats"));

  require_tree_for_film(options.keep_tree, scene);
  std::optional<plan::Plan> earlier;
  Json earlier_summary;
  int nodes_kept = 0;  // in the file
  if (options.resume) {
    PlanFolder folder = read_searched_folder(options.out);
    if (folder.plan.left_out)
      throw InputError(fmt::format(
          "{}: holds the path alone (--keep-tree path), and a search goes on from the whole tree; plan anew "
          "without --resume",
          file.string()));
    if (folder.plan.system_hash == system.hash()) require_of_world(folder.plan, world, options.out);
    earlier = std::move(folder.plan);
    earlier_summary = std::move(folder.summary);
    nodes_kept = earlier->tree.size();
    if (earlier->system_hash != system.hash())
      throw InputError(
          fmt::format("{}: was made for another world than this scene's, or begins elsewhere; "
                      "resume with the same --from and --frame, or plan anew without --resume",
                      file.string()));
    log::info("{}: going on after {} iterations", file.string(), earlier->statistics.iterations);
  }
  Found found = find_plan(scene, system, options, std::move(earlier), earlier_summary);
  plan::Plan& plan = found.plan;
  if (beginning.from) found.extra["from"] = json_of_fields(*beginning.from);
  // Whatever comes of a search, of shortcuts or of better paths is in the tree.
  if (stop_signal() != 0 && plan.tree.size() == nodes_kept) {
    log::info("{}: is as it was; go on with --resume", file.string());
    throw_if_stopped();
  }
  KeptPlan kept =
      keep_plan(options.out, scene, bodies, world, system, plan, found.extra, options.keep_tree == "path");
  kept.also_done = std::move(found.also_done);
  if (stop_signal() != 0) {
    log::info(
        "{}: the plan so far is kept{}; go on with --resume", file.string(),
        lacks_path(plan) ? ", but for the path to its nearest node, which takes longer to simulate" : "");
    throw_if_stopped();
  }
  return kept;
}

namespace {

// What `limber export` and `limber report` made. Leaves the user's own files where they are, and what was
// exported with -o.
void remove_what_shows_another_plan(const fs::path& folder, const Json& summary) {
  const Json before = read_manifest(folder).value("plan", Json::object());
  const auto differs = [&](const char* hash) { return before.value(hash, "") != summary.at(hash); };
  if (!differs("trajectory_hash") && !differs("tree_hash")) return;
  bool removed = fs::remove(folder / "report.html");
  for (const fs::path& file : exported_files(folder / "export")) removed |= fs::remove(file);
  if (removed)
    log::info("{}: export and report of another plan are removed; make them anew", folder.string());
}

}  // namespace

KeptPlan keep_plan(const fs::path& folder, const scenes::Scene& scene,
                   const std::vector<PreparedBody>& bodies, const fem::World& world, const FemSystem& system,
                   plan::Plan& plan, const Json& extra, bool path_alone) {
  MotionFigures figures;
  try {
    const NothingToKeep nothing_to_keep;
    throw_if_stopped();
    figures = measure_motion(world, bodies, plan.trajectory, system.surfaces());
    plan.measured = true;
  } catch (const Interrupted&) {
    plan.measured = false;
  }
  if (path_alone) leave_path_alone(plan, extra, folder);
  try {
    return keep_measured_plan(folder, scene, bodies, world, system, plan, figures, extra);
  } catch (const Interrupted&) {  // while it was asked why nothing was found: before anything was written
    plan.measured = false;
    return keep_measured_plan(folder, scene, bodies, world, system, plan, figures, extra);
  }
}

void leave_path_alone(plan::Plan& plan, const Json& extra, const fs::path& folder) {
  if (plan.simulation) return;
  if (plan.measured && finished(plan) && !extra.contains("refine"))
    plan::keep_path(plan);
  else
    log::info("{}: the whole tree is kept, for a search may go on from it", (folder / "plan.npz").string());
}

void require_tree_for_film(const std::string& keep_tree, const scenes::Scene& scene) {
  if (keep_tree == "path" && scene.film.tree)
    throw InputError(
        "--keep-tree path: film.tree shows the whole tree; add --set film.tree=false, or keep all of it");
}

KeptPlan keep_measured_plan(const fs::path& folder, const scenes::Scene& scene,
                            const std::vector<PreparedBody>& bodies, const fem::World& world,
                            const FemSystem& system, const plan::Plan& plan, const MotionFigures& figures,
                            const Json& extra) {
  Json summary = facts_of(plan, world, system, figures);
  if (!plan.simulation) {  // whose bytes depend on no clock
    summary["dynamics"] = json_of(system.cost());
    if (!world.parting.pairs.empty()) summary["dynamics"]["parting_cpu_s"] = world.parting.cpu_s;
  }
  if (!extra.is_null()) summary.update(extra);
  remove_what_shows_another_plan(folder, summary);
  write_plan_folder(folder, plan, scene, bodies, summary);
  const std::map<std::string, std::string> pictures = pictures_of(scene, world, plan, figures);
  for (const char* name : {"volume.svg", "volume.png", "tree.svg"})
    if (!pictures.contains(name)) fs::remove(folder / name);  // of what was here before
  for (const auto& [name, bytes] : pictures) write_file(folder / name, bytes);
  update_manifest(folder, "plan", plan::without_timings(summary));
  const bool is_simulation = plan.simulation.has_value();
  return {.file = folder / "plan.npz",
          .summary_json = text_of(summary, 2),
          .is_simulation = is_simulation,
          .reached = is_simulation ? plan.simulation->ending != plan::Simulation::diverged : plan.solved(),
          .measured = !is_unmeasured(plan)};
}

bool plan_is_up_to_date(const PlanOptions& options, const scenes::Scene& scene) {
  if (!fs::exists(options.out / "plan.npz")) return false;
  try {
    const std::vector<PreparedBody> bodies =
        prepare_bodies(scene, options.scene.data, options.out, options.scene.store);
    const PlanFolder folder = read_searched_folder(options.out);
    if (begins_elsewhere(folder)) return false;
    const fem::World world = build_world_in(options.out, options.scene.store, scene, bodies,
                                            State(folder.plan.tree.states[0]).positions);
    plan::Settings settings = settings_of(scene, options);
    const auto searches = folder.told.portfolio.value_or(PortfolioTold{}).searches;
    if (options.portfolio > 1
            ? searches.size() != std::size_t(options.portfolio) || searches[0].seed != settings.seed
            : !searches.empty())
      return false;
    if (!searches.empty()) settings.seed = folder.plan.settings.seed;
    const bool path_wanted = options.keep_tree == "path";
    if (folder.plan.left_out.has_value() != path_wanted)
      throw InputError(fmt::format("{} holds {}, and --keep-tree {} is asked for",
                                   (options.out / "plan.npz").string(),
                                   path_wanted ? "the whole tree" : "the path alone", options.keep_tree));
    return folder.plan.system_hash == FemSystem(world, goal_rules_of(scene)).hash() &&
           plan::first_difference(folder.plan.settings, settings).empty() && finished(folder.plan) &&
           (folder.plan.solved() || folder.plan.settings.max_iterations >= settings.max_iterations) &&
           folder.plan.measured && folder.plan.settings.frames_per_second == settings.frames_per_second &&
           (!options.improve || folder.told.improve) && folder.told.wrong.empty() &&
           // Written after the pictures, so that they are there.
           read_manifest(options.out).value("plan", Json()) == kept_summary(folder) &&
           (!folder.plan.solved() || shortened(folder.told.shortcut, shortcuts_of(scene, options, {})));
  } catch (const InputError& error) {
    log::info("planning anew: {}", error.what());
    return false;
  }
}

}  // namespace limber::detail
