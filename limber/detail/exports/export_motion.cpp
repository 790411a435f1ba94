#include "limber/detail/exports/export_motion.h"

#include <algorithm>
#include <set>

#include "core/hash.h"
#include "core/json_fields.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/temporary_files.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/plan/exported_files.h"
#include "limber/detail/plan/manifest.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"

namespace limber::detail {

namespace {

// The one that may refuse the frames comes first.
constexpr std::pair<const char*, WrittenFiles (*)(const PlannedMotion&, const fs::path&)> writers[] = {
    {"pc2", write_point_caches}, {"gltf", write_gltf}, {"usd", write_usd}, {"vtu", write_vtu_series}};

}  // namespace

Points surface_at(const PlannedMotion& motion, int body, int frame) {
  return surface_at(motion.world, motion.bodies[std::size_t(body)], motion.frames[std::size_t(frame)], body);
}

const Appearance& appearance_shown(const PlannedMotion& motion, int body) {
  static const Appearance none;
  const auto b = std::size_t(body);
  return motion.scene.bodies[b].texture ? motion.bodies[b].appearance : none;
}

std::vector<fs::path> exported_files(const fs::path& folder) {
  std::vector<fs::path> files;
  const auto add = [&](const fs::path& where, const auto& is_ours) {
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(where, none))
      if (entry.is_regular_file() && is_ours(entry.path())) files.push_back(entry.path());
  };
  const auto is = [](std::set<std::string> names) {
    return [names](const fs::path& file) { return names.contains(file.filename().string()); };
  };
  add(folder, is({"motion.glb", "motion.usda"}));
  add(folder / "textures", [](const fs::path& file) {
    return file.stem().string().find("-image-") != std::string::npos &&
           (file.extension() == ".png" || file.extension() == ".jpg");
  });
  add(folder / "pc2", [](const fs::path& file) { return file.extension() == ".pc2"; });
  for (const fs::path& cache : std::vector<fs::path>(files))
    if (cache.extension() == ".pc2") files.push_back(fs::path(cache).replace_extension(".obj"));
  add(folder / "pc2", is({"load_in_blender.py", "README.txt"}));
  add(folder / "vtu", is({"cages.pvd", "surfaces.pvd"}));
  for (const char* series : {"cages", "surfaces"})
    add(folder / "vtu" / series, [](const fs::path& file) {
      const std::string stem = file.stem().string();
      return file.extension() == ".vtu" && stem.find_first_not_of("0123456789") == stem.npos;
    });
  std::sort(files.begin(), files.end());
  return files;
}

ExportedMotion export_motion(const ExportOptions& options) {
  const PlanFolder planned = read_plan_folder(options.folder);
  const auto [bodies, world] = read_world_of(planned, options.folder);
  const plan::Trajectory& path = planned.plan.trajectory;
  const int count = int(path.frames.size());
  std::int64_t left_out = 0;
  const PlannedMotion motion{planned.scene,
                             bodies,
                             world,
                             path.frames,
                             path.frames_per_second,
                             parse_frames(options.frames, count, &left_out)};
  if (left_out > 0)
    log::warn("frames {}: {} frames beyond the last, {}, are left out", options.frames, left_out, count - 1);
  const fs::path out = options.out.value_or(options.folder / "export");
  const bool recorded = can_update_manifest(options.folder);
  if (!recorded)
    log::warn("{}: cannot be written into, so its manifest.json will not tell of this export",
              options.folder.string());
  make_folder(out);
  const FolderLock lock(out, FolderLock::alone);
  remove_abandoned(out);

  ExportedMotion exported{.frames = motion.wanted,
                          .frames_of_motion = count,
                          .trajectory_hash = hex(plan::hash_of(path)),
                          .folder = out};
  for (const auto& [format, write] : writers)
    if (std::find(options.formats.begin(), options.formats.end(), format) != options.formats.end())
      exported.formats.emplace_back(format, write(motion, out));
  for (const scenes::BodySpec& body : planned.scene.bodies)
    exported.bodies.emplace_back(body.name,
                                 body.deformation == scenes::Deformation::phong ? "phong" : "linear");
  if (recorded) update_manifest(options.folder, "export", json_of_fields(exported));
  return exported;
}

}  // namespace limber::detail
