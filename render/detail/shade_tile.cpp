#include "render/detail/shade_tile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace limber::render::detail {

namespace {

struct Place {
  float x, y;  // in samples from the middle of a pixel
};
// The middles of some of a pixel's four samples (Covered).
constexpr std::array<Place, 16> middles_of(const std::array<Place, 4>& samples) {
  std::array<Place, 16> middles{};
  for (unsigned bits = 1; bits < 16; ++bits) {
    Place sum{};
    for (unsigned s = 0; s < 4; ++s)
      if (bits >> s & 1) sum.x += samples[s].x, sum.y += samples[s].y;
    middles[bits] = {sum.x / float(std::popcount(bits)), sum.y / float(std::popcount(bits))};
  }
  return middles;
}
constexpr std::array<Place, 16> middles =
    middles_of({{{-0.5f, -0.5f}, {0.5f, -0.5f}, {-0.5f, 0.5f}, {0.5f, 0.5f}}});
// Of transparent surfaces (tiles.cpp).
constexpr std::array<Place, 16> turned_middles =
    middles_of({{{-0.25f, -0.75f}, {0.75f, -0.25f}, {-0.75f, 0.25f}, {0.25f, 0.75f}}});

// To the nearest, ties to even; what is too large becomes the largest, what is no number 0.
std::uint16_t half_of(float x) {
  x = x > 0 ? std::min(x, 65504.0f) : 0.0f;
  const auto bits = std::bit_cast<std::uint32_t>(x);
  if (bits < 0x38800000) return std::uint16_t(std::bit_cast<std::uint32_t>(x + 0.5f) - 0x3f000000);
  return std::uint16_t((bits - 0x38000000 + 0xfff + (bits >> 13 & 1)) >> 13);
}

float float_of(std::uint16_t half) {
  const std::uint32_t bits = std::uint32_t(half) << 13;
  return half < 0x400 ? float(half) * (1.0f / (1 << 24)) : std::bit_cast<float>(bits + 0x38000000);
}

std::uint16_t pixel_of(const Covered& item) { return std::uint16_t(item.y * tile_pixels + item.x); }

Shade best_shade() {
  static const Shade best = __builtin_cpu_supports("x86-64-v4")   ? shade_avx512()
                            : __builtin_cpu_supports("x86-64-v3") ? shade_avx2()
                                                                  : shade_sse2();
  return best;
}

using Numbers = float __attribute__((vector_size(4 * vertex_numbers)));
using Rgba = float __attribute__((vector_size(16)));

}  // namespace

void TileShader::collect(const std::vector<ScreenTriangle>& triangles, const Tiles::Samples& samples) {
  for (std::vector<Covered>& items : items_) items.clear();
  for (int y = 0; y < tile_pixels; ++y)
    for (int x = 0; x < tile_pixels; ++x) {
      const std::int32_t* low = &samples.triangle[std::size_t(2 * y * tile_samples + 2 * x)];
      const std::int32_t four[4] = {low[0], low[1], low[tile_samples], low[tile_samples + 1]};
      unsigned left = 0;
      for (unsigned i = 0; i < 4; ++i) left |= unsigned(four[i] >= 0) << i;
      for (unsigned i = 0; left != 0; ++i) {
        if (!(left >> i & 1)) continue;
        unsigned same = 0;
        for (unsigned j = i; j < 4; ++j) same |= unsigned(four[j] == four[i]) << j;
        items_[triangles[std::size_t(four[i])].mesh].push_back(
            {four[i], std::int16_t(x), std::int16_t(y), std::uint8_t(same)});
        left &= ~same;
      }
    }
}

// What a triangle has at the middle of an item's samples, and a sample beside it and above, by barycentric
// shares in perspective (of one that was clipped by its places times w, as some w are not above 0: Olano and
// Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997); of transparent surfaces the first
// alone is asked for. Places beyond the last item repeat it.
[[gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]] void TileShader::place(
    const ShadedMesh& mesh, const std::vector<ScreenTriangle>& triangles, const Covered* items, int count,
    int x0, int y0) {
  alignas(64) float rows[3][places_at_once][vertex_numbers];
  for (int i = 0; i < places_at_once; ++i) {
    const Covered& item = items[std::min(i, count - 1)];
    const ScreenTriangle& t = triangles[std::size_t(item.triangle)];
    const std::uint32_t* corner = mesh.corners + 3 * std::size_t(t.number);
    const std::uint32_t order[3] = {corner[0], t.front ? corner[1] : corner[2],
                                    t.front ? corner[2] : corner[1]};
    Numbers vertex[3];
    float x[3], y[3], w[3], per_w[3];
    const Place middle = (mesh.finish.transparent ? turned_middles : middles)[item.samples];
    const float px = float(2 * item.x + 1) + middle.x, py = float(2 * item.y + 1) + middle.y;
    for (std::size_t c = 0; c < 3; ++c) {
      std::memcpy(&vertex[c], &mesh.vertices[vertex_numbers * std::size_t(order[c])], sizeof vertex[c]);
      if (t.clipped) {
        const Eigen::Vector3f place =
            mesh.in_picture * Eigen::Vector4f(vertex[c][0], vertex[c][1], vertex[c][2], 1);
        w[c] = place[2], per_w[c] = 1;
        x[c] = place[0] - (float(x0) + px) * w[c], y[c] = place[1] - (float(y0) + py) * w[c];
        continue;
      }
      x[c] = float(t.x[c] - 256 * x0) * (1.0f / 256) - px,
      y[c] = float(t.y[c] - 256 * y0) * (1.0f / 256) - py;
      w[c] = 1, per_w[c] = mesh.per_w[order[c]];
    }
    const float e[3] = {(x[1] * y[2] - x[2] * y[1]) * per_w[0], (x[2] * y[0] - x[0] * y[2]) * per_w[1],
                        (x[0] * y[1] - x[1] * y[0]) * per_w[2]};
    // A sample to the right, the first of them changes by y₁ − y₂, and so on; one up by x₂ − x₁.
    const float dx[3] = {(w[2] * y[1] - w[1] * y[2]) * per_w[0], (w[0] * y[2] - w[2] * y[0]) * per_w[1],
                         (w[1] * y[0] - w[0] * y[1]) * per_w[2]};
    const float dy[3] = {(w[1] * x[2] - w[2] * x[1]) * per_w[0], (w[2] * x[0] - w[0] * x[2]) * per_w[1],
                         (w[0] * x[1] - w[1] * x[0]) * per_w[2]};
    const Numbers sum = e[0] * vertex[0] + e[1] * vertex[1] + e[2] * vertex[2];
    const float all = e[0] + e[1] + e[2];
    const Numbers value = sum * (1 / all);
    std::memcpy(rows[0][i], &value, sizeof value);
    places_.side[i] = t.front ? 1 : -1;
    if (mesh.finish.transparent) continue;
    const Numbers right = sum + dx[0] * vertex[0] + dx[1] * vertex[1] + dx[2] * vertex[2],
                  up = sum + dy[0] * vertex[0] + dy[1] * vertex[1] + dy[2] * vertex[2];
    const Numbers along_x = right * (1 / (all + dx[0] + dx[1] + dx[2])) - value,
                  along_y = up * (1 / (all + dy[0] + dy[1] + dy[2])) - value;
    std::memcpy(rows[1][i], &along_x, sizeof value), std::memcpy(rows[2][i], &along_y, sizeof value);
    places_.pixel_x[i] = float(x0 / 2 + item.x), places_.pixel_y[i] = float(y0 / 2 + item.y);
    const float weight = 1 / float(std::popcount(item.samples));
    for (int s = 0; s < 4; ++s) places_.weight[s][i] = item.samples >> s & 1 ? weight : 0;
    places_.middle_x[i] = -middle.x, places_.middle_y[i] = -middle.y;
  }
  for (int k = 0; k < vertex_numbers; ++k)
    for (int i = 0; i < places_at_once; ++i) places_.value[k][i] = rows[0][i][k];
  const auto copy_changes = [&](int first, int end) __attribute__((always_inline)) {
    for (int k = first; k < end; ++k)
      for (int i = 0; i < places_at_once; ++i)
        places_.along_x[k][i] = rows[1][i][k], places_.along_y[k][i] = rows[2][i][k];
  };
  if (mesh.finish.transparent) return;
  copy_changes(at_shadow, vertex_numbers);
  if (mesh.finish.grain > 0) copy_changes(at_place, at_normal), copy_changes(at_rest, at_shadow);
}

void TileShader::shade(const Stage& stage, const std::vector<ShadedMesh>& meshes,
                       const std::vector<ScreenTriangle>& triangles, const Tiles::Samples& samples, int x0,
                       int y0, std::uint16_t* halves) {
  std::memset(halves, 0, sizeof(std::uint16_t) * 4 * tile_samples * tile_samples);
  items_.resize(meshes.size());
  collect(triangles, samples);
  const Shade light = best_shade();
  for (std::size_t m = 0; m < meshes.size(); ++m)
    for (std::size_t begin = 0; begin < items_[m].size(); begin += places_at_once) {
      const int count = int(std::min(items_[m].size() - begin, std::size_t(places_at_once)));
      place(meshes[m], triangles, &items_[m][begin], count, x0, y0);
      light(stage, meshes[m].finish, places_);
      for (int i = 0; i < count; ++i) {
        const Covered& item = items_[m][begin + std::size_t(i)];
        const std::uint16_t rgba[4] = {half_of(places_.light[0][i]), half_of(places_.light[1][i]),
                                       half_of(places_.light[2][i]), 0x3c00};
        for (int s = 0; s < 4; ++s)
          if (item.samples >> s & 1)
            std::memcpy(halves + 4 * ((2 * item.y + (s >> 1)) * tile_samples + 2 * item.x + (s & 1)), rgba,
                        sizeof rgba);
      }
    }
}

void TileShader::put_surfaces(const Stage& stage, const std::vector<ShadedMesh>& meshes,
                              const std::vector<ScreenTriangle>& triangles, const std::vector<Covered>& items,
                              int x0, int y0) {
  const Shade light = best_shade();
  for (std::size_t begin = 0; begin < items.size();) {
    const std::uint16_t mesh = triangles[std::size_t(items[begin].triangle)].mesh;
    std::size_t end = begin;
    while (end < items.size() && end < begin + places_at_once &&
           triangles[std::size_t(items[end].triangle)].mesh == mesh)
      ++end;
    place(meshes[mesh], triangles, &items[begin], int(end - begin), x0, y0);
    light(stage, meshes[mesh].finish, places_);
    for (std::size_t i = begin; i < end; ++i) {
      const ScreenTriangle& t = triangles[std::size_t(items[i].triangle)];
      const Place middle = turned_middles[items[i].samples];
      const float x = float(x0 + 2 * items[i].x) + 0.5f + middle.x,
                  y = float(y0 + 2 * items[i].y) + 0.5f + middle.y;
      const std::size_t k = i - begin;
      layers_.push_back(
          {t.z + x * t.dz_dx + y * t.dz_dy,
           {places_.light[0][k], places_.light[1][k], places_.light[2][k], places_.held_back[k]},
           pixel_of(items[i]),
           items[i].samples});
    }
    begin = end;
  }
}

void TileShader::put_lines(const Tiles& tiles, const std::vector<Stroke>& strokes,
                           const std::vector<Covered>& items, int x0, int y0) {
  for (const Covered& item : items) {
    const ScreenTriangle& t = tiles.triangles()[std::size_t(item.triangle)];
    const Stroke& stroke = strokes[t.mesh];
    for (int s = 0; s < 4; ++s) {
      if (!(item.samples >> s & 1)) continue;
      const int x = x0 + 2 * item.x + s % 2, y = y0 + 2 * item.y + s / 2;
      const float share =
          stroke.opacity * std::clamp(stroke.half_width + 0.5f - std::abs(tiles.across(t, x, y)), 0.0f, 1.0f);
      if (share > 0)
        layers_.push_back({t.z + float(x) * t.dz_dx + float(y) * t.dz_dy,
                           {share * stroke.color[0], share * stroke.color[1], share * stroke.color[2], share},
                           pixel_of(item),
                           std::uint8_t(1 << s)});
    }
  }
}

void TileShader::lay_over(std::uint16_t* halves) {
  constexpr std::size_t pixels = tile_pixels * tile_pixels;
  first_.assign(pixels + 2, 0);
  for (const Layer& layer : layers_) ++first_[layer.pixel + std::size_t(2)];
  for (std::size_t p = 2; p < first_.size(); ++p) first_[p] += first_[p - 1];
  of_pixels_.resize(layers_.size());
  for (std::size_t i = 0; i < layers_.size(); ++i)
    of_pixels_[first_[layers_[i].pixel + std::size_t(1)]++] = std::uint32_t(i);
  for (std::size_t p = 0; p < pixels; ++p) {
    const auto begin = of_pixels_.begin() + first_[p], end = of_pixels_.begin() + first_[p + 1];
    if (begin == end) continue;
    // Of two that are as far the later is in front.
    std::sort(begin, end, [&](std::uint32_t a, std::uint32_t b) {
      return layers_[a].depth != layers_[b].depth ? layers_[a].depth < layers_[b].depth : a > b;
    });
    unsigned common = 15;
    for (auto at = begin; at != end; ++at) common &= layers_[*at].samples;
    Rgba sum{};
    for (unsigned s = 0; s < 4; ++s) {
      if (s == 0 || common != 15) {
        sum = Rgba{};
        for (auto at = begin; at != end; ++at)
          if (const Layer& layer = layers_[*at]; layer.samples >> s & 1) {
            Rgba light;
            std::memcpy(&light, layer.light.data(), sizeof light);
            sum += (1 - sum[3]) * light;
          }
      }
      std::uint16_t* const to =
          halves + 4 * ((2 * (p / tile_pixels) + s / 2) * tile_samples + 2 * (p % tile_pixels) + s % 2);
      for (int c = 0; c < 4; ++c) to[c] = half_of(sum[c] + (1 - sum[3]) * float_of(to[c]));
    }
  }
  layers_.clear();
}

}  // namespace limber::render::detail
