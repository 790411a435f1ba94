#include <algorithm>
#include <cmath>
#include <set>

#include "core/appearance_file.h"
#include "core/error.h"
#include "core/progress.h"
#include "core/version.h"
#include "limber/detail/exports/motion_files.h"
#include "render/image.h"
#include "render/renderer.h"

namespace limber::detail {

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

class UsdWriter {
 public:
  UsdWriter(const PlannedMotion& motion, const fs::path& path)
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

  Vec3 plain_color(std::size_t b) const {
    return render::linear_from_srgb(motion_.scene.bodies[b].color_srgb);
  }

  // Of faces, or of their corners where these have some.
  void display_colors(std::size_t b) {
    const Appearance& a = appearance_shown(motion_, int(b));
    if (a.empty()) {
      const Vec3 color = plain_color(b);
      add(text_,
          "        color3f[] primvars:displayColor = [({}, {}, {})] (\n            interpolation = "
          "\"constant\"\n        )\n",
          color.x(), color.y(), color.z());
      return;
    }
    const bool of_corners = a.colors.rows() > 0;
    add(text_, "        color3f[] primvars:displayColor = [");
    for (std::size_t t = 0; t < a.material_from_triangle.size(); ++t) {
      const int m = a.material_from_triangle[t];
      for (int c = 0; c < (of_corners ? 3 : 1); ++c) {
        Vec3 color = m < 0 ? plain_color(b) : a.materials[std::size_t(m)].color;
        if (of_corners && m >= 0)
          color = color.cwiseProduct(a.colors.row(3 * Eigen::Index(t) + c).transpose());
        add(text_, "{}({:.6g},{:.6g},{:.6g})", t + std::size_t(c) ? "," : "", color.x(), color.y(),
            color.z());
      }
    }
    add(text_, "] (\n            interpolation = \"{}\"\n        )\n",
        of_corners ? "faceVarying" : "uniform");
  }

  void coordinates(std::size_t b) {
    const Uvs& uv = appearance_shown(motion_, int(b)).uv;
    if (uv.rows() == 0) return;
    add(text_, "        texCoord2f[] primvars:st = [");
    for (Eigen::Index i = 0; i < uv.rows(); ++i)
      add(text_, "{}({:.9g},{:.9g})", i ? "," : "", uv(i, 0), uv(i, 1));
    add(text_, "] (\n            interpolation = \"faceVarying\"\n        )\n");
  }

  std::string material_name(std::size_t b, std::size_t material) const {
    return fmt::format("{}__{}", names_[b], material);
  }

  // Faces that no material is bound to show displayColor: of a body with colors of corners all but those with
  // an image. Readers of such colors are part of USD's preview surface, but not all programs know them.
  bool colors_alone(const Appearance& a, int material) const {
    return a.colors.rows() > 0 && (material < 0 || (a.materials[std::size_t(material)].image < 0 &&
                                                    a.materials[std::size_t(material)].normal_image < 0));
  }

  // The faces of each material; what is in none has that of the whole mesh.
  void subsets(std::size_t b) {
    const Appearance& a = appearance_shown(motion_, int(b));
    if (!a.empty())
      add(text_, "        uniform token subsetFamily:materialBind:familyType = \"nonOverlapping\"\n");
    for (int m = 0; m < int(a.materials.size()); ++m) {
      if (colors_alone(a, m)) continue;
      add(text_,
          "\n        def GeomSubset \"material_{}\" (\n            prepend apiSchemas = "
          "[\"MaterialBindingAPI\"]\n        )\n        {{\n"
          "            uniform token elementType = \"face\"\n"
          "            uniform token familyName = \"materialBind\"\n"
          "            rel material:binding = </limber/materials/{}>\n            int[] indices = [",
          m, material_name(b, std::size_t(m)));
      bool first = true;
      for (std::size_t t = 0; t < a.material_from_triangle.size(); ++t)
        if (a.material_from_triangle[t] == m) add(text_, "{}{}", first ? "" : ",", t), first = false;
      add(text_, "]\n        }}\n");
    }
  }

  void mesh(std::size_t b) {
    const SurfaceMesh& surface = motion_.bodies[b].surface;
    add(text_,
        "    def Mesh \"{}\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {{\n"
        "        uniform token subdivisionScheme = \"none\"\n"
        "        uniform bool doubleSided = 1\n",
        names_[b]);
    if (!colors_alone(appearance_shown(motion_, int(b)), -1))
      add(text_, "        rel material:binding = </limber/materials/{}>\n", names_[b]);
    display_colors(b);
    coordinates(b);
    add(text_, "        int[] faceVertexCounts = [");
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
    subsets(b);
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
    for (std::size_t b = 0; b < names_.size(); ++b) {
      const Vec3 color = plain_color(b);
      const Appearance& a = appearance_shown(motion_, int(b));
      if (!colors_alone(a, -1))
        material(names_[b],
                 fmt::format("inputs:diffuseColor = ({}, {}, {})", color.x(), color.y(), color.z()), "", "");
      for (std::size_t m = 0; m < a.materials.size(); ++m)
        if (!colors_alone(a, int(m))) own_material(b, m);
    }
    add(text_, "    }}\n");
  }

  // `color` and `normal`: lines of the preview surface; `shaders`: what they are connected with.
  void material(const std::string& name, const std::string& color, const std::string& normal,
                const std::string& shaders) {
    const render::MeshLook look;
    add(text_,
        "        def Material \"{0}\"\n        {{\n"
        "            token outputs:surface.connect = </limber/materials/{0}/shader.outputs:surface>\n"
        "            def Shader \"shader\"\n            {{\n"
        "                uniform token info:id = \"UsdPreviewSurface\"\n"
        "                color3f {1}\n"
        "{2}"
        "                float inputs:metallic = {3}\n"
        "                float inputs:roughness = {4}\n"
        "                token outputs:surface\n            }}\n{5}        }}\n",
        name, color, normal, look.metallic, look.roughness, shaders);
  }

  // A preview surface cannot multiply an image by the corners' colors: it has the image.
  void own_material(std::size_t b, std::size_t m) {
    const Appearance& a = appearance_shown(motion_, int(b));
    const SurfaceMaterial& own = a.materials[m];
    const std::string name = material_name(b, m), path = "/limber/materials/" + name;
    std::string shaders, normal,
        color =
            fmt::format("inputs:diffuseColor = ({}, {}, {})", own.color.x(), own.color.y(), own.color.z());
    const auto texture = [&](const char* shader, int image, const char* space, const std::string& scale) {
      shaders += fmt::format(
          "            def Shader \"{}\"\n            {{\n"
          "                uniform token info:id = \"UsdUVTexture\"\n"
          "                asset inputs:file = @./textures/{}@\n"
          "                float2 inputs:st.connect = <{}/coordinates.outputs:result>\n"
          "                token inputs:wrapS = \"repeat\"\n                token inputs:wrapT = \"repeat\"\n"
          "                token inputs:sourceColorSpace = \"{}\"\n{}"
          "                float3 outputs:rgb\n            }}\n",
          shader, image_name(b, image), path, space, scale);
    };
    if (own.image >= 0 || own.normal_image >= 0)
      shaders =
          "            def Shader \"coordinates\"\n            {\n"
          "                uniform token info:id = \"UsdPrimvarReader_float2\"\n"
          "                string inputs:varname = \"st\"\n"
          "                float2 outputs:result\n            }\n";
    if (own.image >= 0) {
      texture("image", own.image, "sRGB",
              fmt::format("                float4 inputs:scale = ({}, {}, {}, 1)\n", own.color.x(),
                          own.color.y(), own.color.z()));
      color = fmt::format("inputs:diffuseColor.connect = <{}/image.outputs:rgb>", path);
    }
    if (own.normal_image >= 0) {
      texture("normals", own.normal_image, "raw",
              "                float4 inputs:scale = (2, 2, 2, 1)\n"
              "                float4 inputs:bias = (-1, -1, -1, 0)\n");
      normal =
          fmt::format("                normal3f inputs:normal.connect = <{}/normals.outputs:rgb>\n", path);
    }
    material(name, color, normal, shaders);
  }

  std::string image_name(std::size_t b, int image) const {
    return names_[b] + "-" + name_of_image_file(appearance_shown(motion_, int(b)), std::size_t(image));
  }

 public:
  // Their sizes are added to what is written.
  void write_images(const fs::path& folder, WrittenFiles& written) const {
    for (std::size_t b = 0; b < names_.size(); ++b) {
      const std::vector<ImageFile>& images = appearance_shown(motion_, int(b)).images;
      if (!images.empty()) make_folder(folder);
      for (std::size_t i = 0; i < images.size(); ++i) {
        write_file(folder / image_name(b, int(i)), images[i].bytes);
        ++written.files, written.bytes += images[i].bytes.size();
      }
    }
  }

 private:
  const PlannedMotion& motion_;
  int decimals_;
  std::vector<std::string> names_;
  FileWriter file_;
  Text text_;
};

}  // namespace

WrittenFiles write_usd(const PlannedMotion& motion, const fs::path& folder) {
  const fs::path path = folder / "motion.usda";
  UsdWriter writer(motion, path);
  WrittenFiles written{path, 1, 0};
  writer.write_images(folder / "textures", written);
  written.bytes += writer.write();
  return written;
}

}  // namespace limber::detail
