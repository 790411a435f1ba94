#include <algorithm>
#include <cmath>
#include <set>

#include "app/motion_files.h"
#include "core/error.h"
#include "core/progress.h"
#include "core/version.h"
#include "render/image.h"
#include "render/renderer.h"

namespace limber::app {

namespace {

using Text = fmt::memory_buffer;

template <class... Arguments>
void add(Text& text, fmt::format_string<Arguments...> form, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(text), form, std::forward<Arguments>(arguments)...);
}

// USD's names have no '-' and do not begin with a digit.
std::vector<std::string> prim_names(const scenes::Scene& scene) {
  std::vector<std::string> names;
  std::set<std::string> taken{"materials"};
  for (const scenes::BodySpec& body : scene.bodies) {
    std::string name = body.name;
    std::replace(name.begin(), name.end(), '-', '_');
    if (std::isdigit(static_cast<unsigned char>(name.front()))) name.insert(name.begin(), '_');
    while (!taken.insert(name).second) name += "_";
    names.push_back(name);
  }
  return names;
}

// As many as tell a millionth of the scene's diagonal.
int decimals_of(const PlannedMotion& motion) {
  return std::max(0, int(std::ceil(6 - std::log10(motion.world.bounds_m.diagonal()))));
}

void add_points(Text& text, const Points& points, int decimals) {
  text.push_back('[');
  for (Eigen::Index v = 0; v < points.rows(); ++v)
    add(text, "{}({:.{}f},{:.{}f},{:.{}f})", v ? "," : "", points(v, 0), decimals, points(v, 1), decimals,
        points(v, 2), decimals);
  text.push_back(']');
}

void add_extent(Text& text, const Points& points, int decimals) {
  const Box box = bounding_box(points);
  Points corners(2, 3);
  corners << box.lower.transpose(), box.upper.transpose();
  add_points(text, corners, decimals);
}

class Writer {
 public:
  Writer(const PlannedMotion& motion, const fs::path& path)
      : motion_(motion), decimals_(decimals_of(motion)), names_(prim_names(motion.scene)), file_(path) {}

  std::uintmax_t write() {
    add(text_,
        "#usda 1.0\n(\n    defaultPrim = \"limber\"\n    doc = \"made by limber {}\"\n"
        "    metersPerUnit = 1\n    upAxis = \"Z\"\n    startTimeCode = {}\n    endTimeCode = {}\n"
        "    timeCodesPerSecond = {}\n    framesPerSecond = {}\n)\n\ndef Xform \"limber\" (\n    kind = "
        "\"group\"\n)\n{{\n",
        version, motion_.wanted.front(), motion_.wanted.back(), motion_.frames_per_second,
        motion_.frames_per_second);
    for (std::size_t b = 0; b < motion_.bodies.size(); ++b) mesh(b);
    materials();
    add(text_, "}}\n");
    flush();
    file_.commit();
    return file_.size();
  }

 private:
  void flush() {
    file_.append({text_.data(), text_.size()});
    text_.clear();
  }

  void mesh(std::size_t b) {
    const SurfaceMesh& surface = motion_.bodies[b].surface;
    const Vec3 color = render::linear_from_srgb(motion_.scene.bodies[b].color_srgb);
    add(text_,
        "    def Mesh \"{}\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {{\n"
        "        uniform token subdivisionScheme = \"none\"\n"
        "        uniform bool doubleSided = 1\n"
        "        rel material:binding = </limber/materials/{}>\n"
        "        color3f[] primvars:displayColor = [({}, {}, {})] (\n            interpolation = "
        "\"constant\"\n        )\n"
        "        int[] faceVertexCounts = [",
        names_[b], names_[b], color.x(), color.y(), color.z());
    for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) add(text_, "{}3", t ? "," : "");
    add(text_, "]\n        int[] faceVertexIndices = [");
    for (Eigen::Index i = 0; i < surface.triangles.size(); ++i)
      add(text_, "{}{}", i ? "," : "", surface.triangles.data()[i]);
    add(text_, "]\n");
    if (motion_.world.bodies[b].moving) {
      samples(b, "float3[] extent", add_extent);
      samples(b, "point3f[] points", add_points);
    } else {
      add(text_, "        float3[] extent = "), add_extent(text_, surface.positions, decimals_);
      add(text_, "\n        point3f[] points = "), add_points(text_, surface.positions, decimals_);
      add(text_, "\n");
    }
    add(text_, "    }}\n\n");
    flush();
  }

  void samples(std::size_t b, const char* attribute, void (*add_value)(Text&, const Points&, int)) {
    add(text_, "        {}.timeSamples = {{\n", attribute);
    for (const int f : motion_.wanted) {
      throw_if_stopped();
      add(text_, "            {}: ", f);
      add_value(text_, surface_at(motion_, int(b), f), decimals_);
      add(text_, ",\n");
      flush();
    }
    add(text_, "        }}\n");
  }

  // displayColor alone is shown by few; a preview surface by nearly all.
  void materials() {
    add(text_, "    def Scope \"materials\"\n    {{\n");
    const render::MeshLook look;
    for (std::size_t b = 0; b < names_.size(); ++b) {
      const Vec3 color = render::linear_from_srgb(motion_.scene.bodies[b].color_srgb);
      add(text_,
          "        def Material \"{0}\"\n        {{\n"
          "            token outputs:surface.connect = </limber/materials/{0}/shader.outputs:surface>\n"
          "            def Shader \"shader\"\n            {{\n"
          "                uniform token info:id = \"UsdPreviewSurface\"\n"
          "                color3f inputs:diffuseColor = ({1}, {2}, {3})\n"
          "                float inputs:metallic = {4}\n"
          "                float inputs:roughness = {5}\n"
          "                token outputs:surface\n            }}\n        }}\n",
          names_[b], color.x(), color.y(), color.z(), look.metallic, look.roughness);
    }
    add(text_, "    }}\n");
  }

  const PlannedMotion& motion_;
  int decimals_;
  std::vector<std::string> names_;
  FileWriter file_;
  Text text_;
};

}  // namespace

WrittenFiles write_usd(const PlannedMotion& motion, const fs::path& folder) {
  const fs::path path = folder / "motion.usda";
  return {path, 1, Writer(motion, path).write()};
}

}  // namespace limber::app
