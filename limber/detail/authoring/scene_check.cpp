#include "limber/detail/authoring/scene_check.h"

#include <algorithm>
#include <deque>
#include <set>

#include "core/error.h"
#include "core/json_text.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "core/threads.h"
#include "fem/observe.h"
#include "fem/parting.h"
#include "limber/detail/authoring/scene_facts.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/film/start.h"
#include "limber/detail/plan/diagnosis.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/script_doubts.h"
#include "meshing/surface_overlap.h"
#include "render/film.h"
#include "scenes/library.h"
#include "scenes/problems.h"

namespace limber::detail {

namespace {

// CPU s of a body without shells, once and for each triangle: within a factor of 2 for eleven organs that
// were prepared on one machine, of 8,326 to 174,534 triangles.
struct PrepareCost {
  double once_s, a_triangle_s;
};
constexpr PrepareCost in_cells{0.5, 3e-5}, by_tets{0.5, 5.5e-5};

constexpr int tried_iterations = 64;
constexpr double tried_s = 10;

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
  Check(const SceneCheckOptions& options, const fs::path& file) : options_(options) { found_.file = file; }

  SceneFindings run() {
    std::vector<std::string> sets = options_.scene.sets;
    if (!options_.preset.empty()) sets.push_back("planner.preset=" + options_.preset);
    found_.problems =
        scenes::problems_of(read_file(found_.file, scenes::max_scene_bytes), found_.file.string(), sets);
    if (!found_.problems.empty()) return found_;
    scene_ = scenes::read_scene_file(found_.file, sets);
    found_.lacks = scene_.lacks;
    load();
    for (std::size_t b = 0; b < models_.size(); ++b)
      if (models_[b]) look_at_place(b), look_at_held(b);
    if (found_.problems.empty()) robot_size_m_ = box_of(scene_.robot).size().maxCoeff();
    if (found_.problems.empty()) look_at_pairs();
    look_at_files();
    if (found_.problems.empty()) look_at_start();
    return found_;
  }

 private:
  Box box_of(int body) const { return bounding_box(models_[std::size_t(body)]->model.surface.positions); }
  const std::string& name(std::size_t body) const { return scene_.bodies[body].name; }

  void load() {
    double cpu_s = 0;
    std::set<Json> made;
    for (const scenes::BodySpec& body : scene_.bodies) {
      throw_if_stopped();
      Json json = facts_of(body);
      std::optional<LoadedModel>& loaded = models_.emplace_back();
      try {
        loaded = load_model(scene_, body, options_.scene.data);
        const SurfaceMesh& surface = loaded->model.surface;
        const Vec3 size = bounding_box(surface.positions).size();
        json["model"] = loaded->from, json["triangles"] = surface.triangles.rows();
        json["size_m"] = {size.x(), size.y(), size.z()};
        for (const std::string& warning : loaded->model.warnings)
          found_.warnings.push_back(fmt::format("body {}: {}", body.name, warning));
        const PrepareCost& cost = loaded->made_cage ? in_cells : by_tets;
        if (made.insert(loaded->input).second)
          cpu_s += cost.once_s + cost.a_triangle_s * double(surface.triangles.rows());
      } catch (const InputError& error) {
        found_.problems.push_back(error.what());
      }
      found_.bodies_json.push_back(text_of(json));
    }
    for (const scenes::BodySpec& body : scene_.scenery) found_.bodies_json.push_back(text_of(facts_of(body)));
    found_.prepare_cpu_s = cpu_s;
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
      found_.problems.push_back(
          fmt::format("{}: bodies.{} is outside the bounds: its surface reaches {} = {:.6g}, they end at "
                      "{:.6g}; move it or "
                      "enlarge world.bounds_m",
                      scene_.bodies[b].where, name(b), "xyz"[c], below > above ? box.lower[c] : box.upper[c],
                      below > above ? scene_.bounds_m.lower[c] : scene_.bounds_m.upper[c]));
    }
  }

  // What is held are nodes of the cage, which reaches beyond its surface by a few hundredths of the size.
  void look_at_held(std::size_t b) {
    const Box body = box_of(int(b));
    const double size = body.size().maxCoeff(), perhaps = 0.1 * size, certainly = size;
    for (const Box& box : scene_.bodies[b].fixed.boxes_m) {
      const double apart = std::max((box.lower - body.upper).maxCoeff(), (body.lower - box.upper).maxCoeff());
      if (apart > perhaps)
        (apart > certainly ? found_.problems : found_.warnings)
            .push_back(fmt::format(
                "{}: bodies.{}.fixed: the box from [{:.6g}] to [{:.6g}] is beside the body, which "
                "reaches from [{:.6g}] to [{:.6g}]; a box that holds no node of its cage is refused",
                scene_.bodies[b].where, name(b), fmt::join(box.lower, ", "), fmt::join(box.upper, ", "),
                fmt::join(body.lower, ", "), fmt::join(body.upper, ", ")));
    }
  }

  // A goal of which no point is outside a rigid body that stays where it is.
  void look_at_blocked(const std::string& which, const scenes::Goal& goal,
                       const std::deque<meshing::PlacedSurface>& placed) {
    const Vec3 middle = goal.box_m ? goal.box_m->center() : goal.center_of_mass_m;
    const double radius = goal.box_m ? 0.5 * goal.box_m->diagonal() : goal.radius_m;
    for (std::size_t b = 0; b < placed.size(); ++b)
      if (scene_.bodies[b].kind == scenes::Kind::rigid && !moves(scene_.bodies[b]) &&
          placed[b].winding(middle) > 0.5 && placed[b].distance(middle) >= radius)
        found_.warnings.push_back(
            fmt::format("{} lies within {}, which is rigid and stays where it is: the robot's centre of mass "
                        "comes there only if the robot surrounds it; move the goal",
                        which, name(b)));
  }

  // A goal that is all nearer to a wall of the bounds than the middle of the robot is to its own surface.
  void look_at_walled(const std::string& which, const scenes::Goal& goal,
                      const meshing::PlacedSurface& robot) {
    if (!scene_.walls || goal.moves_with >= 0) return;
    const Vec3 own_middle = middle_of(models_[std::size_t(scene_.robot)]->model.surface);
    if (!(robot.winding(own_middle) > 0.5)) return;
    const double inner_m = robot.distance(own_middle);
    const Vec3 reach = Vec3::Constant(goal.radius_m),
               lower = goal.box_m ? goal.box_m->lower : Vec3(goal.center_of_mass_m - reach),
               upper = goal.box_m ? goal.box_m->upper : Vec3(goal.center_of_mass_m + reach);
    for (int c = 0; c < 3; ++c)
      for (const double wall : {scene_.bounds_m.lower[c], scene_.bounds_m.upper[c]}) {
        const double farthest_m = wall == scene_.bounds_m.lower[c] ? upper[c] - wall : wall - lower[c];
        if (farthest_m < 0.9 * inner_m)
          found_.warnings.push_back(
              fmt::format("{} is nowhere more than {:.3g} m from the wall {} = {:g}, and the middle of the "
                          "robot is {:.3g} m "
                          "from its own surface: it comes there only if it is squeezed flat; move the goal, "
                          "or make it larger",
                          which, std::max(farthest_m, 0.0), "xyz"[c], wall, inner_m));
      }
  }

  // Surfaces in one another, or so near that they push.
  void look_at_pairs() {
    const bool cages = all_touched_at_cages(scene_);
    const double offset_m = contact_offset_m(scene_, box_of(scene_.robot));
    const double allowed_m = cages ? 1e-6 * scene_.bounds_m.diagonal() : offset_m;
    if (!cages) found_.contact_offset_m = offset_m;
    std::deque<meshing::SurfaceShape> shapes;
    std::deque<meshing::PlacedSurface> placed;
    for (const auto& loaded : models_) {
      const SurfaceMesh& surface = loaded->model.surface;
      placed.emplace_back(shapes.emplace_back(surface.positions, surface.triangles), surface.positions);
    }
    const auto look_at_goal = [&](const std::string& which, const scenes::Goal& goal) {
      look_at_blocked(which, goal, placed);
      look_at_walled(which, goal, placed[std::size_t(scene_.robot)]);
    };
    for (std::size_t v = 0; v < scene_.via.size(); ++v)
      look_at_goal(fmt::format("via {}", v + 1), scene_.via[v].goal);
    if (scene_.lacks.empty()) look_at_goal("the goal", scene_.goal);
    const auto size_of = [&](std::size_t b) { return box_of(int(b)).size().maxCoeff(); };
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
    found_.pairs.emplace();
    for (const Pair& pair : pairs) {
      NearPair found;
      found.body = name(pair.one), found.other = name(pair.other);
      if (pair.depth_m > 0) {
        found.depth_m = pair.depth_m, found.of_robot_size = pair.depth_m / robot_size_m_;
        found.parted = !cages && scene_.part_overlaps && pair.depth_m > allowed_m;
        const std::size_t smaller = size_of(pair.one) < size_of(pair.other) ? pair.one : pair.other;
        if (*found.parted && pair.depth_m > fem::deepest_parted_share * size_of(smaller)) {
          found.parted = false;
          found_.problems.push_back(
              fmt::format("{}: bodies {} and {} overlap at the start, {:.3g} m deep, which is more than a "
                          "quarter of {}'s "
                          "size, {:.3g} m, and too deep to be parted; move them apart",
                          scene_.bodies[pair.other].where, found.body, found.other, pair.depth_m,
                          name(smaller), size_of(smaller)));
        } else if (pair.depth_m > allowed_m && !*found.parted)
          found_.problems.push_back(
              fmt::format("{}: bodies {} and {} overlap at the start, {:.3g} m deep ({:.3g} % of the robot's "
                          "size; {:.3g} m are let pass); move them apart",
                          scene_.bodies[pair.other].where, found.body, found.other, pair.depth_m,
                          100 * found.of_robot_size, allowed_m));
      } else if (!cages && pair.gap_m < offset_m) {
        found.gap_m = pair.gap_m;
      } else {
        continue;
      }
      found_.pairs->push_back(std::move(found));
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
        found_.problems.push_back(error.what());
      }
    found_.film_possible = true;
    try {
      render::require_film_possible(scene_.film.frames_per_second, "film.mp4");
      require_letters(scene_.film);
    } catch (const InputError& error) {
      found_.film_possible = false;
      found_.warnings.push_back(error.what());
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
      found_.problems.push_back(error.what());
      return;
    }
    StartFindings& found = found_.start.emplace();
    found.prepared = start->prepared;
    if (start->step_known) found.dt_s = start->world.dt_s;
    if (start->prepared)
      for (std::string& doubt : doubts_of_script(scene_, start->world))
        found_.warnings.push_back(std::move(doubt));
    const bool can_be_planned = scene_.lacks.empty();
    if (can_be_planned && start->prepared)
      try_search(*start);
    else if (can_be_planned)
      look_at_goals();
    paint(*start);
  }

  void add_goal(const std::string& which, const std::vector<GoalTerm>& terms) {
    for (const GoalTerm& term : terms)
      found_.start->goal.push_back({which + term.asked, term.met, term.found});
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
      term.found = fmt::format("about {:.3g} m from its middle", away);
      add_goal(which, {term});
      return term.met;
    };
    for (std::size_t v = 0; v < scene_.via.size(); ++v)
      look(fmt::format("via {}: ", v + 1), scene_.via[v].goal);
    const scenes::Goal& goal = scene_.goal;
    const bool there = look("", goal);
    std::vector<std::string>& more = found_.start->asked_too;
    for (const auto& [key, asked] : {std::pair("shape", goal.shape.has_value()),
                                     {"above", goal.above >= 0},
                                     {"below", goal.below >= 0},
                                     {"clear_of", goal.clear_of >= 0},
                                     {"volume", goal.volume > 0},
                                     {"through", !goal.through.empty()}})
      if (asked) more.push_back(fmt::format("goal.{}", key));
    if (there && more.empty() && scene_.via.empty()) already_there();
  }

  void already_there() {
    found_.warnings.push_back(
        "the robot is in the goal at the start: the search ends at once; move the goal");
  }

  void try_search(const Start& start) {
    const FemSystem system(start.world, goal_rules_of(scene_));
    const State rest = system.start();
    const auto look = [&](const std::string& which, const scenes::Goal& goal) {
      const std::vector<GoalTerm> terms = terms_of(scene_, goal, start.world, rest);
      add_goal(which, terms);
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
    if (!diagnosis.json.is_null()) found_.start->rigid_passage_json = text_of(diagnosis.json);
    const double radius = diagnosis.robot_radius_m, passage = diagnosis.widest_passage_m;
    if (passage < 0)
      found_.warnings.push_back(
          "rigid bodies and walls, where they stand at the start, leave no way to the goal even for a point; "
          "move "
          "them or the goal");
    else if (passage < radius)
      found_.warnings.push_back(
          fmt::format("between rigid bodies and walls the robot can only pass by squeezing: the "
                      "widest way lets a ball of radius {:.3g} m through, and it holds one of "
                      "{:.3g} m",
                      passage, radius));
    const plan::Statistics& s = tried.statistics;
    const double wall_s = s.iterations > 0 ? s.wall_s / double(s.iterations) * double(all) : 0;
    found_.start->tried = {.iterations = s.iterations,
                           .of_all = all,
                           .wall_s = s.wall_s,
                           .all_wall_s = wall_s,
                           .solved = tried.solved()};
  }

  void paint(const Start& start) {
    found_.start->frames_a_second = scene_.film.frames_per_second / scene_.film.speed;
    if (!options_.still) return;
    const auto size = options_.size.empty() ? std::pair(scene_.film.width_px, scene_.film.height_px)
                                            : parse_size(options_.size);
    found_.start->paint_s = write_still(start, options_.camera, size, *options_.still);
  }

  const SceneCheckOptions& options_;
  scenes::Scene scene_;
  std::vector<std::optional<LoadedModel>> models_;  // nothing: it could not be read
  double robot_size_m_ = 0;
  Vec3 middle_of_robot_m_ = Vec3::Zero();
  SceneFindings found_;
};

}  // namespace

SceneFindings check_scene(const SceneCheckOptions& options) {
  return Check(options, scenes::find_scene(options.scene.scene)).run();
}

}  // namespace limber::detail
