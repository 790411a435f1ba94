// Bodies drawn on the CPU, tile by tile (tiles.h, shade_tile.h), into the same targets as by OpenGL, which
// goes on from there where there are lines, or transparent surfaces that it has to draw.
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/error.h"
#include "render/detail/grain.h"
#include "render/detail/line_quads.h"
#include "render/detail/renderer_impl.h"

namespace limber::render {

namespace {

constexpr double fine_relief = 24;  // samples a wave: of what is finer each sample has its own normal

// With its rim.
detail::DepthMap read_back(const Texture& map, int side, std::vector<float>& to) {
  const std::size_t across = std::size_t(side + detail::DepthMap::rim);
  to.resize(across * across, 1.0f);
  map.bind(0);
  glPixelStorei(GL_PACK_ROW_LENGTH, int(across));
  glGetTexImage(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, GL_FLOAT, &to[across + 1]);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  return {side, to.data()};
}

// Each level the means of two by two by two cells of the one before.
void fill_levels(bool woven, std::vector<unsigned>& texels, detail::Relief& relief) {
  std::vector<std::uint8_t> fine = detail::grain_slopes(woven), coarse;
  int n = detail::grain_cells;
  for (int level = 0; level < detail::Relief::levels; ++level, n /= 2) {
    relief.first[level] = int(texels.size()), relief.cells[level] = n;
    for (std::size_t i = 0; i < fine.size(); i += 4)
      texels.push_back(unsigned(fine[i] | fine[i + 1] << 8 | fine[i + 2] << 16));
    coarse.clear();
    for (int z = 0; z < n / 2; ++z)
      for (int y = 0; y < n / 2; ++y)
        for (int x = 0; x < n / 2; ++x)
          for (int c = 0; c < 4; ++c) {
            int sum = 4;
            for (int i = 0; i < 8; ++i)
              sum += fine[std::size_t(
                  4 * (((2 * z + (i >> 2)) * n + 2 * y + (i >> 1 & 1)) * n + 2 * x + (i & 1)) + c)];
            coarse.push_back(std::uint8_t(sum / 8));
          }
    fine.swap(coarse);
  }
  relief.texels = texels.data();
}

void put(const Vec3& from, float (&to)[3]) {
  for (int i = 0; i < 3; ++i) to[i] = float(from[i]);
}

}  // namespace

// Its vertices, packed, and how its surface answers light.
detail::ShadedMesh Renderer::Impl::shaded_in_tiles(const Mesh& mesh) {
  const Eigen::Matrix4f shadow = shadow_from_world.cast<float>();
  const Eigen::RowVector4f w = clip_from_world.row(3).cast<float>();
  const Vec3f toward_key = settings.toward_key.cast<float>();
  const float offset_m = float(2 * shadow_texel_m);
  const DrawnMesh& drawn_mesh = mesh.card.drawn();
  const MeshLook& look = mesh.look;
  detail::ShadedMesh s{drawn_mesh.corners.data(), {}, {}, {}, {}};
  const SampleGrid grid = sample_grid(settings);
  s.in_picture << 0.5f * float(grid.width) * (clip_from_world.row(0).cast<float>() + w),
      0.5f * float(grid.height) * (clip_from_world.row(1).cast<float>() + w), w;
  detail::Finish& finish = s.finish;
  finish.transparent = mesh.transparent(), finish.sheet = look.sheet;
  finish.flat_inside = !mesh.planes.empty() && !(mesh.transparent() && *mesh.solid);
  finish.opacity = float(look.opacity);
  finish.log2_clear = mesh.transparent() ? float(std::log2(1 - look.opacity)) : 0;
  finish.tinted = mesh.card.tinted();
  finish.roughness = float(look.roughness), finish.metallic = float(look.metallic),
  finish.sheen = float(look.sheen);
  finish.open_power = std::exp2(-16 * finish.roughness - 1);
  const Vec3 albedo = linear_from_srgb(look.color_srgb);
  if (mesh.translucent()) {
    const Vec3 reach = Vec3::Constant(0.3) + 0.7 * albedo / std::max(albedo.maxCoeff(), 1e-3);
    finish.translucency = float(look.translucency);
    put(-1.442695 * (look.scatter_m / shadow_depth_m * reach).cwiseInverse(), finish.scatter_powers);
    finish.scatter_radius = float(1.5 * look.scatter_m / (shadow_texel_m * shadow_size));
  }
  float waves = 0;
  if (mesh.grained()) {
    const std::size_t kind = std::size_t(look.woven);
    if (relief_texels[kind].empty()) fill_levels(look.woven, relief_texels[kind], reliefs[kind]);
    finish.grain = float(look.grain), finish.relief = &reliefs[kind];
    waves = float(1 / (detail::grain_waves * look.grain_m));
    const Box& box = mesh.card.box();
    const double away_m = (box.center() - camera.eye).norm() - 0.5 * box.diagonal(),
                 sample_m = 2 * std::max(away_m, near_m) * std::tan(camera.fov_deg * std::numbers::pi / 360) /
                            sample_grid(settings).height;
    finish.fine = look.grain_m < fine_relief * sample_m;
  }
  const std::size_t vertices = drawn_mesh.vertex_from_drawn.size();
  s.vertices.resize(vertices * std::size_t(detail::vertex_numbers));
  s.per_w.resize(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    float* to = &s.vertices[v * std::size_t(detail::vertex_numbers)];
    const Eigen::Map<const Vec3f> place(&drawn_mesh.positions[3 * v]), normal(&drawn_mesh.normals[3 * v]);
    std::copy_n(place.data(), 3, to), std::copy_n(normal.data(), 3, to + 3);
    for (int c = 0; c < 4; ++c)
      to[6 + c] = finish.tinted ? float(mesh.card.tints()[4 * v + std::size_t(c)]) / 65535
                  : c < 3       ? float(albedo[c])
                                : 1.0f;
    for (int c = 0; c < 3; ++c) to[10 + c] = waves > 0 ? waves * mesh.card.rest()[3 * v + std::size_t(c)] : 0;
    const Vec3f aside = place + (normal.dot(toward_key) < 0 ? -offset_m : offset_m) * normal;
    const Vec3f in_map = (shadow * aside.homogeneous()).head<3>();
    std::copy_n(in_map.data(), 3, to + 13);
    s.per_w[v] = 1 / w.dot(place.homogeneous());
  }
  return s;
}

detail::Stage Renderer::Impl::stage_of_tiles() {
  detail::Stage stage;
  put(camera.eye, stage.eye), put(settings.up, stage.up), put(settings.toward_key, stage.toward_key);
  put(detail::toward_soft_box(settings), stage.toward_box);
  put(settings.key_light, stage.key_light), put(settings.sky_light, stage.sky_light);
  const Vec3 ground_color =
      settings.ground_height_m ? linear_from_srgb(settings.ground_srgb) : Vec3(Vec3::Zero());
  put(ground_color.cwiseProduct(0.9 * settings.toward_key.dot(settings.up) * settings.key_light +
                                0.9 * settings.sky_light),
      stage.bounced);
  stage.ground_height = float(ground.height_m),
  stage.faced_m = float(std::max(0.05 * stage_box.diagonal(), 1e-6));
  put(ground.plane_from_world.row(0), stage.ground_x), put(ground.plane_from_world.row(1), stage.ground_y);
  stage.ground_lower[0] = float(sky_shade.lower.x()), stage.ground_lower[1] = float(sky_shade.lower.y());
  stage.ground_scale[0] = float(1 / (sky_shade.cell_m * sky_shade.columns));
  stage.ground_scale[1] = float(1 / (sky_shade.cell_m * sky_shade.rows));
  stage.ground_sky = sky_shade.blocked.data(), stage.ground_columns = sky_shade.columns,
  stage.ground_rows = sky_shade.rows;
  for (int i = 0; i < 9; ++i) stage.shadow_from_normal[i] = float(shadow_from_normal(i / 3, i % 3));
  stage.shadow_softness = float(shadow_softness), stage.min_shadow = float(detail::min_shadow),
  stage.max_shadow = float(detail::max_shadow);
  for (int k = 0; k < 12; ++k) stage.searching[k] = std::sqrt((float(k) + 0.5f) / 12);
  for (int k = 0; k < 16; ++k) stage.taps[k] = std::sqrt((float(k) + 0.5f) / 16);
  stage.shadow = stage.entry = read_back(targets.shadow_map, shadow_size, shadow_depths);
  if (entry_map != &targets.shadow_map)
    stage.entry = read_back(*entry_map, Targets::entry_size, entry_depths);
  return stage;
}

// All of these meshes, or false where one has images or colours of corners.
bool Renderer::Impl::put_in_tiles(bool transparent, detail::Tiles& tiles,
                                  std::vector<detail::ShadedMesh>& shaded) {
  for (const Mesh& mesh : meshes) {
    if (!mesh.drawn() || mesh.transparent() != transparent) continue;
    if (!mesh.card.drawn().batches.empty()) return false;
    tiles.add(mesh.card.drawn().positions, mesh.card.drawn().corners, clip_from_world,
              !transparent && hides_its_back(mesh), detail::stand_back(mesh, settings.supersampling),
              planes_of(mesh));
    shaded.push_back(shaded_in_tiles(mesh));
  }
  tiles.sort();
  return true;
}

// Lines, each as a mesh of its own.
void Renderer::Impl::put_in_tiles(detail::Tiles& tiles, std::vector<detail::Stroke>& looks) {
  std::vector<float> corners;
  each_line([&](const Points& ends, const LineLook& look, const std::vector<Plane>& planes) {
    const double width = look.width_px * settings.supersampling;
    detail::line_quads(ends, screen(), width, planes, corners);
    tiles.add_lines(corners);
    looks.push_back({{}, float(look.opacity), float(0.5 * width)});
    put(linear_from_srgb(look.color_srgb), looks.back().color);
  });
  tiles.sort();
}

// False where opaque bodies cannot all be drawn so. Where transparent surfaces can, lines are drawn with them
// (are_layered); else OpenGL draws both.
bool Renderer::Impl::draw_in_tiles() {
  are_layered = false;
  const SampleGrid grid = sample_grid(settings);
  if (!settings.tiles || settings.multisampling || settings.supersampling != 2) return false;
  detail::Tiles tiles(grid.width, grid.height),
      layers(grid.width, grid.height, detail::Tiles::Of::transparent);
  detail::Tiles strokes(grid.width, grid.height);
  std::vector<detail::ShadedMesh> shaded, shaded_layers;
  std::vector<detail::Stroke> looks;
  if (!put_in_tiles(false, tiles, shaded)) return false;
  const bool has_lines =
      std::any_of(lines.begin(), lines.end(), [](const Lines& l) { return l.ends.rows() > 0; }) ||
      std::any_of(meshes.begin(), meshes.end(), [](const Mesh& m) { return m.look.edges.has_value(); });
  are_layered = has_transparent() && put_in_tiles(true, layers, shaded_layers);
  if (are_layered) put_in_tiles(strokes, looks);
  const detail::Stage stage = stage_of_tiles();

  drawn = extent_of_drawn();
  const bool more_follows = !are_layered && (has_lines || has_transparent());
  clean_tiles.resize(std::size_t(tiles.columns() * tiles.rows()), false);
  constexpr int side = detail::tile_samples;
  glPixelStorei(GL_UNPACK_ROW_LENGTH, side);
  const auto shown = std::make_unique<detail::Tiles::Samples>();
  const std::vector<float> far(side * side, 1.0f);
  const std::vector<std::uint16_t> nothing(4 * side * side, 0);
  std::vector<std::uint16_t> halves_of_tile(4 * side * side);
  std::vector<detail::Covered> covered;
  detail::TileShader shader;
  for (int r = 0; r < tiles.rows(); ++r)
    for (int c = 0; c < tiles.columns(); ++c) {
      const int x0 = c * side, y0 = r * side, x1 = std::min(x0 + side, grid.width),
                y1 = std::min(y0 + side, grid.height);
      const int left = std::max(x0, drawn.left), right = std::min(x1, drawn.right),
                low = std::max(y0, drawn.top), high = std::min(y1, drawn.bottom);
      if (left >= right || low >= high) continue;
      const std::size_t tile = std::size_t(r * tiles.columns() + c),
                        first = std::size_t((low - y0) * side + left - x0);
      const bool layered = are_layered && !(layers.empty(c, r) && strokes.empty(c, r)),
                 empty = tiles.empty(c, r) && !layered,
                 whole = left == x0 && right == x1 && low == y0 && high == y1;
      if (!empty) {
        tiles.resolve(c, r, *shown);
        shader.shade(stage, shaded, tiles.triangles(), *shown, x0, y0, halves_of_tile.data());
        if (layered) {
          layers.cover(c, r, *shown, covered);
          shader.put_surfaces(stage, shaded_layers, layers.triangles(), covered, x0, y0);
          strokes.cover(c, r, *shown, covered);
          shader.put_lines(strokes, looks, covered, x0, y0);
          shader.lay_over(halves_of_tile.data());
        }
      }
      if (!empty || !clean_tiles[tile]) {
        glBindTexture(GL_TEXTURE_2D, targets.samples.id);
        glTexSubImage2D(GL_TEXTURE_2D, 0, left, low, right - left, high - low, GL_RGBA, GL_HALF_FLOAT,
                        &(empty ? nothing : halves_of_tile)[4 * first]);
        glBindTexture(GL_TEXTURE_2D, targets.samples_depth.id);
        glTexSubImage2D(GL_TEXTURE_2D, 0, left, low, right - left, high - low, GL_DEPTH_COMPONENT, GL_FLOAT,
                        empty ? &far[first] : &shown->depth[first]);
      }
      clean_tiles[tile] = empty && !more_follows && (whole || clean_tiles[tile]);
    }
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glBindFramebuffer(GL_FRAMEBUFFER, targets.samples_frame);
  glViewport(0, 0, grid.width, grid.height);
  glDepthMask(GL_TRUE);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  return true;
}

}  // namespace limber::render
