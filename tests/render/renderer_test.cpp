#include "render/renderer.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <numeric>
#include <optional>
#include <thread>
#include <tuple>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "render/detail/process.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

RenderSettings small_look() {
  RenderSettings look;
  look.width = 320, look.height = 240;
  return look;
}

Camera camera_from(const Vec3& eye, const Vec3& target = Vec3::Zero()) {
  Camera camera;
  camera.eye = eye, camera.target = target;
  return camera;
}

float alpha(const Image& image, int x, int y) {
  return image.rgba[4 * (std::size_t(y) * image.width + x) + 3];
}
double covered_pixels(const Image& image) {
  double sum = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) sum += image.rgba[i];
  return sum;
}
Vec3 color(const Image8& image, int x, int y) {
  const std::uint8_t* p = &image.rgb[3 * (std::size_t(y) * image.width + x)];
  return {double(p[0]), double(p[1]), double(p[2])};
}

struct Difference {
  int largest = 0;
  double mean = 0;
};
Difference difference(const Image& a, const Image& b) {
  const Image8 x = tone_mapped(a), y = tone_mapped(b);
  Difference d;
  for (std::size_t i = 0; i < x.rgb.size(); ++i) {
    const int levels = std::abs(int(x.rgb[i]) - int(y.rgb[i]));
    d.largest = std::max(d.largest, levels);
    d.mean += levels / double(x.rgb.size());
  }
  return d;
}

Image picture_of(const SurfaceMesh& mesh, const RenderSettings& look, const Camera& camera,
                 const MeshLook& mesh_look = {}) {
  Renderer renderer(look);
  renderer.add_mesh(mesh.triangles, mesh.positions, mesh_look);
  return renderer.draw(camera);
}

// A sphere projects to an ellipse of area π f² r² √(l²−r²) / (z²−r²)^1.5: f the focal length, l the distance
// to the middle, z the distance along the view (Quílez, "Sphere - projection").
TEST(Renderer, ASpheresSilhouetteHasTheAreaOfPerspective) {
  RenderSettings look = small_look();
  for (const Vec3& center : {Vec3(0, 0, 0), Vec3(0.6, 0, 0.4), Vec3(-0.7, 1, -0.3)})
    for (const double radius : {0.25, 0.6}) {
      look.multisampling = !look.multisampling;
      const Camera camera = camera_from({0, -5, 0});
      const double f = 0.5 * look.height / std::tan(0.5 * camera.fov_deg * std::numbers::pi / 180);
      const double l2 = (center - camera.eye).squaredNorm(), z = center.y() + 5, r2 = radius * radius;
      const double expected = std::numbers::pi * f * f * r2 * std::sqrt(l2 - r2) / std::pow(z * z - r2, 1.5);
      const double measured = covered_pixels(picture_of(sphere_mesh(center, radius, 90), look, camera));
      EXPECT_NEAR(measured / expected, 1, 0.004) << "centre " << center.transpose() << " radius " << radius;
    }
}

TEST(Renderer, TheNearerQuadHidesTheOtherInWhateverOrder) {
  const auto quad = [](double y) { return quad_mesh({-1, y, -1}, {1, y, -1}, {1, y, 1}, {-1, y, 1}); };
  for (const bool near_first : {true, false}) {
    Renderer renderer(small_look());
    for (const bool near : {near_first, !near_first}) {
      const SurfaceMesh mesh = quad(near ? -1 : 1);
      renderer.add_mesh(mesh.triangles, mesh.positions, {"quad", near ? Vec3(1, 0, 0) : Vec3(0, 0, 1)});
    }
    const Vec3 middle = color(tone_mapped(renderer.draw(camera_from({0, -6, 0}))), 160, 120);
    EXPECT_GT(middle.x(), middle.z() + 50);
  }
}

TEST(Renderer, WhereNothingIsTheBackgroundIsTheColourAskedFor) {
  RenderSettings look = small_look();
  look.background_top_srgb = Vec3(30, 60, 90) / 255;
  look.background_bottom_srgb = Vec3(250, 240, 230) / 255;
  const Image image =
      picture_of(box_mesh({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}), look, camera_from({0, -5, 0}));
  const Image8 shown = tone_mapped(image);
  for (int y = 0; y < look.height; ++y) {  // the two are mixed in linear light, before the tone map
    const double height = 1 - (y + 0.5) / look.height;
    for (int c = 0; c < 3; ++c) {
      const auto light = [&](const Vec3& srgb) { return tone_unmapped(linear_from_srgb(srgb[c])); };
      const double mixed =
          (1 - height) * light(look.background_bottom_srgb) + height * light(look.background_top_srgb);
      EXPECT_NEAR(color(shown, 3, y)[c], 255 * srgb_from_linear(tone_mapped(mixed)), 1) << y;
    }
  }
  EXPECT_LE((color(shown, 3, look.height - 1) - Vec3(250, 240, 230)).cwiseAbs().maxCoeff(), 1);
  EXPECT_EQ(alpha(image, 3, 3), 0);
  // With a ground the lower colour is that of the horizon, and of the far ground before it.
  look.ground_height_m = -0.1;
  const Image8 with_ground =
      tone_mapped(picture_of(box_mesh({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}), look, camera_from({0, -5, 0})));
  for (const int below : {0, 2})
    EXPECT_LE((color(with_ground, 3, look.height / 2 + below) - Vec3(250, 240, 230)).cwiseAbs().maxCoeff(),
              1.01);
  EXPECT_LT(color(with_ground, 3, 0)[0], 248);
}

// Of a sheet a slanting ray passes 1 / cos of its thickness, and each part lets through as much as the one
// before.
TEST(Renderer, ASheetHidesTheMoreTheMoreItSlants) {
  constexpr double opacity = 0.2;
  for (const double slant_deg : {0.0, 40.0, 60.0, 75.0, 84.0}) {
    const double slant = slant_deg * std::numbers::pi / 180;
    const Vec3 along(std::sin(slant), -std::cos(slant), 0), up(0, 0, 3);
    const Vec3 side = 3 * Vec3(std::cos(slant), std::sin(slant), 0);
    const SurfaceMesh quad = quad_mesh(-side - up, side - up, side + up, up - side);
    const MeshLook look{.name = "veil", .opacity = opacity, .sheet = true};
    Camera camera = camera_from({0, -100, 0});
    camera.fov_deg = 1;
    const Image image = picture_of(quad, small_look(), camera, look);
    EXPECT_NEAR(alpha(image, 160, 120), 1 - std::pow(1 - opacity, 1 / std::cos(slant)), 3e-3) << slant_deg;
  }
}

// Turned and moved together with light and eye, a body shows the same relief: it goes by the place at rest.
TEST(Renderer, TheGrainGoesWithTheMesh) {
  const SurfaceMesh ball = sphere_mesh({0.1, 0.2, 0.3}, 0.5, 60);
  MeshLook look{.name = "ball", .roughness = 0.3, .grain = 0.6, .grain_m = 0.1};
  const Eigen::Isometry3d turn = Eigen::Translation3d(3, -2, 5) *
                                 Eigen::AngleAxisd(1.1, Vec3(0.3, -0.5, 0.8).normalized()) *
                                 Eigen::Isometry3d::Identity();
  const auto picture = [&](const Eigen::Isometry3d& moved, bool moves_body) {
    RenderSettings light = small_look();
    light.up = moved.linear() * light.up, light.toward_key = moved.linear() * light.toward_key;
    Camera camera = camera_from(moved * Vec3(0.5, -2, 0.8), moved * Vec3(0.1, 0.2, 0.3));
    camera.up = moved.linear() * camera.up;
    Renderer renderer(light);
    const int mesh = renderer.add_mesh(ball.triangles, ball.positions, look);
    Points positions = ball.positions;
    if (moves_body)
      positions = (positions * moved.linear().transpose()).rowwise() + moved.translation().transpose();
    renderer.set_positions(mesh, positions);
    return renderer.draw(camera);
  };
  const Image still = picture(Eigen::Isometry3d::Identity(), true), moved = picture(turn, true);
  EXPECT_LT(difference(still, moved).mean, 0.05);
  const Image woven = (look.woven = true, picture(turn, true)), plain = (look.grain = 0, picture(turn, true));
  EXPECT_GT(difference(moved, plain).mean, 0.5);
  EXPECT_GT(difference(woven, plain).mean, 0.5);
  EXPECT_GT(difference(moved, woven).mean, 0.5);
}

// White stuff lit from behind: of the light, e to the thickness over the depth is left, by a stand-in, too.
TEST(Renderer, ThinPartsLetLightThrough) {
  constexpr double scatter_m = 0.1;
  RenderSettings light = small_look();
  light.toward_key = {0, 1, 0.1};
  light.stage.include(Vec3(-1, -1, -1)), light.stage.include(Vec3(1, 1, 1));
  const auto seen_through = [&](double thickness, bool stand_in) {
    const SurfaceMesh slab = box_mesh({-0.8, 0, -0.8}, {0.8, thickness, 0.8});
    double green[2];
    for (const double translucency : {0.0, 0.5}) {
      Renderer renderer(light);
      renderer.add_mesh(slab.triangles, slab.positions,
                        {.name = "slab",
                         .color_srgb = {1, 1, 1},
                         .translucency = translucency,
                         .scatter_m = scatter_m,
                         .casts_shadow = !stand_in});
      if (stand_in) renderer.add_mesh(slab.triangles, slab.positions, {.name = "stand-in", .seen = false});
      green[translucency > 0] =
          double(renderer.draw(camera_from({0, -5, 0})).rgba[4 * (120 * 320 + 160) + 1]);
    }
    return green[1] - green[0];
  };
  for (const bool stand_in : {false, true}) {
    const double thin = seen_through(0.1, stand_in), thick = seen_through(0.2, stand_in);
    EXPECT_GT(thin, 0.03);
    EXPECT_NEAR(std::log(thin / thick), 0.1 * std::sqrt(1.01) / scatter_m, 0.05) << stand_in;
  }
}

// Where the shadow of a small plate falls: the middle of the pixels that the plate darkens, once on the
// ground (shaded by height bands) and once on a large body (by the shadow map).
TEST(Renderer, TheShadowFallsWhereTheLightLeads) {
  const Vec3 plate_middle(0.2, -0.1, 1.5);
  const SurfaceMesh plate = quad_mesh(plate_middle + Vec3(-.2, -.2, 0), plate_middle + Vec3(.2, -.2, 0),
                                      plate_middle + Vec3(.2, .2, 0), plate_middle + Vec3(-.2, .2, 0));
  const SurfaceMesh floor = quad_mesh({-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
  const Camera camera = camera_from({0, -4, 7});
  for (const bool on_body : {false, true})
    for (const Vec3& toward_key : {Vec3(-0.6, -0.3, 1), Vec3(0.7, -0.5, 1)}) {
      SCOPED_TRACE(fmt::format("on body {}, light from {}", on_body, toward_key.x()));
      RenderSettings look = small_look();
      look.toward_key = toward_key;
      look.key_size_deg = 1;
      if (!on_body) look.ground_height_m = 0;
      look.stage.include(Vec3(-2, -2, 0)), look.stage.include(Vec3(2, 2, 2));
      Image images[2];
      for (const bool with_plate : {false, true}) {
        Renderer renderer(look);
        if (on_body) renderer.add_mesh(floor.triangles, floor.positions, {"floor"});
        if (with_plate) renderer.add_mesh(plate.triangles, plate.positions, {"plate", Vec3(1, 1, 1)});
        images[with_plate] = renderer.draw(camera);
      }
      // The plate itself is left out by its place on the screen.
      const Vec3 plate_pixel = pixel_from_world(camera, plate_middle, look.width, look.height);
      double sum = 0, x_sum = 0, y_sum = 0;
      for (int y = 0; y < look.height; ++y)
        for (int x = 0; x < look.width; ++x) {
          const std::size_t at = 4 * (std::size_t(y) * look.width + x) + 1;
          const double darkening = images[0].rgba[at] - images[1].rgba[at];
          if (std::hypot(x - plate_pixel.x(), y - plate_pixel.y()) < 20 || darkening < 0.12) continue;
          sum += 1, x_sum += x + 0.5, y_sum += y + 0.5;
        }
      ASSERT_GT(sum, 50);
      const Vec3 foot = plate_middle - plate_middle.z() * toward_key;
      const Vec3 expected = pixel_from_world(camera, foot, look.width, look.height);
      EXPECT_NEAR(x_sum / sum, expected.x(), 1.0);
      EXPECT_NEAR(y_sum / sum, expected.y(), 1.0);
      // Its size: the plate is parallel to the ground, so the shadow has its area.
      const auto at = [&](double dx, double dy) {
        return pixel_from_world(camera, foot + Vec3(dx, dy, 0), look.width, look.height);
      };
      const Vec3 across = at(.2, .2) - at(-.2, -.2), other = at(-.2, .2) - at(.2, -.2);
      const double area = 0.5 * std::abs(across.x() * other.y() - across.y() * other.x());
      EXPECT_NEAR(sum / area, 1, 0.12);
    }
}

// A roof ends at x = 0, at height h, and the light comes over it at 45 degrees, under a half angle a. Of its
// disc, (acos(−t) + t √(1 − t²))/π is open at a place t r beside the shadow's edge, r = 2 h tan a: which goes
// from a tenth to nine tenths within 1.374 r.
TEST(Renderer, HalfShadeBetweenBodiesIsAsWideAsHeightAndLightMakeIt) {
  const SurfaceMesh floor = quad_mesh({-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
  for (const auto& [height, angle_deg] : {std::pair(0.5, 7.0), {1.0, 7.0}, {1.0, 3.5}, {1.5, 5.0}}) {
    SCOPED_TRACE(fmt::format("{} m, {} degrees", height, angle_deg));
    const SurfaceMesh roof = quad_mesh({-4, -4, height}, {0, -4, height}, {0, 4, height}, {-4, 4, height});
    Camera camera = camera_from({height, 0, 6}, {height, 0, 0});
    camera.up = {0, 1, 0};
    RenderSettings look = small_look();
    look.toward_key = {-1, 0, 1}, look.key_size_deg = angle_deg;
    look.stage.include(Vec3(-4, -4, 0)), look.stage.include(Vec3(4, 4, 2));
    Image images[2];
    for (const bool with_roof : {false, true}) {
      Renderer renderer(look);
      renderer.add_mesh(floor.triangles, floor.positions, {"floor"});
      if (with_roof) renderer.add_mesh(roof.triangles, roof.positions, {"roof"});
      images[with_roof] = renderer.draw(camera);
    }
    const double metres_a_pixel = 12 * std::tan(0.5 * camera.fov_deg * std::numbers::pi / 180) / look.height;
    // How much darker it is, from under the roof's edge to the light.
    std::vector<double> darker;
    for (int x = look.width / 2 - int(0.9 * height / metres_a_pixel); x < look.width; ++x) {
      double sum = 0;
      for (int y = 90; y < 150; ++y) {
        const std::size_t at = 4 * (std::size_t(y) * std::size_t(look.width) + std::size_t(x)) + 1;
        sum += double(images[0].rgba[at] - images[1].rgba[at]);
      }
      darker.push_back(sum);
    }
    const double all = *std::max_element(darker.begin(), darker.end());
    const auto last_above = [&](double share) {
      std::size_t k = darker.size() - 2;
      while (k > 0 && darker[k] < share * all) --k;
      return double(k) + (darker[k] - share * all) / (darker[k] - darker[k + 1]);
    };
    const double width_m = (last_above(0.1) - last_above(0.9)) * metres_a_pixel;
    const double radius_m = 2 * height * std::tan(angle_deg * std::numbers::pi / 180);
    EXPECT_NEAR(width_m / (1.374 * radius_m), 1, 0.1);
    EXPECT_NEAR((last_above(0.5) - 0.9 * height / metres_a_pixel) * metres_a_pixel, 0,
                0.1 * radius_m + 1.5 * metres_a_pixel);
  }
}

// A wide disc does not darken the slanting face that it lies in.
TEST(Renderer, NothingShadesItself) {
  for (const double slant_deg : {0.0, 30.0, 50.0, 70.0}) {
    const double slant = slant_deg * std::numbers::pi / 180;
    const Vec3 along = 2 * Vec3(std::cos(slant), 0, std::sin(slant)), across(0, 2, 0);
    const SurfaceMesh face = quad_mesh(-along - across, along - across, along + across, across - along);
    RenderSettings look = small_look();
    look.toward_key = {-0.3, 0.2, 1}, look.key_size_deg = 20;
    Image images[2];
    for (const bool casts : {false, true}) {
      Renderer renderer(look);
      renderer.add_mesh(face.triangles, face.positions, {.name = "face", .casts_shadow = casts});
      images[casts] = renderer.draw(camera_from({0, -1, 6}));
    }
    EXPECT_LE(difference(images[0], images[1]).largest, 1) << slant_deg;
  }
}

TEST(Renderer, TheOrderOfTrianglesAndVerticesChangesNoPixel) {
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0.5}, 0.5, 40);
  Rng rng(51, 0);
  std::vector<int> new_from_old(std::size_t(sphere.positions.rows()));
  std::iota(new_from_old.begin(), new_from_old.end(), 0);
  for (int i = int(new_from_old.size()) - 1; i > 0; --i)
    std::swap(new_from_old[i], new_from_old[rng.below(i + 1)]);
  SurfaceMesh shuffled = sphere;
  for (int v = 0; v < sphere.positions.rows(); ++v)
    shuffled.positions.row(new_from_old[v]) = sphere.positions.row(v);
  for (int t = int(sphere.triangles.rows()) - 1; t >= 0; --t)
    for (int i = 0; i < 3; ++i) shuffled.triangles(t, i) = new_from_old[sphere.triangles(t, i)];
  for (int t = int(sphere.triangles.rows()) - 1; t > 0; --t)
    shuffled.triangles.row(t).swap(shuffled.triangles.row(rng.below(t + 1)));
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -3, 1.5}, {0, 0, 0.5});
  EXPECT_LE(difference(picture_of(sphere, look, camera), picture_of(shuffled, look, camera)).largest, 1);
}

TEST(Renderer, AMeshTurnedInsideOutLooksTheSame) {
  SurfaceMesh sphere = sphere_mesh({0, 0, 0.5}, 0.5, 40), inside_out = sphere;
  inside_out.triangles.col(1).swap(inside_out.triangles.col(2));
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -3, 1.5}, {0, 0, 0.5});
  EXPECT_LT(difference(picture_of(sphere, look, camera), picture_of(inside_out, look, camera)).mean, 0.02);
}

TEST(Renderer, MovingAMeshIsTheSameAsMakingItThere) {
  const SurfaceMesh rest = box_mesh({-0.5, -0.5, 0}, {0.5, 0.5, 1});
  SurfaceMesh moved = rest;
  for (int v = 0; v < 8; ++v)
    moved.positions(v, 0) += 0.4 * moved.positions(v, 2), moved.positions(v, 1) *= 1.3;
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -4, 2}, {0, 0, 0.5});
  Renderer renderer(look);
  const int mesh = renderer.add_mesh(rest.triangles, rest.positions, {"box"});
  renderer.draw(camera);
  const Image expected = picture_of(moved, look, camera, {"box"});
  renderer.set_positions(mesh, moved.positions);
  EXPECT_EQ(renderer.draw(camera).rgba, expected.rgba);
  renderer.set_positions(mesh, moved.positions, vertex_normals(moved.positions, moved.triangles));
  EXPECT_EQ(renderer.draw(camera).rgba, expected.rgba);
}

// Meshes, camera, light and up turned together: the picture stays, but for the grids of the shadow maps.
// Only what meshes and lines may cover is cleared and read. What an earlier picture left beside it is never
// seen: each picture is that of a renderer that drew nothing before, and that of one that clears all for its
// passes.
TEST(Renderer, NothingIsLeftOfThePictureBefore) {
  RenderSettings look = small_look();
  for (const int samples : {1, 2, 3}) {
    look.supersampling = samples;
    const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.2, 20);
    MeshLook glass;
    glass.opacity = 0.4;
    LineLook thick;
    thick.width_px = 9;
    const auto add = [&](Renderer& renderer, const Vec3& at, bool with_line) {
      const Points moved = ball.positions.rowwise() + at.transpose();
      renderer.add_mesh(ball.triangles, moved, at.x() < 0 ? glass : MeshLook{});
      Points ends(2, 3);
      ends << (at + Vec3(0.4, -0.3, -0.3)).transpose(), (at + Vec3(0.4, -0.3, 0.3)).transpose();
      if (with_line) renderer.add_lines(ends, thick);
    };
    const Camera camera = camera_from({0, -5, 0});
    for (const Vec3& at :
         {Vec3(0, 0, 0), Vec3(-1.7, 0, 1.3), Vec3(1.75, 0, -1.2), Vec3(0, 0, 7), Vec3(0, -5, 0)})
      for (const bool with_line : {true, false}) {
        Renderer before(look), passes_too(look);
        Renderer first(look);
        for (Renderer* renderer : {&before, &first, &passes_too}) add(*renderer, at, with_line);
        before.draw(camera_from(at - Vec3(0, 0.25, 0), at));  // the ball is all that is seen
        Passes passes;
        const Image expected = passes_too.draw(camera, &passes);
        EXPECT_EQ(first.draw(camera).rgba, expected.rgba) << samples << " at " << at.transpose();
        EXPECT_EQ(before.draw(camera).rgba, expected.rgba) << samples << " at " << at.transpose();
      }
  }
}

TEST(Renderer, ThePictureDoesNotDependOnTheAxes) {
  Eigen::Matrix3d turn;
  turn << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  RenderSettings look = small_look();
  look.ground_height_m = 0.0;
  Camera camera = camera_from({1, -4, 2}, {0, 0, 0.5});
  SurfaceMesh mesh = sphere_mesh({0.1, 0, 0.7}, 0.5, 40);
  const Image before = picture_of(mesh, look, camera);
  mesh.positions = (mesh.positions * turn.transpose()).eval();
  look.up = turn * look.up, look.toward_key = turn * look.toward_key;
  camera.eye = turn * camera.eye, camera.target = turn * camera.target, camera.up = turn * camera.up;
  EXPECT_LT(difference(before, picture_of(mesh, look, camera)).mean, 0.05);
}

TEST(Renderer, ALineHasItsWidthAndIsHiddenByWhatIsBeforeIt) {
  RenderSettings look = small_look();
  for (const double width : {1.0, 1.5, 3.0, 8.0}) {
    Renderer renderer(look);
    Points ends(2, 3);
    ends << 0.01, 0, -3, 0.01, 0, 3;
    renderer.add_lines(ends, {{1, 0, 0}, width, 1.0});
    const Image image = renderer.draw(camera_from({0, -5, 0}));
    for (int y = 10; y < look.height; y += 50) {
      double row = 0;
      for (int x = 0; x < look.width; ++x) row += alpha(image, x, y);
      EXPECT_NEAR(row, width, 0.05);
    }
    const SurfaceMesh quad = quad_mesh({-1, -1, -0.5}, {1, -1, -0.5}, {1, -1, 0.5}, {-1, -1, 0.5});
    renderer.add_mesh(quad.triangles, quad.positions, {"quad", {0, 1, 0}});
    const Vec3 middle = color(tone_mapped(renderer.draw(camera_from({0, -5, 0}))), 160, 120);
    EXPECT_LT(middle.x(), 0.8 * middle.y());
  }
}

TEST(Renderer, ALineThatPassesTheEyeIsCutAndNotMirrored) {
  Renderer renderer(small_look());
  Points ends(2, 3);
  ends << 0, -50, 0.3, 0, 50, 0.3;  // overhead, from far behind to far ahead: only above the horizon
  renderer.add_lines(ends, {{1, 0, 0}, 2, 1});
  const Image image = renderer.draw(camera_from({0.001, 0, 0}, {0, 5, 0}));
  double above = 0, below = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) (y < image.height / 2 ? above : below) += alpha(image, x, y);
  EXPECT_GT(above, 100);
  EXPECT_EQ(below, 0);
}

SurfaceMesh upright_quad(double y, double half = 1) {
  return quad_mesh({-half, y, -half}, {half, y, -half}, {half, y, half}, {-half, y, half});
}

int add(Renderer& renderer, const SurfaceMesh& mesh, const MeshLook& look) {
  return renderer.add_mesh(mesh.triangles, mesh.positions, look);
}

// Colour and alpha, premultiplied.
Eigen::Vector4d rgba(const Image& image, int x, int y) {
  const float* p = &image.rgba[4 * (std::size_t(y) * image.width + x)];
  return {p[0], p[1], p[2], p[3]};
}
Eigen::Vector4d over(const Eigen::Vector4d& front, const Eigen::Vector4d& back) {
  return front + (1 - front[3]) * back;
}

TEST(Renderer, ATransparentSurfaceShowsItsFrontAndItsBackLayer) {
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.5, 30);
  for (const bool multisampling : {false, true}) {
    RenderSettings look = small_look();
    look.multisampling = multisampling;
    const Image image = picture_of(ball, look, camera_from({0, -4, 0}), {"veil", {1, 1, 1}, 0.5, 0, 0.25});
    EXPECT_NEAR(alpha(image, 160, 120), 1 - 0.75 * 0.75, 1e-3);
    const Image solid = picture_of(ball, look, camera_from({0, -4, 0}));
    EXPECT_NEAR(covered_pixels(image) / covered_pixels(solid), 1 - 0.75 * 0.75, 1e-3);
  }
}

// Two transparent surfaces that pass through each other, a third behind them and something opaque: as if each
// were drawn alone and the four pictures laid over one another, nearest first, whatever the order they were
// added in.
TEST(Renderer, TransparentSurfacesAreSortedWithinEachPixel) {
  const MeshLook red{"red", {0.9, 0.2, 0.1}, 0.5, 0, 0.4}, green{"green", {0.2, 0.8, 0.1}, 0.5, 0, 0.3},
      blue{"blue", {0.1, 0.2, 0.9}, 0.5, 0, 0.45}, solid{"solid", {0.7, 0.7, 0.7}};
  const SurfaceMesh falling = quad_mesh({-1, -0.5, -1}, {1, 0.5, -1}, {1, 0.5, 1}, {-1, -0.5, 1}),
                    rising = quad_mesh({-1, 0.5, -1}, {1, -0.5, -1}, {1, -0.5, 1}, {-1, 0.5, 1});
  const std::vector<std::pair<SurfaceMesh, MeshLook>> all{
      {falling, red}, {rising, green}, {upright_quad(1), blue}, {upright_quad(2, 2), solid}};
  const Camera camera = camera_from({0, -5, 0});
  for (const bool multisampling : {false, true}) {
    RenderSettings look = small_look();
    look.multisampling = multisampling;
    look.transparent_background = true;
    for (const auto& [mesh, mesh_look] : all) look.stage.include(bounding_box(mesh.positions));
    std::vector<Image> alone;
    for (const auto& [mesh, mesh_look] : all) alone.push_back(picture_of(mesh, look, camera, mesh_look));
    for (const std::vector<int>& order : {std::vector{0, 1, 2, 3}, std::vector{3, 2, 1, 0}}) {
      Renderer renderer(look);
      for (const int i : order) add(renderer, all[std::size_t(i)].first, all[std::size_t(i)].second);
      const Image image = renderer.draw(camera);
      for (const auto& [x, near, far] : {std::tuple{130, 0, 1}, std::tuple{190, 1, 0}}) {
        const Eigen::Vector4d expected = over(rgba(alone[std::size_t(near)], x, 100),
                                              over(rgba(alone[std::size_t(far)], x, 100),
                                                   over(rgba(alone[2], x, 100), rgba(alone[3], x, 100))));
        EXPECT_LT((rgba(image, x, 100) - expected).cwiseAbs().maxCoeff(), 2e-3) << x << ' ' << multisampling;
      }
    }
  }
}

// Of two sheets that meet in an edge and lie on one side of it, the nearer hides the farther up to the edge,
// in the pixels of which the middle lies beyond it too.
TEST(Renderer, AlongATransparentSurfacesOutlineItsNearSideIsInFront) {
  const Vec3 left(-1, 0, -0.13), right(1, 0, 0.21), up(0, 0, 1);
  for (const bool multisampling : {false, true}) {
    RenderSettings look = small_look();
    look.multisampling = multisampling;
    look.transparent_background = true;
    look.stage.include(Box{Vec3(-1, -1, -1), Vec3(1, 1, 2)});
    Renderer renderer(look);
    for (const double toward : {-0.4, 0.4}) {
      const Vec3 slope = up + toward * Vec3::UnitY();
      const SurfaceMesh sheet = quad_mesh(left, right, right + slope, left + slope);
      renderer.add_mesh(sheet.triangles, sheet.positions,
                        {"sheet", toward < 0 ? Vec3(0.9, 0, 0) : Vec3(0, 0.9, 0), 1, 0, 0.999});
    }
    const Image image = renderer.draw(camera_from({0, -5, 0.3}));
    int along = 0;  // pixels that the outline runs through
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const Eigen::Vector4d seen = rgba(image, x, y);
        along += 0.1 < seen.w() && seen.w() < 0.9;
        EXPECT_LE(seen.y(), seen.x() + 2e-3) << x << ' ' << y << ' ' << multisampling;
      }
    EXPECT_GT(along, 100);
  }
}

// A transparent surface that enters something opaque is seen up to there, to a sample: where the line of
// entry passes between the samples of a pixel, half of them show it.
TEST(Renderer, ATransparentSurfaceIsSeenUpToWhereItEntersSomethingOpaque) {
  const Camera camera = camera_from({0, -5, 0});
  const MeshLook veil{"veil", {0.2, 0.9, 0.3}, 0.5, 0, 0.4}, solid{"solid", {0.7, 0.3, 0.3}};
  for (const auto& [supersampling, multisampling] :
       {std::pair{2, false}, std::pair{2, true}, std::pair{1, false}, std::pair{4, false}}) {
    RenderSettings look = small_look();
    look.multisampling = multisampling, look.supersampling = supersampling;
    look.transparent_background = true;
    look.stage.include(Vec3(-2, -2, -2)), look.stage.include(Vec3(2, 2, 2));
    const double pixel = 10 * std::tan(camera.fov_deg * std::numbers::pi / 360) / look.height;
    const double entry = 10.4 * pixel;  // of the pixel from 10 to 11 right of the middle
    const SurfaceMesh slanting =
        quad_mesh({entry - 1, -1, -1}, {entry + 1, 1, -1}, {entry + 1, 1, 1}, {entry - 1, -1, 1});
    const Image behind = picture_of(upright_quad(0), look, camera, solid);
    const Image before = picture_of(slanting, look, camera, veil);
    Renderer renderer(look);
    add(renderer, slanting, veil);
    add(renderer, upright_quad(0), solid);
    const Image image = renderer.draw(camera);
    const auto seen = [&](int x) {  // share of the transparent surface's samples
      const Eigen::Vector4d none = rgba(behind, x, 120), all = over(rgba(before, x, 120), none);
      return (rgba(image, x, 120) - none).dot(all - none) / (all - none).squaredNorm();
    };
    EXPECT_NEAR(seen(169), 1, 0.03) << supersampling << multisampling;
    EXPECT_NEAR(seen(170), supersampling == 1 ? 0 : 0.5, 0.03) << supersampling << multisampling;
    EXPECT_EQ(rgba(image, 171, 120), rgba(behind, 171, 120)) << supersampling << multisampling;
  }
}

// Each one is seen, also where they are too many to be held for the whole picture at once.
TEST(Renderer, EveryTransparentLayerCounts) {
  constexpr double opacity = 0.03;
  for (const int layers : {2, 11, 30}) {
    Renderer renderer(small_look());
    for (int i = 0; i < layers; ++i)
      add(renderer, upright_quad(0.1 * i, 3 + 0.2 * i), {"veil", {1, 1, 1}, 0.5, 0, opacity});
    const Image image = renderer.draw(camera_from({0, -5, 0}));
    for (const int y : {2, 60, 120, 180, 237})
      for (const int x : {2, 160, 317})
        EXPECT_NEAR(alpha(image, x, y), 1 - std::pow(1 - opacity, layers), 1e-3) << x << ' ' << y;
  }
}

// Three transparent surfaces, a line before, between or behind them, drawn across something opaque: as if
// each were drawn alone and the pictures laid over one another. Where no line is, nothing changes.
TEST(Renderer, ATransparentSurfaceWhoseOpacityIsSetIsAsIfMadeSoAndOfNoneIsNotThere) {
  const Camera camera = camera_from({0, -5, 0});
  const SurfaceMesh ball = sphere_mesh(Vec3::Zero(), 0.6, 24),
                    pane = quad_mesh({-1, -2, -1}, {1, -2, -1}, {1, -2, 1}, {-1, -2, 1});
  const auto picture = [&](std::optional<double> made, std::optional<double> set) {
    Renderer renderer(small_look());
    renderer.add_mesh(ball.triangles, ball.positions, {});
    if (made) {
      const int mesh = renderer.add_mesh(pane.triangles, pane.positions,
                                         {.opacity = *made, .casts_shadow = false, .edges = LineLook{}});
      if (set) renderer.set_opacity(mesh, *set);
    }
    return renderer.draw_shown(camera);
  };
  EXPECT_EQ(picture(0.7, 0.3), picture(0.3, {}));
  EXPECT_NE(picture(0.7, 0.3), picture(0.7, {}));
  EXPECT_EQ(picture(0.7, 0), picture({}, {}));
}

TEST(Renderer, ALineBetweenTransparentSurfacesIsDimmedByThoseBeforeItAlone) {
  const Camera camera = camera_from({0, -5, 0});
  const LineLook line_look{{0.9, 0.1, 0.1}, 8, 0.7};
  const auto line_at = [](double y) {
    Points ends(2, 3);
    ends << -2, y, 0, 2, y, 0;
    return ends;
  };
  for (const bool multisampling : {false, true}) {
    RenderSettings look = small_look();
    look.multisampling = multisampling;
    look.transparent_background = true;
    look.stage.include(Vec3(-2, -2, -2)), look.stage.include(Vec3(2, 4, 2));
    const auto veil = [](int i) {
      return MeshLook{"veil", {0.2 + 0.3 * i, 0.8 - 0.3 * i, 0.5}, 0.5, 0, 0.3 + 0.05 * i};
    };
    const MeshLook solid{"solid", {0.7, 0.7, 0.7}};
    std::vector<Image> alone;
    for (int i = 0; i < 3; ++i) alone.push_back(picture_of(upright_quad(i), look, camera, veil(i)));
    const Image behind = picture_of(upright_quad(3), look, camera, solid);
    const auto with_line = [&](std::optional<double> y) {
      Renderer renderer(look);
      for (const int i : {1, 2, 0}) add(renderer, upright_quad(i), veil(i));
      add(renderer, upright_quad(3), solid);
      if (y) renderer.add_lines(line_at(*y), line_look);
      return renderer.draw(camera);
    };
    const Image without = with_line({});
    for (int before = 0; before < 4; ++before) {  // transparent surfaces before the line
      const double y = before - 0.5;
      Renderer line_alone(look);
      line_alone.add_lines(line_at(y), line_look);
      const Eigen::Vector4d line = rgba(line_alone.draw(camera), 160, 120);
      Eigen::Vector4d expected = rgba(behind, 160, 120);
      for (int i = 2; i >= 0; --i) {
        if (before == i + 1) expected = over(line, expected);
        expected = over(rgba(alone[std::size_t(i)], 160, 120), expected);
      }
      if (before == 0) expected = over(line, expected);
      const Image image = with_line(y);
      EXPECT_LT((rgba(image, 160, 120) - expected).cwiseAbs().maxCoeff(), 3e-3)
          << before << ' ' << multisampling;
      EXPECT_EQ(rgba(image, 160, 60), rgba(without, 160, 60));
    }
  }
}

TEST(Renderer, ALineBehindATransparentSurfaceIsDimmedAndOneBeforeItIsNot) {
  RenderSettings look = small_look();
  look.transparent_background = true;
  const MeshLook veil{"veil", {0, 0, 1}, 1, 0, 0.45};
  const Camera camera = camera_from({0, -5, 0});
  const Eigen::Vector4d veil_alone = rgba(picture_of(upright_quad(0), look, camera, veil), 160, 120);
  for (const double y : {-1.0, 1.0}) {
    Renderer renderer(look);
    add(renderer, upright_quad(0), veil);
    Points ends(2, 3);
    ends << -2, y, 0, 2, y, 0;
    renderer.add_lines(ends, {{1, 0, 0}, 8, 1});
    const Eigen::Vector4d line(1, 0, 0, 1), seen = rgba(renderer.draw(camera), 160, 120);
    EXPECT_LT((seen - (y < 0 ? line : over(veil_alone, line))).cwiseAbs().maxCoeff(), 2e-3) << y;
  }
}

TEST(Renderer, ColoursOfVerticesAreMixedInLinearLight) {
  const SurfaceMesh quad = upright_quad(0);
  const Camera camera = camera_from({0, -5, 0});
  const Vec3 left(0.9, 0.3, 0.1), right(0.1, 0.6, 0.7);
  Renderer renderer(small_look());
  const int mesh = renderer.add_mesh(quad.triangles, quad.positions, {"quad", left});
  const Image plain = renderer.draw(camera);
  Points colors(4, 3);
  colors.rowwise() = left.transpose();
  renderer.set_colors(mesh, colors);
  EXPECT_LE(difference(renderer.draw(camera), plain).largest, 1);

  colors.row(1) = colors.row(2) = right.transpose();
  renderer.set_colors(mesh, colors);
  const Image mixed = renderer.draw(camera);
  for (const double share : {0.25, 0.5, 0.75}) {
    const Vec3 middle =
        ((1 - share) * linear_from_srgb(left) + share * linear_from_srgb(right)).unaryExpr([](double c) {
          return srgb_from_linear(c);
        });
    const int x = int(pixel_from_world(camera, {2 * share - 1, 0, 0}, 320, 240).x());
    const Image expected = picture_of(quad, small_look(), camera, {"quad", middle});
    EXPECT_LT((rgba(mixed, x, 120) - rgba(expected, x, 120)).cwiseAbs().maxCoeff(), 0.01) << share;
  }
  renderer.set_colors(mesh, {});
  EXPECT_LE(difference(renderer.draw(camera), plain).largest, 1);
}

// A side that the key light does not reach has only the sky's light; the other keeps the key's.
TEST(Renderer, OcclusionTakesTheSkyAndLeavesTheKeyLight) {
  const SurfaceMesh quad = upright_quad(0);
  for (const bool lit : {false, true}) {
    RenderSettings look = small_look();
    look.toward_key = {0, lit ? -1.0 : 1.0, 0.2};
    Renderer renderer(look);
    const int mesh = renderer.add_mesh(quad.triangles, quad.positions, {"quad", {0.8, 0.8, 0.8}});
    const auto light = [&](double occlusion) {
      renderer.set_occlusion(mesh, Eigen::VectorXd::Constant(4, occlusion));
      return rgba(renderer.draw(camera_from({0, -5, 0})), 160, 120).head<3>().eval();
    };
    const Vec3 open = light(0), half = light(0.5), hidden = light(1);
    EXPECT_GT((open - half).minCoeff(), 0.01);
    EXPECT_GT((half - hidden).minCoeff(), 0.01);
    if (lit) {
      EXPECT_GT(hidden.minCoeff(), 0.3);
    } else {
      EXPECT_EQ(hidden, Vec3::Zero());
    }
    renderer.set_occlusion(mesh, {});
    EXPECT_EQ(rgba(renderer.draw(camera_from({0, -5, 0})), 160, 120).head<3>(), open);
  }
}

// A coarse mesh casts for a fine one inside it: it is not seen, does not shade the fine one, and its shadow
// falls where it would if it were seen.
TEST(Renderer, AnUnseenCasterShadesAllButWhatItEncloses) {
  const SurfaceMesh ball = sphere_mesh({0, 0, 1}, 0.5, 60), shell = sphere_mesh({0, 0, 1}, 0.55, 12),
                    floor = quad_mesh({-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
  const Camera camera = camera_from({0, -5, 3}, {0, 0, 0.5});
  RenderSettings look = small_look();
  look.stage.include(Vec3(-2, -2, 0)), look.stage.include(Vec3(2, 2, 2));
  const auto picture = [&](bool with_shell, bool shell_seen, bool ball_casts, bool with_ball) {
    Renderer renderer(look);
    add(renderer, floor, {"floor"});
    if (with_ball) {
      MeshLook ball_look{"ball"};
      ball_look.casts_shadow = ball_casts;
      add(renderer, ball, ball_look);
    }
    if (with_shell) {
      MeshLook shell_look{"shell"};
      shell_look.seen = shell_seen;
      add(renderer, shell, shell_look);
    }
    return renderer.draw(camera);
  };
  const Image by_shell = picture(true, false, false, true), by_ball = picture(false, false, true, true),
              lit = picture(false, false, false, true), seen_shell = picture(true, true, false, false),
              empty = picture(false, false, false, false);
  const Vec3 ball_pixel = pixel_from_world(camera, {0, 0, 1}, look.width, look.height);
  int shaded = 0, shaded_by_ball = 0;
  for (int y = 0; y < look.height; ++y)
    for (int x = 0; x < look.width; ++x) {
      const double away = std::hypot(x - ball_pixel.x(), y - ball_pixel.y());
      if (away <
          42) {  // on the ball: as without any caster, but at the shade's edge where its own map is coarse
        EXPECT_LT((rgba(by_shell, x, y) - rgba(lit, x, y)).cwiseAbs().maxCoeff(), 0.02) << x << ' ' << y;
      } else if (away > 60) {
        const bool dark = rgba(by_shell, x, y)[1] < rgba(empty, x, y)[1] - 0.1;
        shaded += dark, shaded_by_ball += rgba(by_ball, x, y)[1] < rgba(empty, x, y)[1] - 0.1;
        if (dark) {
          EXPECT_LT(rgba(seen_shell, x, y)[1], rgba(empty, x, y)[1] - 0.05);
        }
      }
    }
  EXPECT_GT(shaded, 300);
  EXPECT_NEAR(double(shaded) / shaded_by_ball, 1.15, 0.2);
}

// What is left of a box cut twice is the box that is left, but for the cut's darker color.
TEST(Renderer, ACutBoxIsTheBoxThatIsLeft) {
  const RenderSettings look = small_look();
  const Camera camera = camera_from({2, -4, 1.5});
  const SurfaceMesh whole = box_mesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}),
                    rest = box_mesh({-0.5, -0.5, -0.5}, {0.1, 0.5, 0.3});
  Renderer renderer(look), of_rest(look);
  const int box = add(renderer, whole, {"box", {0.9, 0.2, 0.1}});
  add(of_rest, rest, {"box", {0.9, 0.2, 0.1}});
  renderer.set_clip_planes(box, {Plane(-2, 0, 0, 0.2), Plane(0, 0, -1, 0.3)});  // x < 0.1, z < 0.3
  Passes cut_passes, rest_passes;
  const Image cut = renderer.draw(camera, &cut_passes), left = of_rest.draw(camera, &rest_passes);
  for (std::size_t i = 3; i < cut.rgba.size(); i += 4) ASSERT_NEAR(cut.rgba[i], left.rgba[i], 0.51) << i / 4;
  EXPECT_NEAR(covered_pixels(cut) / covered_pixels(left), 1, 0.002);
  int differ = 0;
  for (std::size_t i = 0; i < cut_passes.object.size(); ++i) {
    if (cut_passes.object[i] != rest_passes.object[i])
      ++differ;
    else if (cut_passes.object[i] == box &&
             !(std::abs(cut_passes.depth_m[i] - rest_passes.depth_m[i]) < 1e-3))
      ++differ;
  }
  EXPECT_LT(differ, 0.002 * covered_pixels(left));
  const auto at = [&](const Image& image, const Vec3& place) {
    const Vec3 p = pixel_from_world(camera, place, look.width, look.height);
    return rgba(image, int(p.x()), int(p.y()));
  };
  // On the two cuts darker, beside them the same.
  for (const Vec3& place : {Vec3(0.1, 0, -0.1), Vec3(-0.2, 0, 0.3)})
    EXPECT_LT(at(cut, place)[0], 0.9 * at(left, place)[0]);
  EXPECT_NEAR(at(cut, {-0.2, -0.5, 0})[0], at(left, {-0.2, -0.5, 0})[0], 1e-3);
  renderer.set_clip_planes(box, {});
  EXPECT_EQ(renderer.draw(camera).rgba, picture_of(whole, look, camera, {"box", {0.9, 0.2, 0.1}}).rgba);
  EXPECT_THROW(renderer.set_clip_planes(box, {Plane(0, 0, 0, 1)}), InputError);
  EXPECT_THROW(renderer.set_clip_planes(box, std::vector<Plane>(max_clip_planes + 1, Plane(1, 0, 0, 0))),
               InputError);
}

// Of a ball of radius r cut off at height h the face is a disk of radius √(r² − h²), seen face on from so far
// away that it is as large as there (pixels on its rim count); of a shell it is the ring between two such
// disks.
TEST(Renderer, TheFaceOfACutIsWhereTheSurfaceIsWoundRound) {
  RenderSettings look = small_look();
  Camera camera = camera_from({0, -400, 0});
  camera.fov_deg = 0.2;
  const double pixels_a_metre = 0.5 * look.height / std::tan(0.1 * std::numbers::pi / 180) / 400;
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.5, 60);
  SurfaceMesh shell = sphere_mesh({0, 0, 0}, 0.3, 60);
  shell.triangles.col(1).swap(shell.triangles.col(2));
  const Eigen::Index before = shell.positions.rows();
  shell.triangles.conservativeResize(shell.triangles.rows() + ball.triangles.rows(), 3);
  shell.triangles.bottomRows(ball.triangles.rows()) = ball.triangles.array() + int(before);
  shell.positions.conservativeResize(before + ball.positions.rows(), 3);
  shell.positions.bottomRows(ball.positions.rows()) = ball.positions;
  for (const bool hollow : {false, true})
    for (const double height : {0.0, 0.2}) {
      Renderer renderer(look);
      const int mesh = add(renderer, hollow ? shell : ball, {"ball"});
      renderer.set_clip_planes(mesh, {Plane(0, 1, 0, height)});  // y > −height
      Passes passes;
      renderer.draw(camera, &passes);
      int on_face = 0;
      for (std::size_t i = 0; i < passes.object.size(); ++i)
        on_face += int(passes.object[i] == mesh && std::abs(passes.depth_m[i] - (400 - height)) < 0.004);
      const double wanted = std::numbers::pi *
                            (0.25 - height * height - (hollow ? 0.09 - height * height : 0)) *
                            pixels_a_metre * pixels_a_metre;
      EXPECT_NEAR(on_face / wanted, 1, 0.03) << hollow << " " << height;
    }
}

// A ray through a cut transparent surface passes two layers, the face and what is behind it, as through the
// whole one.
TEST(Renderer, ATransparentSurfaceThatIsCutIsClosedToo) {
  const RenderSettings look = small_look();
  const Camera camera = camera_from({0, -4, 0});
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.5, 60);
  Renderer renderer(look);
  MeshLook veil{"veil", {0.3, 0.3, 0.3}};
  veil.opacity = 0.4;
  const int mesh = add(renderer, ball, veil);
  renderer.set_clip_planes(mesh, {Plane(0, 1, 0, 0)});
  EXPECT_NEAR(alpha(renderer.draw(camera), look.width / 2, look.height / 2), 1 - 0.6 * 0.6, 2e-3);
}

// Red in green in blue, all cut by one plane: within the disk of each radius its own color is seen, whichever
// was added first, from near and far, face on and aslant.
TEST(Renderer, OfFacesOfACutInOneAnotherTheInnerIsSeen) {
  RenderSettings look = small_look();
  const double radii[] = {0.5, 0.35, 0.2};
  const Vec3 normal = Vec3(0.3, 1, -0.2).normalized();
  const Vec3 across = normal.unitOrthogonal(), upward = normal.cross(across);
  for (const bool tiles : {true, false})
    for (const bool inner_first : {true, false}) {
      look.tiles = tiles;
      Renderer renderer(look);
      for (int i = 0; i < 3; ++i) {
        const int k = inner_first ? 2 - i : i;
        MeshLook ball{"ball", Vec3::Unit(2 - k)};
        ball.roughness = 1;
        const int mesh = add(renderer, sphere_mesh({0, 0, 0}, radii[k], 40), ball);
        renderer.set_clip_planes(mesh, {Plane(normal.x(), normal.y(), normal.z(), 0)});
      }
      for (const Vec3& eye : {Vec3(0, -3, 0), Vec3(-4, -1.5, 1), Vec3(0.3, -1, 0.2), Vec3(10, -30, -40)}) {
        Camera camera = camera_from(eye);
        camera.fov_deg = 80 / eye.norm();
        const Image8 picture = tone_mapped(renderer.draw(camera));
        for (int k = 0; k < 3; ++k)
          for (int turn = 0; turn < 24; ++turn) {
            const double angle = turn * std::numbers::pi / 12,
                         radius = (k < 2 ? 0.5 * (radii[k] + radii[k + 1]) : 0.1);
            const Vec3 p =
                pixel_from_world(camera, radius * (std::cos(angle) * across + std::sin(angle) * upward),
                                 look.width, look.height);
            if (p.x() < 1 || p.y() < 1 || p.x() >= look.width - 1 || p.y() >= look.height - 1) continue;
            const Vec3 seen = color(picture, int(p.x()), int(p.y()));
            EXPECT_GT(seen[2 - k], 1.5 * std::max(seen[(3 - k) % 3], seen[(4 - k) % 3]))
                << k << " from " << eye.transpose() << ": " << seen.transpose();
          }
      }
    }
}

// Of a clear box that two planes cut nothing is seen, and nothing casts a shadow, where the box that is left
// is not.
TEST(Renderer, OfWhatTwoPlanesCutNoLineAndNoShadowIsLeft) {
  const Camera camera = camera_from({2, -4, 1.5});
  const SurfaceMesh whole = box_mesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}),
                    rest = box_mesh({-0.5, -0.5, -0.5}, {-0.2, 0.5, -0.1});
  const std::vector<Plane> planes{Plane(-1, 0, 0, -0.2), Plane(0, 0, -1, -0.1)};
  for (const double opacity : {0.5, 1.0}) {
    RenderSettings look = small_look();
    look.ground_height_m = -1;
    look.stage = bounding_box(whole.positions);
    MeshLook clear{"box", {0.9, 0.2, 0.1}};
    clear.opacity = opacity;
    Renderer renderer(look);
    renderer.set_clip_planes(add(renderer, whole, clear), planes);
    const Image cut = renderer.draw(camera), left = picture_of(rest, look, camera, clear);
    const Image8 cut_shown = tone_mapped(cut), left_shown = tone_mapped(left);
    constexpr int near = 2;  // pixels: half a line
    for (int y = near; y < look.height - near; ++y)
      for (int x = near; x < look.width - near; ++x) {
        bool beside = true;
        for (int dy = -near; dy <= near; ++dy)
          for (int dx = -near; dx <= near; ++dx) beside = beside && alpha(left, x + dx, y + dy) == 0;
        if (!beside) continue;
        ASSERT_EQ(alpha(cut, x, y), 0) << x << ' ' << y;
        ASSERT_LE((color(cut_shown, x, y) - color(left_shown, x, y)).cwiseAbs().maxCoeff(), 6)
            << x << ' ' << y;
      }
  }
}

// An edge is seen when one of its two faces looks towards the eye.
TEST(Renderer, EdgesAreDrawnOverTheSurfaceThatHidesTheOthers) {
  const RenderSettings look = small_look();
  const Camera camera = camera_from({1.5, -4, 2});
  const SurfaceMesh box = box_mesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  Renderer renderer(look);
  MeshLook mesh_look{"box", {0.9, 0.9, 0.9}};
  mesh_look.edges = LineLook{{1, 0, 0}, 3, 1};
  const int number = add(renderer, box, mesh_look);
  const Image image = renderer.draw(camera);
  int seen = 0, hidden = 0;
  const Points ends = edges_of(bounding_box(box.positions));
  for (int e = 0; e < 12; ++e) {
    const Vec3 middle = 0.5 * (ends.row(2 * e) + ends.row(2 * e + 1));
    bool faces_eye = false;
    for (int axis = 0; axis < 3; ++axis)
      if (middle[axis] != 0) faces_eye |= (camera.eye[axis] - middle[axis]) * middle[axis] > 0;
    const Vec3 pixel = pixel_from_world(camera, middle, look.width, look.height);
    const Eigen::Vector4d c = rgba(image, int(pixel.x()), int(pixel.y()));
    EXPECT_EQ(c[0] > 2 * c[1], faces_eye) << middle.transpose();
    ++(faces_eye ? seen : hidden);
  }
  EXPECT_EQ(seen, 9);
  EXPECT_EQ(hidden, 3);

  // Cut with the box: nothing is left of the edge x = 0.5, y = −0.5.
  renderer.set_clip_planes(number, {Plane(-1, 0, 0, 0.1)});
  const Vec3 gone = pixel_from_world(camera, {0.5, -0.5, 0.2}, look.width, look.height);
  EXPECT_EQ(alpha(renderer.draw(camera), int(gone.x()), int(gone.y())), 0);
}

TEST(Renderer, WhatIsCutOffCastsNothing) {
  const Camera camera = camera_from({0, -5, 3});
  const SurfaceMesh floor = quad_mesh({-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
  for (const bool on_body : {false, true}) {
    RenderSettings look = small_look();
    if (!on_body) look.ground_height_m = 0;
    look.stage.include(Vec3(-2, -2, 0)), look.stage.include(Vec3(2, 2, 2));
    Renderer renderer(look);
    if (on_body) add(renderer, floor, {"floor"});
    const Image without = renderer.draw(camera);
    const int box = add(renderer, box_mesh({-0.5, -0.5, 0.5}, {0.5, 0.5, 1}), {"box"});
    EXPECT_GT(difference(renderer.draw(camera), without).mean, 1);
    renderer.set_clip_planes(box, {Plane(0, 0, -1, 0.4)});  // z < 0.4
    EXPECT_LE(difference(renderer.draw(camera), without).largest, 2);
  }
}

TEST(Renderer, ATransparentPictureOverABackgroundIsThePictureWithIt) {
  const SurfaceMesh ball = sphere_mesh({0, 0, 0.5}, 0.5, 30);
  const Camera camera = camera_from({1, -4, 2}, {0, 0, 0.5});
  RenderSettings look = small_look();
  look.stage = bounding_box(ball.positions);
  const Image whole = picture_of(ball, look, camera, {"ball", {0.8, 0.3, 0.2}}),
              background = Renderer(look).draw(camera);
  look.transparent_background = true;
  const Image alone = picture_of(ball, look, camera, {"ball", {0.8, 0.3, 0.2}});
  for (int y = 0; y < look.height; ++y)
    for (int x = 0; x < look.width; ++x)
      for (int c = 0; c < 3; ++c) {
        // Of the ball's own highlight the tone map compresses a part.
        if (rgba(alone, x, y)[c] > tone_knee * alpha(alone, x, y)) continue;
        const auto shown = [&](const Image& image) { return tone_mapped(rgba(image, x, y)[c]); };
        EXPECT_NEAR(shown(alone) + (1 - alpha(alone, x, y)) * shown(background), shown(whole), 1e-3)
            << x << ' ' << y;
      }
  look.ground_height_m = 0;  // its shadow is black, and alpha says how dark
  const Image with_shadow = picture_of(ball, look, camera, {"ball", {0.8, 0.3, 0.2}});
  const Vec3 foot =
      pixel_from_world(camera, -0.5 / look.toward_key.z() * look.toward_key + Vec3(0, 0, 0.5), 320, 240);
  const Eigen::Vector4d shadow = rgba(with_shadow, int(foot.x()), int(foot.y()));
  EXPECT_EQ(shadow.head<3>(), Vec3::Zero());
  EXPECT_GT(shadow[3], 0.3);
}

TEST(Renderer, PassesTellDepthNormalObjectAndScalarOfASphere) {
  const Vec3 center(0.3, 1, 0.1);
  const double radius = 0.7;
  const SurfaceMesh behind = upright_quad(3, 2), ball = sphere_mesh(center, radius, 120);
  const Camera camera = camera_from({0, -4, 0.5});
  const Mat4 camera_from_world_m = camera_from_world(camera);
  for (const bool multisampling : {false, true}) {
    RenderSettings look = small_look();
    look.multisampling = multisampling;
    Renderer renderer(look);
    add(renderer, behind, {"behind"});
    const int mesh = renderer.add_mesh(ball.triangles, ball.positions, {"ball"});
    renderer.set_scalars(mesh, ball.positions.col(2));
    Passes passes;
    const Image image = renderer.draw(camera, &passes);
    EXPECT_EQ(image.rgba, renderer.draw(camera).rgba);
    int on_ball = 0, on_quad = 0, nowhere = 0;
    for (int y = 0; y < look.height; ++y)
      for (int x = 0; x < look.width; ++x) {
        const std::size_t i = std::size_t(y) * look.width + x;
        if (passes.object[i] < 0) {
          ++nowhere;
          EXPECT_EQ(passes.depth_m[i], INFINITY);
          EXPECT_TRUE(std::isnan(passes.scalar[i]));
          EXPECT_EQ(alpha(image, x, y), 0);
          continue;
        }
        const Vec3 normal(passes.normal[3 * i], passes.normal[3 * i + 1], passes.normal[3 * i + 2]);
        if (passes.object[i] == 0) {
          ++on_quad;
          EXPECT_LT((normal - Vec3(0, -1, 0)).norm(), 1e-5);
          EXPECT_EQ(passes.scalar[i], 0);
          continue;
        }
        ++on_ball;
        if (normal.dot((camera.eye - center).normalized()) < 0.4)
          continue;  // the rim changes fast within a pixel
        const Vec3 p = center + radius * normal;
        // Samples that share one shading have depths of their own.
        const double facing = normal.dot((camera.eye - p).normalized());
        const double slack = multisampling ? 0.006 * std::sqrt(1 - facing * facing) / facing : 0;
        EXPECT_NEAR(passes.depth_m[i], -(camera_from_world_m * p.homogeneous()).z(), 2e-3 + slack);
        EXPECT_NEAR(passes.scalar[i], p.z(), 2e-3);
        const Vec3 pixel = pixel_from_world(camera, p, look.width, look.height);
        EXPECT_LT(std::max(std::abs(pixel.x() - x - 0.5), std::abs(pixel.y() - y - 0.5)), 0.55);
      }
    EXPECT_GT(on_ball, 3000);
    EXPECT_GT(on_quad, 10000);
    EXPECT_GT(nowhere, 1000);
  }
}

TEST(Renderer, MultisamplingDrawsNearlyTheSamePicture) {
  const SurfaceMesh ball = sphere_mesh({0, 0, 0.5}, 0.5, 60);
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -4, 2}, {0, 0, 0.5});
  const Image slow = picture_of(ball, look, camera);
  look.multisampling = true;
  const Image fast = picture_of(ball, look, camera);
  EXPECT_NEAR(covered_pixels(fast) / covered_pixels(slow), 1, 0.002);
  EXPECT_LT(difference(slow, fast).mean, 0.1);
}

TEST(Renderer, TheGroundHidesWhatIsBelowItFromAboveOnly) {
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0}, 0.5, 40);
  const double above = covered_pixels(picture_of(sphere, look, camera_from({0, -4, 0.3})));
  const double below = covered_pixels(picture_of(sphere, look, camera_from({0, -4, -0.3})));
  EXPECT_LT(above, 0.65 * below);
}

TEST(Renderer, SeveralThreadsDrawTheSameBytes) {
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0.5}, 0.5, 30);
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -4, 2}, {0, 0, 0.5});
  const Image expected = picture_of(sphere, look, camera);
  std::vector<Image> images(4);
  std::vector<std::thread> threads;
  for (Image& image : images) threads.emplace_back([&] { image = picture_of(sphere, look, camera); });
  for (std::thread& t : threads) t.join();
  for (const Image& image : images) EXPECT_TRUE(image.rgba == expected.rgba);
}

// Of something solid, something with colours, and transparent surfaces.
std::string picture_hash() {
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0.5}, 0.5, 60),
                    small = sphere_mesh({0.5, -0.3, 0.2}, 0.2, 30);
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  Renderer renderer(look);
  const int mesh = renderer.add_mesh(sphere.triangles, sphere.positions, {"solid"});
  renderer.set_colors(mesh, (sphere.positions.array() + 0.5).cwiseMin(1).cwiseMax(0).matrix());
  add(renderer, small, {"veil", {0.2, 0.3, 0.8}, 0.5, 0, 0.4});
  add(renderer, sphere_mesh({0, 0, 0.5}, 0.6, 30), {"veil", {0.8, 0.3, 0.2}, 0.5, 0, 0.3});
  const Image image = renderer.draw(camera_from({1, -4, 2}, {0, 0, 0.5}));
  return hex(Hasher().values(std::span<const float>(image.rgba)).digest());
}

// Not a test by itself: what the next one runs in other processes, for llvmpipe reads its settings once a
// process.
TEST(RendererChild, DISABLED_PrintsItsPicturesHash) { std::cerr << "hash " << picture_hash() << "\n"; }

TEST(Renderer, NeitherLlvmpipesThreadsNorItsVectorWidthNorADisplayMatter) {
  const std::string program = fs::read_symlink("/proc/self/exe").string();
  for (const char* setting : {"LP_NUM_THREADS=0", "LP_NUM_THREADS=1", "LP_NUM_THREADS=4",
                              "LP_NATIVE_VECTOR_WIDTH=512", "DISPLAY=:99"}) {
    detail::Process child({"env", "-u", "DISPLAY", "-u", "LP_NUM_THREADS", setting, program,
                           "--gtest_also_run_disabled_tests", "--gtest_filter=RendererChild.*"});
    EXPECT_EQ(child.finish(), 0) << setting;
    EXPECT_NE(child.said().find("hash " + picture_hash()), std::string::npos)
        << setting << ": " << child.said();
  }
}

TEST(Renderer, BadLooksAreRefused) {
  const auto refused = [](auto change) {
    RenderSettings look = small_look();
    change(look);
    EXPECT_THROW(Renderer{look}, InputError);
  };
  refused([](RenderSettings& l) { l.width = 0; });
  refused([](RenderSettings& l) { l.height = 9000; });
  refused([](RenderSettings& l) { l.supersampling = 5; });
  refused([](RenderSettings& l) { l.width = 8192, l.supersampling = 3; });
  refused([](RenderSettings& l) { l.toward_key = {1, 0, -1}; });
  refused([](RenderSettings& l) { l.up = {0, 0, 0}; });
  refused([](RenderSettings& l) { l.ground_height_m = NAN; });
  Renderer renderer(small_look());
  SurfaceMesh box = box_mesh({0, 0, 0}, {1, 1, 1});
  EXPECT_THROW(renderer.add_mesh(box.triangles, box.positions, {"box", {2, 0, 0}}), InputError);
  EXPECT_THROW(renderer.add_mesh(box.triangles, box.positions, {"box", {1, 0, 0}, 0.0}), InputError);
  box.triangles(3, 1) = 8;
  EXPECT_THROW(renderer.add_mesh(box.triangles, box.positions, {"box"}), InputError);
}

// Through a transparent surface its underside is seen: whole, not in flecks, where that dips in and out of
// the ground.
TEST(Renderer, ATransparentSurfacesUndersideStaysWholeWhereItSinksIntoTheGround) {
  RenderSettings look = small_look();
  look.ground_height_m = 0;
  look.stage = Box{Vec3(-2, -2, 0), Vec3(2, 2, 2)};
  const auto middle = [&](std::optional<double> height) {
    Renderer renderer(look);
    if (height) {
      const double z = *height;
      const SurfaceMesh sheet = quad_mesh({-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z});
      renderer.add_mesh(sheet.triangles, sheet.positions, {.opacity = 0.45, .casts_shadow = false});
    }
    return color(renderer.draw_shown(camera_from({0, -5, 4})), 160, 120);
  };
  EXPECT_GT((middle(0.01) - middle({})).norm(), 10);
  EXPECT_LT((middle(-0.01) - middle(0.01)).norm(), 2);
}

TEST(Renderer, AnEmptyStageIsBackground) {
  const Image image = Renderer(small_look()).draw(camera_from({0, -5, 2}));
  EXPECT_EQ(covered_pixels(image), 0);
}

}  // namespace
}  // namespace limber::render
