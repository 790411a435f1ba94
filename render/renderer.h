// Draws deforming meshes offscreen: a key light with shadow, sky, rim, and a ground that catches shadows and
// fades out. Needs no display and no X. Method, figures and traps: docs/rendering.md.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/appearance.h"
#include "core/mesh.h"
#include "render/camera.h"
#include "render/image.h"

namespace limber::render {

// Holds for every picture of a renderer. Colours are sRGB, 0 … 1 a channel.
struct RenderSettings {
  int width = 1920, height = 1080;  // pixels, 1 … 8192
  int supersampling = 2;            // samples a pixel are this squared; 1 … 4
  bool tiles = true;                // bodies are drawn on the CPU where that can be, else by OpenGL
  // 4 samples a pixel that share one shading (MSAA); supersampling then counts for nothing. Not faster where
  // triangles are about as small as pixels: see docs/rendering.md.
  bool multisampling = false;
  // Where a ground is seen, overhead and at the horizon; else at the top and the bottom of the picture.
  Vec3 background_top_srgb = {0.80, 0.84, 0.88};
  Vec3 background_bottom_srgb = {0.93, 0.94, 0.95};
  Vec3 ground_srgb = {0.93, 0.935, 0.94};  // round the stage, where nothing shades it
  std::optional<Vec3> far_ground_srgb;     // away from it, before the haze of the horizon; else the horizon's
  std::optional<double> ground_height_m;   // along up; none: no ground
  Vec3 up = {0, 0, 1};
  Vec3 toward_key = {-0.8, -0.35, 1.0};  // towards the key light, above the horizon
  double key_size_deg = 7;  // half angle the key light is seen under: softness of shadows, 0 … 30
  // Linear: what a white, matt surface square to the light sends, 0 … 4. A warm key and a cool sky part them.
  Vec3 key_light = {0.80, 0.78, 0.75}, sky_light = {0.42, 0.445, 0.48};
  // The box over the whole motion. Shadow maps and the ground's fade are laid out for it, so nothing swims
  // from frame to frame. Empty: laid out anew for what each frame shows.
  Box stage;
  // The picture holds the bodies, lines and the shadows on the ground alone, to be put over another: see
  // Image.
  bool transparent_background = false;
};

struct LineLook {
  Vec3 color_srgb = {0.55, 0.6, 0.66};
  double width_px = 1.5;  // pixels of the finished picture
  double opacity = 0.8;
};

struct MeshLook {
  std::string name = {};  // for messages
  Vec3 color_srgb = {0.75, 0.75, 0.75};
  double roughness = 0.45;  // 0.05 … 1
  double metallic = 0;      // 0 … 1
  // Of each layer that a ray meets. Shadows on the ground are as faint; below 0.5 it casts none on bodies.
  double opacity = 1;
  // Opacity is that of a thin sheet seen face on; slanting, a ray stays in it longer: 1 − (1 − opacity)^(1 /
  // cos).
  bool sheet = false;
  // Light that enters and comes out elsewhere: round the edge of the unlit side, and through thin parts.
  double translucency = 0;  // 0 … 1
  double scatter_m =
      0.03;  // > 0; behind so much of the material 1/e of that light is left, less of the colours it lacks
  double sheen = 0;  // 0 … 1; fibres that light up towards grazing angles
  // A fine relief that goes with the mesh: a function of the place at rest.
  double grain = 0;       // 0 … 1; its slope
  double grain_m = 0.01;  // > 0; its wavelength at rest; what is finer than a sample fades out
  bool woven = false;     // threads that cross, instead of irregular
  // Edges sharper than this at rest are drawn sharp; 180: all smooth.
  double crease_angle_deg = 50;
  // A coarse closed mesh that is not seen may cast the shadows of a fine one within it that casts none: only
  // its faces turned from the light do, so that it does not shade what it encloses.
  bool seen = true;
  bool casts_shadow = true;
  std::optional<LineLook> edges = {};  // drawn over the surface; what hides the surface hides them
};

// A plane n·p + d = 0 as (n, d).
using Plane = Eigen::Vector4d;
constexpr int max_clip_planes = 6;

// What the picture shows, apart from how it looks: of each pixel the sample nearest to the eye. Of opaque
// meshes only; ground, lines and transparent surfaces are left out. Row 0 is the top.
struct Passes {
  int width = 0, height = 0;
  std::vector<float> depth_m;  // along the view axis; infinity where there is nothing
  std::vector<float>
      normal;  // (height × width × 3), world axes, towards the eye; zero where there is nothing
  std::vector<int> object;    // number of the mesh; −1 where there is nothing
  std::vector<float> scalar;  // set_scalars, 0 for meshes without; NaN where there is nothing
};

// The 12 edges, (24 × 3): edge i runs from row 2i to row 2i + 1.
Points edges_of(const Box&);

// CPU seconds of the process, stage by stage.
struct StageTimes {
  double shadow_map_s = 0, ground_s = 0, opaque_s = 0, lines_s = 0, transparent_s = 0, finish_s = 0;
};

// One drawing context. A renderer stays in the thread that makes it; several work in several threads.
class Renderer {
 public:
  // Throws InputError when a field of RenderSettings is out of its range.
  explicit Renderer(const RenderSettings&);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Returns the mesh's number. It is shown at rest until set_positions. Throws InputError on a bad mesh or
  // look.
  // `appearance` takes the place of the look's color, but for triangles without a material; `images` are its
  // own, decoded.
  int add_mesh(const Triangles&, const Points& rest_positions, const MeshLook&,
               const Appearance& appearance = {},
               const std::vector<std::shared_ptr<const Image8>>& images = {});
  // normals (V × 3) are unit vectors, or empty: then computed. At creases they are always computed.
  void set_positions(int mesh, const Points& positions, const Points& normals = {});

  // One colour a vertex (V × 3, sRGB), in linear light in between; empty: the look's colour again.
  // Not of a mesh with an appearance.
  void set_colors(int mesh, const Points& colors_srgb);
  // The share of the sky that each vertex does not see, 0 … 1, as occlusion.h finds it. It darkens the light
  // of sky and ground, not the key light. Empty: none.
  void set_occlusion(int mesh, const Eigen::VectorXd&);
  void set_scalars(int mesh, const Eigen::VectorXd&);  // one a vertex, for Passes
  // Of a transparent surface: the look's opacity from now on, 0 ≤ … < 1. At 0 the picture is as without the
  // mesh.
  void set_opacity(int mesh, double);

  // What of the mesh and its edges lies where n·p + d < 0 for one of the planes is cut off, and casts no
  // shadow. A closed mesh is solid: the cut is closed by a face of a darker color (cut.h), which is of the
  // mesh in passes. Of an open one insides are drawn flat. Throws InputError when there are more than
  // max_clip_planes or a normal is zero.
  void set_clip_planes(int mesh, const std::vector<Plane>&);

  // ends: row 2i to row 2i + 1. Lines are hidden by what is before them and cast no shadow.
  int add_lines(const Points& ends, const LineLook&);
  void set_lines(int lines, const Points& ends);

  // Where they are asked for, passes come from the same drawing; times are added up.
  Image draw(const Camera&, Passes* = nullptr, StageTimes* = nullptr);
  // The same, tone_mapped; the linear picture, 33 MB for 1920 × 1080, is never made.
  Image8 draw_shown(const Camera&, Passes* = nullptr, StageTimes* = nullptr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::render
