// What the files of the renderer share: its state (Renderer::Impl), what it holds of each mesh and each set
// of lines, and the helpers that more than one stage uses. Private: users include render/renderer.h.
//
// A picture is made stage by stage, in the order of Impl::draw (render/renderer.cpp); each stage leaves in
// Impl what the next ones read:
//   lay out        look_through                        view, near and far plane     detail/shadow_maps.cpp
//   shadow maps    draw_shadow_map, shade_ground_maps  what the key light reaches   detail/shadow_maps.cpp
//   opaque bodies  draw_opaque                         colours, depth, passes       detail/draw_bodies.cpp
//   transparent surfaces, lines   draw_transparent, draw_lines              laid over the colours
//   detail/draw_transparent.cpp finish         finish_passes, finish               pixels
//   detail/finish_picture.cpp
// Method and sources: docs/rendering.md. Until the tone map all light is linear; radiance 1 is what a white,
// matt surface square to the key light sends.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/detail/gl_context.h"
#include "render/detail/gpu_mesh.h"
#include "render/detail/ground_shade.h"
#include "render/detail/image_on_card.h"
#include "render/detail/layer_lists.h"
#include "render/detail/line_quads.h"
#include "render/detail/program.h"
#include "render/detail/shade_tile.h"
#include "render/detail/shaders.h"
#include "render/detail/targets.h"
#include "render/renderer.h"

namespace limber::render {

namespace detail {

constexpr int shadow_size = Targets::shadow_size;
// Radius of the half-shade between bodies, over the side of the map.
constexpr double min_shadow = 1.9 / shadow_size, max_shadow = 0.03;

// A mesh that was added, with what was set of it since.
struct Mesh {
  MeshLook look;
  GpuMesh card;
  Points colors = {};                                        // linear; empty: the look's
  Eigen::VectorXd occlusion = {};                            // empty: none
  std::vector<SurfaceMaterial> materials = {};               // empty: no appearance
  std::vector<ImageOnCard> images = {}, normal_images = {};  // a material; 0: none
  bool outward = false;                                      // as looks_outward() says, at rest
  int number = 0;                                            // by which the caller knows it
  std::vector<render::Plane> planes = {};                    // that cut it
  Triangles triangles = {};                                  // of what is cut; as has_inside() says of them:
  std::optional<bool> solid = {};

  // A transparent surface: drawn into the lists of layers (detail/draw_transparent.cpp), not with the opaque
  // bodies.
  bool transparent() const { return look.opacity < 1; }
  bool drawn() const { return look.seen && look.opacity > 0; }
  bool grained() const { return look.grain > 0 && !transparent(); }
  bool translucent() const { return look.translucency > 0 && !transparent(); }
  // Into the shadow map, which knows only all or nothing: what lets more than half of the light through does
  // not, nor does its stand-in (render/caster.h).
  bool casts() const { return look.casts_shadow && look.opacity >= 0.5; }
  // On the ground: the share of a ray of light that its two layers hold back.
  double blocks() const { return look.casts_shadow ? 1 - (1 - look.opacity) * (1 - look.opacity) : 0; }
};

struct Lines {
  LineLook look;
  Points ends;
};

// Given row by row, from the top: four floats a pixel.
using RowReader = std::function<void(int y, std::span<const float> rgba)>;

template <class Visit>
void for_corners(const Box& box, const Visit& visit) {
  for (int i = 0; i < 8; ++i)
    visit(Vec3(box.lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(box.size())));
}

// How the samples of a pixel lie in the targets: a larger picture, or four samples a texel (MSAA).
SampleGrid sample_grid(const RenderSettings&);

// Turns on as many clip distances as there are planes, and answers the define with which a shader writes
// them. plane_defines({}) turns all of them off.
std::string plane_defines(const std::vector<render::Plane>&);

// Where the soft box stands that surfaces mirror.
Vec3 toward_soft_box(const RenderSettings&);

// Of a mesh that is drawn with its edges over it: pushes the surface back, so that no edge hides in its own
// surface.
double stand_back(const Mesh&, int samples_per_pixel_side);
void stand_back_for_edges(const Mesh&, int samples_per_pixel_side);

}  // namespace detail

// One by one, and not `using namespace detail`: files of detail/ have names of their own (Plane of
// ground_shade.cpp) that must not be seen here where all are compiled in one batch. Likewise render::Plane
// above.
using detail::DrawnMesh;
using detail::for_corners;
using detail::GlContext;
using detail::GpuMesh;
using detail::GroundFrame;
using detail::ImageOnCard;
using detail::LayerLists;
using detail::Lines;
using detail::Mesh;
using detail::plane_defines;
using detail::Program;
using detail::RowReader;
using detail::sample_grid;
using detail::SampleGrid;
using detail::SamplePlaces;
using detail::ShadeMap;
using detail::shadow_size;
using detail::stand_back_for_edges;
using detail::Targets;
using detail::Texture;
using detail::Variants;

struct Renderer::Impl {
  explicit Impl(const RenderSettings& l);

  // A picture from first to last stage. Passes and times are filled where they are not null.
  void draw(const Camera&, const RowReader&, Passes*, StageTimes*);

  // The stages of a picture.
  Box shown() const;  // round all that is drawn
  Box stage() const;  // what shadow maps and the ground are laid out for
  void look_through(const Camera&);
  void draw_shadow_map();
  void shade_ground_maps();
  void draw_opaque(bool passes);
  bool draw_in_tiles();
  bool put_in_tiles(bool transparent, detail::Tiles&, std::vector<detail::ShadedMesh>&);
  void put_in_tiles(detail::Tiles&, std::vector<detail::Stroke>&);
  detail::ShadedMesh shaded_in_tiles(const Mesh&);
  detail::Stage stage_of_tiles();
  struct Rectangle {               // of samples; rows go upward
    int left, top, right, bottom;  // right and bottom are beyond
    Rectangle with(const Rectangle& other) const {
      return {std::min(left, other.left), std::min(top, other.top), std::max(right, other.right),
              std::max(bottom, other.bottom)};
    }
  };
  Rectangle extent_of(const Box&) const;
  Rectangle extent_of_transparent() const;
  Rectangle extent_of_drawn() const;
  void put_transparent(int first_row, int rows);
  void draw_transparent();
  // Where there are transparent surfaces: first what lies before one is put into the lists, then the rest is
  // drawn.
  enum class LinePass { draw_all, put, draw_rest };
  void draw_lines(LinePass);
  detail::Screen screen() const;
  // Also those along the edges of meshes, with the planes that cut these.
  void each_line(const std::function<void(const Points& ends, const LineLook&, const std::vector<Plane>&)>&);
  void finish(const RowReader&);
  Passes finish_passes();

  // The faces of cuts, behind all other meshes while a picture is drawn.
  void add_caps();
  void remove_caps();
  // The planes that cut a mesh: its own, and the ground's where the mesh reaches below it.
  bool hides_its_back(const Mesh&) const;
  std::vector<Plane> planes_of(const Mesh&) const;
  // Programs for what is drawn next, with all their uniforms.
  const Program& use_mesh(const Mesh&, const std::string& defines, const DrawnMesh::Batch* = nullptr);
  template <class WithProgram>
  void draw_mesh(const Mesh&, const std::string& defines, const WithProgram&);
  void use_depth(const Mat4& clip_from, const std::vector<Plane>&);
  bool has_transparent() const;
  // Checks the number, and that there is a value for each of its vertices.
  Mesh& mesh_with(int number, Eigen::Index values, bool may_be_empty);

  RenderSettings settings;
  GlContext context;
  Variants mesh_programs{detail::mesh_vertex_shader, detail::mesh_fragment_shader};
  Variants depth_programs{detail::depth_vertex_shader, detail::depth_fragment_shader};
  Variants line_programs{detail::line_vertex_shader, detail::line_fragment_shader};
  Variants passes_programs{detail::whole_picture_vertex_shader, detail::passes_fragment_shader};
  Variants layers_programs{detail::whole_picture_vertex_shader, detail::layers_fragment_shader};
  std::string samples;  // defines by which a shader reads the samples of a pixel
  Targets targets;
  const std::optional<SamplePlaces>
      four_samples;              // of transparent surfaces' rasterizer, where one list serves a pixel
  const std::string with_lists;  // defines and texts by which a shader uses the lists
  LayerLists lists;
  unsigned empty_array, line_array, line_buffer;  // the first for whole pictures, whose shader has no input
  std::vector<Mesh> meshes;
  std::vector<Lines> lines;
  int caps = 0, rims = 0;  // the last of meshes and lines, while a picture is drawn

  // Left by one stage for the next.
  Camera camera;
  Box stage_box;
  double near_m = 1, far_m = 1;
  Mat4 clip_from_world = Mat4::Identity(), shadow_from_world = Mat4::Identity();
  double shadow_texel_m = 1, shadow_depth_m = 1;  // of the shadow map: a texel, and all of its depth
  const Texture* entry_map = nullptr;             // of targets: where the key light first meets anything
  Eigen::Matrix3d shadow_from_normal = Eigen::Matrix3d::Identity();
  double shadow_softness = 0;  // radius of the half-shade over depth, both in units of the shadow map
  GroundFrame ground;
  Plane ground_plane;
  bool ground_seen = false;  // there is one, and the eye is above it
  ShadeMap key_shade, sky_shade;
  std::vector<float> shadow_depths, entry_depths;  // the maps, read back for the tiles
  std::array<std::vector<unsigned>, 2>
      relief_texels;  // for the tiles, plain and woven, made when they are asked for
  std::array<detail::Relief, 2> reliefs;
  std::vector<bool> clean_tiles;      // of the samples: nothing is in them
  bool are_layered = false;           // transparent surfaces were drawn in tiles
  Rectangle drawn = {0, 0, 0, 0};     // whole pixels: beyond it nothing is, and samples are not cleared
  std::vector<std::uint16_t> halves;  // the samples of it, read back
};

// Material after material, each by a program that is given to with_program first.
template <class WithProgram>
void Renderer::Impl::draw_mesh(const Mesh& mesh, const std::string& defines,
                               const WithProgram& with_program) {
  const std::vector<DrawnMesh::Batch>& batches = mesh.card.drawn().batches;
  if (batches.empty()) {
    with_program(use_mesh(mesh, defines));
    mesh.card.draw();
  }
  for (const DrawnMesh::Batch& batch : batches) {
    with_program(use_mesh(mesh, defines, &batch));
    mesh.card.draw(batch.first_corner, batch.corners);
  }
}

}  // namespace limber::render
