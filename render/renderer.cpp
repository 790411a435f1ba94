#include "render/renderer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/error.h"
#include "render/detail/drawn_mesh.h"
#include "render/detail/gl_context.h"
#include "render/detail/ground_shade.h"
#include "render/detail/shaders.h"

namespace limber::render {

namespace {

using namespace detail;

constexpr int shadow_size = 2048;
constexpr int ground_key_cells = 768, ground_sky_cells = 384;
// A level patch at height h hides the share h²/(π(h²+r²)²) of the sky from a place r beside its foot. Half a
// narrow and half a wide Gaussian (deviations in units of h) keep within 0.03 of what it sums to over a disk.
constexpr double sky_spreads[] = {0.5, 1.6};
const Vec3 key_light(0.80, 0.78, 0.75);
const Vec3 sky_light(0.42, 0.445, 0.48);

class Program {
 public:
  Program(const char* vertex, const char* fragment) : id_(glCreateProgram()) {
    for (const auto& [kind, text] :
         {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
      const GLuint shader = glCreateShader(GLenum(kind));
      glShaderSource(shader, 1, &text, nullptr);
      glCompileShader(shader);
      glAttachShader(id_, shader);
      glDeleteShader(shader);
    }
    glLinkProgram(id_);
    GLint linked = 0;
    glGetProgramiv(id_, GL_LINK_STATUS, &linked);
    char log[2000] = "";
    glGetProgramInfoLog(id_, sizeof log, nullptr, log);
    LIMBER_CHECK(linked, log);
  }
  void use() const { glUseProgram(id_); }
  void set(const char* name, int v) const { glUniform1i(at(name), v); }
  void set(const char* name, double v) const { glUniform1f(at(name), float(v)); }
  void set(const char* name, const Eigen::Vector2d& v) const {
    glUniform2f(at(name), float(v.x()), float(v.y()));
  }
  void set(const char* name, const Vec3& v) const {
    glUniform3f(at(name), float(v.x()), float(v.y()), float(v.z()));
  }
  void set(const char* name, const Eigen::Vector4d& v) const {
    glUniform4f(at(name), float(v[0]), float(v[1]), float(v[2]), float(v[3]));
  }
  void set(const char* name, const Eigen::Matrix3d& m) const {
    glUniformMatrix3fv(at(name), 1, GL_FALSE, Eigen::Matrix3f(m.cast<float>()).data());
  }
  void set(const char* name, const Mat4& m) const {
    glUniformMatrix4fv(at(name), 1, GL_FALSE, Eigen::Matrix4f(m.cast<float>()).data());
  }

 private:
  GLint at(const char* name) const { return glGetUniformLocation(id_, name); }
  GLuint id_;
};

GLuint new_texture(GLenum filter, GLenum wrap) {
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GLint(filter));
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GLint(filter));
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GLint(wrap));
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GLint(wrap));
  return texture;
}

GLuint new_framebuffer(GLuint color, GLuint depth) {
  GLuint framebuffer = 0;
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  if (color) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color, 0);
  if (depth) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
  if (!color) glDrawBuffer(GL_NONE), glReadBuffer(GL_NONE);
  const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  LIMBER_CHECK(status == GL_FRAMEBUFFER_COMPLETE, status);
  return framebuffer;
}

void bind_texture(int unit, GLuint texture) {
  glActiveTexture(GLenum(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D, texture);
}

struct MeshOnCard {
  MeshLook look;
  DrawnMesh drawn;
  Eigen::Index vertices = 0;  // rows the caller hands over
  Box box;
  GLuint array = 0, position_buffer = 0, normal_buffer = 0;

  bool transparent() const { return look.opacity < 1; }
  bool casts() const { return look.opacity >= 0.5; }
};

struct Lines {
  LineLook look;
  Points ends;
};

void require(bool in_range, const std::string& what) {
  if (!in_range) throw InputError(what);
}

void validate(const Look& look) {
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
  for (int c = 0; c < 3; ++c) in(look.color_srgb[c], 0, 1, "a channel of its colour");
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

struct Renderer::Impl {
  explicit Impl(const Look& l);

  // The stages of a picture.
  Box shown() const;
  Box stage() const;
  void draw_shadow_map(const Box& stage);
  void shade_ground_maps(const Box& stage);
  void draw_meshes(const Camera&, const Mat4& clip_from_world, const Box& stage);
  void draw_lines(const Mat4& clip_from_world);
  Image finish(const Camera&, const Box& stage);

  Look look;
  GlContext context;
  Program mesh_program{mesh_vertex_shader, mesh_fragment_shader};
  Program shadow_program{shadow_vertex_shader, shadow_fragment_shader};
  Program line_program{line_vertex_shader, line_fragment_shader};
  Program picture_program{picture_vertex_shader, picture_fragment_shader};
  GLuint shadow_map, shadow_frame, samples, samples_depth, samples_frame, picture, picture_frame;
  GLuint ground_key_map, ground_sky_map, empty_array, line_array, line_buffer;
  std::vector<MeshOnCard> meshes;
  std::vector<Lines> lines;

  // Left by one stage for the next.
  Mat4 shadow_from_world = Mat4::Identity();
  double shadow_texel_m = 1;
  GroundFrame ground;
  ShadeMap key_shade, sky_shade;
};

Renderer::Impl::Impl(const Look& l) : look(l) {
  look.up.normalize();
  look.toward_key.normalize();
  ground = ground_frame(look.up, look.ground_height_m.value_or(0));
  const int width = look.width * look.supersampling, height = look.height * look.supersampling;

  shadow_map = new_texture(GL_LINEAR, GL_CLAMP_TO_BORDER);
  const float lit[] = {1, 1, 1, 1};
  glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, lit);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, shadow_size, shadow_size, 0, GL_DEPTH_COMPONENT,
               GL_FLOAT, nullptr);
  shadow_frame = new_framebuffer(0, shadow_map);

  samples = new_texture(GL_NEAREST, GL_CLAMP_TO_EDGE);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16F, width, height, 0, GL_RGBA, GL_FLOAT, nullptr);
  samples_depth = new_texture(GL_NEAREST, GL_CLAMP_TO_EDGE);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, width, height, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
  samples_frame = new_framebuffer(samples, samples_depth);

  picture = new_texture(GL_NEAREST, GL_CLAMP_TO_EDGE);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, look.width, look.height, 0, GL_RGBA, GL_FLOAT, nullptr);
  picture_frame = new_framebuffer(picture, 0);

  ground_key_map = new_texture(GL_LINEAR, GL_CLAMP_TO_EDGE);
  ground_sky_map = new_texture(GL_LINEAR, GL_CLAMP_TO_EDGE);
  glGenVertexArrays(1, &empty_array);
  glGenVertexArrays(1, &line_array);
  glGenBuffers(1, &line_buffer);
  glBindVertexArray(line_array);
  glBindBuffer(GL_ARRAY_BUFFER, line_buffer);
  glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 5 * sizeof(float), nullptr);
  glVertexAttribPointer(1, 1, GL_FLOAT, GL_FALSE, 5 * sizeof(float),
                        reinterpret_cast<void*>(4 * sizeof(float)));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
}

Box Renderer::Impl::shown() const {
  Box box;
  for (const MeshOnCard& mesh : meshes) box.include(mesh.box);
  for (const Lines& l : lines)
    if (l.ends.rows() > 0) box.include(bounding_box(l.ends));
  if (box.empty()) box.include(Vec3::Zero().eval());
  return box;
}

Box Renderer::Impl::stage() const {
  if (!look.stage.empty()) return look.stage;
  Box box;
  for (const MeshOnCard& mesh : meshes) box.include(mesh.box);
  return box.empty() ? shown() : box;
}

// Orthographic, along the key light, just large enough for the stage and all that casts.
void Renderer::Impl::draw_shadow_map(const Box& stage) {
  Camera light;
  light.target = stage.center();
  light.eye = light.target + look.toward_key;
  light.up = std::abs(look.toward_key.dot(look.up)) > 0.99 ? ground.plane_from_world.row(1).transpose().eval()
                                                           : look.up;
  const Mat4 light_from_world = camera_from_world(light);
  Box seen;
  const auto include = [&](const Vec3& p) {
    seen.include(Vec3((light_from_world * p.homogeneous()).head<3>()));
  };
  for_corners(stage, include);
  for (const MeshOnCard& mesh : meshes)
    if (mesh.casts()) for_corners(mesh.box, include);
  const double side = std::max({seen.size().x(), seen.size().y(), 1e-6}) * (1 + 8.0 / shadow_size);
  const double depth = std::max(seen.size().z(), 1e-6);
  shadow_texel_m = side / shadow_size;

  Mat4 clip_from_light = Mat4::Identity();
  clip_from_light.diagonal() << 2 / side, 2 / side, -2 / (1.02 * depth), 1;
  Mat4 clip_from_world = clip_from_light * light_from_world;
  clip_from_world.topRightCorner<3, 1>() -= (clip_from_light * seen.center().homogeneous()).head<3>();
  Mat4 half = Mat4::Identity();
  half.diagonal() << 0.5, 0.5, 0.5, 1;
  half.col(3) << 0.5, 0.5, 0.5, 1;
  shadow_from_world = half * clip_from_world;

  glBindFramebuffer(GL_FRAMEBUFFER, shadow_frame);
  glViewport(0, 0, shadow_size, shadow_size);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5f, 2.0f);
  shadow_program.use();
  shadow_program.set("clip_from_world", clip_from_world);
  for (const MeshOnCard& mesh : meshes) {
    if (!mesh.casts()) continue;
    glBindVertexArray(mesh.array);
    glDrawElements(GL_TRIANGLES, GLsizei(mesh.drawn.corners.size()), GL_UNSIGNED_INT, nullptr);
  }
  glDisable(GL_POLYGON_OFFSET_FILL);
}

void Renderer::Impl::shade_ground_maps(const Box& stage) {
  std::vector<const DrawnMesh*> casters;
  Box box = stage;
  if (look.ground_height_m)
    for (const MeshOnCard& mesh : meshes)
      if (mesh.casts()) casters.push_back(&mesh.drawn), box.include(mesh.box);
  const double key_spreads[] = {0.5 * std::tan(look.key_size_deg * std::numbers::pi / 180)};
  key_shade = shade_ground(casters, ground, look.toward_key, key_spreads, box, ground_key_cells);
  sky_shade = shade_ground(casters, ground, look.up, sky_spreads, box, ground_sky_cells);
  for (const auto& [texture, map] :
       {std::pair{ground_key_map, &key_shade}, std::pair{ground_sky_map, &sky_shade}}) {
    bind_texture(0, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, map->columns, map->rows, 0, GL_RED, GL_FLOAT,
                 map->blocked.data());
  }
}

void Renderer::Impl::draw_meshes(const Camera& camera, const Mat4& clip_from_world, const Box& stage) {
  glBindFramebuffer(GL_FRAMEBUFFER, samples_frame);
  glViewport(0, 0, look.width * look.supersampling, look.height * look.supersampling);
  glDepthMask(GL_TRUE);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);

  const Eigen::Vector4d ground_plane(ground.up.x(), ground.up.y(), ground.up.z(), -ground.height_m);
  const bool ground_hides = look.ground_height_m && ground_plane.dot(camera.eye.homogeneous()) > 0;
  const Vec3 ground_color = look.ground_height_m ? linear_from_srgb(look.ground_srgb) : Vec3::Zero();
  const Program& p = mesh_program;
  p.use();
  p.set("clip_from_world", clip_from_world);
  p.set("shadow_from_world", shadow_from_world);
  p.set("shadow_offset_m", 2.0 * shadow_texel_m);
  p.set("shadow_step", 1.7 / shadow_size);
  p.set("ground_x", Vec3(ground.plane_from_world.row(0)));
  p.set("ground_y", Vec3(ground.plane_from_world.row(1)));
  p.set("ground_lower", sky_shade.lower);
  p.set("ground_scale",
        Eigen::Vector2d(1 / (sky_shade.cell_m * sky_shade.columns), 1 / (sky_shade.cell_m * sky_shade.rows)));
  p.set("eye", camera.eye);
  p.set("up", look.up);
  p.set("toward_key", look.toward_key);
  p.set("key_light", key_light);
  p.set("sky_light", sky_light);
  p.set("ground_color", ground_color);
  p.set("ground_key", look.toward_key.dot(look.up));
  p.set("ground_height", ground.height_m);
  p.set("faced_m", std::max(0.05 * stage.diagonal(), 1e-6));
  p.set("shadow_map", 0);
  p.set("ground_sky_map", 1);
  bind_texture(0, shadow_map);
  bind_texture(1, ground_sky_map);

  const auto draw = [&](const MeshOnCard& mesh) {
    p.set("albedo", linear_from_srgb(mesh.look.color_srgb));
    p.set("roughness", mesh.look.roughness);
    p.set("metallic", mesh.look.metallic);
    p.set("opacity", mesh.look.opacity);
    bool below = false;
    for_corners(mesh.box, [&](const Vec3& c) { below |= ground_plane.dot(c.homogeneous()) < 0; });
    // A distance that is always positive as well, because Mesa 22.3 clips even where clipping is off.
    const bool cut = ground_hides && below;
    (cut ? glEnable : glDisable)(GL_CLIP_DISTANCE0);
    p.set("cut", cut ? ground_plane : Eigen::Vector4d(0, 0, 0, 1));
    glBindVertexArray(mesh.array);
    glDrawElements(GL_TRIANGLES, GLsizei(mesh.drawn.corners.size()), GL_UNSIGNED_INT, nullptr);
  };
  glDisable(GL_BLEND);
  std::vector<const MeshOnCard*> veils;
  for (const MeshOnCard& mesh : meshes)
    if (mesh.transparent())
      veils.push_back(&mesh);
    else
      draw(mesh);

  // Far ones first; of each only its nearest layer, found by a pass for the depth alone.
  const auto distance = [&](const MeshOnCard* mesh) { return (mesh->box.center() - camera.eye).norm(); };
  std::stable_sort(veils.begin(), veils.end(), [&](auto a, auto b) { return distance(a) > distance(b); });
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  for (const MeshOnCard* mesh : veils) {
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    draw(*mesh);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthFunc(GL_EQUAL);
    draw(*mesh);
    glDepthFunc(GL_LESS);
  }
  glDisable(GL_CLIP_DISTANCE0);
}

// Each segment becomes a quad of constant width on the screen, half a sample wider on each side for its soft
// edge.
void Renderer::Impl::draw_lines(const Mat4& clip_from_world) {
  const Eigen::Vector2d size = Eigen::Vector2d(look.width, look.height) * look.supersampling;
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  line_program.use();
  glBindVertexArray(line_array);
  glBindBuffer(GL_ARRAY_BUFFER, line_buffer);
  std::vector<float> corners;
  for (const Lines& l : lines) {
    const double half_width = 0.5 * l.look.width_px * look.supersampling;
    corners.clear();
    for (Eigen::Index i = 0; i + 1 < l.ends.rows(); i += 2) {
      Eigen::Vector4d a = clip_from_world * Vec3(l.ends.row(i)).homogeneous();
      Eigen::Vector4d b = clip_from_world * Vec3(l.ends.row(i + 1)).homogeneous();
      const double near_a = a.z() + a.w(), near_b = b.z() + b.w();  // > 0: in front of the near plane
      if (near_a <= 0 && near_b <= 0) continue;
      if (near_a <= 0) a += (b - a) * (near_a / (near_a - near_b)) * (1 + 1e-9);
      if (near_b <= 0) b += (a - b) * (near_b / (near_b - near_a)) * (1 + 1e-9);
      const Eigen::Vector2d along = (b.head<2>() / b.w() - a.head<2>() / a.w()).cwiseProduct(0.5 * size);
      if (!(along.norm() > 1e-9)) continue;
      const double reach = half_width + 0.5;
      const Eigen::Vector2d across = Eigen::Vector2d(-along.y(), along.x()).normalized() * reach;
      const auto corner = [&](const Eigen::Vector4d& end, double side) {
        const Eigen::Vector2d moved = end.head<2>() + side * across.cwiseQuotient(0.5 * size) * end.w();
        corners.insert(corners.end(), {float(moved.x()), float(moved.y()), float(end.z()), float(end.w()),
                                       float(side * reach)});
      };
      corner(a, -1), corner(b, -1), corner(b, 1);
      corner(a, -1), corner(b, 1), corner(a, 1);
    }
    if (corners.empty()) continue;
    const Vec3 color = linear_from_srgb(l.look.color_srgb);
    line_program.set("line_color", Eigen::Vector4d(color.x(), color.y(), color.z(), l.look.opacity));
    line_program.set("half_width", half_width);
    glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(corners.size() * sizeof(float)), corners.data(), GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, GLsizei(corners.size() / 5));
  }
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

Image Renderer::Impl::finish(const Camera& camera, const Box& stage) {
  glBindFramebuffer(GL_FRAMEBUFFER, picture_frame);
  glViewport(0, 0, look.width, look.height);
  glDisable(GL_DEPTH_TEST);
  const Program& p = picture_program;
  p.use();

  const double tangent = std::tan(0.5 * camera.fov_deg * std::numbers::pi / 180);
  const Eigen::Matrix3d axes = camera_from_world(camera).topLeftCorner<3, 3>().transpose();
  Eigen::Matrix3d ray;
  ray << axes.col(0) * (tangent * look.width / look.height), axes.col(1) * tangent, -axes.col(2);
  const auto shown_as = [](const Vec3& srgb) {
    return Vec3(linear_from_srgb(srgb).unaryExpr(&tone_unmapped));
  };
  const Eigen::Vector4d ground_plane(ground.up.x(), ground.up.y(), ground.up.z(), -ground.height_m);
  const double key_share = key_light.y() * look.toward_key.dot(look.up);
  p.set("ray_from_screen", ray);
  p.set("samples", 0);
  p.set("per_side", look.supersampling);
  p.set("last_row", look.height - 1);
  p.set("background_bottom", shown_as(look.background_bottom_srgb));
  p.set("background_top", shown_as(look.background_top_srgb));
  p.set("eye", camera.eye);
  p.set("ground", ground_plane);
  p.set("ground_x", Vec3(ground.plane_from_world.row(0)));
  p.set("ground_y", Vec3(ground.plane_from_world.row(1)));
  p.set("ground_color", shown_as(look.ground_srgb));
  p.set("ground_shown", look.ground_height_m && ground_plane.dot(camera.eye.homogeneous()) > 0 ? 1.0 : 0.0);
  p.set("key_share", key_share / (key_share + sky_light.y()));
  p.set("sky_darkening", 0.85);
  p.set("fade_middle", Eigen::Vector2d(ground.plane_from_world * stage.center()));
  p.set("fade_begin", 0.7 * stage.diagonal());
  p.set("fade_end", 2.6 * stage.diagonal() + 1e-6);
  p.set("ground_key_map", 1);
  p.set("ground_sky_map", 2);
  const auto place = [&](const ShadeMap& map, const char* lower, const char* scale) {
    p.set(lower, map.lower);
    p.set(scale, Eigen::Vector2d(1 / (map.cell_m * map.columns), 1 / (map.cell_m * map.rows)));
  };
  place(key_shade, "key_lower", "key_scale");
  place(sky_shade, "sky_lower", "sky_scale");
  bind_texture(0, samples);
  bind_texture(1, ground_key_map);
  bind_texture(2, ground_sky_map);
  glBindVertexArray(empty_array);
  glDrawArrays(GL_TRIANGLES, 0, 3);

  Image image{look.width, look.height, std::vector<float>(std::size_t(look.width) * look.height * 4)};
  glReadPixels(0, 0, look.width, look.height, GL_RGBA, GL_FLOAT, image.rgba.data());
  const GLenum error = glGetError();
  LIMBER_CHECK(error == GL_NO_ERROR, error);
  return image;
}

Renderer::Renderer(const Look& look) {
  validate(look);
  impl_ = std::make_unique<Impl>(look);
}
Renderer::~Renderer() = default;

int Renderer::add_mesh(const Triangles& triangles, const Points& rest_positions, const MeshLook& look) {
  validate(look);
  limber::validate(SurfaceMesh{rest_positions, triangles}, fmt::format("mesh '{}'", look.name));
  impl_->context.make_current();
  MeshOnCard mesh;
  mesh.look = look;
  mesh.vertices = rest_positions.rows();
  mesh.drawn = order_for_drawing(triangles, rest_positions, look.crease_angle_deg);
  glGenVertexArrays(1, &mesh.array);
  glBindVertexArray(mesh.array);
  GLuint buffers[3];
  glGenBuffers(3, buffers);
  for (int i = 0; i < 2; ++i) {
    glBindBuffer(GL_ARRAY_BUFFER, buffers[i]);
    glVertexAttribPointer(GLuint(i), 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(GLuint(i));
  }
  mesh.position_buffer = buffers[0], mesh.normal_buffer = buffers[1];
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[2]);
  const auto& corners = mesh.drawn.corners;
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(corners.size() * sizeof corners[0]), corners.data(),
               GL_STATIC_DRAW);
  impl_->meshes.push_back(std::move(mesh));
  const int number = int(impl_->meshes.size()) - 1;
  set_positions(number, rest_positions);
  return number;
}

void Renderer::set_positions(int number, const Points& positions, const Points& normals) {
  LIMBER_CHECK(0 <= number && number < int(impl_->meshes.size()), number, impl_->meshes.size());
  MeshOnCard& mesh = impl_->meshes[std::size_t(number)];
  LIMBER_CHECK(positions.rows() == mesh.vertices && positions.allFinite(), mesh.look.name, positions.rows(),
               mesh.vertices);
  LIMBER_CHECK(normals.rows() == 0 || normals.rows() == mesh.vertices, mesh.look.name, normals.rows(),
               mesh.vertices);
  impl_->context.make_current();
  deform(mesh.drawn, positions, normals);
  mesh.box = bounding_box(positions);
  for (const auto& [buffer, values] : {std::pair{mesh.position_buffer, &mesh.drawn.positions},
                                       std::pair{mesh.normal_buffer, &mesh.drawn.normals}}) {
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(values->size() * sizeof(float)), values->data(), GL_STREAM_DRAW);
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

Image Renderer::draw(const Camera& camera) {
  render::validate(camera);
  Impl& r = *impl_;
  r.context.make_current();

  const Mat4 camera_from = camera_from_world(camera);
  double nearest = 1e300, farthest = -1e300;
  for_corners(r.shown(), [&](const Vec3& p) {
    const double depth = -(camera_from * p.homogeneous()).z();
    nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
  });
  const double far_m = std::max(1.01 * farthest, 1e-3),
               near_m = std::clamp(0.98 * nearest, 1e-3 * far_m, 0.9 * far_m);
  const Mat4 clip_from_world =
      clip_from_camera(camera.fov_deg, double(r.look.width) / r.look.height, near_m, far_m) * camera_from;

  const Box stage = r.stage();
  r.draw_shadow_map(stage);
  r.shade_ground_maps(stage);
  r.draw_meshes(camera, clip_from_world, stage);
  r.draw_lines(clip_from_world);
  return r.finish(camera, stage);
}

}  // namespace limber::render
