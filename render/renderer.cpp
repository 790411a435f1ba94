// The renderer's interface: it checks what it is given, keeps meshes and lines, and makes a picture stage by
// stage. The stages are files of their own, listed in render/detail/renderer_impl.h; method and figures are
// in docs/rendering.md.
//
// What always holds: InputError for what users can write (settings, looks, meshes, clip planes), LIMBER_CHECK
// for what only our own callers can get wrong (numbers of meshes, sizes of arrays); and every call that
// touches OpenGL first makes this renderer's context current.
#include "render/renderer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/progress.h"
#include "render/cut.h"
#include "render/detail/line_quads.h"
#include "render/detail/outward.h"
#include "render/detail/renderer_impl.h"

namespace limber::render {

using detail::ground_frame;
using detail::image_on_card;
using detail::line_corner_floats;

namespace {

constexpr double cap_shade = 0.86, rim_shade = 0.6;  // of the mesh's color, sRGB
constexpr double rim_px = 1.6;
constexpr double cap_step = 5e-5;  // of the farthest that is seen

// ---- what is asked for, checked ----

void require(bool in_range, const std::string& what) {
  if (!in_range) throw InputError(what);
}

// Ranges are checked here and nowhere else. The key light must stand above the horizon, by an angle whose
// sine is 0.05: shadows on the ground are as long as 1 / tan of it, and need an end.
void validate(const RenderSettings& settings) {
  require(1 <= settings.width && settings.width <= 8192 && 1 <= settings.height && settings.height <= 8192,
          fmt::format("picture of {}×{}: width and height must lie between 1 and 8192", settings.width,
                      settings.height));
  require(1 <= settings.supersampling && settings.supersampling <= 4,
          fmt::format("supersampling is {}, but must lie between 1 and 4", settings.supersampling));
  require(
      std::max(settings.width, settings.height) * settings.supersampling <= 16384,
      fmt::format("picture of {}×{} with supersampling {}: at most 16384 samples a side; lower one of them",
                  settings.width, settings.height, settings.supersampling));
  require(settings.up.allFinite() && settings.up.norm() > 0, "up is zero or not finite");
  require(settings.toward_key.allFinite() &&
              settings.toward_key.normalized().dot(settings.up.normalized()) > 0.05,
          "the key light must stand at least 3 degrees above the horizon");
  require(0 <= settings.key_size_deg && settings.key_size_deg <= 30,
          fmt::format("key_size_deg is {}, but must lie between 0 and 30", settings.key_size_deg));
  for (const Vec3* light : {&settings.key_light, &settings.sky_light})
    require(light->allFinite() && light->minCoeff() >= 0 && light->maxCoeff() <= 4,
            "key_light and sky_light must lie between 0 and 4 in each channel");
  require(!settings.ground_height_m || std::isfinite(*settings.ground_height_m),
          "ground_height_m is not finite");
}

// `in` names mesh and field, so that whoever wrote the value finds it.
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

}  // namespace

// Of each axis the four edges along it: `side` has a bit for each of the two other axes, at its upper end or
// not.
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

// How a shader reads the samples of a pixel: four of one texel (MSAA), or a square of texels in a picture
// that is `supersampling` times as wide and high as the finished one.
std::string sample_defines(const RenderSettings& settings) {
  if (settings.multisampling)
    return "#define SAMPLER sampler2DMS\n#define INTEGER_SAMPLER isampler2DMS\n#define SAMPLES 4\n"
           "#define FETCH(samples, pixel, i) texelFetch(samples, pixel, i)\n";
  return fmt::format(
      "#define SAMPLER sampler2D\n#define INTEGER_SAMPLER isampler2D\n#define SAMPLES {1}\n"
      "#define FETCH(samples, pixel, i) texelFetch(samples, pixel * {0} + ivec2(i % {0}, i / {0}), 0)\n",
      settings.supersampling, settings.supersampling * settings.supersampling);
}

// How the lists of layers are shared: four samples of a pixel have one list (a rasterizer of four samples a
// pixel then draws transparent surfaces), else each sample has its own.
std::string list_defines(const RenderSettings& settings, const std::optional<SamplePlaces>& four) {
  std::string defines = fmt::format("#define SAMPLES_A_LIST {}\n", four ? 4 : 1);
  if (!four) return defines + "#define LIST ivec2(gl_FragCoord.xy)\n#define SAMPLE 1u\n";
  const auto table = [](const auto& write) {
    return fmt::format("({}, {}, {}, {})[i]\n", write(0), write(1), write(2), write(3));
  };
  const auto quarter = [&](int i) { return ((*four)[i].x() > 0 ? 1 : 0) + ((*four)[i].y() > 0 ? 2 : 0); };
  const bool texel = settings.multisampling;
  defines += texel ? "#define LIST ivec2(gl_FragCoord.xy)\n#define SAMPLE (1u << gl_SampleID)\n"
                   : "#define LIST (ivec2(gl_FragCoord.xy) >> 1)\n"
                     "#define SAMPLE (1u << ((int(gl_FragCoord.x) & 1) | (int(gl_FragCoord.y) & 1) << 1))\n";
  defines += "#define DEPTH_SAMPLE(i) int[4]" +
             table([&](int i) { return fmt::format("{}", texel ? i : quarter(i)); });
  defines += "#define DEPTH_PLACE(i) vec2[4]" + table([&](int i) {
               const Eigen::Vector2d place =
                   texel ? (*four)[i] : Eigen::Vector2d((*four)[i].array().sign() * 0.25);
               return fmt::format("vec2({}, {})", place.x(), place.y());
             });
  return defines;
}

}  // namespace

SampleGrid detail::sample_grid(const RenderSettings& settings) {
  if (settings.multisampling) return {settings.width, settings.height, 4};
  return {settings.width * settings.supersampling, settings.height * settings.supersampling, 0};
}

// ---- the order of the stages ----

// Directions become unit vectors once, here. Corners of lines have four floats of place in clip space, and
// the distance from the middle of the line (detail/line_quads.h).
Renderer::Impl::Impl(const RenderSettings& l)
    : settings(l),
      samples(sample_defines(l)),
      targets(l.width, l.height, sample_grid(l)),
      four_samples(l.multisampling || l.supersampling == 2 ? detail::four_samples() : std::nullopt),
      with_lists(samples + list_defines(l, four_samples) + detail::layer_lists),
      lists(four_samples ? l.width : sample_grid(l).width, four_samples ? l.height : sample_grid(l).height) {
  settings.up.normalize();
  settings.toward_key.normalize();
  ground = ground_frame(settings.up, settings.ground_height_m.value_or(0));
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

bool Renderer::Impl::has_transparent() const {
  return std::any_of(meshes.begin(), meshes.end(),
                     [](const Mesh& m) { return m.drawn() && m.transparent(); });
}

// Stage after stage. Where there are transparent surfaces, lines are drawn with them: by OpenGL what of a
// line lies before a transparent surface goes into the transparent surface's lists. Passes and picture come
// from one drawing, so they agree sample by sample.
void Renderer::Impl::draw(const Camera& from, const RowReader& read, Passes* passes, StageTimes* times) {
  render::validate(from);
  context.make_current();
  remove_caps();  // of a picture that failed
  double before = times ? cpu_seconds() : 0;
  const auto done = [&](double StageTimes::*stage) {
    if (!times) return;
    glFinish();  // or the next stage would pay
    const double now = cpu_seconds();
    times->*stage += now - std::exchange(before, now);
  };
  look_through(from);
  add_caps();
  draw_shadow_map();
  done(&StageTimes::shadow_map_s);
  shade_ground_maps();
  done(&StageTimes::ground_s);
  draw_opaque(passes != nullptr);
  done(&StageTimes::opaque_s);
  if (!are_layered && has_transparent()) {
    draw_transparent();
    done(&StageTimes::transparent_s);
  } else if (!are_layered) {
    draw_lines(LinePass::draw_all);
    done(&StageTimes::lines_s);
  }
  if (passes) *passes = finish_passes();
  finish(read);
  done(&StageTimes::finish_s);
  remove_caps();
}

// In linear light, for whoever computes with it or writes 16 bits a channel.
Image Renderer::draw(const Camera& camera, Passes* passes, StageTimes* times) {
  const int width = impl_->settings.width, height = impl_->settings.height;
  Image image{width, height, {}};
  image.rgba.reserve(4 * std::size_t(width) * std::size_t(height));
  impl_->draw(
      camera,
      [&](int, std::span<const float> row) { image.rgba.insert(image.rgba.end(), row.begin(), row.end()); },
      passes, times);
  return image;
}

// Each row is tone-mapped as soon as it is there, so the linear picture is never held as a whole.
Image8 Renderer::draw_shown(const Camera& camera, Passes* passes, StageTimes* times) {
  const int width = impl_->settings.width, height = impl_->settings.height;
  Image8 image{width, height, std::vector<std::uint8_t>(3 * std::size_t(width) * std::size_t(height))};
  impl_->draw(
      camera,
      [&](int y, std::span<const float> row) {
        tone_mapped(row, y, &image.rgb[3 * std::size_t(width) * std::size_t(y)]);
      },
      passes, times);
  return image;
}

// ---- meshes and lines ----

Renderer::Renderer(const RenderSettings& settings) {
  validate(settings);
  impl_ = std::make_unique<Impl>(settings);
}
Renderer::~Renderer() = default;

// Images go to the card once each, but twice where one serves as colours (sRGB, decoded) and as numbers
// (normals).
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
  made.number = int(impl_->meshes.size()) - 1;
  made.materials = appearance.materials;
  made.outward = look.seen && detail::looks_outward(rest_positions, triangles);
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

// Colours and occlusion share one attribute a vertex: linear colour, and the share of the sky that is open.
// So what was set of one is kept when the other is set.
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

// The way of all setters: checks the number of the mesh and of its values, and makes the context current.
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

// Kept in linear light, so that what lies between two vertices is blended as light is.
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

// Of transparent surfaces alone: one that became opaque would lack what opaque meshes get when they are added
// (its places at rest, for the relief).
void Renderer::set_opacity(int number, double opacity) {
  MeshLook& look = impl_->mesh_with(number, 0, true).look;
  LIMBER_CHECK(look.opacity < 1 && 0 <= opacity && opacity < 1, look.name, look.opacity, opacity);
  look.opacity = opacity;
}

// Planes are kept with unit normals, so that n·p + d is a distance in metres.
void Renderer::set_clip_planes(int number, const std::vector<Plane>& planes) {
  Mesh& mesh = impl_->mesh_with(number, 0, true);
  require(planes.size() <= max_clip_planes, fmt::format("mesh '{}': {} clip planes: at most {}",
                                                        mesh.look.name, planes.size(), max_clip_planes));
  for (std::size_t i = 0; i < planes.size(); ++i)
    require(planes[i].allFinite() && planes[i].head<3>().norm() > 0,
            fmt::format("mesh '{}': clip plane {}: its normal is zero, or a number is not finite",
                        mesh.look.name, i));
  mesh.planes.clear();
  for (const Plane& plane : planes) mesh.planes.push_back(plane / plane.head<3>().norm());
  if (mesh.planes.empty() || mesh.solid) return;
  mesh.triangles = mesh.card.triangles();
  mesh.solid = has_inside(mesh.triangles);
}

namespace {

struct Cap {
  std::size_t mesh;
  Plane plane;
  SurfaceMesh face;
  double area_m2;
};

// Caps of several meshes in one plane lie in one another: where one mesh is inside another, its own is to be
// seen. That is the smaller one, so each stands before all larger ones of its plane, by a little that
// depths can tell apart.
void put_smaller_before_larger(std::vector<Cap>& caps, double step_m) {
  std::stable_sort(caps.begin(), caps.end(),
                   [](const Cap& a, const Cap& b) { return a.area_m2 > b.area_m2; });
  for (std::size_t c = 0; c < caps.size(); ++c) {
    const Plane& plane = caps[c].plane;
    const auto larger = std::count_if(caps.begin(), caps.begin() + std::ptrdiff_t(c), [&](const Cap& other) {
      return (other.plane - plane).cwiseAbs().maxCoeff() <= 1e-9 * (1 + plane.cwiseAbs().maxCoeff());
    });
    caps[c].face.positions.rowwise() -= double(larger) * step_m * plane.head<3>().transpose();
  }
}

}  // namespace

// A cap is a mesh of the frame; in passes it is of the mesh that it closes. Casters that are not seen cast by
// their far sides alone, and the cap of what they stand in for is seen.
void Renderer::Impl::add_caps() {
  std::vector<Cap> faces;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (meshes[m].planes.empty() || !*meshes[m].solid || !meshes[m].drawn()) continue;
    const Points positions = meshes[m].card.positions();
    for (std::size_t i = 0; i < meshes[m].planes.size(); ++i) {
      std::vector<Plane> others = meshes[m].planes;
      others.erase(others.begin() + std::ptrdiff_t(i));
      const Plane& plane = meshes[m].planes[i];
      SurfaceMesh face = clipped(cap_of(positions, meshes[m].triangles, plane), others);
      if (face.triangles.rows() == 0) continue;
      const double area_m2 = area(face);
      faces.push_back({m, plane, std::move(face), area_m2});
    }
  }
  put_smaller_before_larger(faces, cap_step * far_m);
  for (const Cap& cap : faces) {
    MeshLook look = meshes[cap.mesh].look;
    const Vec3 rim_color = rim_shade * look.color_srgb;
    look.color_srgb *= cap_shade;
    look.roughness = std::max(look.roughness, 0.7), look.metallic = look.sheen = 0;
    look.grain = look.translucency = 0;
    look.edges.reset();
    Mesh made{look, GpuMesh(cap.face.triangles, cap.face.positions, 180)};
    made.number = meshes[cap.mesh].number;
    made.solid = true;
    meshes.push_back(std::move(made));
    ++caps;
    if (look.opacity == 1) continue;  // a transparent surface's is hardly seen without its rim
    lines.push_back({{.color_srgb = rim_color, .width_px = rim_px, .opacity = 0.9}, rim_of(cap.face)});
    ++rims;
  }
}

void Renderer::Impl::remove_caps() {
  for (; caps > 0; --caps) {
    meshes.back().card.release();
    meshes.pop_back();
  }
  for (; rims > 0; --rims) lines.pop_back();
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

}  // namespace limber::render
