// Opaque bodies drawn on the CPU: which triangle a sample shows, and the light it sends.
#include "render/detail/tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>

#include "core/random.h"
#include "render/detail/shade_light.h"
#include "render/renderer.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

using detail::tile_samples;
using detail::Tiles;

// How often each sample of a grid is covered by triangles that are drawn one by one.
std::vector<int> coverage(int columns, int rows, const std::vector<float>& positions,
                          const std::vector<std::uint32_t>& corners, const Mat4& clip) {
  std::vector<int> times(std::size_t(columns * rows), 0);
  const auto shown = std::make_unique<Tiles::Samples>();
  for (std::size_t c = 0; c < corners.size(); c += 3) {
    Tiles tiles(columns, rows);
    EXPECT_TRUE(tiles.add(positions, {corners[c], corners[c + 1], corners[c + 2]}, clip, false, 0));
    tiles.sort();
    for (int r = 0; r < tiles.rows(); ++r)
      for (int t = 0; t < tiles.columns(); ++t) {
        tiles.resolve(t, r, *shown);
        for (int y = 0; y < tile_samples; ++y)
          for (int x = 0; x < tile_samples; ++x)
            if (t * tile_samples + x < columns && r * tile_samples + y < rows)
              times[std::size_t((r * tile_samples + y) * columns + t * tile_samples + x)] +=
                  shown->triangle[std::size_t(y * tile_samples + x)] >= 0;
      }
  }
  return times;
}

// Round a point, whose triangles share edges of all slopes, some through samples' middles, some a great way
// out of the picture: each sample is covered once, wherever the point is and whichever way triangles are
// wound.
TEST(Tiles, TrianglesThatShareEdgesCoverEachSampleOnce) {
  constexpr int columns = 200, rows = 130;
  Rng rng(5, 0);
  for (const double x : {0.0, 0.5 / columns, 0.31, -0.7}) {
    std::vector<float> positions{float(x), float(-0.3 * x), 0};
    std::vector<std::uint32_t> corners;
    constexpr int around = 23;
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      positions.insert(positions.end(), {float(9 * std::cos(angle)), float(9 * std::sin(angle)),
                                         float(rng.uniform(-0.9, 0.9))});
      const std::uint32_t a = std::uint32_t(1 + k), b = std::uint32_t(1 + (k + 1) % around);
      corners.insert(corners.end(), {0u, k % 2 ? a : b, k % 2 ? b : a});
    }
    for (const int times : coverage(columns, rows, positions, corners, Mat4::Identity()))
      ASSERT_EQ(times, 1) << x;
  }
}

// Two that cross: at each sample the one whose plane is nearer there.
TEST(Tiles, TheNearerPlaneIsShown) {
  constexpr int n = 90;
  Tiles tiles(n, n);
  const std::vector<std::uint32_t> corners{0, 1, 2};
  const auto plane = [](float left, float right) {
    const float middle = (left + right) / 2, slope = (right - left) / 2;
    return std::vector<float>{-3, -3, middle - 3 * slope, 3, -3, middle + 3 * slope, 0, 6, middle};
  };
  ASSERT_TRUE(tiles.add(plane(-0.3f, 0.3f), corners, Mat4::Identity(), false, 0));
  ASSERT_TRUE(tiles.add(plane(0.2f, -0.25f), corners, Mat4::Identity(), false, 0));
  tiles.sort();
  const auto shown = std::make_unique<Tiles::Samples>();
  for (int t = 0; t < 2; ++t) {
    tiles.resolve(t, 0, *shown);
    for (int x = 0; x < tile_samples && t * tile_samples + x < n; ++x) {
      // z = left at −1 and right at 1, and depth is ½ + z/2.
      const double place = -1 + 2 * (t * tile_samples + x + 0.5) / n, one = 0.3 * place,
                   other = -0.025 - 0.225 * place;
      if (std::abs(one - other) < 1e-3) continue;
      const std::size_t sample = std::size_t(7 * tile_samples + x);
      ASSERT_GE(shown->triangle[sample], 0);
      EXPECT_EQ(tiles.triangles()[std::size_t(shown->triangle[sample])].mesh, one < other ? 0 : 1) << place;
      EXPECT_NEAR(shown->depth[sample], 0.5 + 0.5 * std::min(one, other), 1e-5);
    }
  }
}

// Of a wall, in perspective, what is below a plane is not there: each sample's ray meets the wall above it or
// below.
TEST(Tiles, APlaneCutsThemInPerspective) {
  constexpr int n = 128;
  const Mat4 clip = clip_from_camera(60, 1, 0.1, 20);
  const std::vector<float> wall{-9, -9, -3, 9, -9, -7, 9, 9, -7, -9, 9, -3};  // z = −5 − 2x/9
  const Eigen::Vector4d cut(0.6, 0.8, 0.3, 1.2);
  Tiles tiles(n, n);
  ASSERT_TRUE(tiles.add(wall, {0, 1, 2, 0, 2, 3}, clip, false, 0, &cut));
  tiles.sort();
  const auto shown = std::make_unique<Tiles::Samples>();
  int there = 0, gone = 0;
  for (int r = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c) {
      tiles.resolve(c, r, *shown);
      for (int y = 0; y < tile_samples; ++y)
        for (int x = 0; x < tile_samples; ++x) {
          const double u = (2 * (c * tile_samples + x + 0.5) / n - 1) * std::tan(std::numbers::pi / 6),
                       v = (2 * (r * tile_samples + y + 0.5) / n - 1) * std::tan(std::numbers::pi / 6);
          const double depth = 5 / (1 - 2.0 / 9 * u);  // of the ray (u, v, −1) times it
          const double above = cut.dot(Eigen::Vector4d(u * depth, v * depth, -depth, 1));
          if (std::abs(above) < 1e-2) continue;
          ASSERT_EQ(shown->triangle[std::size_t(y * tile_samples + x)] >= 0, above > 0) << u << " " << v;
          ++(above > 0 ? there : gone);
        }
    }
  EXPECT_GT(there, 1000);
  EXPECT_GT(gone, 1000);
}

TEST(Tiles, WhatReachesBehindTheEyeIsNotTaken) {
  Tiles tiles(64, 64);
  const Mat4 clip = clip_from_camera(40, 1, 0.1, 10);
  EXPECT_TRUE(tiles.add({0, 0, -1, 1, 0, -1, 0, 1, -1}, {0, 1, 2}, clip, false, 0));
  EXPECT_FALSE(tiles.add({0, 0, -1, 1, 0, -1, 0, 1, 1}, {0, 1, 2}, clip, false, 0));
  EXPECT_EQ(tiles.triangles().size(), 1u);
}

// The same formula in three instruction sets.
TEST(TileLight, IsTheSameBitsWhateverTheInstructions) {
  Rng rng(3, 0);
  const auto number = [&](double low, double high) { return float(rng.uniform(low, high)); };
  constexpr int side = 32;
  std::vector<float> depths(std::size_t((side + detail::DepthMap::rim) * (side + detail::DepthMap::rim)));
  for (float& d : depths) d = number(0, 1);
  std::vector<float> sky(48);
  for (float& s : sky) s = number(0, 1);
  std::vector<unsigned> texels(64 * 64 * 64);
  for (unsigned& t : texels) t = unsigned(rng.uniform(0, 1 << 24));
  detail::Relief relief{texels.data(), {}, {}};
  for (int l = 0; l < detail::Relief::levels; ++l) relief.first[l] = 0, relief.cells[l] = 64 >> l;
  detail::Stage stage{};
  for (auto* three : {&stage.eye, &stage.up, &stage.toward_key, &stage.toward_box, &stage.key_light,
                      &stage.sky_light, &stage.bounced, &stage.ground_x, &stage.ground_y})
    for (float& x : *three) x = number(0.1, 1);
  for (float& x : stage.shadow_from_normal) x = number(-1, 1);
  for (float& x : stage.searching) x = number(0, 1);
  for (float& x : stage.taps) x = number(0, 1);
  stage.faced_m = 0.1f, stage.ground_scale[0] = stage.ground_scale[1] = 0.5f;
  stage.ground_sky = sky.data(), stage.ground_columns = 8, stage.ground_rows = 6;
  stage.shadow_softness = 0.3f, stage.min_shadow = 0.01f, stage.max_shadow = 0.2f;
  stage.shadow = stage.entry = {side, depths.data()};
  for (int turn = 0; turn < 40; ++turn) {
    detail::Finish finish{
        true, number(0.1, 1), number(0, 1),           number(0, 1),  number(0, 1), number(0, 1),
        {},   0.1f,           turn % 2 ? 0.4f : 0.0f, turn % 4 == 1, &relief};
    for (float& x : finish.scatter_powers) x = number(-9, -1);
    auto places = std::make_unique<detail::LitPlaces>();
    float* const numbers = reinterpret_cast<float*>(places.get());
    for (std::size_t i = 0; i < sizeof *places / sizeof(float); ++i) numbers[i] = number(-1, 1);
    for (auto& row : places->along_x)
      for (float& x : row) x *= 0.1f;
    const auto lit_by = [&](detail::Shade shade) {
      auto lit = std::make_unique<detail::LitPlaces>(*places);
      shade(stage, finish, *lit);
      std::vector<float> light(&lit->light[0][0], &lit->light[0][0] + 3 * detail::places_at_once);
      return light;
    };
    const std::vector<float> one = lit_by(detail::shade_sse2());
    EXPECT_TRUE(std::all_of(one.begin(), one.end(), [](float x) { return std::isfinite(x); }));
    EXPECT_GT(*std::max_element(one.begin(), one.end()), *std::min_element(one.begin(), one.end()));
    if (__builtin_cpu_supports("x86-64-v3")) {
      EXPECT_EQ(lit_by(detail::shade_avx2()), one);
    }
    if (__builtin_cpu_supports("x86-64-v4")) {
      EXPECT_EQ(lit_by(detail::shade_avx512()), one);
    }
  }
}

// By OpenGL each sample is shaded by itself, here a pixel's together: the same picture, but for a level or
// two, more at few edges of few pixels.
TEST(TileLight, IsThatOfTheShader) {
  RenderSettings settings;
  settings.width = 480, settings.height = 360;
  settings.ground_height_m = -0.42;  // which cuts the ball and the box
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.5, 40), box = box_mesh({0.3, 0.1, -0.5}, {0.9, 0.6, 0.3}),
                    leaf =
                        quad_mesh({-0.9, -0.3, -0.4}, {-0.5, 0.2, -0.4}, {-0.5, 0.3, 0.5}, {-0.9, -0.2, 0.5});
  std::vector<MeshLook> looks(6);
  looks[1].grain = 0.5, looks[1].grain_m = 0.06;
  looks[2].translucency = 0.8, looks[2].scatter_m = 0.1;
  looks[3].metallic = 0.9, looks[3].roughness = 0.3;
  looks[4].sheen = 1, looks[4].grain = 0.4, looks[4].grain_m = 0.03, looks[4].woven = true;
  looks[5].edges = LineLook{};
  for (std::size_t k = 0; k < looks.size(); ++k) {
    Image8 pictures[2];
    for (const bool tiles : {true, false}) {
      settings.tiles = tiles;
      Renderer renderer(settings);
      looks[k].color_srgb = {0.8, 0.35, 0.25};
      const int number = renderer.add_mesh(ball.triangles, ball.positions, looks[k]);
      renderer.add_mesh(box.triangles, box.positions, {.color_srgb = {0.3, 0.5, 0.8}});
      renderer.add_mesh(leaf.triangles, leaf.positions,
                        {.color_srgb = {0.4, 0.7, 0.3}});  // its back is seen, too
      if (k % 2) {
        renderer.set_occlusion(number, (0.5 + 0.5 * ball.positions.col(0).array()).matrix());
        renderer.set_colors(number, (0.5 + ball.positions.array()).matrix());
      }
      Camera camera;
      camera.eye = Vec3(-1, -3, 1.2), camera.target = Vec3(0, 0, 0);
      pictures[tiles] = renderer.draw_shown(camera);
    }
    int differ = 0, largest = 0;
    for (std::size_t i = 0; i < pictures[0].rgb.size(); ++i) {
      const int levels = std::abs(int(pictures[0].rgb[i]) - int(pictures[1].rgb[i]));
      differ += levels > 2, largest = std::max(largest, levels);
    }
    EXPECT_LT(differ, 3 * settings.width * settings.height / 1000) << k;
    EXPECT_LT(largest, 24) << k;
  }
}

// What a picture leaves in the targets is not seen in the next.
TEST(TileLight, AMotionLeavesNoTrace) {
  RenderSettings settings;
  settings.width = 160, settings.height = 120;
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.3, 12);
  Camera camera;
  camera.eye = Vec3(0, -3, 1), camera.target = Vec3(0, 0, 0);
  MeshLook plain, edged;
  edged.edges = LineLook{.width_px = 24};
  for (const MeshLook& look : {plain, edged}) {
    Renderer renderer(settings);
    const int number = renderer.add_mesh(ball.triangles, ball.positions, look);
    for (const double x : {-0.8, 0.1, 0.7, -0.2, -0.75, 0.45, 0.0}) {
      const Points moved = ball.positions.rowwise() + Eigen::RowVector3d(x, 0, 0.3 * x);
      renderer.set_positions(number, moved);
      Renderer fresh(settings);
      fresh.set_positions(fresh.add_mesh(ball.triangles, ball.positions, look), moved);
      EXPECT_EQ(renderer.draw_shown(camera).rgb, fresh.draw_shown(camera).rgb) << x;
    }
  }
}

}  // namespace
}  // namespace limber::render
