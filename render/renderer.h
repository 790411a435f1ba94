// Draws deforming meshes offscreen: a key light with shadow, sky, rim, and a ground that catches shadows and
// fades out. Needs no display and no X. Method, figures and traps: docs/rendering.md.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/mesh.h"
#include "render/camera.h"
#include "render/image.h"

namespace limber::render {

// Holds for every picture of a renderer. Colours are sRGB, 0 … 1 a channel.
struct Look {
  int width = 1920, height = 1080;  // pixels, 1 … 8192
  int supersampling = 2;            // samples a pixel are this squared; 1 … 4
  Vec3 background_top_srgb = {0.80, 0.84, 0.88};
  Vec3 background_bottom_srgb = {0.93, 0.94, 0.95};
  Vec3 ground_srgb = {0.93, 0.935, 0.94};  // where nothing shades it
  std::optional<double> ground_height_m;   // along up; none: no ground
  Vec3 up = {0, 0, 1};
  Vec3 toward_key = {-0.8, -0.35, 1.0};  // towards the key light, above the horizon
  double key_size_deg = 7;  // half angle the key light is seen under: softness of shadows, 0 … 30
  // The box over the whole motion. Shadow maps and the ground's fade are laid out for it, so nothing swims
  // from frame to frame. Empty: laid out anew for what each frame shows.
  Box stage;
};

struct MeshLook {
  std::string name;  // for messages
  Vec3 color_srgb = {0.75, 0.75, 0.75};
  double roughness = 0.45;  // 0.05 … 1
  double metallic = 0;      // 0 … 1
  double opacity = 1;       // below 1 only the layer nearest to the eye is seen; below 0.5 it casts no shadow
  // Edges sharper than this at rest are drawn sharp; 180: all smooth.
  double crease_angle_deg = 50;
};

struct LineLook {
  Vec3 color_srgb = {0.55, 0.6, 0.66};
  double width_px = 1.5;  // pixels of the finished picture
  double opacity = 0.8;
};

// The 12 edges, (24 × 3): edge i runs from row 2i to row 2i + 1.
Points edges_of(const Box&);

// One drawing context. A renderer may move between threads but serves one at a time; several work in several
// threads.
class Renderer {
 public:
  // Throws InputError when a field of Look is out of its range.
  explicit Renderer(const Look&);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Returns the mesh's number. It is shown at rest until set_positions. Throws InputError on a bad mesh or
  // look.
  int add_mesh(const Triangles&, const Points& rest_positions, const MeshLook&);
  // normals (V × 3) are unit vectors, or empty: then computed. At creases they are always computed.
  void set_positions(int mesh, const Points& positions, const Points& normals = {});

  // ends: row 2i to row 2i + 1. Lines are hidden by what is before them and cast no shadow.
  int add_lines(const Points& ends, const LineLook&);
  void set_lines(int lines, const Points& ends);

  Image draw(const Camera&);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::render
