#include "core/error.h"
#include "core/hash.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/temporary_files.h"
#include "core/threads.h"
#include "limber/detail/commands.h"
#include "limber/detail/plan/diagnosis.h"
#include "limber/detail/plan/exported_files.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/plan/search_log.h"
#include "limber/detail/plan/simulate.h"
#include "limber/detail/plan/tree_plot.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "plan/anytime.h"
#include "plan/portfolio.h"
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
    const std::int64_t end = last ? plan.statistics.iterations : plan.legs[leg + 1].first_iteration;
    legs.push_back({{"goal", plan::name_of_goal(plan.settings, int(leg))},
                    {"reached", !last || plan.solved()},
                    {"root", plan.legs[leg].root},
                    {"iterations", end - plan.legs[leg].first_iteration}});
  }
  return legs;
}

std::string text_of_shortcut(const Json& report) {
  const Json &before = report.at("before"), &after = report.at("after");
  const auto change = [&](const char* key, double unit) {
    return fmt::format("{:.3g} → {:.3g}", unit * before.at(key).get<double>(),
                       unit * after.at(key).get<double>());
  };
  return fmt::format(
      "  shortcut     {} changes accepted in {} rounds, {:.2f} CPU s: {} s, effort {} N s, elastic energy {} "
      "J, "
      "volume change {} %\n",
      report.at("accepted").get<int>(), report.at("rounds").get<int>(), report.at("cpu_s").get<double>(),
      change("duration_s", 1), change("effort_n_s", 1), change("strain_energy_j", 1),
      change("volume_change", 100));
}

std::string text_of_portfolio(const plan::PortfolioReport& report, const plan::Plan& plan) {
  const std::uint64_t first = report.searches.front().seed, last = report.searches.back().seed;
  return fmt::format(
      "  portfolio    seeds {} to {}, {} iterations in all, {:.2f} CPU s, {:.2f} s; {} seed {}\n", first,
      last, report.iterations, report.cpu_s, report.wall_s,
      plan.solved() ? "the quickest is" : "none solves it, the nearest is", plan.settings.seed);
}

std::string text_of_improvements(const plan::AnytimeReport& report) {
  std::string text = fmt::format(
      "  improve      {} searches, {} of them reached the goal, {} iterations in all; {:.2f} CPU s, {:.2f} "
      "s\n",
      report.searches, report.solved, report.iterations, report.cpu_s, report.wall_s);
  for (const plan::Improvement& i : report.improvements)
    text += fmt::format("               {} {:.4g} after {:.2f} s and {} iterations\n",
                        plan::name_of(report.settings.cost), plan::cost_in(i.costs, report.settings.cost),
                        i.wall_s, i.iterations);
  return text;
}

std::string text_of_legs(const Json& legs) {
  std::string text;
  for (const Json& leg : legs)
    text += fmt::format("{}{} {} after {} iterations", text.empty() ? "  legs         " : ", ",
                        leg.at("goal").get<std::string>(),
                        leg.at("reached").get<bool>() ? "reached" : "not reached",
                        leg.at("iterations").get<std::int64_t>());
  return text + "\n";
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

std::string text_of_parting(const Json& s) {
  std::string text;
  const Json& parted = s.at("parted");
  const auto mm = [](const Json& m) { return 1e3 * m.get<double>(); };
  for (const Json& pair : parted.at("pairs"))
    text += fmt::format(
        "  start        {} and {} overlapped by {:.3g} mm: parted by {:.3g} and {:.3g} mm, {:.2g} mm apart "
        "now\n",
        pair.at("bodies").at(0).get<std::string>(), pair.at("bodies").at(1).get<std::string>(),
        mm(pair.at("depth_m")), mm(pair.at("moved_m").at(0)), mm(pair.at("moved_m").at(1)),
        mm(pair.at("gap_m")));
  return text +
         fmt::format(
             "               in {} steps{}; no node was moved by more than {:.2f} % of the robot's size\n",
             parted.at("steps").get<int>(),
             s.contains("dynamics")
                 ? fmt::format(", {:.2f} CPU s", s.at("dynamics").at("parting_cpu_s").get<double>())
                 : "",
             100 * parted.at("largest_move_of_robot_size").get<double>());
}

// Of the motion: what a plan and a simulation tell alike.
std::string text_of_motion(const Json& s) {
  std::string volumes;
  for (const auto& [name, percent] : s.at("largest_volume_change_percent").items())
    volumes += fmt::format("{}{} {:.2f} %", volumes.empty() ? "" : ", ", name, percent.get<double>());
  return fmt::format(
      "  motion       {:.2f} s in {} frames, time step {:.3g} ms\n"
      "  volume       changes at most: {}\n"
      "  penetration  at most {:.4f} m, {:.2f} % of the robot's size ({})\n"
      "  surfaces     overlap at most {:.2f} % ({}), in themselves {:.2f} % ({}), gap where they press "
      "{:.2f} % "
      "in the median\n"
      "  strain       at most {:.3f} ({})\n"
      "  contact      at most {:.1f} N ({})\n",
      s.at("motion_s").get<double>(), s.at("frames").get<int>(), 1e3 * s.at("dt_s").get<double>(), volumes,
      s.at("deepest_penetration_m").get<double>(),
      100 * s.at("deepest_penetration_of_robot_size").get<double>(),
      s.at("penetration_between").get<std::string>(),
      100 * s.at("deepest_overlap_of_robot_size").get<double>(), s.at("overlap_between").get<std::string>(),
      100 * s.at("deepest_self_overlap_of_robot_size").get<double>(),
      s.at("self_overlap_of").get<std::string>(),
      100 * s.at("gap_at_contact").at("median_of_robot_size").get<double>(),
      s.at("largest_strain").get<double>(), s.at("largest_strain_of").get<std::string>(),
      s.at("largest_contact_force_n").get<double>(), s.at("contact_between").get<std::string>());
}

std::string text_of_simulation(const Json& s, const std::string& extra, const fs::path& file) {
  return fmt::format("{}\n{}{}{}  hashes       trajectory {}\n  file         {}\n",
                     s.at("explanation").get<std::string>(), s.contains("parted") ? text_of_parting(s) : "",
                     text_of_motion(s), extra, s.at("trajectory_hash").get<std::string>(), file.string());
}

std::string text_of(const Json& s, const std::string& extra, const fs::path& file) {
  const Json &t = s.at("statistics"), &d = s.at("dynamics");
  return fmt::format(
      "{}\n"
      "{}{}"
      "  search       {} iterations, {} nodes, {} diverged, {} rejected, {} ways refused; {:.2f} CPU s, "
      "{:.2f} s\n"
      "  memory       {:.1f} kB a node, {:.1f} where nothing is shared with the parent\n"
      "  dynamics     contact {:.2f} × the force step; a lane takes {:.1f} µs to load, {:.1f} µs to store\n"
      "{}"
      "{}"
      "  hashes       tree {}, trajectory {}\n"
      "  file         {}\n",
      s.at("explanation").get<std::string>(), s.contains("parted") ? text_of_parting(s) : "",
      s.contains("legs") ? text_of_legs(s.at("legs")) : "", t.at("iterations").get<std::int64_t>(),
      s.at("nodes").get<int>(), t.at("diverged").get<std::int64_t>(), t.at("rejected").get<std::int64_t>(),
      t.at("refused").get<std::int64_t>(), t.at("cpu_s").get<double>(), t.at("wall_s").get<double>(),
      1e-3 * s.at("node_bytes").get<double>(), 1e-3 * s.at("node_bytes_unshared").get<double>(),
      d.at("contact_of_force_step").get<double>(), d.at("load_us").get<double>(),
      d.at("store_us").get<double>(), text_of_motion(s), extra, s.at("tree_hash").get<std::string>(),
      s.at("trajectory_hash").get<std::string>(), file.string());
}

// `earlier` is the summary of the plan that this one goes on from, null for none: a solved one has its rounds
// behind it.
plan::ShortcutSettings shortcuts_of(const scenes::Scene& scene, const PlanOptions& options,
                                    const Json& earlier) {
  plan::ShortcutSettings s;
  s.rounds = options.shortcut_rounds.value_or(scene.planner.shortcut_rounds);
  s.cost = plan::cost_kind_from(options.cost);
  if (earlier.contains("shortcut") && earlier.at("shortcut").at("cost") == options.cost)
    s.rounds_done = earlier.at("shortcut").at("rounds").get<int>();
  return s;
}

// Whether nothing is left to do for a plan with that summary.
bool shortened(const Json& summary, const plan::ShortcutSettings& wanted) {
  return summary.contains("shortcut") ? summary.at("shortcut").at("cost") == plan::name_of(wanted.cost) &&
                                            summary.at("shortcut").at("rounds") == wanted.rounds
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
            {"motion_s", double(path.end.step - plan.tree.states.steps()[0]) * world.dt_s},
            {"frames", path.frames.size()},
            {"tree_hash", hex(plan::hash_of(plan.tree))},
            {"trajectory_hash", hex(plan::hash_of(path))}};
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
               {"nodes", plan.tree.size()},
               {"node_bytes", plan.tree.states.bytes() / std::size_t(plan.tree.size())},
               {"node_bytes_unshared", plan.tree.states.bytes_unshared() / std::size_t(plan.tree.size())},
               {"distance_m", plan.best_distance_m},
               {"statistics", plan::json_of(plan.statistics)}});
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
  s.max_force_n = p.max_force_n;
  s.min_force_share = p.min_force_share, s.max_force_share = p.max_force_share;
  s.min_duration_s = p.min_duration_s, s.max_duration_s = p.max_duration_s;
  s.control_point_radius_m = p.control_point_radius_m;
  s.settle = {.max_duration_s = p.settle_time_s,
              .mean_speed_m_s = p.settle_speed_m_s,
              .max_force_share = p.settle_force_share,
              .hold = p.settle_hold && !scene.goal.shape};  // which holding would leave alone
  s.laws = {.lag = p.lag,
            .metric = p.metric == "distance" ? plan::Metric::distance : plan::Metric::time_to_go,
            .time_weight = p.time_weight,
            .guidance = p.guidance,
            .soft_price = p.soft_price,
            .learn_prices = p.learn_prices,
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

Outcome plan(const PlanOptions& options) {
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
      return {kept.plan.solved() ? exit_done : exit_no_plan, kept.summary, text_of(kept.summary, "", file)};
    }
  }
  return plan(options, scene);
}

Found find_plan(const scenes::Scene& scene, const FemSystem& system, const PlanOptions& options,
                std::optional<plan::Plan> earlier, const Json& earlier_summary) {
  const plan::Settings settings = settings_of(scene, options);
  const bool several = options.portfolio > 1;
  Found found;
  std::optional<SearchLog> search_log;
  if (options.stats) search_log.emplace(*options.stats, earlier ? earlier->statistics.iterations : 0);
  plan::PortfolioReport searches;
  found.plan = several ? plan::portfolio(system, settings, options.portfolio, &searches)
                       : plan::plan(system, settings, std::move(earlier), [&](const plan::Moment& moment) {
                           if (search_log) search_log->add(moment);
                         });
  if (search_log) search_log->finish();

  plan::Plan& plan = found.plan;
  const plan::ShortcutSettings shortcuts = shortcuts_of(scene, options, earlier_summary);
  for (const char* later : {"shortcut", "improve", "refine"})
    if (earlier_summary.contains(later)) found.extra[later] = earlier_summary.at(later);
  if (several) {
    found.extra["portfolio"] = plan::json_of(searches);
    found.extra_text += text_of_portfolio(searches, plan);
  }
  if (plan.solved() && shortcuts.rounds > shortcuts.rounds_done) {
    found.extra["shortcut"] = plan::json_of(plan::shorten(system, plan, shortcuts));
    found.extra_text += text_of_shortcut(found.extra.at("shortcut"));
  }
  if (plan.solved() && options.improve) {
    const plan::AnytimeReport report =
        plan::improve(system, plan, {.cost = shortcuts.cost, .shortcut_rounds = shortcuts.rounds});
    found.extra["improve"] = plan::json_of(report);
    found.extra_text += text_of_improvements(report);
  }
  return found;
}

Outcome plan(const PlanOptions& options, const scenes::Scene& scene) {
  make_folder(options.out);
  remove_abandoned(options.out);
  const std::vector<PreparedBody> bodies =
      prepare_bodies(scene, options.scene.data, options.out, options.scene.store);
  const fem::World world = build_world(scene, bodies);
  const Beginning beginning = beginning_of(options.from, options.frame, options.out, scene, world);
  const FemSystem system(world, bodies, goal_rules_of(scene), beginning.start);
  const fs::path file = options.out / "plan.npz";
  if (options.portfolio > 1 && (options.resume || options.stats))
    throw InputError(fmt::format("--portfolio is of several searches, {} of one; leave one of the two out",
                                 options.resume ? "--resume" : "--stats"));

  std::optional<plan::Plan> earlier;
  Json earlier_summary;
  int nodes_kept = 0;  // in the file
  if (options.resume) {
    PlanFolder folder = read_searched_folder(options.out);
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
  if (beginning.start) {
    found.extra["from"] = beginning.from;
    found.extra_text = fmt::format("  from         frame {} of {}\n", beginning.from.at("frame").get<int>(),
                                   options.from.string()) +
                       found.extra_text;
  }
  // Whatever comes of a search, of shortcuts or of better paths is in the tree.
  if (stop_signal() != 0 && plan.tree.size() == nodes_kept) {
    log::info("{}: is as it was; go on with --resume", file.string());
    throw_if_stopped();
  }
  const Outcome outcome =
      keep_plan(options.out, scene, bodies, world, system, plan, found.extra, found.extra_text);
  if (stop_signal() != 0) {
    log::info("{}: the plan so far is kept; go on with --resume", file.string());
    throw_if_stopped();
  }
  return outcome;
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

Outcome keep_plan(const fs::path& folder, const scenes::Scene& scene, const std::vector<PreparedBody>& bodies,
                  const fem::World& world, const FemSystem& system, plan::Plan& plan, const Json& extra,
                  const std::string& extra_text) {
  MotionFigures figures;
  try {
    const NothingToKeep nothing_to_keep;
    throw_if_stopped();
    figures = measure_motion(world, bodies, plan.trajectory, system.surfaces());
    plan.measured = true;
  } catch (const Interrupted&) {
    plan.measured = false;
  }
  return keep_measured_plan(folder, scene, bodies, world, system, plan, figures, extra, extra_text);
}

Outcome keep_measured_plan(const fs::path& folder, const scenes::Scene& scene,
                           const std::vector<PreparedBody>& bodies, const fem::World& world,
                           const FemSystem& system, const plan::Plan& plan, const MotionFigures& figures,
                           const Json& extra, const std::string& extra_text) {
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
  update_manifest(folder, "plan", summary);
  if (plan.simulation)
    return {plan.simulation->ending == plan::Simulation::diverged ? exit_no_plan : exit_done, summary,
            is_unmeasured(plan) ? "" : text_of_simulation(summary, extra_text, folder / "plan.npz")};
  return {plan.solved() ? exit_done : exit_no_plan, summary,
          is_unmeasured(plan) ? "" : text_of(summary, extra_text, folder / "plan.npz")};
}

bool plan_is_up_to_date(const PlanOptions& options, const scenes::Scene& scene) {
  if (!fs::exists(options.out / "plan.npz")) return false;
  try {
    const std::vector<PreparedBody> bodies =
        prepare_bodies(scene, options.scene.data, options.out, options.scene.store);
    const PlanFolder folder = read_searched_folder(options.out);
    if (begins_elsewhere(folder)) return false;
    const fem::World world = build_world(scene, bodies, State(folder.plan.tree.states[0]).positions);
    plan::Settings settings = settings_of(scene, options);
    const Json searches = folder.summary.value("portfolio", Json::object()).value("searches", Json::array());
    if (options.portfolio > 1
            ? searches.size() != std::size_t(options.portfolio) || searches.at(0).at("seed") != settings.seed
            : !searches.empty())
      return false;
    if (!searches.empty()) settings.seed = folder.plan.settings.seed;
    return folder.plan.system_hash == FemSystem(world, goal_rules_of(scene)).hash() &&
           plan::first_difference(folder.plan.settings, settings).empty() && finished(folder.plan) &&
           (folder.plan.solved() || folder.plan.settings.max_iterations >= settings.max_iterations) &&
           folder.plan.measured && folder.plan.settings.frames_per_second == settings.frames_per_second &&
           (!options.improve || folder.summary.contains("improve")) &&
           // Written after the pictures, so that they are there.
           read_manifest(options.out).value("plan", Json()) == folder.summary &&
           (!folder.plan.solved() || shortened(folder.summary, shortcuts_of(scene, options, {})));
  } catch (const InputError& error) {
    log::info("planning anew: {}", error.what());
    return false;
  }
}

}  // namespace limber::detail
