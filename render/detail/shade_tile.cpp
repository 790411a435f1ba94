#include "render/detail/shade_tile.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace limber::render::detail {

namespace {

constexpr int pixels = tile_samples / 2;  // a side of a tile

// The middle of some of a pixel's four samples (bits: lower left, lower right, upper left, upper right), in
// samples from the pixel's.
constexpr float third = 1 / 6.0f, half = 0.5f;
constexpr float middles[16][2] = {{0, 0},        {-half, -half},  {half, -half},  {0, -half},
                                  {-half, half}, {-half, 0},      {0, 0},         {-third, -third},
                                  {half, half},  {0, 0},          {half, 0},      {third, -third},
                                  {0, half},     {-third, third}, {third, third}, {0, 0}};

// To the nearest, ties to even; what is too large becomes the largest, what is no number 0.
std::uint16_t half_of(float x) {
  x = x > 0 ? std::min(x, 65504.0f) : 0.0f;
  const auto bits = std::bit_cast<std::uint32_t>(x);
  if (bits < 0x38800000) return std::uint16_t(std::bit_cast<std::uint32_t>(x + 0.5f) - 0x3f000000);
  return std::uint16_t((bits - 0x38000000 + 0xfff + (bits >> 13 & 1)) >> 13);
}

Shade best_shade() {
  static const Shade best = __builtin_cpu_supports("x86-64-v4")   ? shade_avx512()
                            : __builtin_cpu_supports("x86-64-v3") ? shade_avx2()
                                                                  : shade_sse2();
  return best;
}

using Numbers = float __attribute__((vector_size(4 * vertex_numbers)));

}  // namespace

void TileShader::collect(const std::vector<ScreenTriangle>& triangles, const Tiles::Samples& samples) {
  for (std::vector<Item>& items : items_) items.clear();
  for (int y = 0; y < pixels; ++y)
    for (int x = 0; x < pixels; ++x) {
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
// shares in perspective. Places beyond the last item repeat it.
[[gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]] void TileShader::place(
    const ShadedMesh& mesh, const std::vector<ScreenTriangle>& triangles, const Item* items, int count,
    int x0, int y0) {
  alignas(64) float rows[3][places_at_once][vertex_numbers];
  for (int i = 0; i < places_at_once; ++i) {
    const Item& item = items[std::min(i, count - 1)];
    const ScreenTriangle& t = triangles[std::size_t(item.triangle)];
    const std::uint32_t* corner = mesh.corners + 3 * std::size_t(t.number);
    const std::uint32_t order[3] = {corner[0], t.front ? corner[1] : corner[2],
                                    t.front ? corner[2] : corner[1]};
    Numbers vertex[3];
    float x[3], y[3], per_w[3];
    const float* const middle = middles[item.samples];
    const float px = float(2 * item.x + 1) + middle[0], py = float(2 * item.y + 1) + middle[1];
    for (std::size_t c = 0; c < 3; ++c) {
      std::memcpy(&vertex[c], &mesh.vertices[vertex_numbers * std::size_t(order[c])], sizeof vertex[c]);
      x[c] = float(t.x[c] - 256 * x0) * (1.0f / 256) - px,
      y[c] = float(t.y[c] - 256 * y0) * (1.0f / 256) - py;
      per_w[c] = mesh.per_w[order[c]];
    }
    const float e[3] = {(x[1] * y[2] - x[2] * y[1]) * per_w[0], (x[2] * y[0] - x[0] * y[2]) * per_w[1],
                        (x[0] * y[1] - x[1] * y[0]) * per_w[2]};
    // A sample to the right, the first of them changes by y₁ − y₂, and so on; one up by x₂ − x₁.
    const float dx[3] = {(y[1] - y[2]) * per_w[0], (y[2] - y[0]) * per_w[1], (y[0] - y[1]) * per_w[2]};
    const float dy[3] = {(x[2] - x[1]) * per_w[0], (x[0] - x[2]) * per_w[1], (x[1] - x[0]) * per_w[2]};
    const Numbers sum = e[0] * vertex[0] + e[1] * vertex[1] + e[2] * vertex[2],
                  right = sum + dx[0] * vertex[0] + dx[1] * vertex[1] + dx[2] * vertex[2],
                  up = sum + dy[0] * vertex[0] + dy[1] * vertex[1] + dy[2] * vertex[2];
    const float all = e[0] + e[1] + e[2];
    const Numbers value = sum * (1 / all), along_x = right * (1 / (all + dx[0] + dx[1] + dx[2])) - value,
                  along_y = up * (1 / (all + dy[0] + dy[1] + dy[2])) - value;
    std::memcpy(rows[0][i], &value, sizeof value), std::memcpy(rows[1][i], &along_x, sizeof value);
    std::memcpy(rows[2][i], &along_y, sizeof value);
    places_.side[i] = t.front ? 1 : -1;
    places_.pixel_x[i] = float(x0 / 2 + item.x), places_.pixel_y[i] = float(y0 / 2 + item.y);
    const float weight = 1 / float(std::popcount(item.samples));
    for (int s = 0; s < 4; ++s) places_.weight[s][i] = item.samples >> s & 1 ? weight : 0;
    places_.middle_x[i] = -middle[0], places_.middle_y[i] = -middle[1];
  }
  for (int k = 0; k < vertex_numbers; ++k)
    for (int i = 0; i < places_at_once; ++i) places_.value[k][i] = rows[0][i][k];
  const auto copy_changes = [&](int first, int end) __attribute__((always_inline)) {
    for (int k = first; k < end; ++k)
      for (int i = 0; i < places_at_once; ++i)
        places_.along_x[k][i] = rows[1][i][k], places_.along_y[k][i] = rows[2][i][k];
  };
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
        const Item& item = items_[m][begin + std::size_t(i)];
        const std::uint16_t rgba[4] = {half_of(places_.light[0][i]), half_of(places_.light[1][i]),
                                       half_of(places_.light[2][i]), 0x3c00};
        for (int s = 0; s < 4; ++s)
          if (item.samples >> s & 1)
            std::memcpy(halves + 4 * ((2 * item.y + (s >> 1)) * tile_samples + 2 * item.x + (s & 1)), rgba,
                        sizeof rgba);
      }
    }
}

}  // namespace limber::render::detail
