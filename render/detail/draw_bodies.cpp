// The drawing of opaque bodies, and the programs by which all bodies are drawn: what cuts them, which variant
// of the mesh shader they take, and all its uniforms.
//
// A variant is compiled for each set of defines when it is first wanted (Variants), so a body without images,
// relief or light that shines through pays for none of these. The shading itself (Lambert and GGX, sky and
// ground, occlusion) is in detail/shaders.cpp. Method: docs/rendering.md, 4, 8, 9 and 10.
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/error.h"
#include "render/detail/grain.h"
#include "render/detail/renderer_impl.h"

namespace limber::render {

using detail::grain_waves;

// Its light is only ever seen mirrored: the key light's direction turned by 110° about up, 25° above the
// horizon.
Vec3 detail::toward_soft_box(const RenderSettings& settings) {
  const Vec3 level = settings.toward_key - settings.toward_key.dot(settings.up) * settings.up;
  const Vec3 turned = level.norm() > 1e-6
                          ? Eigen::AngleAxisd(110 * std::numbers::pi / 180, settings.up) * level.normalized()
                          : settings.up.unitOrthogonal();
  const double height = 25 * std::numbers::pi / 180;
  return std::cos(height) * turned + std::sin(height) * settings.up;
}

// ---- what cuts a mesh ----

// What is below the ground is cut off, too, where the eye sees it from above. The undersides of transparent
// surfaces, which are seen through them, stay whole where they stand on it and sink in a little.
std::vector<Plane> Renderer::Impl::planes_of(const Mesh& mesh) const {
  std::vector<Plane> planes = mesh.planes;
  Plane plane = ground_plane;
  if (mesh.transparent()) plane[3] += 0.005 * stage_box.size().norm();
  bool below = false;
  for_corners(mesh.card.box(), [&](const Vec3& c) { below |= plane.dot(c.homogeneous()) < 0; });
  if (ground_seen && below) planes.push_back(plane);
  return planes;
}

// Mesa 22.3 clips by what a shader writes even where clipping is off: so a shader writes as many as are
// wanted.
std::string detail::plane_defines(const std::vector<render::Plane>& planes) {
  for (int i = 0; i <= max_clip_planes; ++i)
    (i < int(planes.size()) ? glEnable : glDisable)(GLenum(GL_CLIP_DISTANCE0 + i));
  return fmt::format("#define PLANES {}\n", planes.size());
}

namespace {

void set_planes(const Program& program, const std::vector<Plane>& planes) {
  for (std::size_t i = 0; i < planes.size(); ++i)
    program.set(fmt::format("planes[{}]", i).c_str(), planes[i]);
}

}  // namespace

// ---- programs ----

// For shadow maps: depth alone.
void Renderer::Impl::use_depth(const Mat4& clip_from, const std::vector<Plane>& planes) {
  const Program& p = depth_programs.with(plane_defines(planes));
  p.use();
  p.set("clip_from_world", clip_from);
  set_planes(p, planes);
}

namespace {

// The colour that a part of a mesh has, all in all: of its material where it has one, else of its look.
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

// The program of a mesh, or of the part of it that one material covers, in use and with all its uniforms.
// `defines` says what is drawn (passes, transparent surfaces); the rest follows from the mesh. Lengths that
// the shader compares with the shadow map are handed over in its units: 1 is the side of the map across the
// light, and its range of depth along the light. Texture units: 0 and 2 the shadow map (compared, and as it
// is), 1 the ground's sky, 3 where light enters, 4 relief, 5 image, 6 image of normals.
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
  if (!mesh.planes.empty() && !(mesh.transparent() && *mesh.solid)) all += "#define FLAT_INSIDE\n";
  const Program& p = mesh_programs.with(all);
  p.use();
  set_planes(p, planes);
  p.set("clip_from_world", clip_from_world);
  p.set("shadow_from_world", shadow_from_world);
  p.set("shadow_offset_m", 2.0 * shadow_texel_m);
  p.set("shadow_from_normal", shadow_from_normal);
  p.set("shadow_softness", shadow_softness);
  p.set("min_shadow", detail::min_shadow);
  p.set("max_shadow", detail::max_shadow);
  p.set("ground_x", Vec3(ground.plane_from_world.row(0)));
  p.set("ground_y", Vec3(ground.plane_from_world.row(1)));
  p.set("ground_lower", sky_shade.lower);
  p.set("ground_scale",
        Eigen::Vector2d(1 / (sky_shade.cell_m * sky_shade.columns), 1 / (sky_shade.cell_m * sky_shade.rows)));
  p.set("eye", camera.eye);
  p.set("up", settings.up);
  p.set("toward_key", settings.toward_key);
  p.set("toward_box", detail::toward_soft_box(settings));
  p.set("key_light", settings.key_light);
  p.set("sky_light", settings.sky_light);
  p.set("ground_color",
        settings.ground_height_m ? linear_from_srgb(settings.ground_srgb) : Vec3(Vec3::Zero()));
  p.set("ground_key", settings.toward_key.dot(settings.up));
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
    // A colour that the material lacks gets three tenths as far as the one it has most of.
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
  p.set("object", mesh.number);
  return p;
}

// The surface stands back by as much as its depth changes over half the width of a line (the first number is
// a multiple of the slope of its depth a sample), and a little more for rounding.
double detail::stand_back(const Mesh& mesh, int samples_per_pixel_side) {
  return mesh.look.edges ? 0.5 * mesh.look.edges->width_px * samples_per_pixel_side + 1.5 : 0;
}
void detail::stand_back_for_edges(const Mesh& mesh, int samples_per_pixel_side) {
  (mesh.look.edges ? glEnable : glDisable)(GL_POLYGON_OFFSET_FILL);
  if (mesh.look.edges) glPolygonOffset(float(stand_back(mesh, samples_per_pixel_side)), 4.0f);
}

// ---- the stage ----

// Of a body that looks outward nobody sees the back, unless it is cut open or the eye may be in it; its back
// triangles are half of all.
bool Renderer::Impl::hides_its_back(const Mesh& mesh) const {
  const Box& box = mesh.card.box();
  const bool outside =
      (camera.eye.array() < box.lower.array()).any() || (camera.eye.array() > box.upper.array()).any();
  return mesh.outward && mesh.planes.empty() && outside;
}

// Clears all targets and draws what is opaque, colours and depth; with `passes` also normal, scalar and
// number of the mesh of every sample, into targets of their own. What is drawn nowhere keeps alpha 0, no
// object (−1) and no scalar (NaN). Colours and depth are of the tiles where these can be drawn, with passes
// too.
void Renderer::Impl::draw_opaque(bool passes) {
  if (!passes && draw_in_tiles()) return;
  clean_tiles.clear();
  glBindFramebuffer(GL_FRAMEBUFFER, passes ? targets.passes().frame : targets.samples_frame);
  const SampleGrid grid = sample_grid(settings);
  glViewport(0, 0, grid.width, grid.height);
  glDepthMask(GL_TRUE);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glCullFace(GL_BACK);
  const float nothing[4] = {0, 0, 0, 0}, no_scalar[4] = {0, 0, 0, NAN}, far[1] = {1};
  const int no_object[4] = {-1, 0, 0, 0};
  drawn = passes ? Rectangle{0, 0, grid.width, grid.height} : extent_of_drawn();
  if (settings.multisampling) {
    glClearBufferfv(GL_COLOR, 0, nothing);
    glClearBufferfv(GL_DEPTH, 0, far);
  } else if (drawn.right > 0) {  // row by row: llvmpipe clears buffers tile by tile, five times as long
    const auto clear = [&](const Texture& texture, GLenum format, const float* value) {
      glClearTexSubImage(texture.id, 0, drawn.left, drawn.top, 0, drawn.right - drawn.left,
                         drawn.bottom - drawn.top, 1, format, GL_FLOAT, value);
    };
    clear(targets.samples, GL_RGBA, nothing);
    clear(targets.samples_depth, GL_DEPTH_COMPONENT, far);
  }
  if (passes) {
    glClearBufferfv(GL_COLOR, 1, no_scalar);
    glClearBufferiv(GL_COLOR, 2, no_object);
  }
  // The nearest first: what it hides is not shaded. Distances are of middles of boxes.
  std::vector<std::pair<double, const Mesh*>> order;
  for (const Mesh& mesh : meshes)
    if (mesh.look.seen && !mesh.transparent())
      order.emplace_back((mesh.card.box().center() - camera.eye).norm(), &mesh);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [distance, opaque] : order) {
    const Mesh& mesh = *opaque;
    stand_back_for_edges(mesh, settings.multisampling ? 1 : settings.supersampling);
    (hides_its_back(mesh) ? glEnable : glDisable)(GL_CULL_FACE);
    draw_mesh(mesh, passes ? "#define PASSES\n" : "", [](const Program&) {});
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_POLYGON_OFFSET_FILL);
  plane_defines({});
  if (passes && draw_in_tiles()) glBindFramebuffer(GL_FRAMEBUFFER, targets.passes().frame);
}

}  // namespace limber::render
