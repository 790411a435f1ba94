#include "render/renderer.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <numeric>
#include <thread>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "render/detail/process.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

Look small_look() {
  Look look;
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

Image picture_of(const SurfaceMesh& mesh, const Look& look, const Camera& camera,
                 const MeshLook& mesh_look = {}) {
  Renderer renderer(look);
  renderer.add_mesh(mesh.triangles, mesh.positions, mesh_look);
  return renderer.draw(camera);
}

// A sphere projects to an ellipse of area π f² r² √(l²−r²) / (z²−r²)^1.5: f the focal length, l the distance
// to the middle, z the distance along the view (Quílez, "Sphere - projection").
TEST(Renderer, ASpheresSilhouetteHasTheAreaOfPerspective) {
  Look look = small_look();
  for (const Vec3& center : {Vec3(0, 0, 0), Vec3(0.6, 0, 0.4), Vec3(-0.7, 1, -0.3)})
    for (const double radius : {0.25, 0.6}) {
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
  Look look = small_look();
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
  look.ground_height_m = -0.1;  // the ground fades out: far away is background
  const Image8 with_ground =
      tone_mapped(picture_of(box_mesh({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}), look, camera_from({0, -5, 1})));
  EXPECT_LE((color(with_ground, 3, 0) - color(shown, 3, 0)).cwiseAbs().maxCoeff(), 1);
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
      Look look = small_look();
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
  Look look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -3, 1.5}, {0, 0, 0.5});
  EXPECT_LE(difference(picture_of(sphere, look, camera), picture_of(shuffled, look, camera)).largest, 1);
}

TEST(Renderer, AMeshTurnedInsideOutLooksTheSame) {
  SurfaceMesh sphere = sphere_mesh({0, 0, 0.5}, 0.5, 40), inside_out = sphere;
  inside_out.triangles.col(1).swap(inside_out.triangles.col(2));
  Look look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -3, 1.5}, {0, 0, 0.5});
  EXPECT_LT(difference(picture_of(sphere, look, camera), picture_of(inside_out, look, camera)).mean, 0.02);
}

TEST(Renderer, MovingAMeshIsTheSameAsMakingItThere) {
  const SurfaceMesh rest = box_mesh({-0.5, -0.5, 0}, {0.5, 0.5, 1});
  SurfaceMesh moved = rest;
  for (int v = 0; v < 8; ++v)
    moved.positions(v, 0) += 0.4 * moved.positions(v, 2), moved.positions(v, 1) *= 1.3;
  Look look = small_look();
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
TEST(Renderer, ThePictureDoesNotDependOnTheAxes) {
  Eigen::Matrix3d turn;
  turn << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  Look look = small_look();
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
  Look look = small_look();
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

TEST(Renderer, AVeilShowsItsNearestLayerOnly) {
  const Image image = picture_of(sphere_mesh({0, 0, 0}, 0.5, 30), small_look(), camera_from({0, -4, 0}),
                                 {"veil", {1, 1, 1}, 0.5, 0, 0.25});
  EXPECT_NEAR(alpha(image, 160, 120), 0.25, 1e-3);
}

TEST(Renderer, TheGroundHidesWhatIsBelowItFromAboveOnly) {
  Look look = small_look();
  look.ground_height_m = 0;
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0}, 0.5, 40);
  const double above = covered_pixels(picture_of(sphere, look, camera_from({0, -4, 0.3})));
  const double below = covered_pixels(picture_of(sphere, look, camera_from({0, -4, -0.3})));
  EXPECT_LT(above, 0.65 * below);
}

TEST(Renderer, SeveralThreadsDrawTheSameBytes) {
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0.5}, 0.5, 30);
  Look look = small_look();
  look.ground_height_m = 0;
  const Camera camera = camera_from({1, -4, 2}, {0, 0, 0.5});
  const Image expected = picture_of(sphere, look, camera);
  std::vector<Image> images(4);
  std::vector<std::thread> threads;
  for (Image& image : images) threads.emplace_back([&] { image = picture_of(sphere, look, camera); });
  for (std::thread& t : threads) t.join();
  for (const Image& image : images) EXPECT_TRUE(image.rgba == expected.rgba);
}

std::string picture_hash() {
  const SurfaceMesh sphere = sphere_mesh({0, 0, 0.5}, 0.5, 60);
  Look look = small_look();
  look.ground_height_m = 0;
  const Image image = picture_of(sphere, look, camera_from({1, -4, 2}, {0, 0, 0.5}));
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
    Look look = small_look();
    change(look);
    EXPECT_THROW(Renderer{look}, InputError);
  };
  refused([](Look& l) { l.width = 0; });
  refused([](Look& l) { l.height = 9000; });
  refused([](Look& l) { l.supersampling = 5; });
  refused([](Look& l) { l.width = 8192, l.supersampling = 3; });
  refused([](Look& l) { l.toward_key = {1, 0, -1}; });
  refused([](Look& l) { l.up = {0, 0, 0}; });
  refused([](Look& l) { l.ground_height_m = NAN; });
  Renderer renderer(small_look());
  SurfaceMesh box = box_mesh({0, 0, 0}, {1, 1, 1});
  EXPECT_THROW(renderer.add_mesh(box.triangles, box.positions, {"box", {2, 0, 0}}), InputError);
  EXPECT_THROW(renderer.add_mesh(box.triangles, box.positions, {"box", {1, 0, 0}, 0.0}), InputError);
  box.triangles(3, 1) = 8;
  EXPECT_THROW(renderer.add_mesh(box.triangles, box.positions, {"box"}), InputError);
}

TEST(Renderer, AnEmptyStageIsBackground) {
  const Image image = Renderer(small_look()).draw(camera_from({0, -5, 2}));
  EXPECT_EQ(covered_pixels(image), 0);
}

}  // namespace
}  // namespace limber::render
