// What a user wants to know of a scene before hours of planning: docs/cli.md.
#include <algorithm>
#include <deque>

#include "core/error.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "core/threads.h"
#include "fem/observe.h"
#include "limber/detail/commands.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/film/start.h"
#include "limber/detail/plan/diagnosis.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/goal_terms.h"
#include "meshing/surface_overlap.h"
#include "render/film.h"
#include "scenes/library.h"
#include "scenes/problems.h"

namespace limber::detail {

namespace {

// CPU s of a body, without and for each triangle: within a factor of 2 for nine of ten of 113 bodies that
// were prepared on one machine, of 48 to 174,534 triangles.
struct PrepareCost {
  double once_s, a_triangle_s;
};
constexpr PrepareCost in_cells{0.5, 3e-5}, by_tets{1.5, 8e-5};

constexpr int tried_iterations = 64;
constexpr double tried_s = 10;

bool moves(const scenes::BodySpec& body) {
  return body.kind == scenes::Kind::deformable || body.role != scenes::Role::obstacle;
}

const char* name_of(scenes::Role role) {
  switch (role) {
    case scenes::Role::robot:
      return "robot";
    case scenes::Role::obstacle:
      return "obstacle";
    case scenes::Role::free:
      return "free";
    case scenes::Role::scenery:
      break;
  }
  return "scenery";
}

Json json_of(const scenes::BodySpec& body) {
  Json json{{"name", body.name}, {"role", name_of(body.role)}};
  if (body.role == scenes::Role::scenery) return json;
  json["kind"] = body.kind == scenes::Kind::rigid ? "rigid" : "deformable";
  const scenes::MaterialSpec& m = body.material;
  json["contact"] = body.contact == scenes::Contact::cage ? "cage" : "surface";
  if (body.cage.tets > 0) json["tets_asked"] = body.cage.tets;
  if (body.cage.cells.x() > 0)
    json["cells"] = {body.cage.cells.x(), body.cage.cells.y(), body.cage.cells.z()};
  if (body.cage.cell_m > 0) json["cell_m"] = body.cage.cell_m;
  json["material"] = {{"friction", m.friction}};
  if (moves(body)) json["material"]["density_kg_m3"] = m.density_kg_m3;
  if (body.kind == scenes::Kind::deformable)
    json["material"].update(
        {{"model", m.model}, {"youngs_modulus_pa", m.youngs_modulus_pa}, {"poisson_ratio", m.poisson_ratio}});
  return json;
}

std::string line_of(const Json& body) {
  std::string text = fmt::format("  body         {}: {}", body.at("name").get<std::string>(),
                                 body.at("role").get<std::string>());
  if (body.contains("kind")) text += ", " + body.at("kind").get<std::string>();
  if (body.contains("contact"))
    text += fmt::format(", touched at its {}", body.at("contact").get<std::string>());
  if (body.contains("triangles"))
    text += fmt::format("; {} triangles of {}", body.at("triangles").get<std::int64_t>(),
                        body.at("model").get<std::string>());
  else if (body.contains("model"))
    text += "; " + body.at("model").get<std::string>();
  if (body.contains("tets_asked"))
    text += fmt::format(", {} tets asked for", body.at("tets_asked").get<int>());
  if (body.contains("cells")) text += fmt::format(", cells {}", body.at("cells").dump());
  if (body.contains("cell_m")) text += fmt::format(", cells of {} m", body.at("cell_m").get<double>());
  if (body.contains("size_m"))
    text += fmt::format("; {:.3g} x {:.3g} x {:.3g} m", body.at("size_m")[0].get<double>(),
                        body.at("size_m")[1].get<double>(), body.at("size_m")[2].get<double>());
  if (body.contains("material")) {
    const Json& m = body.at("material");
    if (m.contains("youngs_modulus_pa"))
      text += fmt::format("; {}, {:.4g} Pa, Poisson {}", m.at("model").get<std::string>(),
                          m.at("youngs_modulus_pa").get<double>(), m.at("poisson_ratio").get<double>());
    if (m.contains("density_kg_m3"))
      text += fmt::format(", {:.4g} kg/m3", m.at("density_kg_m3").get<double>());
  }
  return text + "\n";
}

// Of a surface that is closed, its solid's; else the middle of its box.
Vec3 middle_of(const SurfaceMesh& mesh) {
  const Box box = bounding_box(mesh.positions);
  Vec3 sum = Vec3::Zero();
  double volume6 = 0;
  for (const auto t : mesh.triangles.rowwise()) {
    const Vec3 a = mesh.positions.row(t[0]), b = mesh.positions.row(t[1]), c = mesh.positions.row(t[2]);
    const double v = (a - box.center()).dot((b - box.center()).cross(c - box.center()));
    volume6 += v, sum += v * (a + b + c - 3 * box.center()) / 4;
  }
  const bool solid = std::abs(volume6) > 1e-6 * box.size().prod();
  return solid ? Vec3(box.center() + sum / volume6) : box.center();
}

class Check {
 public:
  Check(const SceneCheckOptions& options, const fs::path& file) : options_(options), file_(file) {
    json_["scene"] = file.string();
  }

  Outcome run() {
    std::vector<std::string> sets = options_.scene.sets;
    if (!options_.preset.empty()) sets.push_back("planner.preset=" + options_.preset);
    problems_ = scenes::problems_of(read_file(file_, scenes::most_scene_bytes), file_.string(), sets);
    if (!problems_.empty()) return ended();
    scene_ = scenes::read_scene_file(file_, sets);
    load();
    for (std::size_t b = 0; b < models_.size(); ++b)
      if (models_[b]) look_at_place(b);
    if (problems_.empty()) robot_size_m_ = box_of(scene_.robot).size().maxCoeff();
    if (problems_.empty()) look_at_pairs();
    look_at_files();
    if (problems_.empty()) look_at_start();
    return ended();
  }

 private:
  Box box_of(int body) const { return bounding_box(models_[std::size_t(body)]->model.surface.positions); }
  const std::string& name(std::size_t body) const { return scene_.bodies[body].name; }
  void tell(const char* key, const std::string& words) { text_ += fmt::format("  {:12} {}\n", key, words); }

  void load() {
    double cpu_s = 0;
    for (const scenes::BodySpec& body : scene_.bodies) {
      throw_if_stopped();
      Json json = json_of(body);
      std::optional<LoadedModel>& loaded = models_.emplace_back();
      try {
        loaded = load_model(scene_, body, options_.scene.data);
        const SurfaceMesh& surface = loaded->model.surface;
        const Vec3 size = bounding_box(surface.positions).size();
        json["model"] = loaded->from, json["triangles"] = surface.triangles.rows();
        json["size_m"] = {size.x(), size.y(), size.z()};
        for (const std::string& warning : loaded->model.warnings)
          warnings_.push_back(fmt::format("body {}: {}", body.name, warning));
        const PrepareCost& cost = loaded->made_cage ? in_cells : by_tets;
        cpu_s += cost.once_s + cost.a_triangle_s * double(surface.triangles.rows());
      } catch (const InputError& error) {
        problems_.push_back(error.what());
      }
      add(std::move(json));
    }
    for (const scenes::BodySpec& body : scene_.scenery) add(json_of(body));
    json_["estimate"]["prepare_cpu_s"] = cpu_s;
  }

  void add(Json body) {
    text_ += line_of(body);
    json_["bodies"].push_back(std::move(body));
  }

  // As build_world asks of the cage, which is a little larger.
  void look_at_place(std::size_t b) {
    if (!scene_.walls || !moves(scene_.bodies[b])) return;
    const Box box = box_of(int(b));
    const double tolerance_m = 1e-6 * scene_.bounds_m.diagonal();
    for (int c = 0; c < 3; ++c) {
      const double below = scene_.bounds_m.lower[c] - box.lower[c],
                   above = box.upper[c] - scene_.bounds_m.upper[c];
      if (std::max(below, above) <= tolerance_m) continue;
      problems_.push_back(
          fmt::format("{}: bodies.{} is outside the bounds: its surface reaches {} = {:.6g}, they end at "
                      "{:.6g}; move it or "
                      "enlarge world.bounds_m",
                      scene_.bodies[b].where, name(b), "xyz"[c], below > above ? box.lower[c] : box.upper[c],
                      below > above ? scene_.bounds_m.lower[c] : scene_.bounds_m.upper[c]));
    }
  }

  // Surfaces in one another, or so near that they push.
  void look_at_pairs() {
    const bool cages = all_touched_at_cages(scene_);
    const double offset_m = contact_offset_m(scene_, box_of(scene_.robot));
    const double allowed_m = cages ? 1e-6 * scene_.bounds_m.diagonal() : offset_m;
    if (!cages) json_["contact_offset_m"] = offset_m;
    std::deque<meshing::SurfaceShape> shapes;
    std::deque<meshing::PlacedSurface> placed;
    for (const auto& loaded : models_) {
      const SurfaceMesh& surface = loaded->model.surface;
      placed.emplace_back(shapes.emplace_back(surface.positions, surface.triangles), surface.positions);
    }
    struct Pair {
      std::size_t one, other;
      double depth_m = 0, gap_m = 0;
    };
    std::vector<Pair> pairs;
    for (std::size_t a = 0; a < placed.size(); ++a)
      for (std::size_t b = a + 1; b < placed.size(); ++b)
        if (moves(scene_.bodies[a]) || moves(scene_.bodies[b])) pairs.push_back({a, b});
    parallel_for(int(pairs.size()), [&](int i) {
      Pair& pair = pairs[std::size_t(i)];
      throw_if_stopped();
      pair.depth_m = meshing::overlap(placed[pair.one], placed[pair.other]).depth_m;
      if (pair.depth_m == 0)
        pair.gap_m = meshing::gap(placed[pair.one], placed[pair.other], offset_m).distance_m;
    });
    json_["overlaps"] = Json::array(), json_["gaps_below_offset"] = Json::array();
    for (const Pair& pair : pairs) {
      Json json{{"body", name(pair.one)}, {"other", name(pair.other)}};
      const std::string both = fmt::format("{} and {}", name(pair.one), name(pair.other));
      if (pair.depth_m > 0) {
        const double share = pair.depth_m / robot_size_m_;
        json.update({{"depth_m", pair.depth_m}, {"of_robot_size", share}});
        const bool parted = !cages && scene_.part_overlaps && pair.depth_m > allowed_m;
        json["parted"] = parted;
        tell("overlap", fmt::format("{}: {:.3g} m deep, {:.3g} % of the robot's size{}", both, pair.depth_m,
                                    100 * share, parted ? "; they are parted before the plan begins" : ""));
        if (pair.depth_m > allowed_m && !parted)
          problems_.push_back(
              fmt::format("{}: bodies {} overlap at the start, {:.3g} m deep ({:.3g} % of the robot's size; "
                          "{:.3g} m are let "
                          "pass); move them apart",
                          scene_.bodies[pair.other].where, both, pair.depth_m, 100 * share, allowed_m));
        json_["overlaps"].push_back(json);
      } else if (!cages && pair.gap_m < offset_m) {
        json["gap_m"] = pair.gap_m;
        tell("near",
             fmt::format("{}: {:.3g} m apart, less than the contact offset of {:.3g} m, which is as much "
                         "between these two",
                         both, pair.gap_m, offset_m));
        json_["gaps_below_offset"].push_back(json);
      }
    }
  }

  void look_at_files() {
    if (scene_.goal.shape && !scene_.goal.shape->cage.empty()) try {
        const auto cage = find_goal_cage(scene_, options_.scene.data);
        if (!cage)
          throw InputError(
              fmt::format("goal.shape.cage: there is no file {}; write where it is, or give its "
                          "folder with --data",
                          scene_.goal.shape->cage));
        read_msh(*cage);
      } catch (const InputError& error) {
        problems_.push_back(error.what());
      }
    json_["film_possible"] = true;
    try {
      render::require_film_possible(scene_.film.frames_per_second, "film.mp4");
      require_letters(scene_.film);
    } catch (const InputError& error) {
      json_["film_possible"] = false;
      warnings_.push_back(error.what());
    }
  }

  // What it takes a world to know.
  void look_at_start() {
    std::optional<Start> start;
    try {
      if (options_.work) {
        make_folder(*options_.work);
        const FolderLock lock(*options_.work, FolderLock::alone);
        prepare_bodies(scene_, options_.scene.data, *options_.work, options_.scene.store);
        start = prepared_start(scene_, *options_.work);
      } else {
        std::vector<LoadedModel> models;
        for (std::optional<LoadedModel>& loaded : models_) models.push_back(std::move(*loaded));
        middle_of_robot_m_ = middle_of(models[std::size_t(scene_.robot)].model.surface);
        start = loaded_start(scene_, models, options_.scene.data);
      }
    } catch (const InputError& error) {
      problems_.push_back(error.what());
      return;
    }
    json_["dt_s"] = start->step_known ? Json(start->world.dt_s) : Json();
    tell("time step", start->step_known ? fmt::format("{:.3g} ms", 1e3 * start->world.dt_s)
                                        : "not known before cages are made; --work DIR makes them");
    const bool can_be_planned = scene_.lacks.empty();
    if (can_be_planned && start->prepared)
      try_search(*start);
    else if (can_be_planned)
      look_at_goals();
    const std::string prepare =
        start->prepared
            ? "done"
            : fmt::format("about {:.2g} CPU s, by the number of triangles; may be twice or half that",
                          json_.at("estimate").at("prepare_cpu_s").get<double>());
    tell("to prepare", prepare);
    if (can_be_planned)
      tell("to plan", plan_estimate_.empty()
                          ? "not known before bodies are prepared; --work DIR prepares and tries"
                          : plan_estimate_);
    paint(*start);
  }

  void tell_goal(const std::string& which, const std::vector<GoalTerm>& terms, const char* about) {
    for (const GoalTerm& term : terms) {
      tell("goal",
           fmt::format("{}{}: {}{}{}", which, term.asked, about, term.found, term.met ? ", met" : ""));
      json_["goal"].push_back({{"asked", which + term.asked}, {"found", term.found}, {"met", term.met}});
    }
  }

  // Without cages: where the middle of the robot's surface is to each goal.
  void look_at_goals() {
    const auto look = [&](const std::string& which, const scenes::Goal& goal) {
      GoalTerm term{"centre of mass in its box", false, ""};
      const double away = (middle_of_robot_m_ - goal.center_of_mass_m).norm();
      if (goal.box_m)
        term.met = (middle_of_robot_m_.array() >= goal.box_m->lower.array()).all() &&
                   (middle_of_robot_m_.array() <= goal.box_m->upper.array()).all();
      else
        term.asked =
            fmt::format("centre of mass within {:g} m of ({:g} {:g} {:g})", goal.radius_m,
                        goal.center_of_mass_m.x(), goal.center_of_mass_m.y(), goal.center_of_mass_m.z()),
        term.met = away <= goal.radius_m;
      term.found = fmt::format("{:.3g} m from its middle", away);
      tell_goal(which, {term}, "about ");
      return term.met;
    };
    for (std::size_t v = 0; v < scene_.via.size(); ++v)
      look(fmt::format("via {}: ", v + 1), scene_.via[v].goal);
    const scenes::Goal& goal = scene_.goal;
    const bool there = look("", goal),
               more = goal.shape || goal.above >= 0 || goal.below >= 0 || goal.clear_of >= 0;
    if (there && !more && scene_.via.empty()) already_there();
  }

  void already_there() {
    warnings_.push_back("the robot is in the goal at the start: the search ends at once; move the goal");
  }

  void try_search(const Start& start) {
    const FemSystem system(start.world, goal_rules_of(scene_));
    const State rest = system.start();
    const auto look = [&](const std::string& which, const scenes::Goal& goal) {
      const std::vector<GoalTerm> terms = terms_of(scene_, goal, start.world, rest);
      tell_goal(which, terms, "");
      return std::all_of(terms.begin(), terms.end(), [](const GoalTerm& term) { return term.met; });
    };
    for (std::size_t v = 0; v < scene_.via.size(); ++v)
      look(fmt::format("via {}: ", v + 1), scene_.via[v].goal);
    if (look("", scene_.goal) && scene_.via.empty()) already_there();
    plan::Settings settings = settings_of(scene_, PlanOptions{});
    const std::int64_t all = settings.max_iterations;
    settings.max_iterations = std::min<std::int64_t>(all, tried_iterations);
    settings.time_limit_s = tried_s;
    const plan::Plan tried = plan::plan(system, settings);
    throw_if_stopped();
    const Diagnosis diagnosis = diagnose(start.world, system, tried);
    json_["rigid_passage"] = diagnosis.json;
    const double radius = diagnosis.json.at("robot_inner_radius_m"),
                 passage = diagnosis.json.at("widest_rigid_passage_m");
    if (passage < 0)
      warnings_.push_back(
          "rigid bodies and walls, where they stand at the start, leave no way to the goal even for a point; "
          "move "
          "them or the goal");
    else if (passage < radius)
      warnings_.push_back(
          fmt::format("between rigid bodies and walls the robot can only pass by squeezing: the "
                      "widest way lets a ball of radius {:.3g} m through, and it holds one of "
                      "{:.3g} m",
                      passage, radius));
    const plan::Statistics& s = tried.statistics;
    const double wall_s = s.iterations > 0 ? s.wall_s / double(s.iterations) * double(all) : 0;
    json_["estimate"]["plan"] = {{"tried_iterations", s.iterations},
                                 {"tried_wall_s", s.wall_s},
                                 {"solved", tried.solved()},
                                 {"iterations", all},
                                 {"all_iterations_wall_s", wall_s}};
    plan_estimate_ =
        tried.solved()
            ? fmt::format("a search of {} iterations and {:.2g} s reaches the goal", s.iterations, s.wall_s)
            : fmt::format(
                  "{} iterations took {:.2g} s; all {} would take about {:.2g} s, and a search that "
                  "reaches the goal ends before",
                  s.iterations, s.wall_s, all, wall_s);
  }

  void paint(const Start& start) {
    const double frames_a_second = scene_.film.frames_per_second / scene_.film.speed;
    json_["estimate"]["frames_a_second_of_motion"] = frames_a_second;
    if (!options_.still) {
      tell("to film", fmt::format("{:g} frames a second of motion; --still FILE.png paints one and tells how "
                                  "long that takes",
                                  frames_a_second));
      return;
    }
    const auto size = options_.size.empty() ? std::pair(scene_.film.width_px, scene_.film.height_px)
                                            : parse_size(options_.size);
    const double seconds = write_still(start, options_.camera, size, *options_.still);
    json_["still"] = options_.still->string();
    json_["estimate"]["paint_s"] = seconds;
    tell("to film",
         fmt::format("painting the still took {:.2g} s; at that, {:g} frames a second of motion take "
                     "{:.2g} s, shared by the threads",
                     seconds, frames_a_second, frames_a_second * seconds));
    tell("still", options_.still->string());
  }

  Outcome ended() {
    const bool good = problems_.empty();
    json_["problems"] = problems_, json_["warnings"] = warnings_;
    const bool to_plan = scene_.lacks.empty();
    if (good && !to_plan) tell("no plan", scene_.lacks);
    json_["can_be_planned"] = good && to_plan, json_["can_be_simulated"] = good;
    for (const std::string& warning : warnings_) tell("warning", warning);
    for (const std::string& problem : problems_) tell("problem", problem);
    if (!good) json_["error"] = problems_.front(), json_["exit_code"] = int(exit_bad_input);
    const char* const done = to_plan ? "planned" : "simulated";
    const std::string verdict = good ? fmt::format("can be {}", done)
                                     : fmt::format("cannot be {}: {} problem{}", done, problems_.size(),
                                                   problems_.size() == 1 ? "" : "s");
    return {good ? exit_done : exit_bad_input, json_,
            fmt::format("{}: {}\n{}", file_.string(), verdict, text_)};
  }

  const SceneCheckOptions& options_;
  const fs::path file_;
  scenes::Scene scene_;
  std::vector<std::optional<LoadedModel>> models_;  // nothing: it could not be read
  double robot_size_m_ = 0;
  Vec3 middle_of_robot_m_ = Vec3::Zero();
  std::vector<std::string> problems_, warnings_;
  std::string plan_estimate_;
  Json json_;
  std::string text_;
};

}  // namespace

Outcome check_scene(const SceneCheckOptions& options) {
  return Check(options, scenes::find_scene(options.scene.scene)).run();
}

Outcome info_of_scene(const fs::path& file) {
  const scenes::Scene scene = scenes::read_scene_file(file);
  Json json{{"scene", file.string()}, {"name", scene.name}, {"description", scene.description}};
  std::string text = fmt::format("{}: {}\n", scene.name, scene.description);
  for (const auto* bodies : {&scene.bodies, &scene.scenery})
    for (const scenes::BodySpec& body : *bodies) {
      json["bodies"].push_back(json_of(body));
      text += line_of(json.at("bodies").back());
    }
  const bool to_plan = scene.lacks.empty();
  json["goals"] = to_plan ? scene.via.size() + 1 : 0;
  if (to_plan) json["preset"] = scene.planner.preset, json["iterations"] = scene.planner.iterations;
  json["film"] = {{"size_px", {scene.film.width_px, scene.film.height_px}},
                  {"frames_per_second", scene.film.frames_per_second},
                  {"cameras", scene.cameras.size()}};
  text += to_plan ? fmt::format("  goals        {}\n  planner      {}, {} iterations\n", scene.via.size() + 1,
                                scene.planner.preset, scene.planner.iterations)
                  : "  goals        none; it can be simulated\n";
  text += fmt::format(
      "  film         {} x {}, {} frames a second, cameras: {}\n"
      "limber scene check {} loads its models and says more\n",
      scene.film.width_px, scene.film.height_px, scene.film.frames_per_second, scene.cameras.size(),
      file.string());
  return {exit_done, json, text};
}

Outcome render_still(const StillOptions& options) {
  const fs::path file = scenes::find_scene(options.scene.scene);
  const scenes::Scene scene = scenes::read_scene_file(file, options.scene.sets);
  const fs::path still = options.out.value_or(scene.name + ".png");
  const auto size =
      options.size.empty() ? std::pair(scene.film.width_px, scene.film.height_px) : parse_size(options.size);
  std::vector<LoadedModel> models;
  for (const scenes::BodySpec& body : scene.bodies) {
    throw_if_stopped();
    models.push_back(load_model(scene, body, options.scene.data));
  }
  write_still(loaded_start(scene, models, options.scene.data), options.camera, size, still);
  return {exit_done,
          {{"still", still.string()}, {"size", {size.first, size.second}}, {"camera", options.camera}},
          still.string() + "\n"};
}

}  // namespace limber::detail
