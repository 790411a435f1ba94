// A surface that shows an image looks, place by place, as one of the color that the image has there.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "render/renderer.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

using Images = std::vector<std::shared_ptr<const Image8>>;

// Squares of one pixel, the lower left one first, row by row upwards.
std::shared_ptr<const Image8> image_of(int width, const std::vector<Vec3>& colors) {
  const int height = int(colors.size()) / width;
  Image8 image{width, height, std::vector<std::uint8_t>(3 * colors.size())};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        image.rgb[std::size_t(3 * ((height - 1 - y) * width + x) + c)] =
            std::uint8_t(std::lround(255 * colors[std::size_t(y * width + x)][c]));
  return std::make_shared<const Image8>(std::move(image));
}

// Of quad_mesh: its corners at the corners of (0 0) … upper.
Appearance of_quad(const Eigen::Vector2d& upper, SurfaceMaterial material, int images) {
  Appearance a;
  a.uv.resize(6, 2);
  a.uv << 0, 0, upper.x(), 0, upper.x(), upper.y(), 0, 0, upper.x(), upper.y(), 0, upper.y();
  a.material_from_triangle = {0, 0};
  a.materials = {std::move(material)};
  a.images.resize(std::size_t(images));
  return a;
}

RenderSettings look_of_pictures() {
  RenderSettings look;
  look.width = 240, look.height = 240;
  look.tiles = false;  // as meshes with images are drawn
  return look;
}
const Camera camera{.eye = {0, -6, 0}, .target = {0, 0, 0}};
const SurfaceMesh quad = quad_mesh({-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1});

Image picture(const SurfaceMesh& mesh, const MeshLook& look, const Appearance& a = {},
              const Images& images = {}, const Points& normals = {}) {
  Renderer renderer(look_of_pictures());
  const int number = renderer.add_mesh(mesh.triangles, mesh.positions, look, a, images);
  if (normals.rows() > 0) renderer.set_positions(number, mesh.positions, normals);
  return renderer.draw(camera);
}
Vec3 light(const Image& image, int x, int y) {
  const float* p = &image.rgba[4 * (std::size_t(y) * std::size_t(image.width) + std::size_t(x))];
  return Vec3(double(p[0]), double(p[1]), double(p[2]));
}
// Of the place on the quad with these shares of its sides.
Vec3 light(const Image& image, const Eigen::Vector2d& uv) {
  const Vec3 pixel = pixel_from_world(camera, Vec3(2 * uv.x() - 1, 0, 2 * uv.y() - 1), 240, 240);
  return light(image, int(pixel.x()), int(pixel.y()));
}
Image plain(const Vec3& color) { return picture(quad, {.name = "", .color_srgb = color}); }

const std::vector<Vec3> four{Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0.6, 0.6, 0.2)};

TEST(Appearance, AnImageIsSeenWhereItsCoordinatesSay) {
  const Image shown = picture(quad, {}, of_quad({1, 1}, {.image = 0}, 1), {image_of(2, four)});
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 2; ++x) {
      const Eigen::Vector2d middle(0.25 + 0.5 * x, 0.25 + 0.5 * y);
      EXPECT_LT((light(shown, middle) - light(plain(four[std::size_t(2 * y + x)]), middle)).norm(), 0.01)
          << x << ' ' << y;
    }
  // Between two pixels half of both, in linear light.
  const Eigen::Vector2d between(0.5, 0.25);
  const Vec3 half = 0.5 * (light(plain(four[0]), between) + light(plain(four[1]), between));
  EXPECT_LT((light(shown, between) - half).norm(), 0.03);
  // Beyond (1 1) it is repeated.
  const Image twice = picture(quad, {}, of_quad({2, 1}, {.image = 0}, 1), {image_of(2, four)});
  for (const double u : {0.125, 0.625})
    EXPECT_LT((light(twice, {u, 0.25}) - light(plain(four[0]), {u, 0.25})).norm(), 0.01) << u;
}

TEST(Appearance, MaterialAndCornersMultiplyTheImage) {
  const Vec3 white(1, 1, 1);
  Appearance a = of_quad({1, 1}, {.color = Vec3(0.5, 1, 0.25), .image = 0}, 1);
  a.colors.resize(6, 3);
  a.colors.rowwise() = Eigen::RowVector3d(1, 0.5, 0.5);
  const Image shown = picture(quad, {}, a, {image_of(1, {Vec3(1, 1, 1)})});
  const auto srgb = [](double x) { return srgb_from_linear(x); };
  const Image wanted = plain(Vec3(srgb(0.5), srgb(0.5), srgb(0.125)));
  EXPECT_LT((light(shown, 120, 120) - light(wanted, 120, 120)).norm(), 2e-3);
  // Of triangles without a material the look's color is shown.
  a.material_from_triangle = {0, -1};
  const Image half = picture(quad, {.name = "", .color_srgb = {0.2, 0.4, 0.9}}, a, {image_of(1, {white})});
  EXPECT_LT((light(half, {0.25, 0.75}) - light(plain({0.2, 0.4, 0.9}), {0.25, 0.75})).norm(), 1e-3);
  EXPECT_LT((light(half, {0.75, 0.25}) - light(wanted, {0.75, 0.25})).norm(), 2e-3);
}

// Far away, fine squares of black and white are a half of both: they neither flicker nor make waves.
TEST(Appearance, WhatIsFinerThanAPixelIsItsMean) {
  std::vector<Vec3> squares;
  for (int i = 0; i < 256 * 256; ++i) squares.push_back(Vec3::Constant((i + i / 256) % 2));
  const Image shown = picture(quad, {}, of_quad({3, 3}, {.image = 0}, 1), {image_of(256, squares)});
  const Vec3 wanted = 0.5 * (light(plain(Vec3::Ones()), 120, 120) + light(plain(Vec3::Zero()), 120, 120));
  for (int x = 80; x < 160; x += 7)
    for (int y = 80; y < 160; y += 7) EXPECT_LT((light(shown, x, y) - wanted).norm(), 0.02) << x << ' ' << y;
}

// Normals of an image: x along u, y along v, which are the quad's world x and z; it faces −y.
TEST(Appearance, NormalsOfAnImageBendTheSurface) {
  const SurfaceMaterial grey{.color = Vec3::Constant(linear_from_srgb(0.5)), .normal_image = 0};
  const Image smooth = plain({0.5, 0.5, 0.5});
  for (const auto& [x, y] : {std::pair(0.4, 0.), {-0.4, 0.}, {0., 0.4}, {0., -0.4}, {0.3, 0.3}}) {
    // As eight bits hold it.
    const Vec3 levels = (Vec3(x, y, std::sqrt(1 - x * x - y * y)) * 127.5 + Vec3::Constant(127.5))
                            .unaryExpr([](double number) { return std::round(number); }),
               n = (levels / 127.5 - Vec3::Ones()).normalized();
    Renderer renderer(look_of_pictures());
    renderer.add_mesh(quad.triangles, quad.positions, {.name = "quad"}, of_quad({1, 1}, grey, 1),
                      {image_of(1, {levels / 255})});
    Passes passes;
    const Image bent = renderer.draw(camera, &passes);
    for (const int at : {240 * 120 + 120, 240 * 90 + 100}) {
      const float* seen = &passes.normal[std::size_t(3 * at)];
      EXPECT_LT((Vec3(double(seen[0]), double(seen[1]), double(seen[2])) - Vec3(n.x(), -n.z(), n.y())).norm(),
                2e-3)
          << x << ' ' << y;
    }
    EXPECT_GT((light(bent, 120, 120) - light(smooth, 120, 120)).norm(), 0.02) << x << ' ' << y;
  }
}

// A surface whose seams show nothing is the picture of one without, to the bit: vertices that a seam parts
// keep their normal, smooth or at a crease.
TEST(Appearance, SeamsAreNotSeen) {
  const Vec3 color(0.3, 0.5, 0.7);
  for (const SurfaceMesh& mesh :
       {sphere_mesh(Vec3::Zero(), 1, 12), box_mesh({-0.7, -0.8, -0.9}, {0.7, 0.8, 0.9})}) {
    Appearance a;
    const Eigen::Index triangles = mesh.triangles.rows();
    a.uv.resize(3 * triangles, 2);
    for (Eigen::Index i = 0; i < a.uv.rows(); ++i) a.uv.row(i) << double(i % 7) / 7, double(i % 5) / 5;
    a.material_from_triangle.assign(std::size_t(triangles), 0);
    a.materials = {{.color = linear_from_srgb(color), .image = 0}};
    a.images.resize(1);
    for (const bool given : {false, true}) {
      const Points normals = given ? vertex_normals(mesh.positions, mesh.triangles) : Points();
      const Image shown = picture(mesh, {.name = "", .color_srgb = color}, a, {image_of(1, {Vec3(1, 1, 1)})},
                                  normals),
                  wanted = picture(mesh, {.name = "", .color_srgb = color}, {}, {}, normals);
      EXPECT_EQ(tone_mapped(shown), tone_mapped(wanted)) << triangles << ' ' << given;
    }
  }
}

}  // namespace
}  // namespace limber::render
