#include "app/verify.h"
#include "app/analysis.h"
#include "app/commands.h"
#include "app/fem_system.h"
#include "app/plan_folder.h"
#include "app/scene_world.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "meshing/certificate.h"
#include "plan/trajectory.h"

namespace limber::app {

namespace {

// The paper's conclusion: every deformable object stays within 10 % of its rest volume.
// What limber promises on its own scenes, as a share of the robot's size.
constexpr double largest_penetration = 0.04;

class Table {
 public:
  void row(const std::string& promise, bool kept, const std::string& value) {
    rows_.push_back({{"promise", promise}, {"kept", kept}, {"value", value}});
    all_kept_ = all_kept_ && kept;
  }
  // What no promise is made of.
  void measured(const std::string& what, const std::string& value) {
    measured_.push_back({{"what", what}, {"value", value}});
  }
  // `motion` is of the path, null where there is none.
  Outcome outcome(const Json& motion) const {
    std::string text;
    for (const Json& r : rows_)
      text += fmt::format("  {:6}  {:48}  {}\n", r.at("kept").get<bool>() ? "kept" : "BROKEN",
                          r.at("promise").get<std::string>(), r.at("value").get<std::string>());
    for (const Json& r : measured_)
      text += fmt::format("  {:8}{:48}  {}\n", "found", r.at("what").get<std::string>(),
                          r.at("value").get<std::string>());
    if (!motion.is_null())
      text += fmt::format("largest strain {:.3f} ({}), strongest contact {:.1f} N ({})\n",
                          motion.at("largest_strain").get<double>(),
                          motion.at("largest_strain_of").get<std::string>(),
                          motion.at("largest_contact_force_n").get<double>(),
                          motion.at("contact_between").get<std::string>());
    text += all_kept_ ? "every promise is kept\n" : "not every promise is kept\n";
    return {all_kept_ ? exit_done : exit_defect,
            {{"all_kept", all_kept_}, {"promises", rows_}, {"measured", measured_}, {"motion", motion}},
            text};
  }

 private:
  std::vector<Json> rows_, measured_;
  bool all_kept_ = true;
};

void check_body(const std::string& name, const PreparedBody& body, Table& table) {
  const meshing::Certificate c = meshing::certify(body.surface, body.cage);
  table.row(name + ": no vertex outside the cage", c.vertices_outside == 0,
            fmt::format("{} of {}", c.vertices_outside, c.vertices));
  table.row(name + ": no triangle crosses its boundary", c.triangles_crossing == 0,
            fmt::format("{} of {}", c.triangles_crossing, c.triangles));
  table.row(name + ": boundary of the cage is a manifold", c.nonmanifold_edges + c.nonmanifold_vertices == 0,
            fmt::format("{} edges and {} vertices are not", c.nonmanifold_edges, c.nonmanifold_vertices));
  const Json& written = body.report.at("certificate");
  table.row(name + ": certificate is of these meshes",
            written.at("surface_hash") == hex(c.surface_hash) &&
                written.at("cage_hash") == hex(c.cage_hash) && written.at("holds") == c.holds(),
            fmt::format("dihedrals {:.1f} … {:.1f} degrees", c.min_dihedral_deg, c.max_dihedral_deg));
}

// Each leg begins where the one before has reached its goal; the replay is of the controls up to there.
void check_via(const plan::Plan& plan, const FemSystem& system, Table& table) {
  for (std::size_t leg = 1; leg < plan.legs.size(); ++leg) {
    std::vector<Control> controls = plan.trajectory.controls;
    controls.resize(std::min(controls.size(), plan::path_to(plan.tree, plan.legs[leg].root).size() - 1));
    const plan::Trajectory replay = plan::simulate(system, controls, plan.settings.frames_per_second);
    const plan::System& on_leg = system.on_leg(int(leg) - 1);
    const plan::Via& via = plan.settings.via[leg - 1];
    const Vec3 place = system.robot_center(replay.end) - on_leg.goal_shift(replay.end);
    const double speed = system.mean_speed(replay.end);
    table.row(
        fmt::format("{} is reached{}", plan::name_of_goal(plan.settings, int(leg) - 1),
                    via.rest ? ", and the robot rests" : ""),
        plan::holds(via.goal, place) && on_leg.goal_holds(replay.end) &&
            (!via.rest || speed <= plan.settings.settle.mean_speed_m_s),
        fmt::format("{:.3f} m from it at {:.4f} m/s", (place - via.goal.center_of_mass_m).norm(), speed));
  }
}

// Promises where contact is on the surfaces that are seen, findings where it is between cages.
void check_seen(const MotionFigures& figures, bool promised, Table& table) {
  const SeenLimits limits;
  const auto row = [&](const std::string& what, const std::string& limit, bool kept,
                       const std::string& value) {
    promised ? table.row(what + ": " + limit, kept, value) : table.measured(what, value);
  };
  const double size = figures.robot_surface_size_m;
  const auto percent = [](double share) { return fmt::format("{:g} %", 100 * share); };
  const auto of_size = [&](double metres) { return fmt::format("{:.2f} %", 100 * metres / size); };
  row("what is seen: deepest overlap of two surfaces", "at most " + percent(limits.overlap),
      figures.deepest_overlap_m <= limits.overlap * size,
      fmt::format("{:.4f} m, {} ({})", figures.deepest_overlap_m, of_size(figures.deepest_overlap_m),
                  figures.overlap_between));
  const auto gap_row = [&](const std::string& what, const GapFigures& gap) {
    row("what is seen: " + what,
        fmt::format("in the median below {}, below {}", percent(limits.median_gap),
                    percent(limits.worst_gap)),
        gap.count == 0 || (gap.median_m < limits.median_gap * size && gap.worst_m < limits.worst_gap * size),
        gap.count == 0
            ? gap.worst_between
            : fmt::format("median {}, worst {} ({}), of {} pairs and frames", of_size(gap.median_m),
                          of_size(gap.worst_m), gap.worst_between, gap.count));
  };
  gap_row("gap between surfaces that press each other", figures.gap);
  gap_row("the same gap where the strongest force acts", figures.gap_at_contact);
  gap_row("gap between a surface and a wall that it presses", figures.gap_to_wall);
  row("what is seen: a body's overlap with itself", "at most " + percent(limits.self_overlap),
      figures.deepest_self_overlap_m <= limits.self_overlap * size,
      fmt::format("{:.4f} m, {} ({})", figures.deepest_self_overlap_m,
                  of_size(figures.deepest_self_overlap_m), figures.self_overlap_of));
  table.measured("least and largest stretch of a tet",
                 fmt::format("{:.3f} ({}), {:.3f} ({})", figures.least_stretch, figures.least_stretch_of,
                             figures.largest_stretch, figures.largest_stretch_of));
}

// Of each body that promises it, at every frame.
void check_stretch(const MotionFigures& figures, const fem::World& world, Table& table) {
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const double most = world.bodies[b].max_stretch;
    if (!world.bodies[b].moving || !std::isfinite(most)) continue;
    double least = 1, largest = 1;
    for (const FrameFigures& frame : figures.frames)
      least = std::min(least, frame.bodies[b].least_stretch),
      largest = std::max(largest, frame.bodies[b].largest_stretch);
    table.row(
        fmt::format("{}: tets are stretched within {:.3g} and {:.3g}", world.bodies[b].name, 1 / most, most),
        least >= 1 / most * (1 - 1e-6) && largest <= most * (1 + 1e-6),
        fmt::format("{:.3f}, {:.3f}", least, largest));
  }
}

MotionFigures check_plan(const PlanFolder& planned, const std::vector<PreparedBody>& bodies,
                         const fem::World& world, Table& table) {
  const plan::Plan& plan = planned.plan;
  const plan::Trajectory& path = plan.trajectory;
  const FemSystem system(world, goal_rules_of(planned.scene));
  table.row("the plan is of this world", plan.system_hash == system.hash(), hex(system.hash()));

  const plan::Trajectory replay = plan::simulate(system, path.controls, path.frames_per_second);
  const bool same = replay.frames == path.frames && replay.end == path.end;
  table.row("replay gives the same bits", same,
            fmt::format("{} frames, end {}", replay.frames.size(), hex(hash_of(replay.end))));

  const MotionFigures figures = measure_motion(world, bodies, replay);
  check_via(plan, system, table);
  const auto distance_in = [&](const State& state) {
    return (system.robot_center(state) - system.goal_shift(state) - plan.settings.goal.center_of_mass_m)
        .norm();
  };
  const double distance = distance_in(plan.tree.states[std::size_t(plan.best_node)]);
  table.row("the robot reaches the goal", distance <= plan.settings.goal.radius_m,
            fmt::format("{:.3f} m from it, radius {:.3f} m", distance, plan.settings.goal.radius_m));
  const double end_distance = distance_in(replay.end);
  const double end_speed = system.mean_speed(replay.end);
  table.row("and comes to rest near it",
            end_distance <= plan.settings.goal.radius_m && (plan.settings.settle.max_duration_s == 0 ||
                                                            end_speed <= plan.settings.settle.mean_speed_m_s),
            fmt::format("{:.3f} m from it at {:.4f} m/s", end_distance, end_speed));
  table.row("no force is above the maximum",
            figures.largest_force_n <= plan.settings.max_force_n * (1 + 1e-6),
            fmt::format("{:.1f} of {:.1f} N", figures.largest_force_n, plan.settings.max_force_n));
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    if (world.bodies[b].moving)
      table.row(fmt::format("{}: volume changes by at most {:g} %", world.bodies[b].name,
                            100 * world.bodies[b].max_volume_change),
                figures.largest_volume_change[b] <= world.bodies[b].max_volume_change,
                fmt::format("{:.2f} %", 100 * figures.largest_volume_change[b]));
  table.row("no tet is inverted at a frame", figures.inverted_tets == 0,
            fmt::format("{}", figures.inverted_tets));
  const std::string cages =
      fmt::format("{:.4f} m, {:.2f} % ({})", figures.deepest_penetration_m,
                  100 * figures.deepest_penetration_m / figures.robot_size_m, figures.penetration_between);
  if (!world.touches_on_surfaces())
    table.row("penetration of cages is at most 4 % of the robot's size",
              figures.deepest_penetration_m <= largest_penetration * figures.robot_size_m, cages);
  check_stretch(figures, world, table);
  check_seen(figures, world.touches_on_surfaces(), table);
  return figures;
}

}  // namespace

Outcome verify_plan(const PlanFolder& planned, const std::vector<PreparedBody>& bodies,
                    const fem::World& world, MotionFigures& figures) {
  Table table;
  for (std::size_t b = 0; b < bodies.size(); ++b) check_body(planned.scene.bodies[b].name, bodies[b], table);
  figures = check_plan(planned, bodies, world, table);
  return table.outcome(json_of(figures));
}

Outcome verify(const fs::path& folder, const std::optional<fs::path>& observables) {
  if (!fs::is_directory(folder))
    throw InputError(fmt::format("{}: is not a folder; name a work folder of limber", folder.string()));
  if (fs::exists(folder / "plan.npz")) {
    const PlanFolder planned = read_plan_folder(folder);
    const std::vector<PreparedBody> bodies = read_bodies_of(planned, folder);
    const fem::World world = build_world(planned.scene, bodies);
    MotionFigures figures;
    const Outcome outcome = verify_plan(planned, bodies, world, figures);
    if (observables) write_observables(*observables, world, figures);
    return outcome;
  }
  if (fs::exists(folder / "report.json")) {
    if (observables)
      throw InputError(fmt::format(
          "{}: holds no plan, so there is nothing to observe; leave --observables out", folder.string()));
    Table table;
    check_body("body", read_body(folder), table);
    return table.outcome({});
  }
  throw InputError(
      fmt::format("{}: holds neither plan.npz nor report.json; make them with limber run or limber prepare",
                  folder.string()));
}

}  // namespace limber::app
