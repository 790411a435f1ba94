#include "app/verify.h"

#include "app/commands.h"
#include "app/promises.h"
#include "app/scene_world.h"
#include "app/verify_body.h"
#include "app/verify_plan.h"
#include "core/error.h"
#include "core/progress.h"

namespace limber::app {

namespace {

Outcome outcome_of(const Promises& table, const Json& motion) {
  std::string text;
  for (const Json& r : table.rows())
    text += fmt::format("  {:6}  {:48}  {}\n", r.at("kept").get<bool>() ? "kept" : "BROKEN",
                        r.at("promise").get<std::string>(), r.at("value").get<std::string>());
  for (const Json& r : table.measured())
    text += fmt::format("  {:8}{:48}  {}\n", "found", r.at("what").get<std::string>(),
                        r.at("value").get<std::string>());
  if (!motion.is_null())
    text += fmt::format(
        "largest strain {:.3f} ({}), strongest contact {:.1f} N ({})\n",
        motion.at("largest_strain").get<double>(), motion.at("largest_strain_of").get<std::string>(),
        motion.at("largest_contact_force_n").get<double>(), motion.at("contact_between").get<std::string>());
  text += table.all_kept() ? "every promise is kept\n" : "not every promise is kept\n";
  return {table.all_kept() ? exit_done : exit_defect,
          {{"all_kept", table.all_kept()},
           {"promises", table.rows()},
           {"measured", table.measured()},
           {"motion", motion}},
          text};
}

}  // namespace

Outcome verify_plan(const fs::path& folder, const PlanFolder& planned,
                    const std::vector<PreparedBody>& bodies, const fem::World& world,
                    MotionFigures& figures) {
  const NothingToKeep nothing_to_keep;
  Promises table;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const scenes::BodySpec& body = planned.scene.bodies[b];
    check_origin(body.name, origin_of(planned.scene, body, bodies[b]), table);
    check_body(body.name, bodies[b], body_folder(folder, body), table);
  }
  for (const scenes::BodySpec& body : planned.scene.scenery)
    check_origin(body.name, origin_of_scenery(planned.scene, body, folder), table);
  check_plan(folder, planned, bodies, world, figures, table);
  check_pictures(folder, planned, world, figures, table);
  return outcome_of(table, json_of(figures));
}

Outcome verify(const fs::path& folder, const std::optional<fs::path>& observables) {
  if (!fs::is_directory(folder))
    throw InputError(fmt::format("{}: is not a folder; name a work folder of limber", folder.string()));
  if (fs::exists(folder / "plan.npz")) {
    const PlanFolder planned = read_plan_folder(folder);
    const std::vector<PreparedBody> bodies = read_bodies_of(planned, folder);
    const fem::World world = build_world(planned.scene, bodies);
    MotionFigures figures;
    const Outcome outcome = verify_plan(folder, planned, bodies, world, figures);
    if (observables) write_observables(*observables, world, figures);
    return outcome;
  }
  if (fs::exists(folder / "report.json")) {
    if (observables)
      throw InputError(fmt::format(
          "{}: holds no plan, so there is nothing to observe; leave --observables out", folder.string()));
    Promises table;
    check_body("body", read_body(folder), folder, table);
    return outcome_of(table, {});
  }
  throw InputError(
      fmt::format("{}: holds neither plan.npz nor report.json; make them with limber run or limber prepare",
                  folder.string()));
}

}  // namespace limber::app
