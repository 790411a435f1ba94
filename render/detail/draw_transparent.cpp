// Transparent surfaces (bodies of opacity below 1) and lines, laid over what is opaque.
//
// All that a pixel shows half transparent goes into a list of its own, with its depth and the samples that it
// covers: Carpenter's A-buffer (1984), as linked lists on the card (Yang et al. 2010; detail/layer_lists.h).
// Each list is then laid over the samples front to back. So any number of transparent surfaces, inside or
// through one another, is in order in each sample, and triangles are drawn once. (Depth peeling, which draws
// all of them twice a layer, took twice as long.) A triangle is shaded once a pixel, by a rasterizer of four
// samples a pixel that draws into nothing; the shader itself asks which samples something opaque hides.
// (Shading each sample took twice as long.) That is so with four samples a pixel; with another number of them
// each sample has a list of its own and is shaded.
//
// Lines are quads of constant width on the screen with a soft edge (detail/line_quads.h). Where there are
// transparent surfaces, what of a line lies before one is put into the list just before the nearest
// transparent surface behind it. Method: docs/rendering.md, 7 and 9.
//
// Colours are premultiplied, so what lies in front is added as color + (1 − alpha) · what is behind.
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>
#include <cmath>

#include "render/detail/line_quads.h"
#include "render/detail/renderer_impl.h"

namespace limber::render {

using detail::line_corner_floats;
using detail::line_quads;
using detail::Screen;

// All samples that transparent surfaces may cover: the rectangle round their boxes on the screen.
Renderer::Impl::Rectangle Renderer::Impl::extent_of_transparent() const {
  Rectangle all{sample_grid(settings).width, sample_grid(settings).height, 0, 0};
  for (const Mesh& mesh : meshes)
    if (mesh.drawn() && mesh.transparent()) all = all.with(extent_of(mesh.card.box()));
  return all;
}

// Whole pixels that anything may cover, with room for the width of lines. The rest of the samples is neither
// cleared nor read.
Renderer::Impl::Rectangle Renderer::Impl::extent_of_drawn() const {
  const SampleGrid grid = sample_grid(settings);
  const int per_side = settings.multisampling ? 1 : settings.supersampling;
  Rectangle all{grid.width, grid.height, 0, 0};
  double width_px = 0;
  for (const Mesh& mesh : meshes) {
    if (!mesh.drawn()) continue;
    all = all.with(extent_of(mesh.card.box()));
    if (mesh.look.edges) width_px = std::max(width_px, mesh.look.edges->width_px);
  }
  for (const Lines& l : lines) {
    if (l.ends.rows() > 0) all = all.with(extent_of(bounding_box(l.ends)));
    width_px = std::max(width_px, l.look.width_px);
  }
  if (all.left >= all.right || all.top >= all.bottom) return {0, 0, 0, 0};
  const int margin = per_side * (int(std::ceil(width_px)) + 2);
  const auto down = [&](int x) { return std::max(x - margin, 0) / per_side * per_side; };
  const auto up = [&](int x, int last) {
    return std::min((x + margin + per_side - 1) / per_side * per_side, last);
  };
  return {down(all.left), down(all.top), up(all.right, grid.width), up(all.bottom, grid.height)};
}

// All of the picture where a box reaches behind the eye, whose corners there have no place on the screen.
Renderer::Impl::Rectangle Renderer::Impl::extent_of(const Box& box) const {
  const SampleGrid grid = sample_grid(settings);
  Eigen::Array2d lower(1, 1), upper(-1, -1);  // of the screen, −1 … 1
  bool behind = false;
  for_corners(box, [&](const Vec3& corner) {
    const Eigen::Vector4d clip = clip_from_world * corner.homogeneous();
    behind |= !(clip.w() > 0);
    lower = lower.min(clip.head<2>().array() / clip.w());
    upper = upper.max(clip.head<2>().array() / clip.w());
  });
  if (behind) return {0, 0, grid.width, grid.height};
  const auto sample = [](double screen, int side) {
    return int(std::clamp(0.5 + 0.5 * screen, 0.0, 1.0) * side);
  };
  return {sample(lower.x(), grid.width), sample(lower.y(), grid.height),
          std::min(sample(upper.x(), grid.width) + 1, grid.width),
          std::min(sample(upper.y(), grid.height) + 1, grid.height)};
}

// Puts what the transparent surfaces show in these rows of lists into them, whatever is not hidden by the
// opaque.
void Renderer::Impl::put_transparent(int first_row, int rows) {
  const bool a_pixel = four_samples.has_value();
  glBindFramebuffer(GL_FRAMEBUFFER, a_pixel ? targets.four_samples_frame() : targets.samples_frame);
  if (a_pixel) glViewport(0, 0, settings.width, settings.height);
  glScissor(0, first_row, lists.columns(), rows);
  glDepthMask(GL_FALSE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  for (const Mesh& mesh : meshes) {
    if (!mesh.drawn() || !mesh.transparent()) continue;
    if (!a_pixel) stand_back_for_edges(mesh, settings.multisampling ? 1 : settings.supersampling);
    draw_mesh(mesh, "#define TRANSPARENT\n" + with_lists, [&](const Program& program) {
      lists.set_uniforms(program);
      if (!a_pixel) return;
      program.set("opaque_depth", 7);
      program.set("stand_back", stand_back(mesh, 1));
      targets.samples_depth.bind(7);
    });
  }
  glDisable(GL_POLYGON_OFFSET_FILL);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  plane_defines({});
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  const SampleGrid grid = sample_grid(settings);
  glBindFramebuffer(GL_FRAMEBUFFER, targets.samples_frame);
  glViewport(0, 0, grid.width, grid.height);
}

// Transparent surfaces, and the lines before some of them, by lists of layers: each list is put over the
// samples front to back.
//
// Lists are made for a band of rows at a time, for OpenGL allows no buffer as large as many layers of a large
// picture need (128 MB here: 8 million layers of pixels). How many layers a band has is known only after
// they were put. Where they found no room, the buffer is made larger and the band drawn again; where it
// cannot be larger, the band is halved.
void Renderer::Impl::draw_transparent() {
  const Rectangle place = extent_of_transparent();
  glEnable(GL_SCISSOR_TEST);
  const int height = lists.rows(), row_samples = sample_grid(settings).height / height;
  int rows = lists.max_rows();
  for (int row = 0; row < height;) {
    rows = std::min(rows, height - row);
    lists.clear(row, rows);
    put_transparent(row, rows);
    const int top = row * row_samples, bottom = (row + rows) * row_samples;
    glScissor(0, top, sample_grid(settings).width, bottom - top);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
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

    const int first = std::max(top, place.top), last = std::min(bottom, place.bottom);
    glScissor(place.left, first, std::max(place.right - place.left, 0), std::max(last - first, 0));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    const Program& p = layers_programs.with(with_lists);
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

Screen Renderer::Impl::screen() const {
  const SampleGrid grid = sample_grid(settings);
  return {clip_from_world, Eigen::Vector2d(grid.width, grid.height)};
}

void Renderer::Impl::each_line(
    const std::function<void(const Points&, const LineLook&, const std::vector<Plane>&)>& visit) {
  for (const Lines& l : lines) visit(l.ends, l.look, {});
  for (Mesh& mesh : meshes)
    if (mesh.drawn() && mesh.look.edges) visit(mesh.card.edge_ends(), *mesh.look.edges, planes_of(mesh));
}

// Lines test their depth against the opaque and leave it as it is. `corners` is one buffer for all of them,
// filled anew for each.
void Renderer::Impl::draw_lines(LinePass pass) {
  const double per_pixel = settings.multisampling ? 1 : settings.supersampling;
  glBindFramebuffer(GL_FRAMEBUFFER, targets.samples_frame);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  const Program& p =
      line_programs.with(pass == LinePass::draw_all ? "" : "#define TRANSPARENT\n" + with_lists);
  p.use();
  if (pass != LinePass::draw_all) {
    lists.set_uniforms(p);
    p.set("putting", pass == LinePass::put ? 1 : 0);
  }
  glBindVertexArray(line_array);
  std::vector<float> corners;
  each_line([&](const Points& ends, const LineLook& line, const std::vector<Plane>& planes) {
    line_quads(ends, screen(), line.width_px * per_pixel, planes, corners);
    if (corners.empty()) return;
    const Vec3 color = linear_from_srgb(line.color_srgb);
    p.set("line_color", Eigen::Vector4d(color.x(), color.y(), color.z(), line.opacity));
    p.set("half_width", 0.5 * line.width_px * per_pixel);
    glBindBuffer(GL_ARRAY_BUFFER, line_buffer);
    glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(corners.size() * sizeof(float)), corners.data(), GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, GLsizei(corners.size() / line_corner_floats));
  });
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

}  // namespace limber::render
