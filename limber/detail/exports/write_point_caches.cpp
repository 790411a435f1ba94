#include "core/error.h"
#include "core/json.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "limber/detail/exports/motion_files.h"
#include "render/image.h"

namespace limber::detail {

namespace {

// The step from one frame to the next; a cache has no times of its own.
int even_step(const std::vector<int>& frames) {
  const int step = frames.size() < 2 ? 1 : frames[1] - frames[0];
  for (std::size_t i = 1; i < frames.size(); ++i)
    if (frames[i] - frames[i - 1] != step)
      throw InputError(
          fmt::format("frames: a point cache has frames evenly apart, but {} follows {} where the first "
                      "step is {}; choose a single range such as {}-{}:{}",
                      frames[i], frames[i - 1], step, frames.front(), frames.back(), step));
  return step;
}

// Autodesk's PC2: a head of 32 bytes, then the points of one frame after the other as float32.
std::uintmax_t write_pc2(const PlannedMotion& motion, int body, const fs::path& path) {
  FileWriter file(path);
  const auto number = [&](auto n) { file.append({reinterpret_cast<const char*>(&n), sizeof n}); };
  file.append(std::string_view("POINTCACHE2\0", 12));
  number(std::int32_t(1));  // version
  number(std::int32_t(motion.bodies[std::size_t(body)].surface.positions.rows()));
  number(0.0f);  // the frame of the first sample
  number(1.0f);  // frames from one to the next
  number(std::int32_t(motion.wanted.size()));
  for (const int f : motion.wanted) {
    throw_if_stopped();
    const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> points =
        surface_at(motion, body, f).cast<float>();
    file.append({reinterpret_cast<const char*>(points.data()), sizeof(float) * std::size_t(points.size())});
  }
  file.commit();
  return file.size();
}

constexpr const char* loader =
    R"(# blender --python load_in_blender.py: the motion as meshes with Mesh Cache modifiers, first frame = 1.
import os
import bpy

frames_per_second, frames = {fps}, {frames}
bodies = {bodies}

folder = os.path.dirname(os.path.abspath(__file__))
if not bpy.data.filepath and "Cube" in bpy.data.objects:  # of Blender's own empty start, never of a file
    bpy.data.objects.remove(bpy.data.objects["Cube"])
for body in bodies:
    bpy.ops.wm.obj_import(filepath=os.path.join(folder, body["name"] + ".obj"), forward_axis="Y", up_axis="Z")
    shape = bpy.context.selected_objects[0]
    shape.name = body["name"]
    for polygon in shape.data.polygons:
        polygon.use_smooth = True
    material = bpy.data.materials.new(body["name"])
    material.diffuse_color = body["color"]
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = body["color"]
    shape.data.materials.clear()
    shape.data.materials.append(material)
    if body["moves"]:
        cache = shape.modifiers.new("limber", "MESH_CACHE")
        cache.cache_format = "PC2"
        cache.filepath = os.path.join(folder, body["name"] + ".pc2")
        cache.forward_axis, cache.up_axis = "POS_Y", "POS_Z"
        cache.frame_start = 1
scene = bpy.context.scene
scene.frame_start, scene.frame_end = 1, frames
scene.render.fps, scene.render.fps_base = round(frames_per_second), round(frames_per_second) / frames_per_second
scene.frame_set(1)
)";

constexpr const char* readme =
    R"(A planned motion as OBJ meshes and PC2 point caches: metres, z up, {fps} frames a second, {frames} frames.

    blender --python load_in_blender.py

loads all of it. By hand: import each NAME.obj with Forward Axis Y and Up Axis Z (the default would turn it), which keeps the
order of its vertices; give it a Mesh Cache modifier with Format PC2, File Path NAME.pc2, Forward Y and Up Z, Frame Start 1.
A body without a .pc2 stands still.
)";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  LIMBER_CHECK(at != text.npos, what);
  return text.replace(at, what.size(), by);
}

}  // namespace

WrittenFiles write_point_caches(const PlannedMotion& motion, const fs::path& out) {
  const double frames_per_second = motion.frames_per_second / even_step(motion.wanted);
  const fs::path folder = out / "pc2";
  make_folder(folder);
  WrittenFiles written{folder / "load_in_blender.py", 0, 0};
  const auto count = [&](std::uintmax_t bytes) { ++written.files, written.bytes += bytes; };
  Json bodies = Json::array();
  for (std::size_t b = 0; b < motion.bodies.size(); ++b) {
    const std::string& name = motion.scene.bodies[b].name;
    const Vec3 color = render::linear_from_srgb(motion.scene.bodies[b].color_srgb);
    const bool moves = motion.world.bodies[b].moving;
    bodies.push_back(
        {{"name", name}, {"moves", int(moves)}, {"color", {color.x(), color.y(), color.z(), 1}}});
    write_obj(folder / (name + ".obj"), motion.bodies[b].surface);
    count(fs::file_size(folder / (name + ".obj")));
    if (moves) count(write_pc2(motion, int(b), folder / (name + ".pc2")));
  }
  const auto filled = [&](const char* text) {
    return replaced(replaced(text, "{fps}", fmt::format("{:g}", frames_per_second)), "{frames}",
                    std::to_string(motion.wanted.size()));
  };
  const std::string script = replaced(filled(loader), "{bodies}", bodies.dump()), words = filled(readme);
  write_file(written.open, script), count(script.size());
  write_file(folder / "README.txt", words), count(words.size());
  return written;
}

}  // namespace limber::detail
