// What a picture shows, found without a drawing context, against the passes of one.
#include "render/sight.h"

#include <gtest/gtest.h>

#include "render/cut.h"
#include "render/renderer.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

// Bodies that hide and pass through one another, one of them cut.
TEST(Sight, ShowsWhatThePassesShow) {
  RenderSettings settings;
  settings.width = 200, settings.height = 150, settings.supersampling = 1;
  Camera camera;
  camera.eye = {1, -4, 2}, camera.target = {0, 0, 0.2};
  const std::vector<SurfaceMesh> meshes{
      sphere_mesh({0, 0, 0}, 0.6, 40), sphere_mesh({0.5, 0.2, 0.3}, 0.5, 30),
      box_mesh({-1, -0.5, -0.6}, {-0.2, 1, 0.4}),
      quad_mesh({-3, -3, -0.7}, {3, -3, -0.7}, {3, 3, -0.7}, {-3, 3, -0.7})};
  const Plane plane(0, 0.6, -0.8, 0.2);
  Renderer renderer(settings);
  Sight sight(settings.width, settings.height);
  for (int m = 0; m < int(meshes.size()); ++m) {
    const SurfaceMesh& mesh = meshes[std::size_t(m)];
    renderer.add_mesh(mesh.triangles, mesh.positions, {});
    const std::vector<Plane> planes = m == 1 ? std::vector<Plane>{plane} : std::vector<Plane>{};
    renderer.set_clip_planes(m, planes);
    lay_over(sight, camera, mesh.positions, mesh.triangles, m, planes);
    if (m != 1) continue;
    const SurfaceMesh cap = cap_of(mesh.positions, mesh.triangles, plane);
    lay_over(sight, camera, cap.positions, cap.triangles, m);
  }
  Passes passes;
  renderer.draw(camera, &passes);
  int differ = 0;
  std::vector<int> pixels(meshes.size(), 0);
  for (std::size_t i = 0; i < sight.object.size(); ++i) {
    if (sight.object[i] >= 0) ++pixels[std::size_t(sight.object[i])];
    if (sight.object[i] != passes.object[i]) {
      ++differ;
    } else if (sight.object[i] >= 0) {
      EXPECT_NEAR(sight.depth_m[i], passes.depth_m[i], 2e-3);
    }
  }
  EXPECT_LE(differ, 10);
  for (const int count : pixels) EXPECT_GT(count, 500);
}

TEST(Sight, WhatIsBehindTheEyeIsNotSeen) {
  Sight sight(40, 30);
  Camera camera;
  camera.eye = {0, 0, 0}, camera.target = {0, 1, 0};
  lay_over(sight, camera, sphere_mesh({0, -3, 0}, 1, 10).positions, sphere_mesh({0, -3, 0}, 1, 10).triangles,
           0);
  EXPECT_EQ(std::count(sight.object.begin(), sight.object.end(), -1), 40 * 30);
}

// Of a square of s pixels a side the distance to its rim, by its definition.
TEST(Sight, ClearancesAreDistancesToTheNextObject) {
  Sight sight(30, 20);
  for (int y = 4; y < 15; ++y)
    for (int x = 7; x < 21; ++x) sight.object[sight.at(x, y)] = 3;
  for (int x = 0; x < 7; ++x) sight.object[sight.at(x, 9)] = 1;
  const std::vector<int> clear = clearances(sight);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 30; ++x) {
      int nearest = std::min({x + 1, y + 1, 30 - x, 20 - y});
      for (int v = 0; v < 20; ++v)
        for (int u = 0; u < 30; ++u)
          if (sight.object[sight.at(u, v)] != sight.object[sight.at(x, y)])
            nearest = std::min(nearest, std::abs(u - x) + std::abs(v - y));
      EXPECT_EQ(clear[sight.at(x, y)], nearest) << x << " " << y;
    }
}

}  // namespace
}  // namespace limber::render
