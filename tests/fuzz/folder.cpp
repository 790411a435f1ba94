#include "tests/fuzz/folder.h"

#include <fstream>

#include "cli/commands.h"
#include "core/contact_shape_file.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "core/words.h"
#include "ffd/binding_file.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "meshing/contact_shape.h"
#include "plan/plan_file.h"
#include "tests/core/temporary_folder.h"
#include "tests/fuzz/edits.h"

namespace limber::fuzz {

namespace {

constexpr const char* scene_text = R"(name = "tiny"
[world]
bounds_m = [[0, 0, 0], [3, 2, 2]]
gravity_m_s2 = [0, 0, -1]
[[bodies]]
name = "robot"
role = "robot"
model = { box = { size_m = [0.5, 0.5, 0.5], triangle_m = 0.25 } }
cage = { cells = [1, 1, 1], shells = 2 }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [0.6, 1, 0.3] }
[[bodies]]
name = "block"
role = "obstacle"
model = { box = { size_m = [0.4, 1, 0.4], triangle_m = 0.2 } }
cage = { cells = [1, 1, 1], shells = 2 }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [1.5, 1, 0.2] }
fixed = "walls"
[[bodies]]
name = "sign"
role = "scenery"
model = { box = { size_m = [0.2, 0.2, 0.2], triangle_m = 0.2 } }
pose = { position_m = [2.5, 1.7, 1] }
[[via]]
center_of_mass_m = [0.8, 1, 0.4]
radius_m = 0.15
[goal]
center_of_mass_m = [1, 1, 0.5]
radius_m = 0.2
[planner]
preset = "fast"
iterations = 40
max_force_n = 60
settle_time_s = 0
[film]
size_px = [32, 32]
frames_per_second = 10
sheet = [2, 1]
)";

struct BodyFiles {
  std::string name, shells;
  detail::PreparedBody body;
};

// What a run that went well left, in memory.
struct Good {
  Good() {
    log::set_up(-1);
    set_progress_enabled(false);
    std::ofstream(scene_file) << scene_text;
    const scenes::Scene scene = scenes::read_scene_file(scene_file);
    detail::prepare_bodies(scene, {}, work);
    for (const scenes::BodySpec& spec : scene.bodies) {
      const std::string& name = spec.name;
      const detail::PreparedBody prepared = detail::read_body(work / "bodies" / name);
      bodies.push_back({name, read_file(work / "bodies" / name / "shells.obj"), prepared});
      // Of a field for show a thousandth will do.
      bodies.back().body.contact = meshing::make_contact_shape(
          prepared.surface, prepared.cage, {.cells = 8, .max_cells = 8, .max_nodes = 1000});
      write_body(bodies.back());
    }
    PlanOptions options;
    options.scene.scene = scene_file.string(), options.out = work;
    plan_scene(options, at_terminal());
    planned = plan::read_plan(work / "plan.npz");
    manifest = read_json(work / "manifest.json");
    for (const char* file : {"sign.ply", "sign.json"}) scenery[file] = read_file(work / "scenery" / file);
  }

  fs::path write_body(const BodyFiles& one) const {
    const fs::path folder = work / "bodies" / one.name;
    make_folder(folder);
    const detail::PreparedBody& b = one.body;
    write_ply(folder / "surface.ply", b.surface);
    write_file(folder / "shells.obj", one.shells);
    write_msh(folder / "cage.msh", b.cage, b.shell_from_tet);
    ffd::write_binding(folder / "binding.npz", b.binding, b.surface, b.cage);
    write_contact_shape(folder / "contact.npz", b.contact, b.surface, b.cage);
    write_report(folder, b.report.json);
    return folder;
  }

  static void write_report(const fs::path& folder, Json report) {
    const bool has_files = report.is_object() && report.value("files", Json::object()).is_object();
    for (const char* name : {"surface.ply", "shells.obj", "cage.msh", "binding.npz", "contact.npz"})
      if (has_files) report["files"][name] = hex(hash_of(std::string_view(read_file(folder / name))));
    write_json(folder / "report.json", report);
  }

  TemporaryFolder root;
  const fs::path work = root / "work", scene_file = root / "scene.toml";
  std::vector<BodyFiles> bodies;
  plan::PlanFile planned;
  Json manifest;
  std::map<std::string, std::string> scenery;
};

const Good& good() {
  static const Good made;
  return made;
}

void write_folder() {
  const fs::path& work = good().work;
  fs::remove_all(work);
  for (const BodyFiles& body : good().bodies) good().write_body(body);
  make_folder(work / "scenery");
  for (const auto& [name, bytes] : good().scenery) write_file(work / "scenery" / name, bytes);
  write_json(work / "manifest.json", good().manifest);
  plan::write_plan(work / "plan.npz", good().planned.plan, good().planned.given);
}

void change_npz(const fs::path& path, Script& script) {
  Npz file = read_npz(path);
  edit(file, script);
  write_npz(path, file);
}

// One of its files, and its report so that it fits, or that alone.
void change_body(Json& given, Script& script) {
  BodyFiles one = good().bodies[std::size_t(script.below(int(good().bodies.size())))];
  detail::PreparedBody& body = one.body;
  const int file = script.below(6);
  if (file == 0) edit(body.surface, script);
  if (file == 1) edit(body.cage, body.shell_from_tet, script);
  if (file == 2) one.shells = edited(one.shells, script);
  if (file == 3) edit(body.report.json, script);
  const fs::path folder = good().write_body(one);
  if (file == 4) change_npz(folder / "binding.npz", script);
  if (file == 5) change_npz(folder / "contact.npz", script);
  if (file >= 4) good().write_report(folder, body.report.json);
  given["cage_hashes"][one.name] = hex(hash_of(body.cage));
}

void change_folder(Script& script) {
  plan::PlanFile planned = good().planned;
  switch (script.below(8)) {
    case 0:
    case 1:
      edit(planned.plan, script);
      break;
    case 2:
      for (const std::string& set : scene_edits({"robot", "block", "sign"}, script))
        if (is_utf8(set)) planned.given["sets"].push_back(set);
      break;
    case 3:
      edit(planned.given, script);
      break;
    case 4: {
      Json manifest = good().manifest;
      edit(manifest, script);
      write_file(good().work / "manifest.json", manifest.dump(1, ' ', false, Json::error_handler_t::replace));
      break;
    }
    case 5: {
      const auto one = std::next(good().scenery.begin(), script.below(2));
      write_file(good().work / "scenery" / one->first, edited(one->second, script));
      break;
    }
    default:
      change_body(planned.given, script);
  }
  plan::write_plan(good().work / "plan.npz", planned.plan, planned.given);
}

}  // namespace

void meet_changed_folder(std::string_view bytes) {
  Script script(bytes);
  const fs::path& work = good().work;
  write_folder();
  const int command = script.below(8);
  change_folder(script);
  detail::read_manifest(work);
  const detail::PlanFolder planned = detail::read_plan_folder(work);
  if (command == 0) {
    cli::info(work), cli::info(work / "bodies" / "robot"), cli::info(work / "bodies" / "block");
    return;
  }
  if (command < 5) {
    ExportOptions options;
    options.folder = work, options.formats = {motion_formats[std::size_t(command - 1)]};
    limber::export_motion(options, at_terminal());
  } else if (command == 5) {
    render_film(work, {.frames = "0-0", .size = "32x32"}, at_terminal());
  } else if (command == 6) {
    test_robustness({.folder = work, .perturbations = 1}, at_terminal());
  } else {
    const std::vector<detail::PreparedBody> bodies = detail::read_world_of(planned, work).bodies;
    const fem::World world = detail::build_world(planned.scene, bodies);
    const detail::FemSystem system(world, detail::goal_rules_of(planned.scene));
    const detail::MotionFigures figures = detail::measure_motion(world, bodies, planned.plan.trajectory);
    detail::facts_of(planned.plan, world, system, figures);
    detail::pictures_of(planned.scene, world, planned.plan, figures);
    plan::explain(planned.plan);
  }
}

}  // namespace limber::fuzz
