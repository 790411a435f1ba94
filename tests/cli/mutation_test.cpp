// A certificate is worth what it refuses: ways to make a good work folder wrong, each by an adversary who
// knows limber, changes one thing and then makes all hashes, reports, figures and pictures fit. verify must
// name each. A new promise wants its mutations here: one line in the list of its file.
#include <Eigen/LU>
#include <map>
#include <numbers>

#include "core/contact_shape_file.h"
#include "core/hash.h"
#include "core/mesh_files.h"
#include "core/npz.h"
#include "ffd/binding_file.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/body_source.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "meshing/cage.h"
#include "meshing/certificate.h"
#include "meshing/contact_shape.h"
#include "meshing/convex_hull.h"
#include "meshing/shell_check.h"
#include "plan/plan_file.h"
#include "plan/timings.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

// A soft ball, a soft block of two convex parts, and a post that is only seen.
constexpr const char* scene_text = R"(name = "mutants"
[world]
bounds_m = [[0, 0, 0], [4, 2, 2]]
gravity_m_s2 = [0, 0, 0]
[[bodies]]
name = "ball"
role = "robot"
model = { sphere = { diameter_m = 0.6, triangle_m = 0.06 } }
cage = { tets = 48, shells = 32 }
material = { youngs_modulus_pa = 5e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [0.6, 1, 1.3] }
[[bodies]]
name = "block"
role = "obstacle"
model = { blocks = { solids = [[[-0.2, -0.8, -0.4], [0.2, 0.8, 0]], [[-0.2, -0.3, 0], [0.2, 0.3, 0.4]]], triangle_m = 0.1 } }
cage = { tets = 120, shells = 2 }
material = { youngs_modulus_pa = 5e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [2, 1, 0.58] }
fixed = [{ box_m = [[0, 0, 0], [4, 2, 0.2]] }]
[[bodies]]
name = "post"
role = "scenery"
model = { box = { size_m = [0.1, 0.1, 1] } }
pose = { position_m = [3.5, 0.2, 0.5] }
[goal]
center_of_mass_m = [3.2, 1, 1]
radius_m = 0.3
[planner]
preset = "fast"
seed = 1
iterations = 400
max_force_n = 100
[film]
frames_per_second = 5
)";

// The same with a soft ball on the block, 0.04 m deep in it.
std::string overlapping_scene() {
  std::string text = scene_text;
  return text.insert(text.find("[[bodies]]\nname = \"post\""), R"([[bodies]]
name = "pebble"
role = "free"
model = { sphere = { diameter_m = 0.4, triangle_m = 0.06 } }
cage = { tets = 48, shells = 32 }
material = { youngs_modulus_pa = 5e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [2, 1.55, 0.74] }
)");
}

// A work folder in memory, to be changed and written so that it fits together again.
struct Mutant {
  explicit Mutant(const fs::path& at) : folder(at), planned(read_plan_folder(at)) {
    read_world_of(planned, at);  // they fit
    for (const scenes::BodySpec& body : planned.scene.bodies) {
      bodies.push_back(read_body(body_folder(at, body)));
      shells.push_back(read_obj_shells(body_folder(at, body) / "shells.obj"));
    }
    if (has_goal_cage(planned.scene))
      bodies[std::size_t(planned.scene.robot)].goal_shape_m =
          read_msh(goal_cage_file(planned.scene, at)).positions;
  }

  // Where the scene puts them.
  std::vector<PreparedBody> placed() const {
    std::vector<PreparedBody> there = bodies;
    for (std::size_t b = 0; b < there.size(); ++b) {
      there[b].deformation = planned.scene.bodies[b].deformation;
      place(there[b], planned.scene.bodies[b].pose.position_m);
    }
    return there;
  }

  // Body b's files and its report, certificate and hashes included, as limber writes them.
  void write_body(std::size_t b) {
    PreparedBody& body = bodies[b];
    const fs::path at = body_folder(folder, planned.scene.bodies[b]);
    write_ply(at / "surface.ply", body.surface);
    write_obj(at / "shells.obj", shells[b]);
    write_msh(at / "cage.msh", body.cage, body.shell_from_tet);
    ffd::write_binding(at / "binding.npz", body.binding, body.surface, body.cage);
    write_contact_shape(at / "contact.npz", body.contact, body.surface, body.cage);
    const Json facts = facts_of_body(body.surface, shells[b], body.cage, body.binding, body.contact,
                                     meshing::certify(body.surface, body.cage));
    for (const auto& [table, figures] : facts.items()) body.report.json[table].update(figures);
    write_report(b);
  }
  void write_report(std::size_t b) {
    const fs::path at = body_folder(folder, planned.scene.bodies[b]);
    for (const auto& [name, hash] : bodies[b].report.json.at("files").items())
      bodies[b].report.json["files"][name] = hex(hash_of(std::string_view(read_file(at / name))));
    write_json(at / "report.json", bodies[b].report.json);
  }
  // plan.npz with the world's hash, its summary, manifest.json and the pictures.
  void write_plan() {
    const std::vector<PreparedBody> there = placed();
    const fem::World world = build_world(planned.scene, there);
    const FemSystem system(world, there, goal_rules_of(planned.scene));
    planned.plan.system_hash = system.hash();
    const MotionFigures figures = measure_motion(world, there, planned.plan.trajectory);
    planned.summary.update(facts_of(planned.plan, world, system, figures));
    for (const auto& [name, bytes] : pictures_of(planned.scene, world, planned.plan, figures))
      write_file(folder / name, bytes);
    write_summary();
  }
  void write_summary() {
    write_plan_folder(folder, planned.plan, planned.scene, placed(), planned.summary);
    update_manifest(folder, "plan", plan::without_timings(planned.summary));
  }

  fs::path folder;
  PlanFolder planned;
  std::vector<PreparedBody> bodies;  // as their files have them
  std::vector<std::vector<ConvexShell>> shells;
};

struct Mutation {
  std::string what;
  std::string named;  // in a promise that is broken, or in the complaint
  std::function<void(Mutant&)> make;
  std::string part = "";  // of the folder, that is verified by itself
};

constexpr std::size_t ball = 0, block = 1;
using List = std::vector<Mutation>;

std::size_t leaf_of(const plan::Plan& p) {  // a node that is not on the path
  const std::vector<int> path = plan::path_to(p.tree, p.best_node);
  for (int n = p.tree.size() - 1; n > 0; --n)
    if (std::count(path.begin(), path.end(), n) == 0 &&
        std::count(p.tree.parents.begin(), p.tree.parents.end(), n) == 0)
      return std::size_t(n);
  throw std::logic_error("the tree is a path");
}

// States are shared: to change one, all are put together anew.
void change_state(plan::Plan& p, std::size_t node, const std::function<void(State&)>& change) {
  plan::States states;
  for (std::size_t n = 0; n < std::size_t(p.tree.size()); ++n) {
    State state = p.tree.states[n];
    if (n == node) change(state);
    states.push_back(state, p.tree.parents[n]);
  }
  p.tree.states = states;
}

// Of the tree and the path. All that follows from them is made anew.
List of_the_plan() {
  List list;
  const auto add = [&](std::string what, std::string named, std::function<void(plan::Plan&)> change) {
    list.push_back({std::move(what), std::move(named), [change = std::move(change)](Mutant& m) {
                      change(m.planned.plan);
                      m.write_plan();
                    }});
  };
  const std::string tree = "searched again from the scene: the same tree",
                    counts = "searched again from the scene: the same counts",
                    replay = "replay gives the same bits", way = "the path is the way through the tree",
                    settings = "the plan's settings are the scene's",
                    claims = "what the plan tells of itself";
  add("a node's position", tree,
      [](plan::Plan& p) { change_state(p, leaf_of(p), [](State& s) { s.positions[7] += 1e-3f; }); });
  add("a node's velocity", tree,
      [](plan::Plan& p) { change_state(p, leaf_of(p), [](State& s) { s.velocities[7] += 1e-3f; }); });
  add("a node of the path", way, [](plan::Plan& p) {
    change_state(p, std::size_t(p.best_node), [](State& s) { s.positions[0] += 1e-3f; });
  });
  add("the start", tree, [](plan::Plan& p) { change_state(p, 0, [](State& s) { s.velocities[0] = 0.1f; }); });
  add("the tree's force", tree, [](plan::Plan& p) { p.tree.controls[leaf_of(p)].force_n *= 0.9f; });
  add("the tree's kind of push", tree,
      [](plan::Plan& p) { p.tree.controls[leaf_of(p)].manipulation = Manipulation::none; });
  add("the tree's radius", tree, [](plan::Plan& p) { p.tree.controls[leaf_of(p)].radius_m += 0.1f; });
  add("the tree's target", tree, [](plan::Plan& p) { p.tree.controls[leaf_of(p)].target_m.x() += 0.1f; });
  add("the tree's largest force", tree, [](plan::Plan& p) { p.tree.controls[leaf_of(p)].max_force_n += 1; });
  add("the tree's node of the robot", tree, [](plan::Plan& p) {
    Control& c = p.tree.controls[leaf_of(p)];
    c.node = c.node == 0 ? 1 : 0;
  });
  add("the tree's steps", tree, [](plan::Plan& p) {
    p.tree.controls[leaf_of(p)].steps += 5;
    change_state(p, leaf_of(p), [](State& s) { s.step += 5; });
  });
  add("a parent", tree, [](plan::Plan& p) {
    const std::size_t leaf = leaf_of(p);
    p.tree.parents[leaf] = p.tree.parents[leaf] == 0 ? 1 : 0;
    change_state(p, leaf, [&](State& s) {
      s.step = p.tree.states[std::size_t(p.tree.parents[leaf])].step + p.tree.controls[leaf].steps;
    });
  });
  add("an iteration", tree, [](plan::Plan& p) { ++p.tree.iterations[leaf_of(p)]; });
  add("a centre", tree, [](plan::Plan& p) { p.tree.centers.x[leaf_of(p)] += 1e-3f; });
  add("a node more", tree, [](plan::Plan& p) {
    p.tree.add(p.tree.states[1], p.tree.parents[1], p.tree.controls[1], p.tree.iterations[1],
               p.tree.centers[1]);
  });
  add("a node more that was not searched for", tree, [](plan::Plan& p) {
    p.tree.add(p.tree.states[1], p.tree.parents[1], p.tree.controls[1], -1, p.tree.centers[1]);
  });
  add("a push that is too strong", "no force is above the maximum", [](plan::Plan& p) {
    Control& c = p.tree.controls[leaf_of(p)];
    c.manipulation = Manipulation::body, c.force_n = Vec3f(150, 0, 0);
  });
  add("a pressure that nobody may give", "no pressure is above the maximum",
      [](plan::Plan& p) { p.tree.controls[leaf_of(p)].pressure_pa = 20; });

  add("the path's pressure", replay, [](plan::Plan& p) {
    p.settings.max_pressure_pa = 500;
    p.trajectory.controls[0].pressure_pa = 400;
  });
  add("the path's force", replay, [](plan::Plan& p) { p.trajectory.controls[0].force_n *= 0.99f; });
  add("the path's force and the tree's", replay, [](plan::Plan& p) {
    const std::vector<int> path = plan::path_to(p.tree, p.best_node);
    p.trajectory.controls[0].force_n *= 0.99f;
    p.tree.controls[std::size_t(path[1])].force_n *= 0.99f;
  });
  add("the path's kind of push", replay,
      [](plan::Plan& p) { p.trajectory.controls[0].manipulation = Manipulation::none; });
  add("the path's radius", way, [](plan::Plan& p) { p.trajectory.controls[0].radius_m += 0.1f; });
  add("the path's node of the robot", way, [](plan::Plan& p) {
    Control& c = p.trajectory.controls[0];
    c.node = c.node == 0 ? 1 : 0;
  });
  add("the path's target", way, [](plan::Plan& p) { p.trajectory.controls[0].target_m.y() += 0.1f; });
  add("the settle's target", replay, [](plan::Plan& p) { p.trajectory.controls.back().target_m.x() -= 1; });
  add("the settle's force", replay, [](plan::Plan& p) { p.trajectory.controls.back().max_force_n = 99; });
  add("a settle that is too strong", "no force is above the maximum",
      [](plan::Plan& p) { p.trajectory.controls.back().max_force_n = 1000; });
  add("a step from the last push to the settle", replay, [](plan::Plan& p) {
    auto& c = p.trajectory.controls;
    --c[c.size() - 2].steps, ++c.back().steps, ++p.trajectory.settle_steps;
  });
  add("a frame's position", replay, [](plan::Plan& p) { p.trajectory.frames[2].positions[1] += 1e-4f; });
  add("a frame's velocity", replay, [](plan::Plan& p) { p.trajectory.frames[2].velocities[1] += 1e-4f; });
  add("the end's position", replay, [](plan::Plan& p) { p.trajectory.end.positions[1] += 1e-4f; });
  add("the end's velocity", replay, [](plan::Plan& p) { p.trajectory.end.velocities[1] = 0; });
  add("no settle", "the goal: at rest", [](plan::Plan& p) {
    plan::Trajectory& t = p.trajectory;
    t.controls.pop_back();
    t.settle_steps = 0;
    t.end = p.tree.states[std::size_t(p.best_node)];
    std::erase_if(t.frames, [&](const State& s) { return s.step > t.end.step; });
  });
  add("a path that does not move", "the goal: centre of mass within", [](plan::Plan& p) {
    plan::Trajectory& t = p.trajectory;
    t.controls.clear();
    t.settle_steps = 0;
    t.end = p.tree.states[0];
    t.frames.resize(1);
    p.best_node = p.goal_node = 0;
    p.best_distance_m = (Vec3(0.6, 1, 1.3) - Vec3(3.2, 1, 1)).norm();
  });
  add("not solved", "the plan says that it is solved", [](plan::Plan& p) {
    p.goal_node = -1, p.ending = plan::Ending::iterations;
    p.settings.max_iterations = p.statistics.iterations;
  });
  add("another best node", way, [](plan::Plan& p) { p.best_node = p.goal_node = int(leaf_of(p)); });
  add("the best distance", claims, [](plan::Plan& p) { p.best_distance_m *= 0.5; });
  add("what ended it", claims, [](plan::Plan& p) { p.ending = plan::Ending::time; });

  add("iterations", counts, [](plan::Plan& p) { ++p.statistics.iterations; });
  add("fewer iterations", counts, [](plan::Plan& p) { --p.statistics.iterations; });
  add("how many diverged", counts, [](plan::Plan& p) { ++p.statistics.diverged; });
  add("how many were rejected", counts, [](plan::Plan& p) { ++p.statistics.rejected; });
  add("how many ways were refused", counts, [](plan::Plan& p) { ++p.statistics.refused; });
  add("why the last way was refused", counts, [](plan::Plan& p) { p.statistics.last_refusal = "it is red"; });
  add("steps of rollouts", counts, [](plan::Plan& p) { --p.statistics.rollout_steps; });

  add("another seed", tree, [](plan::Plan& p) { ++p.settings.seed; });
  using Settings = plan::Settings;
  const std::vector<std::pair<const char*, std::function<void(Settings&)>>> keys{
      {"goal.center_of_mass_m", [](Settings& s) { s.goal.center_of_mass_m.x() -= 0.01; }},
      {"goal.radius_m", [](Settings& s) { s.goal.radius_m *= 2; }},
      {"goal.box_m",
       [](Settings& s) {
         s.goal.box_m = Box{Vec3(3, 0.5, 0.5), Vec3(4, 1.5, 1.5)};
       }},
      {"via", [](Settings& s) { s.goal_bias = 0.2; }},
      {"weights.body", [](Settings& s) { s.weights.body += 0.1; }},
      {"weights.control_point", [](Settings& s) { s.weights.control_point += 0.1; }},
      {"weights.interpolation", [](Settings& s) { s.weights.interpolation += 0.1; }},
      {"max_force_n", [](Settings& s) { s.max_force_n = 1000; }},
      {"min_force_share", [](Settings& s) { s.min_force_share = 0; }},
      {"max_force_share", [](Settings& s) { s.max_force_share = 0.9; }},
      {"min_duration_s", [](Settings& s) { s.min_duration_s = 0.1; }},
      {"max_duration_s", [](Settings& s) { s.max_duration_s = 9; }},
      {"control_point_radius_m", [](Settings& s) { s.control_point_radius_m = 1; }},
      {"settle.max_duration_s", [](Settings& s) { s.settle.max_duration_s = 9; }},
      {"settle.mean_speed_m_s", [](Settings& s) { s.settle.mean_speed_m_s = 9; }},
      {"settle.max_force_share", [](Settings& s) { s.settle.max_force_share = 0.5; }},
      {"settle.hold", [](Settings& s) { s.settle.hold = !s.settle.hold; }},
      {"laws.lag", [](Settings& s) { ++s.search_options.lag; }},
      {"laws.metric", [](Settings& s) { s.search_options.metric = plan::Metric::distance; }},
      {"laws.time_weight", [](Settings& s) { s.search_options.time_weight = 0.5; }},
      {"laws.guidance", [](Settings& s) { s.search_options.guidance = 0.5; }},
      {"laws.soft_price", [](Settings& s) { s.search_options.soft_price = 1; }},
      {"laws.density_price", [](Settings& s) { s.search_options.density_price = 1; }},
      {"laws.learn_prices", [](Settings& s) { s.search_options.learn_prices = false; }},
      {"laws.steer", [](Settings& s) { s.search_options.steer = false; }},
      {"laws.look_s", [](Settings& s) { s.search_options.look_s = 0.2; }},
      {"laws.stop_in_goal", [](Settings& s) { s.search_options.stop_in_goal = false; }},
      {"laws.hold", [](Settings& s) { s.search_options.hold = false; }},
      {"laws.end_hopeless", [](Settings& s) { s.search_options.end_hopeless = false; }}};
  for (const auto& [key, change] : keys)
    add(std::string("the setting ") + key, settings,
        [change = change](plan::Plan& p) { change(p.settings); });
  return list;
}

// What plan.npz tells about itself in words and figures: each key of its summary, with and without the
// manifest's.
List of_the_summary(const Json& summary) {
  List list;
  const auto other = [](const Json& value) -> Json {
    if (value.is_boolean()) return !value.get<bool>();
    if (value.is_number_integer()) return value.get<std::int64_t>() + 1;
    if (value.is_number()) return value.get<double>() * 1.01 + 1e-6;
    if (value.is_string()) return value.get<std::string>() + "?";
    return Json(7);
  };
  const Json flat = plan::without_timings(summary).flatten();
  for (const auto& [pointer, value] : flat.items()) {
    list.push_back({"summary" + pointer, "what the plan tells of itself",
                    [pointer = pointer, value = other(value)](Mutant& m) {
                      m.planned.summary.at(Json::json_pointer(pointer)) = value;
                      m.write_summary();
                    }});
  }
  list.push_back({"a summary with more in it", "what the plan tells of itself", [](Mutant& m) {
                    m.planned.summary["quality"] = "best";
                    m.write_summary();
                  }});
  for (const Json& shares : {Json::array({1.0}), Json(1.0), Json{{"ball", 100.0}}, Json{{"ball", "1"}}})
    list.push_back({"shares of stiffness " + shares.dump(), "stiffness_shares", [=](Mutant& m) {
                      m.planned.summary["stiffness_shares"] = shares;
                      m.write_summary();
                    }});
  list.push_back({"shares of stiffness of nobody", "what the plan tells of itself", [](Mutant& m) {
                    m.planned.summary["stiffness_shares"]["ghost"] = 1.0;
                    m.write_summary();
                  }});
  list.push_back(
      {"a summary of shortcuts that were not", "what the plan tells of itself", [](Mutant& m) {
         const Json costs{
             {"duration_s", 1.0}, {"effort_n_s", 1.0}, {"strain_energy_j", 1.0}, {"volume_change", 0.01}};
         m.planned.summary["shortcut"] = {{"cost", "duration"}, {"rounds", 8},     {"accepted", 3},
                                          {"cpu_s", 1.0},       {"before", costs}, {"after", costs}};
         m.write_summary();
       }});
  return list;
}

// The scene's text with another value, and the world and the settings that follow from it.
List of_the_scene() {
  List list;
  const auto add = [&](const std::string& set, const std::string& named) {
    list.push_back({"the scene with " + set, named, [set](Mutant& m) {
                      PlanFolder& f = m.planned;
                      std::vector<std::string> sets = f.scene.sets;
                      sets.push_back(set);
                      f.scene = scenes::read_scene(f.scene.text, "scene", sets);
                      plan::Settings settings = settings_of(f.scene, {});
                      settings.seed = f.plan.settings.seed;
                      settings.max_iterations = f.plan.settings.max_iterations;
                      f.plan.settings = settings;
                      m.write_plan();
                    }});
  };
  const std::string replay = "replay gives the same bits",
                    tree = "searched again from the scene: the same tree", steps = "frame 1 is at step";
  add("goal.radius_m=0.001", "the goal: centre of mass within 0.001 m");
  add("goal.center_of_mass_m=[1.2, 1, 1]", "the goal: centre of mass within");
  add("goal.below=block", "the goal: whole robot below block");
  add("goal.shape={angle_deg=90, turn_tolerance_deg=1}", "the goal: turned within 1 degrees");
  add("goal.shape={stretch=[2, 1, 1], tolerance_m=0.01}", "the goal: every node within 0.01 m");
  add("planner.settle_speed_m_s=0.0001", "the goal: at rest, slower than 0.0001 m/s");
  add("planner.max_force_n=50", "no force is above the maximum");
  add("planner.settle_force_share=0.5", "no force is above the maximum");
  add("planner.goal_bias=0.9", tree);
  add("planner.guidance=0", tree);
  add("planner.lag=7", tree);
  add("bodies.ball.max_volume_change=0.0001", "ball: volume changes by at most 0.01 %");
  add("bodies.ball.max_stretch=1.001", "ball: tets are stretched within");
  add("bodies.block.max_contact_load_n=0.01", "block: is pressed by at most 0.01 N");
  add("bodies.ball.youngs_modulus_pa=8e3", steps);
  add("bodies.ball.density_kg_m3=90", steps);
  add("bodies.block.material.model=neo_hookean", replay);
  add("bodies.block.damping_ratio=0.5", steps);
  add("bodies.block.contact=cage", replay);
  add("bodies.block.fixed=[]", replay);
  add("bodies.ball.friction=1", tree);
  add("world.gravity_m_s2=[0, 0, -1]", replay);
  add("world.contact_offset_m=0.02", tree);
  add("world.max_dt_s=0.0005", steps);
  add("bodies.ball.pose.position_m=[0.7, 1, 1.3]", replay);
  add("bodies.ball.cage.tets=60", "ball: made as the scene says");
  add("bodies.ball.cage.mode=fast", "ball: made as the scene says");
  add("bodies.block.cage.shells=3", "block: made as the scene says");
  add("bodies.block.model.blocks.triangle_m=0.2", "block: surface is the scene's model");
  add("bodies.post.pose.angle_deg=10", "post: made as the scene says");
  add("film.frames_per_second=6", "plan.npz");
  return list;
}

// Of one body. Its files, its report and the plan's hashes are made to fit.
List of_bodies() {
  List list;
  using Change = std::function<void(PreparedBody&, std::vector<ConvexShell>&)>;
  const auto add = [&](std::size_t b, std::string what, std::string named, Change change) {
    list.push_back({std::move(what), std::move(named), [b, change = std::move(change)](Mutant& m) {
                      change(m.bodies[b], m.shells[b]);
                      m.write_body(b);
                      m.write_plan();
                    }});
  };
  const std::string surface = "ball: surface is the scene's model",
                    outside = "body: no vertex outside the cage",
                    binding = "ball: binding brings back the surface", again = "ball: bound again",
                    convex = "block: shells are convex", cover = "block: shells cover the surface",
                    off = "block: shells stand off the surface", label = "block: each tet of the cage",
                    field = "ball: distances for contact", samples = "ball: samples for contact";
  const auto bind = [](PreparedBody& body) { body.binding = ffd::bind(body.surface, body.cage); };

  add(ball, "a vertex of the surface", surface, [=](PreparedBody& body, auto&) {
    body.surface.positions(5, 2) *= 1.001;
    bind(body);
  });
  add(ball, "the whole surface, smaller", surface, [=](PreparedBody& body, auto&) {
    const Eigen::RowVector3d middle = body.surface.positions.colwise().mean();
    body.surface.positions = ((body.surface.positions.rowwise() - middle) * 0.9).rowwise() + middle;
    bind(body);
  });
  add(ball, "a triangle less", surface, [](PreparedBody& body, auto&) {
    body.surface.triangles.conservativeResize(body.surface.triangles.rows() - 1, 3);
  });
  add(ball, "a triangle turned inside out", surface, [](PreparedBody& body, auto&) {
    std::swap(body.surface.triangles(3, 0), body.surface.triangles(3, 1));
  });

  add(ball, "a cage that is too small", outside, [=](PreparedBody& body, auto&) {
    const Eigen::RowVector3d middle = body.cage.positions.colwise().mean();
    body.cage.positions = ((body.cage.positions.rowwise() - middle) * 0.9).rowwise() + middle;
    bind(body);
  });
  list.back().part = "bodies/ball";  // the plan alone would be refused for its frames' times
  add(ball, "a larger cage", "ball: cage made again", [=](PreparedBody& body, auto&) {
    const Eigen::RowVector3d middle = body.cage.positions.colwise().mean();
    body.cage.positions = ((body.cage.positions.rowwise() - middle) * 1.05).rowwise() + middle;
    bind(body);
  });
  add(ball, "a tet less", outside, [=](PreparedBody& body, auto&) {
    body.cage.tets.conservativeResize(body.cage.tets.rows() - 1, 4);
    body.shell_from_tet.pop_back();
    body.contact.min_weight.conservativeResize(body.cage.tets.rows(), 4);
    for (Eigen::Index s = 0; s < body.contact.samples.tet_from_sample.size(); ++s)
      body.contact.samples.tet_from_sample[s] =
          std::min(body.contact.samples.tet_from_sample[s], int(body.cage.tets.rows()) - 1);
    bind(body);
  });
  list.back().part = "bodies/ball";
  add(block, "a tet of another shell", label,
      [](PreparedBody& body, auto&) { body.shell_from_tet[3] = 1 - body.shell_from_tet[3]; });
  add(block, "a tet of a shell that is none", label,
      [](PreparedBody& body, auto&) { body.shell_from_tet[3] = 5; });

  add(block, "a shell's corner pulled out", off, [](PreparedBody&, auto& shells) {
    const Eigen::RowVector3d middle = shells[0].vertices.colwise().mean();
    shells[0].vertices.row(0) = middle + (shells[0].vertices.row(0) - middle) * 1.01;
  });
  add(block, "a shell's corner pushed in", "block: shells", [](PreparedBody&, auto& shells) {
    const Eigen::RowVector3d middle = shells[0].vertices.colwise().mean();
    shells[0].vertices.row(0) = middle + (shells[0].vertices.row(0) - middle) * 0.8;
  });
  add(block, "a shell that is too small", cover, [](PreparedBody&, auto& shells) {
    const Eigen::RowVector3d middle = shells[0].vertices.colwise().mean();
    shells[0].vertices = ((shells[0].vertices.rowwise() - middle) * 0.99).rowwise() + middle;
  });
  add(block, "a shell that is too large", off, [](PreparedBody&, auto& shells) {
    const Eigen::RowVector3d middle = shells[0].vertices.colwise().mean();
    shells[0].vertices = ((shells[0].vertices.rowwise() - middle) * 1.1).rowwise() + middle;
  });
  add(block, "a shell less", cover, [](PreparedBody& body, auto& shells) {
    shells.pop_back();
    std::fill(body.shell_from_tet.begin(), body.shell_from_tet.end(), 0);
  });
  add(block, "a shell with a hole", convex, [](PreparedBody&, auto& shells) {
    shells[0].triangles.conservativeResize(shells[0].triangles.rows() - 1, 3);
  });
  add(block, "a shell turned inside out", convex,
      [](PreparedBody&, auto& shells) { shells[0].triangles.col(0).swap(shells[0].triangles.col(1)); });

  add(ball, "every vertex bound to one tet", binding,
      [](PreparedBody& body, auto&) { body.binding.tet_from_vertex.setZero(); });
  add(ball, "weights (1, 0, 0, 0)", binding,
      [](PreparedBody& body, auto&) { body.binding.weights.rowwise() = Eigen::RowVector4d(1, 0, 0, 0); });
  add(ball, "one vertex bound a hair off", binding, [](PreparedBody& body, auto&) {
    body.binding.weights(7, 0) += 1e-4, body.binding.weights(7, 1) -= 1e-4;
  });
  add(ball, "one vertex bound to the next tet, by extrapolation", binding, [](PreparedBody& body, auto&) {
    const int t = body.binding.tet_from_vertex[7] == 0 ? 1 : 0;
    Eigen::Matrix3d edges;
    for (int k = 0; k < 3; ++k)
      edges.col(k) =
          body.cage.positions.row(body.cage.tets(t, k)) - body.cage.positions.row(body.cage.tets(t, 3));
    const Vec3 w =
        edges.inverse() *
        (body.surface.positions.row(7) - body.cage.positions.row(body.cage.tets(t, 3))).transpose();
    body.binding.tet_from_vertex[7] = t;
    body.binding.weights.row(7) << w[0], w[1], w[2], 1 - w.sum();
  });
  add(ball, "vertices said to be outside", again,
      [](PreparedBody& body, auto&) { body.binding.outside = 3; });
  add(ball, "how far vertices are outside", again,
      [](PreparedBody& body, auto&) { body.binding.max_outside_distance_m = 0.1; });
  add(ball, "which vertex is farthest outside", again,
      [](PreparedBody& body, auto&) { body.binding.farthest_outside_vertex = 4; });

  const auto fit = [](PreparedBody& body) {  // what follows from the field
    body.contact.min_weight = meshing::min_weights(body.contact.field, body.cage);
  };
  add(ball, "all distances larger", field, [=](PreparedBody& body, auto&) {
    const int by = int(2 * body.contact.field.cell_m / body.contact.field.unit_m);
    for (std::int16_t& v : body.contact.field.values) v = std::int16_t(std::min(32000, v + by));
    fit(body);
  });
  add(ball, "all distances the other way round", field, [=](PreparedBody& body, auto&) {
    for (std::int16_t& v : body.contact.field.values) v = std::int16_t(-v);
    fit(body);
  });
  add(ball, "one distance", field, [=](PreparedBody& body, auto&) {
    body.contact.field.values[body.contact.field.values.size() / 3] = 0;
    fit(body);
  });
  add(ball, "the unit of distances", field, [=](PreparedBody& body, auto&) {
    body.contact.field.unit_m *= 1.2;
    fit(body);
  });
  add(ball, "the cells of the field", field, [=](PreparedBody& body, auto&) {
    body.contact.field.cell_m *= 1.1;
    fit(body);
  });
  add(ball, "the place of the field", field, [=](PreparedBody& body, auto&) {
    body.contact.field.lower_m.x() += 3 * body.contact.field.cell_m;
    fit(body);
  });
  add(ball, "a field of one number", field, [=](PreparedBody& body, auto&) {
    std::fill(body.contact.field.values.begin(), body.contact.field.values.end(), std::int16_t(32000));
    fit(body);
  });
  add(ball, "tets in which nothing is solid", field,
      [](PreparedBody& body, auto&) { body.contact.min_weight.setConstant(2); });
  add(ball, "tets that may be solid anywhere", field,
      [](PreparedBody& body, auto&) { body.contact.min_weight.setZero(); });
  add(ball, "a sample off the surface", samples,
      [](PreparedBody& body, auto&) { body.contact.samples.positions_m(9, 0) += 1e-4; });
  add(ball, "a sample bound beside itself", samples, [](PreparedBody& body, auto&) {
    body.contact.samples.weights(9, 0) += 1e-4, body.contact.samples.weights(9, 1) -= 1e-4;
  });
  add(ball, "a sample in another tet", samples, [](PreparedBody& body, auto&) {
    auto& tets = body.contact.samples.tet_from_sample;
    tets[0] = 0, tets[tets.size() - 1] = int(body.cage.tets.rows()) - 1;
    for (Eigen::Index s = 1; s < tets.size(); ++s)
      if (tets[s] > tets[s - 1]) {
        tets[s - 1] = tets[s];
        break;
      }
  });
  add(ball, "a sample that stands for more", samples,
      [](PreparedBody& body, auto&) { body.contact.samples.area_m2[9] *= 2; });
  add(ball, "half of the samples", samples, [](PreparedBody& body, auto&) {
    SurfaceSamples& s = body.contact.samples;
    const Eigen::Index half = s.area_m2.size() / 2;
    s.area_m2 *= s.area_m2.sum() / s.area_m2.head(half).sum();
    s.positions_m.conservativeResize(half, 3), s.weights.conservativeResize(half, 4);
    s.tet_from_sample.conservativeResize(half), s.area_m2.conservativeResize(half);
  });
  add(ball, "contact by the cage", "ball: contact made again", [](PreparedBody& body, auto&) {
    SurfaceSamples& s = body.contact.samples;
    body.contact.usable = false;
    s.positions_m.resize(0, 3), s.weights.resize(0, 4), s.tet_from_sample.resize(0), s.area_m2.resize(0);
  });
  return list;
}

// A report that tells something else than its files, key by key.
List of_reports(const Json& report) {
  List list;
  const std::map<std::string, std::string> named{{"surface", "ball: report.json"},
                                                 {"certificate", "ball: "},
                                                 {"binding", "ball: report.json"},
                                                 {"input", "ball: made as the scene says"}};
  const auto add = [&](const std::string& pointer, const std::string& name) {
    const Json value = report.at(Json::json_pointer(pointer));
    const Json other = value.is_boolean()          ? Json(!value.get<bool>())
                       : value.is_number_integer() ? Json(value.get<std::int64_t>() + 1)
                       : value.is_number()         ? Json(value.get<double>() * 1.01 + 1e-6)
                                                   : Json(value.get<std::string>() + "0");
    list.push_back({"report.json" + pointer, name, [=](Mutant& m) {
                      m.bodies[ball].report.json.at(Json::json_pointer(pointer)) = other;
                      m.write_report(ball);
                    }});
  };
  const Json flat = report.flatten();
  for (const auto& [pointer, value] : flat.items()) {
    if (pointer.ends_with("/source"))
      continue;  // only tells when to read anew; the surface is compared itself
    if (const auto at = named.find(pointer.substr(1, pointer.find('/', 1) - 1)); at != named.end())
      add(pointer, at->second);
  }
  for (const char* key :
       {"samples", "nodes", "cell_m", "unit_m", "error_p99_m", "error_max_m", "memory_mb", "usable"})
    add(std::string("/contact/") + key, "ball: report.json");
  for (const char* key :
       {"tets", "nodes", "volume_m3", "min_dihedral_deg", "max_dihedral_deg", "median_min_dihedral_deg"})
    add(std::string("/cage/") + key, "ball: report.json");
  for (const char* key :
       {"/shells/count", "/shells/stopped_by", "/shells/inflation", "/shells/sum_of_volumes_m3", "/cage/mode",
        "/cage/volume_ratio", "/cage/glued_share", "/contact/cells", "/contact/characteristic_m",
        "/contact/open_share"})
    add(key, "ball: report.json");
  add("/shells/mean_overshoot", "ball: shells stand off");
  add("/shells/max_overshoot", "ball: shells stand off");
  return list;
}

// Files that lack, are cut, or are another's.
List of_files() {
  List list;
  const auto replace = [&](const std::string& name, const std::string& named,
                           std::function<std::string(std::string)> change) {
    list.push_back({"the file " + name, named, [=](Mutant& m) {
                      const std::string bytes = change(read_file(m.folder / name));
                      write_file(m.folder / name, bytes);
                    }});
  };
  const auto with_one_more = [](std::string bytes) { return bytes + " "; };
  const auto half = [](std::string bytes) { return bytes.substr(0, bytes.size() / 2); };
  for (const char* name : {"surface.ply", "shells.obj", "cage.msh", "binding.npz", "contact.npz"}) {
    replace("bodies/ball/" + std::string(name), name, with_one_more);
    replace("bodies/ball/" + std::string(name), name, half);
  }
  replace("bodies/ball/report.json", "report.json", half);
  replace("plan.npz", "plan.npz", half);
  for (const char* name : {"tree.svg", "volume.svg", "volume.png"}) {
    replace(name, name, with_one_more);
    list.push_back({std::string("no ") + name, name, [=](Mutant& m) { fs::remove(m.folder / name); }});
  }
  list.push_back(
      {"no manifest.json", "manifest.json", [](Mutant& m) { fs::remove(m.folder / "manifest.json"); }});
  list.push_back({"a manifest of another plan", "manifest.json", [](Mutant& m) {
                    Json summary = plan::without_timings(m.planned.summary);
                    summary["trajectory_hash"] = "0123456789abcdef";
                    update_manifest(m.folder, "plan", summary);
                  }});
  for (const char* name :
       {"surface.ply", "shells.obj", "cage.msh", "binding.npz", "contact.npz", "report.json"})
    list.push_back({std::string("no ") + name, name,
                    [=](Mutant& m) { fs::remove(m.folder / "bodies" / "ball" / name); }});
  list.push_back({"a plan without its hash", "one hash stands over all of plan.npz", [](Mutant& m) {
                    const plan::PlanFile file = plan::read_plan(m.folder / "plan.npz");
                    Npz npz = plan::npz_of(file.plan, file.given, 3);
                    npz.texts.erase("hash.txt");
                    std::string& meta = npz.texts.at("meta.json");
                    meta.replace(meta.find("limber plan 3"), 13, "limber plan 2");
                    write_npz(m.folder / "plan.npz", npz);
                  }});
  list.push_back({"how many diverged, without the hash", "an entry was changed", [](Mutant& m) {
                    Npz npz = read_npz(m.folder / "plan.npz");
                    std::string& meta = npz.texts.at("meta.json");
                    meta.replace(meta.find("\"diverged\": "), 12, "\"diverged\": 1");
                    write_npz(m.folder / "plan.npz", npz);
                  }});
  list.push_back({"costs within plan.npz", "plan.npz holds what limber writes", [](Mutant& m) {
                    plan::PlanFile file = plan::read_plan(m.folder / "plan.npz");
                    file.given["summary"]["statistics"]["cpu_s"] = 1e-3;
                    plan::write_plan(m.folder / "plan.npz", file.plan, file.given);
                  }});
  list.push_back({"costs in the manifest", "manifest.json", [](Mutant& m) {
                    Json summary = plan::without_timings(m.planned.summary);
                    summary["statistics"]["cpu_s"] = 1e-3;
                    update_manifest(m.folder, "plan", summary);
                  }});
  list.push_back({"the hash of a cage", "bodies/ball", [](Mutant& m) {
                    m.bodies[ball].cage.positions(0, 0) -= 0.01;  // its files stay
                    m.write_summary();
                  }});
  list.push_back({"scenery moved", "post: surface is the scene's model", [](Mutant& m) {
                    const fs::path ply = m.folder / "scenery" / "post.ply",
                                   json = m.folder / "scenery" / "post.json";
                    SurfaceMesh mesh = read_ply(ply);
                    mesh.positions.col(0).array() += 0.1;
                    write_ply(ply, mesh);
                    Json said = read_json(json);
                    said["hash"] = hex(hash_of(std::string_view(read_file(ply))));
                    write_json(json, said);
                  }});
  list.push_back({"scenery that its hash is not of", "post: made as the scene says", [](Mutant& m) {
                    const fs::path ply = m.folder / "scenery" / "post.ply";
                    SurfaceMesh mesh = read_ply(ply);
                    mesh.positions(0, 0) += 1e-3;
                    write_ply(ply, mesh);
                  }});
  return list;
}

// More in a file than limber writes there, under hashes that fit.
List of_what_nobody_reads() {
  List list;
  const std::string more = "plan.npz holds what limber writes, and no more";
  const auto add_to_plan = [&](std::string what, std::string named, std::function<void(Npz&)> change) {
    list.push_back({std::move(what), std::move(named), [change = std::move(change)](Mutant& m) {
                      Npz npz = read_npz(m.folder / "plan.npz");
                      change(npz);
                      npz.texts["hash.txt"] = hex(hash_of(npz, "hash.txt")) + "\n";
                      write_npz(m.folder / "plan.npz", npz);
                    }});
  };
  const std::vector<float> nothing{std::numeric_limits<float>::quiet_NaN()};
  const NpyArray odd = NpyArray::of<float>(nothing, {1});
  add_to_plan("an array of NaN that nobody reads", more, [=](Npz& npz) { npz.arrays["proof"] = odd; });
  add_to_plan("a text that nobody reads", more, [](Npz& npz) { npz.texts["README.txt"] = "proved"; });
  add_to_plan("a name that differs in case", more, [](Npz& npz) { npz.texts["Meta.json"] = "{}"; });
  for (const char* key : {"/proof", "/settings/proof", "/settings/goal/proof", "/statistics/proof",
                          "/given/proof", "/given/cage_hashes/ghost"})
    add_to_plan(std::string("meta.json with ") + key, more, [key = Json::json_pointer(key)](Npz& npz) {
      Json meta = Json::parse(npz.texts.at("meta.json"));
      meta[key] = "0123456789abcdef";
      npz.texts["meta.json"] = meta.dump(2) + "\n";
    });
  add_to_plan("a key twice", "has the key \"solved\" twice",
              [](Npz& npz) { npz.texts.at("meta.json").insert(1, "\n  \"solved\": false,"); });
  list.push_back({"a comment of the archive", more, [](Mutant& m) {
                    std::string bytes = read_file(m.folder / "plan.npz");
                    bytes[bytes.size() - 2] = 4;
                    write_file(m.folder / "plan.npz", bytes + "more");
                  }});
  for (const bool before : {true, false})
    list.push_back({std::string("bytes ") + (before ? "before" : "after") + " the archive", "plan.npz",
                    [before](Mutant& m) {
                      const std::string bytes = read_file(m.folder / "plan.npz");
                      write_file(m.folder / "plan.npz", before ? "more" + bytes : bytes + "more");
                    }});
  for (const std::string file : {"contact.npz", "binding.npz"}) {
    const auto add = [&](std::string what, std::string named, std::function<void(Npz&)> change) {
      list.push_back({file + ": " + what, std::move(named), [file, change = std::move(change)](Mutant& m) {
                        const fs::path path = m.folder / "bodies" / "ball" / file;
                        Npz npz = read_npz(path);
                        change(npz);
                        write_npz(path, npz);
                        m.write_report(ball);
                      }});
    };
    add("an array that nobody reads", "which limber does not write",
        [=](Npz& npz) { npz.arrays["proof"] = odd; });
    add("a key that nobody reads", "more in it than limber writes", [](Npz& npz) {
      Json meta = Json::parse(npz.texts.at("meta.json"));
      meta["proof"] = 1;
      npz.texts["meta.json"] = meta.dump(2) + "\n";
    });
  }
  for (const char* key : {"/proof", "/shells/proof", "/contact/proof"})
    list.push_back({std::string("report.json with ") + key, "ball: report.json tells of these files",
                    [key = Json::json_pointer(key)](Mutant& m) {
                      m.bodies[ball].report.json[key] = "0123456789abcdef";
                      m.write_report(ball);
                    }});
  list.push_back({"a file more in report.json", "ball: report.json tells of these files", [](Mutant& m) {
                    write_file(m.folder / "bodies" / "ball" / "proof", "proved");
                    m.bodies[ball].report.json["files"]["proof"] = "";
                    m.write_report(ball);
                  }});
  return list;
}

// −0 is not 0, though == says so.
List of_zeros() {
  const std::string tree = "searched again from the scene: the same tree";
  List list;
  list.push_back({"a speed of −0 at the start", tree, [](Mutant& m) {
                    change_state(m.planned.plan, 0, [](State& s) { s.velocities[0] = -0.f; });
                    m.write_plan();
                  }});
  list.push_back({"a speed of −0 in the first frame", "replay gives the same bits", [](Mutant& m) {
                    m.planned.plan.trajectory.frames[0].velocities[0] = -0.f;
                    m.write_plan();
                  }});
  list.push_back({"numbers of −0 that no push uses", tree, [](Mutant& m) {
                    for (Control& control : m.planned.plan.tree.controls)
                      for (float& x : control.target_m)
                        if (x == 0) x = -0.f;
                    m.write_plan();
                  }});
  return list;
}

// Bodies that fit together and are not those that the scene's text leads to. `anew`: planned in.
List of_other_bodies() {
  List list;
  const std::string shells_again = "block: shells made again", cage_again = "ball: cage made again",
                    contact_again = "ball: contact made again";
  const auto plan_anew = [](Mutant& m) {
    TemporaryFolder text;
    std::ofstream(text / "scene.toml") << m.planned.scene.text;
    const Result planned =
        limber_program({"plan", (text / "scene.toml").string(), "-o", m.folder.string(), "-q"});
    if (planned.code != exit_done) throw std::runtime_error("is not planned: " + planned.err);
  };
  using Change = std::function<void(Mutant&)>;
  const auto add = [&](std::size_t b, std::string what, std::string named, bool anew, Change change) {
    list.push_back({std::move(what), std::move(named), [=](Mutant& m) {
                      change(m);
                      m.write_body(b);
                      anew ? plan_anew(m) : m.write_plan();
                    }});
  };
  add(ball, "no samples at the front", contact_again, true, [](Mutant& m) {
    SurfaceSamples& s = m.bodies[ball].contact.samples;
    Eigen::Index tip = 0, left = 0;
    s.positions_m.col(0).maxCoeff(&tip);
    const Vec3 front = s.positions_m.row(tip);
    const double radius = 3 * std::sqrt(s.area_m2[tip]), all = s.area_m2.sum();
    for (Eigen::Index i = 0; i < s.area_m2.size(); ++i) {
      if ((Vec3(s.positions_m.row(i)) - front).norm() <= radius) continue;
      s.positions_m.row(left) = s.positions_m.row(i), s.weights.row(left) = s.weights.row(i);
      s.tet_from_sample[left] = s.tet_from_sample[i], s.area_m2[left++] = s.area_m2[i];
    }
    s.positions_m.conservativeResize(left, 3), s.weights.conservativeResize(left, 4);
    s.tet_from_sample.conservativeResize(left), s.area_m2.conservativeResize(left);
    s.area_m2 *= all / s.area_m2.sum();
  });
  add(ball, "samples that stand for more at the back", contact_again, true, [](Mutant& m) {
    SurfaceSamples& s = m.bodies[ball].contact.samples;
    const double all = s.area_m2.sum(), middle = s.positions_m.col(0).mean();
    for (Eigen::Index i = 0; i < s.area_m2.size(); ++i)
      s.area_m2[i] *= s.positions_m(i, 0) > middle ? 0.7 : 1.3;
    s.area_m2 *= all / s.area_m2.sum();
  });
  add(ball, "all distances larger by less than a cell", contact_again, true, [](Mutant& m) {
    DistanceField& field = m.bodies[ball].contact.field;
    const int by = int(0.9 * field.cell_m / field.unit_m);
    for (std::int16_t& v : field.values) v = std::int16_t(std::min(32000, v + by));
    m.bodies[ball].contact.min_weight = meshing::min_weights(field, m.bodies[ball].cage);
  });
  add(ball, "a cage that is a little larger", cage_again, true, [](Mutant& m) {
    PreparedBody& body = m.bodies[ball];
    const Eigen::RowVector3d middle = body.cage.positions.colwise().mean();
    body.cage.positions = ((body.cage.positions.rowwise() - middle) * 1.02).rowwise() + middle;
    body.binding = ffd::bind(body.surface, body.cage);
    body.contact = meshing::make_contact_shape(body.surface, body.cage);
  });

  const auto label = [](Mutant& m) {
    m.bodies[block].shell_from_tet = meshing::label_tets(m.bodies[block].cage, m.shells[block]);
  };
  const auto tell_honestly = [](Mutant& m) {
    const meshing::ShellCheck c = meshing::check_shells(m.shells[block], m.bodies[block].surface);
    m.bodies[block].report.json["shells"].update({{"mean_overshoot", c.mean_overshoot},
                                                  {"max_overshoot", c.max_overshoot},
                                                  {"vertices_uncovered", c.vertices_uncovered},
                                                  {"triangles_uncovered", c.triangles_uncovered}});
  };
  const auto scale = [](Mutant& m, double by) {
    for (ConvexShell& shell : m.shells[block]) {
      const Eigen::RowVector3d middle = shell.vertices.colwise().mean();
      shell.vertices = ((shell.vertices.rowwise() - middle) * by).rowwise() + middle;
    }
  };
  add(block, "shells too large, said to be inflated", "block: shells stand off", false, [=](Mutant& m) {
    scale(m, 1.3), label(m);
    m.bodies[block].report.json["shells"]["inflation"] = 1e-9;
  });
  add(block, "small shells, and what they do not cover is told", shells_again, false,
      [=](Mutant& m) { scale(m, 0.1), label(m), tell_honestly(m); });
  add(block, "one shell, the hull, and how it stands off is told", shells_again, false, [=](Mutant& m) {
    m.shells[block] = {meshing::convex_hull(m.bodies[block].surface.positions)};
    label(m), tell_honestly(m);
  });
  add(block, "tets of the first shell, said to be in cells", "block: each tet of the cage", false,
      [](Mutant& m) {
        std::vector<int>& shells = m.bodies[block].shell_from_tet;
        std::fill(shells.begin(), shells.end(), 0);
        m.bodies[block].report.json["cage"]["mode"] = "cells";
      });
  add(block, "tets of the other shell, said to be of mode paper", "block: each tet of the cage", false,
      [](Mutant& m) {
        for (int& shell : m.bodies[block].shell_from_tet) shell = 1 - shell;
        m.bodies[block].report.json["cage"]["mode"] = "paper";
      });
  return list;
}

// What is told of shortcuts, better paths and carried ones that were not.
List of_later_ones() {
  const Json costs{
      {"duration_s", 1.0}, {"effort_n_s", 1.0}, {"strain_energy_j", 1.0}, {"volume_change", 0.01}};
  List list;
  const auto add = [&](std::string what, std::function<void(Mutant&)> change) {
    list.push_back(
        {std::move(what), "what the plan tells of itself", [change = std::move(change)](Mutant& m) {
           change(m);
           m.write_plan();
         }});
  };
  add("a better path that was not", [=](Mutant& m) {
    m.planned.summary["improve"] = {{"cost", "duration"}, {"first", costs}, {"improvements", Json::array()},
                                    {"searches", 9},      {"solved", 9},    {"iterations", 99},
                                    {"cpu_s", 1.0},       {"wall_s", 1.0}};
  });
  add("a better path of which nothing is told",
      [](Mutant& m) { m.planned.summary["improve"] = Json::object(); });
  add("a carried plan of which little is told", [](Mutant& m) {
    m.planned.summary["refine"] = {{"how", "replayed"}};
    m.planned.plan.statistics.iterations = 3, m.planned.plan.statistics.rollout_steps = 1;
  });
  for (const char* how : {"replayed", "carried by an angel"})
    add(std::string("a plan that was not ") + how, [how](Mutant& m) {
      std::int64_t tets = 0;
      for (const PreparedBody& body : m.bodies) tets += body.cage.tets.rows();
      m.planned.summary["refine"] = {{"how", how},          {"tracked_s", 1.0},    {"largest_error_m", 0.0},
                                     {"iterations", 0},     {"replay_cpu_s", 1.0}, {"track_cpu_s", 1.0},
                                     {"search_cpu_s", 0.0}, {"coarse_tets", tets}, {"tets", tets}};
    });
  return list;
}

// Of a plan with shortcuts and better paths.
List of_a_better_plan() {
  const std::string claims = "what the plan tells of itself";
  List list;
  const auto add = [&](std::string what, std::string named, std::function<void(Json&)> change) {
    list.push_back({std::move(what), std::move(named), [change = std::move(change)](Mutant& m) {
                      change(m.planned.summary);
                      m.write_summary();
                    }});
  };
  add("what shortcuts began with", claims, [](Json& s) { s["shortcut"]["before"]["duration_s"] = 0.01; });
  add("shortcuts with more in them", claims, [](Json& s) { s["shortcut"]["proof"] = "exact"; });
  add("what the best path costs", claims, [](Json& s) {
    Json& i = s["improve"];
    (i["improvements"].empty() ? i["first"] : i["improvements"].back()["costs"])["duration_s"] = 0.01;
    s["shortcut"]["after"]["duration_s"] = 0.01;
  });
  add("a better path that is not better", claims, [](Json& s) {
    Json& i = s["improve"];
    const Json costs = i["improvements"].empty() ? i["first"] : i["improvements"].back()["costs"];
    i["improvements"].push_back({{"wall_s", 1.0}, {"iterations", 1}, {"search", 1}, {"costs", costs}});
    i["solved"] = 9, i["searches"] = 9;
  });
  add("more searches that ended well than there were", claims,
      [](Json& s) { s["improve"]["solved"] = 1 + s["improve"]["searches"].get<int>(); });
  add("nothing of what came after the search", "searched again from the scene: the same tree",
      [](Json& s) { s.erase("improve"), s.erase("shortcut"); });
  return list;
}

// Of a plan that was carried over.
List of_a_carried_plan() {
  List list;
  const auto add = [&](std::string what, std::function<void(Mutant&)> change) {
    list.push_back(
        {std::move(what), "what the plan tells of itself", [change = std::move(change)](Mutant& m) {
           change(m);
           m.write_plan();
         }});
  };
  add("its tets", [](Mutant& m) { m.planned.summary["refine"]["tets"] = 1'000'000; });
  add("how it was carried", [](Mutant& m) { m.planned.summary["refine"]["how"] = "by an angel"; });
  add("counts of a search", [](Mutant& m) { m.planned.plan.statistics.diverged = 3; });
  add("iterations of its nodes", [](Mutant& m) {
    std::vector<std::int64_t>& of = m.planned.plan.tree.iterations;
    for (std::size_t n = 1; n < of.size(); ++n) of[n] += 7;
  });
  return list;
}

// Of a start at which bodies were parted.
List of_a_parted_start() {
  List list;
  const std::string start = "bodies that overlap at the start are parted again: the same start",
                    claims = "what the plan tells of itself";
  const auto begin_otherwise = [&](std::string what, std::function<void(State&)> change) {
    list.push_back({std::move(what), start, [change = std::move(change)](Mutant& m) {
                      change_state(m.planned.plan, 0, change);
                      change(m.planned.plan.trajectory.frames[0]);
                      m.write_plan();
                    }});
  };
  begin_otherwise("a node of the start", [](State& s) { s.positions[7] += 1e-4f; });
  begin_otherwise("the last node of the start", [](State& s) { s.positions.back() -= 1e-4f; });
  begin_otherwise("a speed at the start", [](State& s) { s.velocities[7] = 1e-3f; });
  list.push_back({"nothing parted", start, [](Mutant& m) {
                    const State rest = fem::rest_state(build_world(m.planned.scene, m.placed()));
                    change_state(m.planned.plan, 0, [&](State& s) { s = rest; });
                    m.planned.plan.trajectory.frames[0] = rest;
                    m.write_plan();
                  }});
  const auto tell = [&](std::string what, std::function<void(Json&)> change) {
    list.push_back({std::move(what), claims, [change = std::move(change)](Mutant& m) {
                      change(m.planned.summary);
                      m.write_summary();
                    }});
  };
  tell("how deep bodies were", [](Json& s) { s["parted"]["pairs"][0]["depth_m"] = 0.01; });
  tell("how far they are apart", [](Json& s) { s["parted"]["pairs"][0]["gap_m"] = 0.01; });
  tell("how far each went", [](Json& s) { s["parted"]["pairs"][0]["moved_m"][1] = 0.0; });
  tell("which bodies overlapped", [](Json& s) { s["parted"]["pairs"][0]["bodies"][0] = "ball"; });
  tell("a pair less", [](Json& s) { s["parted"]["pairs"].clear(); });
  tell("how far nodes were moved", [](Json& s) { s["parted"]["largest_move_m"]["pebble"] = 0.0; });
  tell("how far that is for the robot", [](Json& s) { s["parted"]["largest_move_of_robot_size"] = 1e-4; });
  tell("how many steps it took", [](Json& s) { s["parted"]["steps"] = 1; });
  tell("nothing of a parting", [](Json& s) { s.erase("parted"); });
  list.push_back({"a scene that parts nothing", "overlap at the start", [](Mutant& m) {
                    m.planned.scene.sets.push_back("world.part_overlaps=false");
                    m.write_summary();
                  }});
  return list;
}

class Mutations_slow : public testing::Test {
 protected:
  static void SetUpTestSuite() { plan(scene_text); }
  static void plan(const std::string& text, const std::vector<std::string>& more = {}) {
    if (!shared_) shared_ = new TemporaryFolder;
    std::ofstream(scene_file()) << text;
    std::vector<std::string> words{"plan", scene_file(), "-o", good().string()};
    words.insert(words.end(), more.begin(), more.end());
    planned_ = limber_program(words);
  }
  static std::string scene_file() { return (shared_->path() / "scene.toml").string(); }
  static void TearDownTestSuite() { delete shared_, shared_ = nullptr; }
  static fs::path good() { return shared_->path() / "good"; }

  void SetUp() override { ASSERT_EQ(planned_.code, exit_done) << planned_.err; }

  // Each mutant is refused, by the promise or complaint that is said.
  static void expect_named(const List& list, const std::vector<std::string>& more = {}) {
    const fs::path bad = shared_->path() / "bad";
    std::size_t row = 0, made = 0;
    for (const Mutation& mutation : list) {
      if (!mine(row++)) continue;
      ++made;
      SCOPED_TRACE(mutation.what);
      fs::remove_all(bad);
      fs::copy(good(), bad, fs::copy_options::recursive);
      try {
        Mutant mutant(bad);
        mutation.make(mutant);
      } catch (const std::exception& error) {
        ADD_FAILURE() << "is not made: " << error.what();
        continue;
      }
      std::vector<std::string> words{"verify", (bad / mutation.part).string(), "--json"};
      words.insert(words.end(), more.begin(), more.end());
      const Result result = limber_program(words);
      EXPECT_TRUE(result.code == exit_defect || result.code == exit_bad_input) << result.code;
      std::string found;
      const Json answer = result.json();
      for (const Json& row : answer.value("promises", Json::array()))
        if (!row.at("kept").get<bool>()) found += row.at("promise").get<std::string>() + "\n";
      if (result.code == exit_bad_input) found = answer.at("error").get<std::string>();
      EXPECT_NE(found.find(mutation.named), std::string::npos)
          << "wanted: " << mutation.named << "\nfound: " << (found.empty() ? result.out : found);
    }
    fmt::print("{} mutants\n", made);
  }

 private:
  static inline TemporaryFolder* shared_;
  static inline Result planned_;
};

TEST_F(Mutations_slow, TheGoodFolderKeepsEveryPromise) {
  const Result result = limber_program({"verify", good().string()});
  EXPECT_EQ(result.code, exit_done) << result.out << result.err;
  // What a mutant is written by changes nothing where nothing is changed.
  Mutant same(good());
  const auto before = contents(good());
  for (const std::size_t b : {ball, block}) same.write_body(b);
  same.write_plan();
  EXPECT_EQ(contents(good()), before);
}
TEST_F(Mutations_slow, OfThePlan) { expect_named(of_the_plan()); }
TEST_F(Mutations_slow, OfItsSummary) { expect_named(of_the_summary(read_plan_folder(good()).summary)); }
TEST_F(Mutations_slow, OfTheScene) { expect_named(of_the_scene()); }
TEST_F(Mutations_slow, OfBodies) { expect_named(of_bodies()); }
TEST_F(Mutations_slow, OfReports) {
  expect_named(of_reports(read_json(good() / "bodies" / "ball" / "report.json")));
}
TEST_F(Mutations_slow, OfFiles) { expect_named(of_files()); }
TEST_F(Mutations_slow, OfWhatNobodyReads) { expect_named(of_what_nobody_reads()); }
TEST_F(Mutations_slow, OfZeros) { expect_named(of_zeros()); }
TEST_F(Mutations_slow, OfOtherBodies) { expect_named(of_other_bodies()); }
TEST_F(Mutations_slow, OfLaterOnes) { expect_named(of_later_ones()); }

// A ball of 2 · rings · sectors triangles.
std::string ball_obj(int rings, int sectors) {
  std::string obj;
  for (int r = 0; r < rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const double down = std::numbers::pi * (r + 0.5) / rings, round = 2 * std::numbers::pi * s / sectors;
      obj += fmt::format("v {} {} {}\n", std::sin(down) * std::cos(round), std::sin(down) * std::sin(round),
                         std::cos(down));
    }
  obj += "v 0 0 1\nv 0 0 -1\n";
  const int last = (rings - 1) * sectors;
  for (int s = 0; s < sectors; ++s) {
    const int next = (s + 1) % sectors;
    obj += fmt::format("f {} {} {}\n", rings * sectors + 1, s + 1, next + 1);
    obj += fmt::format("f {} {} {}\n", rings * sectors + 2, last + next + 1, last + s + 1);
    for (int at = 0; at < last; at += sectors) {
      obj += fmt::format("f {} {} {}\n", at + s + 1, at + sectors + s + 1, at + next + 1);
      obj += fmt::format("f {} {} {}\n", at + next + 1, at + sectors + s + 1, at + sectors + next + 1);
    }
  }
  return obj;
}

// What a cage does not promise is told, and the cage is still the one that is made so.
TEST(BodyMutations_slow, OfACageThatNeedNotEnclose) {
  for (const char* mode : {"conform", "paper"}) {
    SCOPED_TRACE(mode);
    const TemporaryFolder folder;
    const std::string model = (folder / "ball.obj").string(), body = (folder / "ball").string();
    write_file(model, ball_obj(15, 20));
    ASSERT_EQ(limber_program({"prepare", model, "-o", body, "--tets", "100", "--mode", mode}).code,
              exit_done);
    const Result good = limber_program({"verify", body});
    EXPECT_EQ(good.code, exit_done) << good.out << good.err;
    EXPECT_NE(good.out.find("found   body: no vertex outside the cage"), std::string::npos) << good.out;

    PreparedBody other = read_body(folder / "ball");
    const fs::path at = folder / "ball";
    other.cage.positions(3, 0) += 1e-3;
    const std::vector<ConvexShell> shells = read_obj_shells(at / "shells.obj");
    other.binding = ffd::bind(other.surface, other.cage);
    other.contact = meshing::make_contact_shape(other.surface, other.cage);
    write_msh(at / "cage.msh", other.cage, other.shell_from_tet);
    ffd::write_binding(at / "binding.npz", other.binding, other.surface, other.cage);
    write_contact_shape(at / "contact.npz", other.contact, other.surface, other.cage);
    const Json facts = facts_of_body(other.surface, shells, other.cage, other.binding, other.contact,
                                     meshing::certify(other.surface, other.cage));
    for (const auto& [table, figures] : facts.items()) other.report.json[table].update(figures);
    for (const auto& [name, hash] : other.report.json.at("files").items())
      other.report.json["files"][name] = hex(hash_of(std::string_view(read_file(at / name))));
    write_json(at / "report.json", other.report.json);
    const Result named = limber_program({"verify", body});
    EXPECT_EQ(named.code, exit_defect);
    EXPECT_NE(named.out.find("BROKEN  body: cage made again"), std::string::npos) << named.out;
  }
}

// Shells of large bodies that are as many as were asked for are made again for those who ask for it; others
// always are.
class ShellMutations_slow : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Asked, ShellMutations_slow, ::testing::Values(1, 32));
TEST_P(ShellMutations_slow, OfShellsThatStandOffTooFar) {
  const bool as_asked = GetParam() == 1;  // a ball is one shell
  const TemporaryFolder folder;
  const std::string model = (folder / "ball.obj").string(), body = (folder / "ball").string();
  write_file(model, ball_obj(101, 101));  // 20,402 triangles
  ASSERT_EQ(
      limber_program({"prepare", model, "-o", body, "--tets", "60", "--shells", std::to_string(GetParam())})
          .code,
      exit_done);
  const auto verified = [&](bool remake) {
    std::vector<std::string> words{"verify", body};
    if (remake) words.push_back("--remake");
    return limber_program(words);
  };
  for (const bool remake : {false, true}) {
    const Result good = verified(remake);
    EXPECT_EQ(good.code, exit_done) << good.out << good.err;
    EXPECT_EQ(good.out.find("made again; --remake") == std::string::npos, remake || !as_asked) << good.out;
  }

  const SurfaceMesh surface = read_ply(folder / "ball" / "surface.ply");
  std::vector<ConvexShell> shells = read_obj_shells(folder / "ball" / "shells.obj");
  shells.at(0).vertices *= 1.5;
  write_obj(folder / "ball" / "shells.obj", shells);
  Json report = read_json(folder / "ball" / "report.json");
  const meshing::ShellCheck c = meshing::check_shells(shells, surface);
  report["shells"].update(
      {{"mean_overshoot", c.mean_overshoot},
       {"max_overshoot", c.max_overshoot},
       {"in_float32", std::count_if(shells.begin(), shells.end(), meshing::holds_in_float32)},
       {"sum_of_volumes_m3", volume(SurfaceMesh{shells[0].vertices, shells[0].triangles})}});
  report["files"]["shells.obj"] = hex(hash_of(std::string_view(read_file(folder / "ball" / "shells.obj"))));
  write_json(folder / "ball" / "report.json", report);
  EXPECT_EQ(verified(false).code, as_asked ? exit_done : exit_defect) << verified(false).out;
  const Result named = verified(as_asked);
  EXPECT_EQ(named.code, exit_defect);
  EXPECT_NE(named.out.find("BROKEN  body: shells made again"), std::string::npos) << named.out;

  report["shells"]["stopped_by"] = as_asked ? "gain" : "count";
  write_json(folder / "ball" / "report.json", report);
  EXPECT_NE(verified(false).out.find("BROKEN  body: report.json tells"), std::string::npos);
}

// A plan of another scene is a plan: whoever knows which scene it should be of says so.
TEST_F(Mutations_slow, OfAnotherScene) {
  const std::vector<std::string> trusted{"--scene", scene_file()};
  const std::string named = "the plan is of the scene " + scene_file();
  EXPECT_EQ(limber_program({"verify", good().string(), "--scene", scene_file()}).code, exit_done);
  expect_named({{"a goal that is next to the start", named,
                 [](Mutant& m) {
                   std::string text = m.planned.scene.text;
                   const std::string goal = "[3.2, 1, 1]";
                   text.replace(text.find(goal), goal.size(), "[0.9, 1, 1.3]");
                   TemporaryFolder other;
                   std::ofstream(other / "scene.toml") << text;
                   limber_program({"plan", (other / "scene.toml").string(), "-o", m.folder.string(), "-q"});
                 }},
                {"an edit by --set", named,
                 [](Mutant& m) {
                   m.planned.scene.sets.push_back(
                       "film.caption=another");  // one that says what the scene says is none
                   m.write_plan();
                 }}},
               trusted);
  EXPECT_EQ(limber_program({"verify", good().string(), "--set", "name=a"}).code, exit_bad_input);
}

class BetterMutations_slow : public Mutations_slow {
 protected:
  static void SetUpTestSuite() { plan(scene_text, {"--shortcut", "2", "--improve", "--iterations", "120"}); }
};
TEST_F(BetterMutations_slow, OfABetterPlan) {
  const Result good_one = limber_program({"verify", good().string()});
  EXPECT_EQ(good_one.code, exit_done) << good_one.out << good_one.err;
  expect_named(of_a_better_plan());
  // Whoever goes on with it still tells what came after the search.
  ASSERT_EQ(limber_program({"plan", scene_file(), "-o", good().string(), "--resume"}).code, exit_done);
  const Result resumed = limber_program({"verify", good().string()});
  EXPECT_EQ(resumed.code, exit_done) << resumed.out << resumed.err;
}
TEST_F(BetterMutations_slow, OfACarriedPlan) {
  const fs::path fine = good().parent_path() / "fine";
  ASSERT_EQ(limber_program({"refine", good().string(), "-o", fine.string(), "--tets-factor", "1", "--set",
                            "film.clock=true"})
                .code,
            exit_done);
  fs::remove_all(good());
  fs::rename(fine, good());
  ASSERT_NE(read_plan_folder(good()).summary.at("refine").at("how"), "replanned");
  const Result good_one = limber_program({"verify", good().string()});
  EXPECT_EQ(good_one.code, exit_done) << good_one.out << good_one.err;
  expect_named(of_a_carried_plan());
}

// A body from a file, and a goal whose shape is one.
class FileMutations_slow : public Mutations_slow {
 protected:
  static void SetUpTestSuite() {
    plan(scene_text);
    const fs::path folder = good().parent_path();
    const PreparedBody made = read_body(good() / "bodies" / "ball");
    std::string obj;
    for (const auto& p : made.surface.positions.rowwise())
      obj += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
    for (const auto& t : made.surface.triangles.rowwise())
      obj += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    write_file(folder / "ball.obj", obj);
    std::string text = scene_text;
    const auto replace = [&](const std::string& from, const std::string& to) {
      text.replace(text.find(from), from.size(), to);
    };
    replace("model = { sphere = { diameter_m = 0.6, triangle_m = 0.06 } }",
            "model = { file = \"ball.obj\" }");
    plan(text);  // prepares the ball; its cage is the shape that is asked for
    fs::copy_file(good() / "bodies" / "ball" / "cage.msh", folder / "goal.msh");
    replace("radius_m = 0.3\n[planner]",
            "radius_m = 0.3\nshape = { cage = \"goal.msh\", tolerance_m = 1 }\n[planner]");
    plan(text);
  }
};
TEST_F(FileMutations_slow, OfWhatAScenesFilesSay) {
  const Result good_one = limber_program({"verify", good().string(), "--scene", scene_file()});
  EXPECT_EQ(good_one.code, exit_done) << good_one.out << good_one.err;
  expect_named({{"a source that nobody has", "ball: surface is the scene's model",
                 [](Mutant& m) {
                   m.bodies[ball].report.json["input"]["model"]["model"]["source"] = "0123456789abcdef";
                   m.write_report(ball);
                   m.write_plan();
                 }},
                {"the shape of the goal", "the goal's shape is goal.shape.cage",
                 [](Mutant& m) {
                   Points& goal = m.bodies[ball].goal_shape_m;
                   goal.col(0) *= 1.001;
                   write_msh(m.folder / "bodies" / "ball" / "goal.msh", {goal, m.bodies[ball].cage.tets},
                             m.bodies[ball].shell_from_tet);
                   m.write_plan();
                 }}},
               {"--scene", scene_file()});
}

class PartedMutations_slow : public Mutations_slow {
 protected:
  static void SetUpTestSuite() { plan(overlapping_scene()); }
};
TEST_F(PartedMutations_slow, OfTheStart) {
  const Result good_one = limber_program({"verify", good().string()});
  EXPECT_EQ(good_one.code, exit_done) << good_one.out << good_one.err;
  EXPECT_NE(good_one.out.find("kept    bodies that overlap at the start are parted again"), std::string::npos)
      << good_one.out;
  expect_named(of_a_parted_start());
}

}  // namespace
}  // namespace limber::detail
