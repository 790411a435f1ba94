#include "render/detail/targets.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <span>
#include <utility>

#include "core/error.h"
#include "render/detail/grain.h"

namespace limber::render::detail {

namespace {

Texture new_texture(GLenum filter, GLenum wrap) {
  Texture texture;
  glGenTextures(1, &texture.id);
  glBindTexture(GL_TEXTURE_2D, texture.id);
  for (const auto& [name, value] :
       {std::pair{GL_TEXTURE_MIN_FILTER, filter}, std::pair{GL_TEXTURE_MAG_FILTER, filter},
        std::pair{GL_TEXTURE_WRAP_S, wrap}, std::pair{GL_TEXTURE_WRAP_T, wrap}})
    glTexParameteri(GL_TEXTURE_2D, GLenum(name), GLint(value));
  return texture;
}

Texture new_target(GLenum format, const SampleGrid& grid) {
  if (grid.per_pixel > 0) {
    Texture texture{0, true};
    glGenTextures(1, &texture.id);
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, texture.id);
    glTexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, grid.per_pixel, format, grid.width, grid.height,
                            GL_TRUE);
    return texture;
  }
  const Texture texture = new_texture(GL_NEAREST, GL_CLAMP_TO_EDGE);
  const GLenum layout = format == GL_DEPTH_COMPONENT32F ? GL_DEPTH_COMPONENT
                        : format == GL_R32I             ? GL_RED_INTEGER
                                                        : GL_RGBA;
  glTexImage2D(GL_TEXTURE_2D, 0, GLint(format), grid.width, grid.height, 0, layout,
               format == GL_R32I ? GL_INT : GL_FLOAT, nullptr);
  return texture;
}

unsigned new_framebuffer(std::initializer_list<Texture> colors, Texture depth) {
  const auto target = [](const Texture& t) {
    return GLenum(t.multisampled ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D);
  };
  GLuint framebuffer = 0;
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  const GLenum places[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
  GLsizei count = 0;
  for (const Texture& color : colors)
    glFramebufferTexture2D(GL_FRAMEBUFFER, places[count++], target(color), color.id, 0);
  if (depth.id) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, target(depth), depth.id, 0);
  if (count > 0)
    glDrawBuffers(count, places);
  else
    glDrawBuffer(GL_NONE), glReadBuffer(GL_NONE);
  const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  LIMBER_CHECK(status == GL_FRAMEBUFFER_COMPLETE, status);
  return framebuffer;
}

}  // namespace

void Texture::bind(int unit) const {
  glActiveTexture(GLenum(GL_TEXTURE0 + unit));
  glBindTexture(multisampled ? GL_TEXTURE_2D_MULTISAMPLE : solid ? GL_TEXTURE_3D : GL_TEXTURE_2D, id);
}

namespace {

// Reads depths as they are, fully lit beyond the border.
GLuint depth_sampler(GLint filter) {
  const float lit[] = {1, 1, 1, 1};
  GLuint sampler = 0;
  glGenSamplers(1, &sampler);
  glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, filter);
  glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, filter);
  glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glSamplerParameteri(sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  glSamplerParameterfv(sampler, GL_TEXTURE_BORDER_COLOR, lit);
  return sampler;
}

}  // namespace

Targets::Targets(int width, int height, SampleGrid grid) : width_(width), height_(height), grid_(grid) {
  shadow_map = new_texture(GL_LINEAR, GL_CLAMP_TO_BORDER);
  const float lit[] = {1, 1, 1, 1};
  glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, lit);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, shadow_size, shadow_size, 0, GL_DEPTH_COMPONENT,
               GL_FLOAT, nullptr);
  shadow_frame = new_framebuffer({}, shadow_map);
  not_compared = depth_sampler(GL_NEAREST);
  blended = depth_sampler(GL_LINEAR);
  entry_map = new_texture(GL_LINEAR, GL_CLAMP_TO_BORDER);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, entry_size, entry_size, 0, GL_DEPTH_COMPONENT,
               GL_FLOAT, nullptr);
  entry_frame = new_framebuffer({}, entry_map);

  samples = new_target(GL_RGBA16F, grid);
  samples_depth = new_target(GL_DEPTH_COMPONENT32F, grid);
  samples_frame = new_framebuffer({samples}, samples_depth);
  ground_sky_map = new_texture(GL_LINEAR, GL_CLAMP_TO_EDGE);
}

const Targets::Passes& Targets::passes() {
  if (passes_.object.id == 0) {
    passes_.normal_scalar = new_target(GL_RGBA32F, grid_);
    passes_.object = new_target(GL_R32I, grid_);
    passes_.frame = new_framebuffer({samples, passes_.normal_scalar, passes_.object}, samples_depth);
    const SampleGrid pixels{width_, height_, 0};
    passes_.pixel_normal_scalar = new_target(GL_RGBA32F, pixels);
    passes_.pixel_object = new_target(GL_R32I, pixels);
    passes_.pixel_depth = new_target(GL_R32F, pixels);
    passes_.pixel_frame =
        new_framebuffer({passes_.pixel_normal_scalar, passes_.pixel_depth, passes_.pixel_object}, {});
  }
  return passes_;
}

const Texture& Targets::grain(bool woven) {
  Texture& grain = grains_[woven];
  if (grain.id != 0) return grain;
  grain.solid = true;
  glGenTextures(1, &grain.id);
  grain.bind(0);
  for (const auto& [name, value] :
       {std::pair{GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST},
        std::pair{GL_TEXTURE_MAG_FILTER, GL_LINEAR}, std::pair{GL_TEXTURE_WRAP_S, GL_REPEAT},
        std::pair{GL_TEXTURE_WRAP_T, GL_REPEAT}, std::pair{GL_TEXTURE_WRAP_R, GL_REPEAT}})
    glTexParameteri(GL_TEXTURE_3D, GLenum(name), value);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_RGBA8, grain_cells, grain_cells, grain_cells, 0, GL_RGBA,
               GL_UNSIGNED_BYTE, grain_slopes(woven).data());
  glGenerateMipmap(GL_TEXTURE_3D);
  return grain;
}

unsigned Targets::resolved_frame() {
  if (resolved_frame_ == 0)
    resolved_frame_ = new_framebuffer({new_target(GL_RGBA16F, {grid_.width, grid_.height, 0})}, {});
  return resolved_frame_;
}

namespace {

// Framebuffers without attachments have no samples in Mesa 22.3, so there is one that nothing is written to.
struct FourSamples {
  GLuint frame = 0, unused = 0;
  FourSamples(int width, int height) {
    glGenFramebuffers(1, &frame);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glGenRenderbuffers(1, &unused);
    glBindRenderbuffer(GL_RENDERBUFFER, unused);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, 4, GL_R8, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, unused);
    const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    LIMBER_CHECK(status == GL_FRAMEBUFFER_COMPLETE, status);
  }
};

}  // namespace

unsigned Targets::four_samples_frame() {
  if (four_samples_frame_ == 0) four_samples_frame_ = FourSamples(width_, height_).frame;
  return four_samples_frame_;
}

std::optional<SamplePlaces> four_samples() {
  const FourSamples one(1, 1);
  SamplePlaces places;
  int quarters = 0;
  for (unsigned i = 0; i < 4; ++i) {
    GLfloat at[2] = {0, 0};
    glGetMultisamplefv(GL_SAMPLE_POSITION, i, at);
    places[i] = Eigen::Vector2d(at[0] - 0.5, at[1] - 0.5);
    quarters |= 1 << ((at[0] > 0.5 ? 1 : 0) + (at[1] > 0.5 ? 2 : 0));
  }
  glDeleteFramebuffers(1, &one.frame);
  glDeleteRenderbuffers(1, &one.unused);
  return quarters == 15 ? std::optional(places) : std::nullopt;
}

void fill(const Texture& texture, int columns, int rows, const float* values) {
  texture.bind(0);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, columns, rows, 0, GL_RED, GL_FLOAT, values);
}

}  // namespace limber::render::detail
