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
                          const std::vector<std::uint32_t>& corners, const Mat4& clip, Tiles::Of of) {
  std::vector<int> times(std::size_t(columns * rows), 0);
  const auto shown = std::make_unique<Tiles::Samples>(), nothing = std::make_unique<Tiles::Samples>();
  nothing->depth.fill(1);
  std::vector<detail::Covered> covered;
  for (std::size_t c = 0; c < corners.size(); c += 3) {
    Tiles tiles(columns, rows, of);
    tiles.add(positions, {corners[c], corners[c + 1], corners[c + 2]}, clip, false, 0);
    tiles.sort();
    for (int r = 0; r < tiles.rows(); ++r)
      for (int t = 0; t < tiles.columns(); ++t) {
        if (of == Tiles::Of::transparent) {
          tiles.cover(t, r, *nothing, covered);
          shown->triangle.fill(-1);
          for (const detail::Covered& pixel : covered)
            for (int s = 0; s < 4; ++s)
              if (pixel.samples >> s & 1)
                shown->triangle[std::size_t((2 * pixel.y + s / 2) * tile_samples + 2 * pixel.x + s % 2)] = 0;
        } else {
          tiles.resolve(t, r, *shown);
        }
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
    for (const Tiles::Of of : {Tiles::Of::opaque, Tiles::Of::transparent})
      for (const int times : coverage(columns, rows, positions, corners, Mat4::Identity(), of))
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
  tiles.add(plane(-0.3f, 0.3f), corners, Mat4::Identity(), false, 0);
  tiles.add(plane(0.2f, -0.25f), corners, Mat4::Identity(), false, 0);
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
  tiles.add(wall, {0, 1, 2, 0, 2, 3}, clip, false, 0, {&cut, 1});
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

// A floor of many triangles round the eye, most of which reach behind it or far out of the picture: each
// sample's ray meets it once, at the depth that it has there, or goes above the horizon. Cut off beyond a
// line, too.
TEST(Tiles, WhatReachesBehindTheEyeIsThereAsFarAsItIsSeen) {
  constexpr int n = 128;
  const double near = 0.1, far = 2000;
  const Mat4 clip = clip_from_camera(60, 1, near, far);
  const Eigen::Vector4d cut(0.3, 0, 1, 40);
  for (const bool is_cut : {false, true}) {
    std::vector<float> floor{0.7f, -1, 0.4f};  // y = −1, the eye at 0 looking along −z
    std::vector<std::uint32_t> corners;
    constexpr int around = 7;
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.3) / around;
      floor.insert(floor.end(), {float(900 * std::cos(angle)), -1, float(900 * std::sin(angle))});
      const std::uint32_t a = std::uint32_t(1 + k), b = std::uint32_t(1 + (k + 1) % around);
      corners.insert(corners.end(), {0u, k % 2 ? a : b, k % 2 ? b : a});
    }
    std::vector<int> times(n * n, 0);
    std::vector<float> depths(n * n, 1);
    const auto shown = std::make_unique<Tiles::Samples>();
    for (std::size_t c = 0; c < corners.size(); c += 3) {
      Tiles tiles(n, n);
      tiles.add(floor, {corners[c], corners[c + 1], corners[c + 2]}, clip, false, 0,
                {&cut, std::size_t(is_cut)});
      tiles.sort();
      for (int r = 0; r < 2; ++r)
        for (int t = 0; t < 2; ++t) {
          tiles.resolve(t, r, *shown);
          for (int i = 0; i < tile_samples * tile_samples; ++i) {
            const int at = (r * tile_samples + i / tile_samples) * n + t * tile_samples + i % tile_samples;
            if (shown->triangle[std::size_t(i)] < 0) continue;
            ++times[std::size_t(at)], depths[std::size_t(at)] = shown->depth[std::size_t(i)];
          }
        }
    }
    int there = 0, gone = 0;
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const double u = (2 * (x + 0.5) / n - 1) * std::tan(std::numbers::pi / 6),
                     v = (2 * (y + 0.5) / n - 1) * std::tan(std::numbers::pi / 6);
        const double depth = -1 / v;  // of the ray (u, v, −1) times it
        const double above = is_cut ? cut.dot(Eigen::Vector4d(u * depth, -1, -depth, 1)) : 1;
        if (v < 0 && (depth > 500 || std::abs(above) < 0.6)) continue;
        const std::size_t at = std::size_t(y * n + x);
        ASSERT_EQ(times[at], v < 0 && above > 0) << u << " " << v << " " << is_cut;
        ++(times[at] ? there : gone);
        if (times[at]) {
          ASSERT_NEAR(depths[at], far * (depth - near) / (depth * (far - near)), 1e-5);
        }
      }
    EXPECT_GT(there, 2000);
    EXPECT_GT(gone, is_cut ? 8400 : 8000);
  }
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
    detail::Finish finish{};
    finish.transparent = turn % 4 == 2, finish.sheet = turn % 8 == 2, finish.flat_inside = turn % 3 == 0;
    finish.opacity = number(0.1, 0.9), finish.log2_clear = std::log2(1 - finish.opacity);
    finish.tinted = true;
    finish.roughness = number(0.1, 1), finish.metallic = number(0, 1), finish.sheen = number(0, 1);
    finish.open_power = number(0, 1), finish.translucency = number(0, 1), finish.scatter_radius = 0.1f;
    finish.grain = turn % 2 ? 0.4f : 0.0f, finish.fine = turn % 4 == 1, finish.relief = &relief;
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
      light.insert(light.end(), lit->held_back, lit->held_back + detail::places_at_once);
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

// Root of the mean square, in levels.
double apart(const Image8& one, const Image8& other) {
  double sum = 0;
  for (std::size_t i = 0; i < one.rgb.size(); ++i) {
    const double levels = double(one.rgb[i]) - double(other.rgb[i]);
    sum += levels * levels;
  }
  return std::sqrt(sum / double(one.rgb.size()));
}

// A ball in a clear ball in a clear box that is open above, through which a clear leaf goes; what is cut
// open, and what stands in the ground. Of sixteen samples a pixel each has layers of its own, by OpenGL:
// tiles of four are no farther from that than OpenGL's of four.
TEST(TileLight, TransparentSurfacesAreNoFartherFromManySamplesThanTheShaders) {
  RenderSettings settings;
  settings.width = 320, settings.height = 240;
  settings.ground_height_m = -0.62;
  const SurfaceMesh core = sphere_mesh({0.05, 0, 0}, 0.3, 30), shell = sphere_mesh({0, 0, 0}, 0.5, 40),
                    leaf =
                        quad_mesh({-0.9, -0.3, -0.3}, {0.4, 0.2, -0.2}, {0.5, 0.3, 0.5}, {-0.9, -0.2, 0.5});
  SurfaceMesh box = box_mesh({-0.7, -0.6, -0.7}, {0.9, 0.6, 0.6});
  for (int k = 0; k < 6; ++k) {
    enum Way { in_tiles, by_opengl, truth };
    Image8 pictures[3];
    for (const Way way : {in_tiles, by_opengl, truth}) {
      settings.tiles = way == in_tiles, settings.supersampling = way == truth ? 4 : 2;
      settings.transparent_background = k == 4;
      Renderer renderer(settings);
      const int in = renderer.add_mesh(core.triangles, core.positions, {.color_srgb = {0.8, 0.3, 0.25}});
      MeshLook skin{.color_srgb = {0.9, 0.7, 0.6}, .opacity = k == 1 ? 0.9 : 0.3, .sheet = k != 2};
      skin.sheen = k == 3 ? 1 : 0;
      const int over = renderer.add_mesh(shell.triangles, shell.positions, skin);
      const int round = renderer.add_mesh(k % 2 ? box.triangles : Triangles(box.triangles.topRows(10)),
                                          box.positions, {.color_srgb = {0.4, 0.6, 0.9}, .opacity = 0.2});
      MeshLook green{.color_srgb = {0.4, 0.7, 0.3}, .opacity = 0.6, .sheet = true};
      if (k == 0) green.edges = LineLook{.width_px = 3};
      renderer.add_mesh(leaf.triangles, leaf.positions, green);
      if (k == 1) renderer.add_lines(edges_of(bounding_box(box.positions)), {});
      if (k % 2) renderer.set_occlusion(over, (0.5 + 0.9 * shell.positions.col(0).array()).matrix());
      if (k == 3) renderer.set_colors(over, (0.5 + shell.positions.array()).matrix());
      // The box is open, so no face closes it; the core is closed by one.
      if (k == 2) renderer.set_clip_planes(round, {{0, 1, 0.2, 0.3}, {-1, 0, 0, 0.5}});
      if (k > 3) renderer.set_clip_planes(in, {{0, 1, 0.3, -0.02}, {-1, 0, 0.2, 0.1}});
      Camera camera;
      camera.eye = Vec3(-1, -3, 1.2), camera.target = Vec3(0, 0, 0);
      pictures[way] = renderer.draw_shown(camera);
    }
    const double of_tiles = apart(pictures[in_tiles], pictures[truth]),
                 of_opengl = apart(pictures[by_opengl], pictures[truth]);
    EXPECT_LT(of_tiles, of_opengl) << k;
    EXPECT_GT(of_tiles, 0) << k;
  }
}

// The eye within a ball, close over a floor that reaches far behind it, before a box that it nearly touches.
TEST(TileLight, ThatReachesBehindTheEyeIsThatOfTheShader) {
  RenderSettings settings;
  settings.width = 480, settings.height = 360;
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 1, 24), box = box_mesh({0.1, 0.35, -0.3}, {0.6, 0.9, 0.2}),
                    floor = quad_mesh({-30, -50, -0.4}, {40, -20, -0.4}, {50, 60, -0.4}, {-20, 30, -0.4});
  for (const double opacity : {1.0, 0.3}) {
    Image8 pictures[2];
    for (const bool tiles : {true, false}) {
      settings.tiles = tiles;
      Renderer renderer(settings);
      const int round = renderer.add_mesh(ball.triangles, ball.positions,
                                          {.color_srgb = {0.8, 0.6, 0.5}, .opacity = opacity});
      renderer.set_colors(round, (0.5 + 0.5 * ball.positions.array()).matrix());
      renderer.add_mesh(floor.triangles, floor.positions,
                        {.color_srgb = {0.4, 0.7, 0.3}, .opacity = opacity});
      renderer.add_mesh(box.triangles, box.positions, {.color_srgb = {0.3, 0.5, 0.8}});
      Camera camera;
      camera.eye = Vec3(0.1, -0.4, -0.1), camera.target = Vec3(0.2, 1, -0.2);
      pictures[tiles] = renderer.draw_shown(camera);
    }
    std::size_t differ = 0;
    for (std::size_t i = 0; i < pictures[0].rgb.size(); ++i)
      differ += std::abs(int(pictures[0].rgb[i]) - int(pictures[1].rgb[i])) > 3;
    EXPECT_LT(differ, pictures[0].rgb.size() / 250) << opacity;
  }
}

// A pane of two triangles a side, each of which several sides of the picture cut.
TEST(TileLight, APaneThatIsLargerThanThePictureIsThatOfTheShader) {
  RenderSettings settings;
  settings.width = 320, settings.height = 180;
  const SurfaceMesh ball = sphere_mesh({0, 0.5, 0}, 0.4, 24),
                    pane = box_mesh({-3, -1.025, -3}, {3, -0.975, 3});
  Image8 pictures[2];
  for (const bool tiles : {true, false}) {
    settings.tiles = tiles;
    Renderer renderer(settings);
    renderer.add_mesh(ball.triangles, ball.positions, {.color_srgb = {0.8, 0.3, 0.2}});
    renderer.add_mesh(pane.triangles, pane.positions, {.color_srgb = {0.2, 0.7, 0.4}, .opacity = 0.5});
    Camera camera;
    camera.eye = Vec3(0, -7, 1), camera.target = Vec3(0, 0, 0), camera.fov_deg = 25;
    pictures[tiles] = renderer.draw_shown(camera);
  }
  EXPECT_LT(apart(pictures[0], pictures[1]), 1);
  for (const auto& [x, y] : {std::pair(3, 3), {316, 3}, {3, 176}, {316, 176}}) {
    const std::uint8_t* p = &pictures[0].rgb[3 * std::size_t(y * settings.width + x)];
    EXPECT_GT(p[1], p[0] + 20) << x << ' ' << y;
  }
}

// What a picture leaves in the targets is not seen in the next.
TEST(TileLight, AMotionLeavesNoTrace) {
  RenderSettings settings;
  settings.width = 160, settings.height = 120;
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.3, 12);
  Camera camera;
  camera.eye = Vec3(0, -3, 1), camera.target = Vec3(0, 0, 0);
  MeshLook plain, edged, clear;
  edged.edges = LineLook{.width_px = 24};
  clear.opacity = 0.4;
  for (const MeshLook& look : {plain, edged, clear}) {
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
