// What a picture is laid out for, and where light gets: the first stages of a picture. The view's near and
// far plane, the shadow map of the key light, and the ground's two maps of shade.
//
// Shadow maps and ground are laid out for the stage, the box over the whole motion, so that nothing swims
// from frame to frame. Between bodies shadows are percentage-closer soft shadows (Fernando 2005), whose
// widths the mesh shader finds from the map and from `shadow_softness`, set here. On the ground they come
// from height bands on the CPU (detail/ground_shade.h). Method: docs/rendering.md, 2, 3 and 6.
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/detail/renderer_impl.h"

namespace limber::render {

using detail::shade_ground;

namespace {

constexpr int ground_key_cells = 768, ground_sky_cells = 384;
// A level patch at height h hides the share h²/(π(h²+r²)²) of the sky from a place r beside its foot. Half a
// narrow and half a wide Gaussian (deviations in units of h) keep within 0.03 of what it sums to over a disk.
constexpr double sky_spreads[] = {0.5, 1.6};

// Row by row, as samples are (detail/draw_bodies.cpp).
void clear_depth(const Texture& map) {
  const float far = 1;
  glClearTexImage(map.id, 0, GL_DEPTH_COMPONENT, GL_FLOAT, &far);
}

}  // namespace

// Never empty, so that a picture of nothing has planes to lie between.
Box Renderer::Impl::shown() const {
  Box box;
  for (const Mesh& mesh : meshes)
    if (mesh.drawn()) box.include(mesh.card.box());
  for (const Lines& l : lines)
    if (l.ends.rows() > 0) box.include(bounding_box(l.ends));
  if (box.empty()) box.include(Vec3::Zero().eval());
  return box;
}

// Without RenderSettings::stage the box of the bodies that this frame shows, and of casters that are not
// seen.
Box Renderer::Impl::stage() const {
  if (!settings.stage.empty()) return settings.stage;
  Box box;
  for (const Mesh& mesh : meshes)
    if (!mesh.look.seen || mesh.drawn()) box.include(mesh.card.box());
  return box.empty() ? shown() : box;
}

// Near and far plane as tight as what is shown allows, so that depth keeps its resolution; the near plane is
// never nearer than a thousandth of the far one, also where the eye stands among the bodies.
void Renderer::Impl::look_through(const Camera& c) {
  camera = c;
  stage_box = stage();
  ground_seen = settings.ground_height_m && ground_plane.dot(camera.eye.homogeneous()) > 0;
  const Mat4 camera_from = camera_from_world(camera);
  double nearest = 1e300, farthest = -1e300;
  for_corners(shown(), [&](const Vec3& p) {
    const double depth = -(camera_from * p.homogeneous()).z();
    nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
  });
  far_m = std::max(1.01 * farthest, 1e-3);
  near_m = std::clamp(0.98 * nearest, 1e-3 * far_m, 0.9 * far_m);
  clip_from_world =
      clip_from_camera(camera.fov_deg, double(settings.width) / settings.height, near_m, far_m) * camera_from;
}

// Orthographic, along the key light, just large enough for the stage and all that casts, and four texels more
// on each side. In the light's frame x and y lie across the light and z points towards it; x, y and depth
// come out as 0 … 1 of the map (`shadow_from_world`).
//
// The half-shade h metres behind an edge has the radius h tan(key_size_deg). Both in units of the map, it is
// `shadow_softness` for each unit of depth between what hides the light and what is shaded.
//
// Seen bodies cast with both sides, pushed back so that they do not shade themselves. Of casters that are not
// seen only the faces turned from the light are drawn: what they enclose stays lit. But then the map does not
// tell where light enters a body. So where there are such casters, and a body that lets light through, a
// second map has the first surface that the light meets; the thickness is counted from there (Green, GPU Gems
// 16).
void Renderer::Impl::draw_shadow_map() {
  Camera light;
  light.target = stage_box.center();
  light.eye = light.target + settings.toward_key;
  light.up = std::abs(settings.toward_key.dot(settings.up)) > 0.99
                 ? ground.plane_from_world.row(1).transpose().eval()
                 : settings.up;
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
  shadow_softness = std::tan(settings.key_size_deg * std::numbers::pi / 180) * 1.02 * depth / side;

  glBindFramebuffer(GL_FRAMEBUFFER, targets.shadow_frame);
  glViewport(0, 0, shadow_size, shadow_size);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  clear_depth(targets.shadow_map);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5f, 2.0f);
  glCullFace(GL_FRONT);
  for (Mesh& mesh : meshes) {
    if (!mesh.casts()) continue;
    (mesh.look.seen ? glDisable : glEnable)(GL_CULL_FACE);
    use_depth(clip_from, mesh.planes);
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
  clear_depth(targets.entry_map);
  for (Mesh& mesh : meshes) {
    if (!mesh.casts()) continue;
    use_depth(clip_from, mesh.planes);
    mesh.card.draw();
  }
}

// The sky's map goes to the card, too: bodies are lit from below by less where the ground is in the dark.
// A light that is a disc of radius tan(key_size_deg) at a distance of 1 is replaced by a Gaussian of the same
// variance: along any axis its deviation is half of that radius.
void Renderer::Impl::shade_ground_maps() {
  std::vector<detail::GroundCaster> casters;
  Box box = stage_box;
  if (settings.ground_height_m)
    for (const Mesh& mesh : meshes)
      if (mesh.blocks() > 0)
        casters.push_back({&mesh.card.drawn(), float(mesh.blocks()), mesh.planes}),
            box.include(mesh.card.box());
  const double key_spreads[] = {0.5 * std::tan(settings.key_size_deg * std::numbers::pi / 180)};
  key_shade = shade_ground(casters, ground, settings.toward_key, key_spreads, box, ground_key_cells);
  sky_shade = shade_ground(casters, ground, settings.up, sky_spreads, box, ground_sky_cells);
  fill(targets.ground_sky_map, sky_shade.columns, sky_shade.rows, sky_shade.blocked.data());
}

}  // namespace limber::render
