// A scene to begin with, from a folder of models in one frame: what a producer of scenes edits further.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "app/commands.h"
#include "core/error.h"
#include "core/log.h"
#include "meshing/import.h"
#include "scenes/models.h"
#include "scenes/scene.h"

namespace limber::app {

namespace {

// What is usual for a part of the body whose name begins so: stiffness of the organ as a whole and colour, as
// anatomical atlases have it. Moduli: order of magnitude of small strain, as in the scenes that come along.
struct Usual {
  const char* name;
  double youngs_modulus_pa, density_kg_m3;
  const char* color;
};
constexpr Usual usual[] = {
    {"heart", 5e3, 1050, "#b0413e"},     {"lung", 1.5e4, 400, "#e0a3a0"},
    {"liver", 1e4, 1050, "#8c4a3a"},     {"kidney", 1e4, 1050, "#8f4b45"},
    {"stomach", 5e3, 1050, "#d9a08a"},   {"spleen", 1e4, 1050, "#7b3f52"},
    {"pancreas", 5e3, 1050, "#e3b778"},  {"trachea", 5e4, 1100, "#cfd8d2"},
    {"diaphragm", 2e4, 1050, "#b5695f"}, {"brain", 3e3, 1040, "#e4b8ab"},
    {"muscle", 2e4, 1060, "#a8453f"},    {"", 1e4, 1000, "#c9a58c"},
};
constexpr const char* bones[] = {"spine", "rib", "skull", "pelvis", "bone", "vertebra", "sternum", "femur"};
constexpr const char* hulls[] = {"skin", "body", "ribcage"};
constexpr const char* endings[] = {".obj", ".off", ".ply", ".stl", ".glb", ".gltf", ".dae", ".fbx"};

template <class Names>
bool begins_with_one_of(const std::string& name, const Names& beginnings) {
  return std::any_of(std::begin(beginnings), std::end(beginnings),
                     [&](const char* beginning) { return name.starts_with(beginning); });
}

const Usual& usual_of(const std::string& name) {
  return *std::find_if(std::begin(usual), std::end(usual),
                       [&](const Usual& u) { return name.starts_with(u.name); });
}

struct Organ {
  std::string name, file;
  Box box;  // metres, in our axes, of its true size
  double volume_m3 = 0;
  bool see_through = false, bone = false;
};

std::vector<Organ> read_organs(const NewSceneOptions& options) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(options.from))
    if (std::count(std::begin(endings), std::end(endings), entry.path().extension().string()) > 0)
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty())
    throw InputError(fmt::format("{}: holds no model ({})", options.from.string(), fmt::join(endings, ", ")));
  std::vector<std::string> names;
  for (const fs::path& file : files) names.push_back(file.stem().string());
  for (const std::string& wanted : options.only)
    if (std::count(names.begin(), names.end(), wanted) == 0)
      throw InputError(fmt::format("--only {}: {} has no such model; there are: {}", wanted,
                                   options.from.string(), fmt::join(names, ", ")));
  std::vector<Organ> organs;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!options.only.empty() && std::count(options.only.begin(), options.only.end(), names[i]) == 0)
      continue;
    log::info("reading {}", files[i].string());
    SurfaceMesh mesh = meshing::import_model(files[i], {}).surface;
    scenes::BodySpec body;
    scenes::FileModel model;
    model.scale = options.scale;
    model.up = scenes::axis_named(options.up), model.front = scenes::axis_named(options.front);
    body.model = model;
    body.pose.anchor = "origin";
    scenes::transform(scenes::world_from_model(body, mesh.positions, false), mesh.positions);
    organs.push_back({.name = names[i],
                      .file = files[i].filename().string(),
                      .box = bounding_box(mesh.positions),
                      .volume_m3 = std::abs(volume(mesh)),
                      .see_through = begins_with_one_of(names[i], hulls),
                      .bone = begins_with_one_of(names[i], bones)});
  }
  return organs;
}

std::string vector_text(const Vec3& v) {
  return fmt::format("[{:.4g}, {:.4g}, {:.4g}]", v.x(), v.y(), v.z());
}

std::string body_text(const Organ& organ, const NewSceneOptions& options) {
  const bool robot = organ.name == options.robot;
  const double scale = options.scale * (organ.see_through ? 1 : options.shrink);
  std::string text = fmt::format("\n[[bodies]]\nname = \"{}\"\nrole = \"{}\"\n", organ.name,
                                 organ.see_through ? "scenery"
                                 : robot           ? "robot"
                                                   : "obstacle");
  if (organ.bone && !organ.see_through) text += "kind = \"rigid\"\n";
  text += fmt::format("model = {{ file = \"{}\", scale = {:g}, up = \"{}\", front = \"{}\" }}\n", organ.file,
                      scale, options.up, options.front);
  text += fmt::format("pose = {{ position_m = {}, anchor = \"center\" }}\n", vector_text(organ.box.center()));
  if (organ.see_through)
    return text + fmt::format("color = \"{}\"\nopacity = {}\n", organ.bone ? "#e8dfc8" : "#e6c3ad",
                              organ.bone ? 0.35 : 0.15);
  text += fmt::format("cage = {{ tets = {} }}\n", organ.bone ? 250 : options.tets);
  if (organ.bone) return text + "color = \"#e8dfc8\"\nroughness = 0.7\n";
  const Usual& u = usual_of(organ.name);
  text += fmt::format(
      "material = {{ youngs_modulus_pa = {:g}, poisson_ratio = 0.45, density_kg_m3 = {:g}, friction = 0.05 "
      "}}\n",
      u.youngs_modulus_pa, u.density_kg_m3);
  text += fmt::format("color = \"{}\"\nroughness = 0.3\n", u.color);
  if (robot) return text;
  const Vec3 half = 0.5 * options.shrink * organ.box.size(), center = organ.box.center();
  const Vec3 lower(center.x() - 2 * half.x(), center.y() - 2 * half.y(), center.z() - 2 * half.z()),
      upper(center.x() - 0.5 * half.x(), center.y() + 2 * half.y(), center.z() + 2 * half.z());
  return text + fmt::format("fixed = [{{ box_m = [{}, {}] }}]   # its back\n", vector_text(lower),
                            vector_text(upper));
}

std::string scene_text(const std::vector<Organ>& organs, const NewSceneOptions& options) {
  const auto robot = std::find_if(organs.begin(), organs.end(),
                                  [&](const Organ& organ) { return organ.name == options.robot; });
  const Vec3 size = options.shrink * robot->box.size(), start = robot->box.center();
  const Vec3 goal = start + Vec3(1.5 * size.x(), 0, 0);
  Box bounds;
  for (const Organ& organ : organs) {
    if (organ.see_through) continue;
    const Vec3 reach = (0.5 * options.shrink * organ.box.size()).array() + 0.5 * size.maxCoeff();
    bounds.include(organ.box.center() - reach), bounds.include(organ.box.center() + reach);
  }
  bounds.include(goal + 1.5 * size), bounds.include(goal - 1.5 * size);
  // At 5 m/s² a body of a metre is pushed for 0.2 to 1 s at a time; times go with the root of the length.
  const double length = size.maxCoeff(), time = std::sqrt(length);
  const double mass = std::pow(options.shrink, 3) * robot->volume_m3 * usual_of(robot->name).density_kg_m3;
  std::string text = fmt::format(
      "# Made by limber scene new. Every organ is {:g} of its true size, about its own middle, so that their "
      "cages do not\n"
      "# overlap at the start: where limber plan says that two do, shrink or move one. Materials are usual "
      "ones; the goal is to\n"
      "# the front. Edit what is to be otherwise: docs/scene.md has all keys.\n"
      "name = \"{}\"\ndescription = \"{} moves to the front among {} organs\"\n\n[world]\nbounds_m = [{}, "
      "{}]\ngravity_m_s2 = [0, 0, 0]\n",
      options.shrink, options.out.stem().string(), robot->name, organs.size() - 1, vector_text(bounds.lower),
      vector_text(bounds.upper));
  for (const Organ& organ : organs) text += body_text(organ, options);
  text +=
      fmt::format("\n[goal]\ncenter_of_mass_m = {}\nradius_m = {:.3g}\n", vector_text(goal), 0.4 * length);
  text += fmt::format(
      "\n[planner]\npreset = \"fast\"\nmax_force_n = {:.2g}\nduration_s = [{:.2g}, {:.2g}]\n"
      "control_point_radius_m = {:.2g}\nsettle_speed_m_s = {:.2g}\n",
      5 * mass, 0.2 * time, time, 0.35 * length, 0.02 * time);
  text += "\n[camera]\ndirection = [1, -0.5, 0.3]\nfov_deg = 24\n";
  text += "\n[[cameras]]\nname = \"side\"\ndirection = [0.1, -1, 0.15]\nfov_deg = 24\n";
  text += fmt::format(
      "\n[[cameras]]\nname = \"follow\"\nfollow = \"{}\"\ndirection = [1, 0.6, 0.25]\nfov_deg = 24\n",
      robot->name);
  text += fmt::format(
      "\n[film]\nframes_per_second = 30\nspeed = {:.2g}   # slow motion: what is small moves "
      "quickly\nbounds_lines = false\nclock = true\ncaption = \"{}\"\n",
      std::clamp(time, 0.05, 1.0), options.out.stem().string());
  return text;
}

}  // namespace

Outcome new_scene(const NewSceneOptions& options) {
  if (fs::exists(options.out))
    throw InputError(
        fmt::format("{}: is there already; choose another name, or remove it", options.out.string()));
  std::vector<Organ> organs = read_organs(options);
  std::vector<std::string> deformable;
  for (Organ& organ : organs) {
    for (const auto& [list, flag] :
         {std::pair(&options.see_through, &organ.see_through), {&options.rigid, &organ.bone}})
      if (std::count(list->begin(), list->end(), organ.name) > 0) *flag = true;
    if (organ.name == options.robot) organ.see_through = organ.bone = false;
    if (!organ.see_through && !organ.bone) deformable.push_back(organ.name);
  }
  if (std::count(deformable.begin(), deformable.end(), options.robot) == 0)
    throw InputError(fmt::format("--robot {}: {} has no such soft body; there are: {}", options.robot,
                                 options.from.string(), fmt::join(deformable, ", ")));
  const std::string text = scene_text(organs, options);
  const scenes::Scene scene = scenes::read_scene(text, options.out.string());
  write_file(options.out, text);
  const std::string next =
      fmt::format("limber run {} --data {} -o DIR", options.out.string(), options.from.string());
  return {exit_done,
          {{"scene", options.out.string()},
           {"bodies", scene.bodies.size()},
           {"scenery", scene.scenery.size()},
           {"next", next}},
          fmt::format("{}: {} bodies, {} seen through; next: {}\n", options.out.string(), scene.bodies.size(),
                      scene.scenery.size(), next)};
}

}  // namespace limber::app
