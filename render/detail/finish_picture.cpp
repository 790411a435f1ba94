// From samples to what the caller gets: the picture over background and ground, row by row, and the passes.
//
// Samples are read back as they are (half floats, 66 MB for 1920 × 1080 with four a pixel) and averaged on
// the CPU, which took half the time of doing it in llvmpipe (detail/compositor.h). With multisampling OpenGL
// averages them first. Passes are one value a pixel, of the sample nearest to the eye: averages of depths,
// normals or numbers of meshes over an edge would mean nothing. Method: docs/rendering.md, 11.
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <cmath>

#include "core/error.h"
#include "render/detail/compositor.h"
#include "render/detail/renderer_impl.h"

namespace limber::render {

using detail::Backdrop;
using detail::Compositor;

// Colours of background and ground pass through the tone map's inverse, so that they come out as they were
// typed. `key_share`, colour by colour, is the part of the light on open, level ground that the key light
// has; a shadow takes away that part alone, so under a warm key it is cool. The ground becomes the far ground
// between half and four diagonals of the stage from its middle, and the horizon's colour by d²/(d² + h²) with
// h = 18 diagonals.
void Renderer::Impl::finish(const RowReader& read) {
  const SampleGrid grid = sample_grid(settings);
  const int per_side = settings.multisampling ? 1 : settings.supersampling;
  const unsigned frame = settings.multisampling ? targets.resolved_frame() : targets.samples_frame;
  if (settings.multisampling) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, targets.samples_frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, frame);
    glBlitFramebuffer(0, 0, grid.width, grid.height, 0, 0, grid.width, grid.height, GL_COLOR_BUFFER_BIT,
                      GL_NEAREST);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  const int columns = drawn.right - drawn.left, rows = drawn.bottom - drawn.top;
  halves.resize(4 * std::size_t(columns) * std::size_t(rows));
  if (columns > 0) glReadPixels(drawn.left, drawn.top, columns, rows, GL_RGBA, GL_HALF_FLOAT, halves.data());
  const GLenum error = glGetError();
  LIMBER_CHECK(error == GL_NO_ERROR, error);

  const auto shown_as = [](const Vec3& srgb) {
    return Vec3(linear_from_srgb(srgb).unaryExpr(&tone_unmapped));
  };
  const Vec3 key = settings.key_light * settings.toward_key.dot(settings.up), all = key + settings.sky_light;
  const Vec3 key_share = key.cwiseQuotient(all.cwiseMax(1e-9));
  const Backdrop backdrop{
      .background_top = shown_as(settings.background_top_srgb),
      .background_bottom = shown_as(settings.background_bottom_srgb),
      .ground_seen = ground_seen,
      .ground = ground,
      .ground_color = shown_as(settings.ground_srgb),
      .key_shade = &key_shade,
      .sky_shade = &sky_shade,
      .far_ground_color = shown_as(settings.far_ground_srgb.value_or(settings.background_bottom_srgb)),
      .key_share = key_share,
      .fade_middle = stage_box.center(),
      .fade_begin_m = 0.5 * stage_box.diagonal(),
      .fade_end_m = 4 * stage_box.diagonal() + 1e-6,
      .haze_m = 18 * stage_box.diagonal() + 1e-6,
      .transparent = settings.transparent_background};
  const Compositor finished(backdrop, camera, settings.width, settings.height);
  std::vector<float> row(4 * std::size_t(settings.width));
  for (int y = 0; y < settings.height; ++y) {
    finished.row(y,
                 {halves.data(), per_side, drawn.left / per_side, columns / per_side, drawn.top / per_side,
                  rows / per_side},
                 row.data());
    read(y, row);
  }
}

// A triangle over the whole picture picks the nearest sample of each pixel, and the result is read back. The
// depth d that OpenGL stores is linear in one over the distance z along the view, 0 at the near plane n and 1
// at the far plane f: z = n f / (f − d (f − n)).
Passes Renderer::Impl::finish_passes() {
  const Targets::Passes& from = targets.passes();
  glBindFramebuffer(GL_FRAMEBUFFER, from.pixel_frame);
  glViewport(0, 0, settings.width, settings.height);
  glDisable(GL_DEPTH_TEST);
  const Program& p = passes_programs.with(samples);
  p.use();
  p.set("samples_depth", 0);
  p.set("normal_scalar", 1);
  p.set("object", 2);
  p.set("last_row", settings.height - 1);
  targets.samples_depth.bind(0);
  from.normal_scalar.bind(1);
  from.object.bind(2);
  glBindVertexArray(empty_array);
  glDrawArrays(GL_TRIANGLES, 0, 3);

  const std::size_t pixels = std::size_t(settings.width) * settings.height;
  Passes passes{
      settings.width, settings.height, std::vector<float>(pixels), {}, std::vector<int>(pixels), {}};
  std::vector<float> normal_scalar(4 * pixels);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, settings.width, settings.height, GL_RGBA, GL_FLOAT, normal_scalar.data());
  glReadBuffer(GL_COLOR_ATTACHMENT1);
  glReadPixels(0, 0, settings.width, settings.height, GL_RED, GL_FLOAT, passes.depth_m.data());
  glReadBuffer(GL_COLOR_ATTACHMENT2);
  glReadPixels(0, 0, settings.width, settings.height, GL_RED_INTEGER, GL_INT, passes.object.data());
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

}  // namespace limber::render
