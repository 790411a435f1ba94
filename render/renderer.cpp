#include "render/renderer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/progress.h"
#include "render/detail/compositor.h"
#include "render/detail/gl_context.h"
#include "render/detail/gpu_mesh.h"
#include "render/detail/grain.h"
#include "render/detail/ground_shade.h"
#include "render/detail/image_on_card.h"
#include "render/detail/layer_lists.h"
#include "render/detail/line_quads.h"
#include "render/detail/program.h"
#include "render/detail/shaders.h"
#include "render/detail/targets.h"

namespace limber::render {

namespace {

using namespace detail;

constexpr int shadow_size = Targets::shadow_size;
constexpr double max_shadow = 0.03;  // radius of the half-shade between bodies, over the side of the map
constexpr int ground_key_cells = 768, ground_sky_cells = 384;
// A level patch at height h hides the share h²/(π(h²+r²)²) of the sky from a place r beside its foot. Half a
// narrow and half a wide Gaussian (deviations in units of h) keep within 0.03 of what it sums to over a disk.
constexpr double sky_spreads[] = {0.5, 1.6};

struct Mesh {
  MeshLook look;
  GpuMesh card;
  Points colors = {};                                        // linear; empty: the look's
  Eigen::VectorXd occlusion = {};                            // empty: none
  std::vector<SurfaceMaterial> materials = {};               // empty: no appearance
  std::vector<ImageOnCard> images = {}, normal_images = {};  // a material; 0: none

  bool transparent() const { return look.opacity < 1; }
  bool drawn() const { return look.seen && look.opacity > 0; }
  bool grained() const { return look.grain > 0 && !transparent(); }
  bool translucent() const { return look.translucency > 0 && !transparent(); }
  bool casts() const { return look.casts_shadow && (!look.seen || look.opacity >= 0.5); }
};

struct Lines {
  LineLook look;
  Points ends;
};

void require(bool in_range, const std::string& what) {
  if (!in_range) throw InputError(what);
}

void validate(const RenderSettings& look) {
  require(
      1 <= look.width && look.width <= 8192 && 1 <= look.height && look.height <= 8192,
      fmt::format("picture of {}×{}: width and height must lie between 1 and 8192", look.width, look.height));
  require(1 <= look.supersampling && look.supersampling <= 4,
          fmt::format("supersampling is {}, but must lie between 1 and 4", look.supersampling));
  require(
      std::max(look.width, look.height) * look.supersampling <= 16384,
      fmt::format("picture of {}×{} with supersampling {}: at most 16384 samples a side; lower one of them",
                  look.width, look.height, look.supersampling));
  require(look.up.allFinite() && look.up.norm() > 0, "up is zero or not finite");
  require(look.toward_key.allFinite() && look.toward_key.normalized().dot(look.up.normalized()) > 0.05,
          "the key light must stand at least 3 degrees above the horizon");
  require(0 <= look.key_size_deg && look.key_size_deg <= 30,
          fmt::format("key_size_deg is {}, but must lie between 0 and 30", look.key_size_deg));
  for (const Vec3* light : {&look.key_light, &look.sky_light})
    require(light->allFinite() && light->minCoeff() >= 0 && light->maxCoeff() <= 4,
            "key_light and sky_light must lie between 0 and 4 in each channel");
  require(!look.ground_height_m || std::isfinite(*look.ground_height_m), "ground_height_m is not finite");
}

void validate(const MeshLook& look) {
  const auto in = [&](double value, double low, double high, const char* field) {
    require(low <= value && value <= high, fmt::format("mesh '{}': {} is {}, but must lie between {} and {}",
                                                       look.name, field, value, low, high));
  };
  in(look.roughness, 0.05, 1, "roughness");
  in(look.metallic, 0, 1, "metallic");
  in(look.opacity, 0, 1, "opacity");
  in(look.crease_angle_deg, 0, 180, "crease_angle_deg");
  in(look.translucency, 0, 1, "translucency");
  in(look.scatter_m, 1e-9, 1e9, "scatter_m");
  in(look.sheen, 0, 1, "sheen");
  in(look.grain, 0, 1, "grain");
  in(look.grain_m, 1e-9, 1e9, "grain_m");
  for (int c = 0; c < 3; ++c) in(look.color_srgb[c], 0, 1, "a channel of its colour");
}

// The key light's direction turned by 110° about up, 25° above the horizon.
Vec3 toward_soft_box(const RenderSettings& look) {
  const Vec3 level = look.toward_key - look.toward_key.dot(look.up) * look.up;
  const Vec3 turned = level.norm() > 1e-6
                          ? Eigen::AngleAxisd(110 * std::numbers::pi / 180, look.up) * level.normalized()
                          : look.up.unitOrthogonal();
  const double height = 25 * std::numbers::pi / 180;
  return std::cos(height) * turned + std::sin(height) * look.up;
}

template <class Visit>
void for_corners(const Box& box, const Visit& visit) {
  for (int i = 0; i < 8; ++i)
    visit(Vec3(box.lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(box.size())));
}

}  // namespace

Points edges_of(const Box& box) {
  Points ends(24, 3);
  int row = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 4; ++side) {
      Vec3 from = box.lower;
      if (side & 1) from[(axis + 1) % 3] = box.upper[(axis + 1) % 3];
      if (side & 2) from[(axis + 2) % 3] = box.upper[(axis + 2) % 3];
      Vec3 to = from;
      to[axis] = box.upper[axis];
      ends.row(row++) = from;
      ends.row(row++) = to;
    }
  return ends;
}

namespace {

// How a shader reads the samples of a pixel.
std::string sample_defines(const RenderSettings& look) {
  if (look.multisampling)
    return "#define SAMPLER sampler2DMS\n#define INTEGER_SAMPLER isampler2DMS\n#define SAMPLES 4\n"
           "#define SAMPLES_A_TEXEL 4\n#define SAMPLE gl_SampleID\n"
           "#define FETCH(samples, pixel, i) texelFetch(samples, pixel, i)\n";
  return fmt::format(
      "#define SAMPLER sampler2D\n#define INTEGER_SAMPLER isampler2D\n#define SAMPLES {1}\n"
      "#define SAMPLES_A_TEXEL 1\n#define SAMPLE 0\n"
      "#define FETCH(samples, pixel, i) texelFetch(samples, pixel * {0} + ivec2(i % {0}, i / {0}), 0)\n",
      look.supersampling, look.supersampling * look.supersampling);
}

SampleGrid sample_grid(const RenderSettings& look) {
  if (look.multisampling) return {look.width, look.height, 4};
  return {look.width * look.supersampling, look.height * look.supersampling, 0};
}

}  // namespace

// Given row by row, from the top: four floats a pixel.
using RowReader = std::function<void(int y, std::span<const float> rgba)>;

struct Renderer::Impl {
  explicit Impl(const RenderSettings& l);

  void draw(const Camera&, const RowReader&, Passes*, StageTimes*);

  // The stages of a picture.
  Box shown() const;
  Box stage() const;
  void look_through(const Camera&);
  void draw_shadow_map();
  void shade_ground_maps();
  void draw_opaque(bool passes);
  struct Rectangle {
    int left, top, right, bottom;  // right and bottom are beyond
  };
  Rectangle place_of_veils() const;
  void draw_veils();
  // Where there are veils: first what lies before one is put into the lists, then the rest is drawn.
  enum class LinePass { draw_all, put, draw_rest };
  void draw_lines(LinePass);
  void finish(const RowReader&);
  Passes finish_passes();

  std::vector<Plane> planes_of(const Mesh&) const;
  // Programs for what is drawn next, with all their uniforms.
  const Program& use_mesh(const Mesh&, const std::string& defines, const DrawnMesh::Batch* = nullptr);
  template <class WithProgram>
  void draw_mesh(const Mesh&, const std::string& defines, const WithProgram&);
  void use_depth(const Mat4& clip_from, const std::vector<Plane>&);
  bool has_veils() const;
  // Checks the number, and that there is a value for each of its vertices.
  Mesh& mesh_with(int number, Eigen::Index values, bool may_be_empty);

  RenderSettings look;
  GlContext context;
  Variants mesh_programs{mesh_vertex_shader, mesh_fragment_shader};
  Variants depth_programs{depth_vertex_shader, depth_fragment_shader};
  Variants line_programs{line_vertex_shader, line_fragment_shader};
  Variants passes_programs{whole_picture_vertex_shader, passes_fragment_shader};
  Variants layers_programs{whole_picture_vertex_shader, layers_fragment_shader};
  std::string samples;  // defines
  const std::string veiled = std::string("#define VEILED\n") + layer_lists;
  Targets targets;
  LayerLists lists;
  GLuint empty_array, line_array, line_buffer;
  std::vector<Mesh> meshes;
  std::vector<Lines> lines;
  std::vector<Plane> clip_planes;

  // Left by one stage for the next.
  Camera camera;
  Box stage_box;
  double near_m = 1, far_m = 1;
  Mat4 clip_from_world = Mat4::Identity(), shadow_from_world = Mat4::Identity();
  double shadow_texel_m = 1, shadow_depth_m = 1;
  const Texture* entry_map = nullptr;  // of targets
  Eigen::Matrix3d shadow_from_normal = Eigen::Matrix3d::Identity();
  double shadow_softness = 0;  // radius of the half-shade over depth, both in units of the shadow map
  GroundFrame ground;
  Plane ground_plane;
  bool ground_seen = false;  // there is one, and the eye is above it
  ShadeMap key_shade, sky_shade;
  std::vector<std::uint16_t> halves;  // the samples, read back
};

Renderer::Impl::Impl(const RenderSettings& l)
    : look(l), samples(sample_defines(l)), targets(l.width, l.height, sample_grid(l)), lists(sample_grid(l)) {
  look.up.normalize();
  look.toward_key.normalize();
  ground = ground_frame(look.up, look.ground_height_m.value_or(0));
  ground_plane << ground.up, -ground.height_m;
  glGenVertexArrays(1, &empty_array);
  glGenVertexArrays(1, &line_array);
  glGenBuffers(1, &line_buffer);
  glBindVertexArray(line_array);
  glBindBuffer(GL_ARRAY_BUFFER, line_buffer);
  constexpr GLsizei stride = line_corner_floats * sizeof(float);
  glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, stride, nullptr);
  glVertexAttribPointer(1, 1, GL_FLOAT, GL_FALSE, stride, reinterpret_cast<void*>(4 * sizeof(float)));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
}

Box Renderer::Impl::shown() const {
  Box box;
  for (const Mesh& mesh : meshes)
    if (mesh.drawn()) box.include(mesh.card.box());
  for (const Lines& l : lines)
    if (l.ends.rows() > 0) box.include(bounding_box(l.ends));
  if (box.empty()) box.include(Vec3::Zero().eval());
  return box;
}

Box Renderer::Impl::stage() const {
  if (!look.stage.empty()) return look.stage;
  Box box;
  for (const Mesh& mesh : meshes)
    if (!mesh.look.seen || mesh.drawn()) box.include(mesh.card.box());
  return box.empty() ? shown() : box;
}

bool Renderer::Impl::has_veils() const {
  return std::any_of(meshes.begin(), meshes.end(),
                     [](const Mesh& m) { return m.drawn() && m.transparent(); });
}

void Renderer::Impl::look_through(const Camera& c) {
  camera = c;
  stage_box = stage();
  ground_seen = look.ground_height_m && ground_plane.dot(camera.eye.homogeneous()) > 0;
  const Mat4 camera_from = camera_from_world(camera);
  double nearest = 1e300, farthest = -1e300;
  for_corners(shown(), [&](const Vec3& p) {
    const double depth = -(camera_from * p.homogeneous()).z();
    nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
  });
  far_m = std::max(1.01 * farthest, 1e-3);
  near_m = std::clamp(0.98 * nearest, 1e-3 * far_m, 0.9 * far_m);
  clip_from_world =
      clip_from_camera(camera.fov_deg, double(look.width) / look.height, near_m, far_m) * camera_from;
}

// Orthographic, along the key light, just large enough for the stage and all that casts.
void Renderer::Impl::draw_shadow_map() {
  Camera light;
  light.target = stage_box.center();
  light.eye = light.target + look.toward_key;
  light.up = std::abs(look.toward_key.dot(look.up)) > 0.99 ? ground.plane_from_world.row(1).transpose().eval()
                                                           : look.up;
  const Mat4 light_from_world = camera_from_world(light);
  Box seen;
  const auto include = [&](const Vec3& p) {
    seen.include(Vec3((light_from_world * p.homogeneous()).head<3>()));
  };
  for_corners(stage_box, include);
  for (const Mesh& mesh : meshes)
    if (mesh.casts()) for_corners(mesh.card.box(), include);
  const double side = std::max({seen.size().x(), seen.size().y(), 1e-6}) * (1 + 8.0 / shadow_size);
  const double depth = std::max(seen.size().z(), 1e-6);
  shadow_texel_m = side / shadow_size, shadow_depth_m = 1.02 * depth;

  Mat4 clip_from_light = Mat4::Identity();
  clip_from_light.diagonal() << 2 / side, 2 / side, -2 / (1.02 * depth), 1;
  Mat4 clip_from = clip_from_light * light_from_world;
  clip_from.topRightCorner<3, 1>() -= (clip_from_light * seen.center().homogeneous()).head<3>();
  Mat4 half = Mat4::Identity();
  half.diagonal() << 0.5, 0.5, 0.5, 1;
  half.col(3) << 0.5, 0.5, 0.5, 1;
  shadow_from_world = half * clip_from;
  shadow_from_normal = shadow_from_world.topLeftCorner<3, 3>().inverse().transpose();
  shadow_softness = std::tan(look.key_size_deg * std::numbers::pi / 180) * 1.02 * depth / side;

  glBindFramebuffer(GL_FRAMEBUFFER, targets.shadow_frame);
  glViewport(0, 0, shadow_size, shadow_size);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5f, 2.0f);
  glCullFace(GL_FRONT);
  for (Mesh& mesh : meshes) {
    if (!mesh.casts()) continue;
    (mesh.look.seen ? glDisable : glEnable)(GL_CULL_FACE);
    use_depth(clip_from, clip_planes);
    mesh.card.draw();
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_POLYGON_OFFSET_FILL);
  entry_map = &targets.shadow_map;
  const auto stands_in = [](const Mesh& mesh) { return mesh.casts() && !mesh.look.seen; };
  if (std::none_of(meshes.begin(), meshes.end(), stands_in) ||
      std::none_of(meshes.begin(), meshes.end(), [](const Mesh& mesh) { return mesh.translucent(); }))
    return;
  // The shadow map has the far sides of stand-ins only.
  entry_map = &targets.entry_map;
  glBindFramebuffer(GL_FRAMEBUFFER, targets.entry_frame);
  glViewport(0, 0, Targets::entry_size, Targets::entry_size);
  glClear(GL_DEPTH_BUFFER_BIT);
  for (Mesh& mesh : meshes) {
    if (!mesh.casts()) continue;
    use_depth(clip_from, clip_planes);
    mesh.card.draw();
  }
}

void Renderer::Impl::shade_ground_maps() {
  std::vector<const DrawnMesh*> casters;
  Box box = stage_box;
  if (look.ground_height_m)
    for (const Mesh& mesh : meshes)
      if (mesh.casts()) casters.push_back(&mesh.card.drawn()), box.include(mesh.card.box());
  const double key_spreads[] = {0.5 * std::tan(look.key_size_deg * std::numbers::pi / 180)};
  key_shade = shade_ground(casters, ground, look.toward_key, key_spreads, box, ground_key_cells, clip_planes);
  sky_shade = shade_ground(casters, ground, look.up, sky_spreads, box, ground_sky_cells, clip_planes);
  fill(targets.ground_sky_map, sky_shade.columns, sky_shade.rows, sky_shade.blocked.data());
}

// What is below the ground is cut off, too, where the eye sees it from above. The undersides of veils, which
// are seen through them, stay whole where they stand on it and sink in a little.
std::vector<Plane> Renderer::Impl::planes_of(const Mesh& mesh) const {
  std::vector<Plane> planes = clip_planes;
  Plane plane = ground_plane;
  if (mesh.transparent()) plane[3] += 0.005 * stage_box.size().norm();
  bool below = false;
  for_corners(mesh.card.box(), [&](const Vec3& c) { below |= plane.dot(c.homogeneous()) < 0; });
  if (ground_seen && below) planes.push_back(plane);
  return planes;
}

namespace {

// Mesa 22.3 clips by what a shader writes even where clipping is off: so a shader writes as many as are
// wanted.
std::string plane_defines(const std::vector<Plane>& planes) {
  for (int i = 0; i <= max_clip_planes; ++i)
    (i < int(planes.size()) ? glEnable : glDisable)(GLenum(GL_CLIP_DISTANCE0 + i));
  return fmt::format("#define PLANES {}\n", planes.size());
}

void set_planes(const Program& program, const std::vector<Plane>& planes) {
  for (std::size_t i = 0; i < planes.size(); ++i)
    program.set(fmt::format("planes[{}]", i).c_str(), planes[i]);
}

}  // namespace

void Renderer::Impl::use_depth(const Mat4& clip_from, const std::vector<Plane>& planes) {
  const Program& p = depth_programs.with(plane_defines(planes));
  p.use();
  p.set("clip_from_world", clip_from);
  set_planes(p, planes);
}

namespace {

// The color that a part of a mesh has, all in all.
struct Paint {
  Vec3 color;  // linear
  const ImageOnCard *image = nullptr, *normal_image = nullptr;
  Vec3 mean() const { return image ? Vec3(color.cwiseProduct(image->mean)) : color; }
};
Paint paint_of(const Mesh& mesh, const DrawnMesh::Batch* batch) {
  if (!batch || batch->material < 0) return {linear_from_srgb(mesh.look.color_srgb)};
  const auto m = std::size_t(batch->material);
  const auto made = [](const ImageOnCard& image) { return image.texture.id ? &image : nullptr; };
  return {mesh.materials[m].color, made(mesh.images[m]), made(mesh.normal_images[m])};
}

}  // namespace

const Program& Renderer::Impl::use_mesh(const Mesh& mesh, const std::string& defines,
                                        const DrawnMesh::Batch* batch) {
  const std::vector<Plane> planes = planes_of(mesh);
  std::string all = plane_defines(planes) + defines;
  const Paint paint = paint_of(mesh, batch);
  if (batch) all += "#define PAINTED\n";
  if (paint.image) all += "#define IMAGE\n";
  if (paint.normal_image) all += "#define NORMAL_IMAGE\n";
  if (batch && batch->material >= 0 && !mesh.card.drawn().colors.empty()) all += "#define CORNER_COLORS\n";
  if (mesh.card.tinted()) all += "#define TINTED\n";
  if (mesh.translucent()) all += "#define TRANSLUCENT\n";
  if (mesh.grained()) all += "#define GRAINED\n";
  if (!clip_planes.empty()) all += "#define FLAT_INSIDE\n";
  const Program& p = mesh_programs.with(all);
  p.use();
  set_planes(p, planes);
  p.set("clip_from_world", clip_from_world);
  p.set("shadow_from_world", shadow_from_world);
  p.set("shadow_offset_m", 2.0 * shadow_texel_m);
  p.set("shadow_from_normal", shadow_from_normal);
  p.set("shadow_softness", shadow_softness);
  p.set("least_shadow", 1.9 / shadow_size);
  p.set("most_shadow", max_shadow);
  p.set("ground_x", Vec3(ground.plane_from_world.row(0)));
  p.set("ground_y", Vec3(ground.plane_from_world.row(1)));
  p.set("ground_lower", sky_shade.lower);
  p.set("ground_scale",
        Eigen::Vector2d(1 / (sky_shade.cell_m * sky_shade.columns), 1 / (sky_shade.cell_m * sky_shade.rows)));
  p.set("eye", camera.eye);
  p.set("up", look.up);
  p.set("toward_key", look.toward_key);
  p.set("toward_box", toward_soft_box(look));
  p.set("key_light", look.key_light);
  p.set("sky_light", look.sky_light);
  p.set("ground_color", look.ground_height_m ? linear_from_srgb(look.ground_srgb) : Vec3(Vec3::Zero()));
  p.set("ground_key", look.toward_key.dot(look.up));
  p.set("ground_height", ground.height_m);
  p.set("faced_m", std::max(0.05 * stage_box.diagonal(), 1e-6));
  p.set("shadow_map", 0);
  p.set("ground_sky_map", 1);
  p.set("shadow_depth", 2);
  targets.shadow_map.bind(0);
  targets.ground_sky_map.bind(1);
  targets.shadow_map.bind(2);
  glBindSampler(2, targets.not_compared);

  p.set("albedo", linear_from_srgb(mesh.look.color_srgb));
  p.set("roughness", mesh.look.roughness);
  p.set("metallic", mesh.look.metallic);
  p.set("opacity", mesh.look.opacity);
  p.set("sheet", int(mesh.look.sheet));
  p.set("sheen", mesh.look.sheen);
  if (mesh.translucent()) {
    const Vec3 albedo = paint.mean();
    const Vec3 reach = Vec3::Constant(0.3) + 0.7 * albedo / std::max(albedo.maxCoeff(), 1e-3);
    p.set("translucency", mesh.look.translucency);
    p.set("scatter", Vec3(mesh.look.scatter_m / shadow_depth_m * reach));
    p.set("scatter_radius", 1.5 * mesh.look.scatter_m / (shadow_texel_m * shadow_size));
    p.set("entry_depth", 3);
    entry_map->bind(3);
    glBindSampler(3, targets.blended);
  }
  if (mesh.grained()) {
    p.set("grain", mesh.look.grain);
    p.set("grains_a_metre", 1 / (grain_waves * mesh.look.grain_m));
    p.set("grain_map", 4);
    targets.grain(mesh.look.woven).bind(4);
  }
  if (batch) p.set("paint", paint.color);
  if (paint.image) {
    p.set("image", 5);
    paint.image->texture.bind(5);
  }
  if (paint.normal_image) {
    p.set("normal_image", 6);
    paint.normal_image->texture.bind(6);
  }
  p.set("object", int(&mesh - meshes.data()));
  return p;
}

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

// Drawn with its edges over it, a surface stands back by as much as its depth changes over half the width of
// a line.
static void stand_back_for_edges(const Mesh& mesh, int samples_per_pixel_side) {
  (mesh.look.edges ? glEnable : glDisable)(GL_POLYGON_OFFSET_FILL);
  if (mesh.look.edges)
    glPolygonOffset(float(0.5 * mesh.look.edges->width_px * samples_per_pixel_side + 1.5), 4.0f);
}

void Renderer::Impl::draw_opaque(bool passes) {
  glBindFramebuffer(GL_FRAMEBUFFER, passes ? targets.passes().frame : targets.samples_frame);
  const SampleGrid grid = sample_grid(look);
  glViewport(0, 0, grid.width, grid.height);
  glDepthMask(GL_TRUE);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  const float nothing[4] = {0, 0, 0, 0}, no_scalar[4] = {0, 0, 0, NAN}, far[1] = {1};
  const int no_object[4] = {-1, 0, 0, 0};
  if (look.multisampling) {
    glClearBufferfv(GL_COLOR, 0, nothing);
    glClearBufferfv(GL_DEPTH, 0, far);
  } else {  // row by row: llvmpipe clears buffers tile by tile, which takes five times as long
    glClearTexImage(targets.samples.id, 0, GL_RGBA, GL_FLOAT, nothing);
    glClearTexImage(targets.samples_depth.id, 0, GL_DEPTH_COMPONENT, GL_FLOAT, far);
  }
  if (passes) {
    glClearBufferfv(GL_COLOR, 1, no_scalar);
    glClearBufferiv(GL_COLOR, 2, no_object);
  }
  for (Mesh& mesh : meshes) {
    if (!mesh.look.seen || mesh.transparent()) continue;
    stand_back_for_edges(mesh, look.multisampling ? 1 : look.supersampling);
    draw_mesh(mesh, passes ? "#define PASSES\n" : "", [](const Program&) {});
  }
  glDisable(GL_POLYGON_OFFSET_FILL);
  plane_defines({});
}

// All samples that veils may cover.
Renderer::Impl::Rectangle Renderer::Impl::place_of_veils() const {
  const SampleGrid grid = sample_grid(look);
  Eigen::Array2d lower(1, 1), upper(-1, -1);  // of the screen, −1 … 1
  for (const Mesh& mesh : meshes)
    if (mesh.drawn() && mesh.transparent())
      for_corners(mesh.card.box(), [&](const Vec3& corner) {
        const Eigen::Vector4d clip = clip_from_world * corner.homogeneous();
        if (clip.w() > 0) {
          lower = lower.min(clip.head<2>().array() / clip.w());
          upper = upper.max(clip.head<2>().array() / clip.w());
        } else {  // behind the eye
          lower.setConstant(-1), upper.setConstant(1);
        }
      });
  const auto sample = [](double screen, int side) {
    return int(std::clamp(0.5 + 0.5 * screen, 0.0, 1.0) * side);
  };
  return {sample(lower.x(), grid.width), sample(lower.y(), grid.height),
          std::min(sample(upper.x(), grid.width) + 1, grid.width),
          std::min(sample(upper.y(), grid.height) + 1, grid.height)};
}

// Veils, and the lines before some of them, by lists of layers: whatever is not hidden by the opaque is
// shaded once, and each sample's list is put over the sample front to back.
void Renderer::Impl::draw_veils() {
  const SampleGrid grid = sample_grid(look);
  const Rectangle place = place_of_veils();
  glBindFramebuffer(GL_FRAMEBUFFER, targets.samples_frame);
  glEnable(GL_SCISSOR_TEST);
  int rows = lists.max_rows();
  for (int row = 0; row < grid.height;) {
    rows = std::min(rows, grid.height - row);
    glScissor(0, row, grid.width, rows);
    lists.clear(row, rows);
    glDepthMask(GL_FALSE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    for (const Mesh& mesh : meshes) {
      if (!mesh.drawn() || !mesh.transparent()) continue;
      stand_back_for_edges(mesh, look.multisampling ? 1 : look.supersampling);
      draw_mesh(mesh, samples + veiled, [&](const Program& program) { lists.set_uniforms(program); });
    }
    glDisable(GL_POLYGON_OFFSET_FILL);
    plane_defines({});
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    draw_lines(LinePass::put);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    if (lists.wanted() > lists.room()) {
      if (lists.make_room(lists.wanted())) continue;
      if (rows > 1) {
        rows = (rows + 1) / 2;
        continue;
      }
    }  // hundreds of layers all along one row: what has no room is left out
    draw_lines(LinePass::draw_rest);

    const int first = std::max(row, place.top), last = std::min(row + rows, place.bottom);
    glScissor(place.left, first, std::max(place.right - place.left, 0), std::max(last - first, 0));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    const Program& p = layers_programs.with(samples + layer_lists);
    p.use();
    lists.set_uniforms(p);
    glBindVertexArray(empty_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_BLEND);
    glEnable(GL_DEPTH_TEST);
    row += rows;
  }
  glDisable(GL_SCISSOR_TEST);
}

void Renderer::Impl::draw_lines(LinePass pass) {
  const double per_pixel = look.multisampling ? 1 : look.supersampling;
  const SampleGrid grid = sample_grid(look);
  const Screen screen{clip_from_world, Eigen::Vector2d(grid.width, grid.height)};
  glBindFramebuffer(GL_FRAMEBUFFER, targets.samples_frame);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  const Program& p = line_programs.with(pass == LinePass::draw_all ? "" : samples + veiled);
  p.use();
  if (pass != LinePass::draw_all) {
    lists.set_uniforms(p);
    p.set("putting", pass == LinePass::put ? 1 : 0);
  }
  glBindVertexArray(line_array);
  std::vector<float> corners;
  const auto draw = [&](const Points& ends, const LineLook& line, const std::vector<Plane>& planes) {
    line_quads(ends, screen, line.width_px * per_pixel, planes, corners);
    if (corners.empty()) return;
    const Vec3 color = linear_from_srgb(line.color_srgb);
    p.set("line_color", Eigen::Vector4d(color.x(), color.y(), color.z(), line.opacity));
    p.set("half_width", 0.5 * line.width_px * per_pixel);
    glBindBuffer(GL_ARRAY_BUFFER, line_buffer);
    glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(corners.size() * sizeof(float)), corners.data(), GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, GLsizei(corners.size() / line_corner_floats));
  };
  for (const Lines& l : lines) draw(l.ends, l.look, {});
  for (Mesh& mesh : meshes)
    if (mesh.drawn() && mesh.look.edges) draw(mesh.card.edge_ends(), *mesh.look.edges, planes_of(mesh));
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

void Renderer::Impl::finish(const RowReader& read) {
  const SampleGrid grid = sample_grid(look);
  const int per_side = look.multisampling ? 1 : look.supersampling;
  const unsigned frame = look.multisampling ? targets.resolved_frame() : targets.samples_frame;
  if (look.multisampling) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, targets.samples_frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, frame);
    glBlitFramebuffer(0, 0, grid.width, grid.height, 0, 0, grid.width, grid.height, GL_COLOR_BUFFER_BIT,
                      GL_NEAREST);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  halves.resize(4 * std::size_t(grid.width) * std::size_t(grid.height));
  glReadPixels(0, 0, grid.width, grid.height, GL_RGBA, GL_HALF_FLOAT, halves.data());
  const GLenum error = glGetError();
  LIMBER_CHECK(error == GL_NO_ERROR, error);

  const auto shown_as = [](const Vec3& srgb) {
    return Vec3(linear_from_srgb(srgb).unaryExpr(&tone_unmapped));
  };
  const Vec3 key = look.key_light * look.toward_key.dot(look.up), all = key + look.sky_light;
  const Vec3 key_share = key.cwiseQuotient(all.cwiseMax(1e-9));
  const Backdrop backdrop{
      .background_top = shown_as(look.background_top_srgb),
      .background_bottom = shown_as(look.background_bottom_srgb),
      .ground_seen = ground_seen,
      .ground = ground,
      .ground_color = shown_as(look.ground_srgb),
      .key_shade = &key_shade,
      .sky_shade = &sky_shade,
      .far_ground_color = shown_as(look.far_ground_srgb.value_or(look.background_bottom_srgb)),
      .key_share = key_share,
      .fade_middle = stage_box.center(),
      .fade_begin_m = 0.5 * stage_box.diagonal(),
      .fade_end_m = 4 * stage_box.diagonal() + 1e-6,
      .haze_m = 18 * stage_box.diagonal() + 1e-6,
      .transparent = look.transparent_background};
  const Compositor finished(backdrop, camera, look.width, look.height);
  std::vector<float> row(4 * std::size_t(look.width));
  for (int y = 0; y < look.height; ++y) {
    finished.row(y, halves.data(), per_side, row.data());
    read(y, row);
  }
}

Passes Renderer::Impl::finish_passes() {
  const Targets::Passes& from = targets.passes();
  glBindFramebuffer(GL_FRAMEBUFFER, from.pixel_frame);
  glViewport(0, 0, look.width, look.height);
  glDisable(GL_DEPTH_TEST);
  const Program& p = passes_programs.with(samples);
  p.use();
  p.set("samples_depth", 0);
  p.set("normal_scalar", 1);
  p.set("object", 2);
  p.set("last_row", look.height - 1);
  targets.samples_depth.bind(0);
  from.normal_scalar.bind(1);
  from.object.bind(2);
  glBindVertexArray(empty_array);
  glDrawArrays(GL_TRIANGLES, 0, 3);

  const std::size_t pixels = std::size_t(look.width) * look.height;
  Passes passes{look.width, look.height, std::vector<float>(pixels), {}, std::vector<int>(pixels), {}};
  std::vector<float> normal_scalar(4 * pixels);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, look.width, look.height, GL_RGBA, GL_FLOAT, normal_scalar.data());
  glReadBuffer(GL_COLOR_ATTACHMENT1);
  glReadPixels(0, 0, look.width, look.height, GL_RED, GL_FLOAT, passes.depth_m.data());
  glReadBuffer(GL_COLOR_ATTACHMENT2);
  glReadPixels(0, 0, look.width, look.height, GL_RED_INTEGER, GL_INT, passes.object.data());
  const GLenum error = glGetError();
  LIMBER_CHECK(error == GL_NO_ERROR, error);

  passes.normal.reserve(3 * pixels), passes.scalar.reserve(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    passes.normal.insert(passes.normal.end(), &normal_scalar[4 * i], &normal_scalar[4 * i] + 3);
    passes.scalar.push_back(normal_scalar[4 * i + 3]);
    float& depth = passes.depth_m[i];  // 0 at near_m, 1 at far_m, linear in 1 / distance
    depth = passes.object[i] < 0 ? INFINITY : float(near_m * far_m / (far_m - depth * (far_m - near_m)));
  }
  return passes;
}

Renderer::Renderer(const RenderSettings& look) {
  validate(look);
  impl_ = std::make_unique<Impl>(look);
}
Renderer::~Renderer() = default;

int Renderer::add_mesh(const Triangles& triangles, const Points& rest_positions, const MeshLook& look,
                       const Appearance& appearance,
                       const std::vector<std::shared_ptr<const Image8>>& images) {
  validate(look);
  limber::validate(SurfaceMesh{rest_positions, triangles}, fmt::format("mesh '{}'", look.name));
  impl_->context.make_current();
  if (!appearance.empty())
    limber::validate(appearance, triangles.rows(), fmt::format("appearance of mesh '{}'", look.name));
  LIMBER_CHECK(images.size() == appearance.images.size(), look.name, images.size(), appearance.images.size());
  impl_->meshes.push_back({look, GpuMesh(triangles, rest_positions, look.crease_angle_deg, appearance)});
  Mesh& made = impl_->meshes.back();
  made.materials = appearance.materials;
  std::map<std::pair<int, bool>, ImageOnCard> on_card;  // an image once, as colors and as numbers
  const auto put = [&](int image, bool colors) {
    if (image < 0) return ImageOnCard{};
    const auto [at, fresh] = on_card.try_emplace({image, colors});
    if (fresh) at->second = image_on_card(*images[std::size_t(image)], colors);
    return at->second;
  };
  for (const SurfaceMaterial& material : made.materials) {
    made.images.push_back(put(material.image, true));
    made.normal_images.push_back(put(material.normal_image, false));
  }
  if (impl_->meshes.back().grained()) impl_->meshes.back().card.set_rest(rest_positions);
  return int(impl_->meshes.size()) - 1;
}

namespace {

void tint(Mesh& mesh) {
  Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> tints(mesh.card.vertices(), 4);
  const Vec3 plain = linear_from_srgb(mesh.look.color_srgb);
  for (Eigen::Index v = 0; v < tints.rows(); ++v) {
    const Vec3 color = mesh.colors.rows() > 0 ? Vec3(mesh.colors.row(v)) : plain;
    const double open = mesh.occlusion.size() > 0 ? 1 - mesh.occlusion[v] : 1;
    tints.row(v) << color.transpose().cast<float>(), float(open);
  }
  mesh.card.set_tints(tints);
}

}  // namespace

Mesh& Renderer::Impl::mesh_with(int number, Eigen::Index values, bool may_be_empty) {
  LIMBER_CHECK(0 <= number && number < int(meshes.size()), number, meshes.size());
  Mesh& mesh = meshes[std::size_t(number)];
  LIMBER_CHECK(values == mesh.card.vertices() || (may_be_empty && values == 0), mesh.look.name, values,
               mesh.card.vertices());
  context.make_current();
  return mesh;
}

void Renderer::set_positions(int number, const Points& positions, const Points& normals) {
  Mesh& mesh = impl_->mesh_with(number, positions.rows(), false);
  LIMBER_CHECK(positions.allFinite(), mesh.look.name);
  impl_->mesh_with(number, normals.rows(), true).card.set_positions(positions, normals);
}

void Renderer::set_colors(int number, const Points& colors_srgb) {
  Mesh& mesh = impl_->mesh_with(number, colors_srgb.rows(), true);
  LIMBER_CHECK(colors_srgb.allFinite() && mesh.card.drawn().batches.empty(), mesh.look.name);
  mesh.colors = colors_srgb.unaryExpr([](double c) { return linear_from_srgb(c); });
  tint(mesh);
}

void Renderer::set_occlusion(int number, const Eigen::VectorXd& occlusion) {
  Mesh& mesh = impl_->mesh_with(number, occlusion.size(), true);
  LIMBER_CHECK(occlusion.allFinite(), mesh.look.name);
  mesh.occlusion = occlusion;
  tint(mesh);
}

void Renderer::set_scalars(int number, const Eigen::VectorXd& values) {
  impl_->mesh_with(number, values.size(), false).card.set_scalars(values);
}

void Renderer::set_opacity(int number, double opacity) {
  MeshLook& look = impl_->mesh_with(number, 0, true).look;
  LIMBER_CHECK(look.opacity < 1 && 0 <= opacity && opacity < 1, look.name, look.opacity, opacity);
  look.opacity = opacity;
}

void Renderer::set_clip_planes(const std::vector<Plane>& planes) {
  require(planes.size() <= max_clip_planes,
          fmt::format("{} clip planes: at most {}", planes.size(), max_clip_planes));
  impl_->clip_planes.clear();
  for (std::size_t i = 0; i < planes.size(); ++i) {
    require(planes[i].allFinite() && planes[i].head<3>().norm() > 0,
            fmt::format("clip plane {}: its normal is zero, or a number is not finite", i));
    impl_->clip_planes.push_back(planes[i] / planes[i].head<3>().norm());
  }
}

int Renderer::add_lines(const Points& ends, const LineLook& look) {
  impl_->lines.push_back({look, {}});
  const int number = int(impl_->lines.size()) - 1;
  set_lines(number, ends);
  return number;
}

void Renderer::set_lines(int number, const Points& ends) {
  LIMBER_CHECK(0 <= number && number < int(impl_->lines.size()), number, impl_->lines.size());
  LIMBER_CHECK(ends.rows() % 2 == 0 && ends.allFinite(), ends.rows());
  impl_->lines[std::size_t(number)].ends = ends;
}

void Renderer::Impl::draw(const Camera& from, const RowReader& read, Passes* passes, StageTimes* times) {
  render::validate(from);
  context.make_current();
  double before = times ? cpu_seconds() : 0;
  const auto done = [&](double StageTimes::*stage) {
    if (!times) return;
    glFinish();  // or the next stage would pay
    const double now = cpu_seconds();
    times->*stage += now - std::exchange(before, now);
  };
  look_through(from);
  draw_shadow_map();
  done(&StageTimes::shadow_map_s);
  shade_ground_maps();
  done(&StageTimes::ground_s);
  draw_opaque(passes != nullptr);
  done(&StageTimes::opaque_s);
  if (has_veils()) {
    draw_veils();
    done(&StageTimes::veils_s);
  } else {
    draw_lines(LinePass::draw_all);
    done(&StageTimes::lines_s);
  }
  if (passes) *passes = finish_passes();
  finish(read);
  done(&StageTimes::finish_s);
}

Image Renderer::draw(const Camera& camera, Passes* passes, StageTimes* times) {
  const int width = impl_->look.width, height = impl_->look.height;
  Image image{width, height, {}};
  image.rgba.reserve(4 * std::size_t(width) * std::size_t(height));
  impl_->draw(
      camera,
      [&](int, std::span<const float> row) { image.rgba.insert(image.rgba.end(), row.begin(), row.end()); },
      passes, times);
  return image;
}

Image8 Renderer::draw_shown(const Camera& camera, Passes* passes, StageTimes* times) {
  const int width = impl_->look.width, height = impl_->look.height;
  Image8 image{width, height, std::vector<std::uint8_t>(3 * std::size_t(width) * std::size_t(height))};
  impl_->draw(
      camera,
      [&](int y, std::span<const float> row) {
        tone_mapped(row, y, &image.rgb[3 * std::size_t(width) * std::size_t(y)]);
      },
      passes, times);
  return image;
}

}  // namespace limber::render
