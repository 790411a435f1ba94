// The beach ball's coordinates and images, which limber makes.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "render/image_file.h"
#include "scenes/detail/plain_png.h"
#include "scenes/models.h"
#include "scenes/shapes.h"

namespace limber::scenes {
namespace {

constexpr double half_turn = std::numbers::pi;

TEST(BeachBall, IsTheSphereAndHasLongitudeAndLatitudeForCoordinates) {
  const SurfaceMesh ball = make_beach_ball(), sphere = make_sphere({1, 0.05});
  EXPECT_EQ(ball.positions, sphere.positions);
  const Appearance a = beach_ball_appearance(ball);
  ASSERT_NO_THROW(validate(a, ball.triangles.rows(), "ball"));
  EXPECT_GE(a.uv.minCoeff(), 0);
  EXPECT_LE(a.uv.col(0).maxCoeff(), 1.25);
  EXPECT_LE(a.uv.col(1).maxCoeff(), 1);
  const Vec3 pole = Vec3(0, -1, std::numbers::phi).normalized(), east(1, 0, 0), north = pole.cross(east);
  double area = 0;
  for (Eigen::Index t = 0; t < ball.triangles.rows(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const Vec3 p = 2 * ball.positions.row(ball.triangles(t, c)).transpose();
      const double longitude = 2 * half_turn * a.uv(3 * t + c, 0),
                   latitude = half_turn * (a.uv(3 * t + c, 1) - 0.5);
      const Vec3 there = std::cos(latitude) * (std::cos(longitude) * east + std::sin(longitude) * north) +
                         std::sin(latitude) * pole;
      ASSERT_LT((p - there).norm(), 1e-7) << t << ' ' << c;  // the arc sine's, beside the poles
    }
    const Eigen::RowVector2d ab = a.uv.row(3 * t + 1) - a.uv.row(3 * t),
                             ac = a.uv.row(3 * t + 2) - a.uv.row(3 * t);
    const double twice = ab.x() * ac.y() - ab.y() * ac.x();
    EXPECT_GT(twice, 1e-6) << t << ": seen from outside the image is not mirrored";
    area += twice / 2;
  }
  // Once round, but for half of what lies beside the poles.
  EXPECT_NEAR(area, 1, 0.03);
}

TEST(BeachBall, IsAModelByNameWithItsLooksAndNoOtherHasThem) {
  BodySpec body;
  body.cage.tets = 100;
  body.model = MadeModel{"beach_ball", 0.7};
  const Appearance made = made_appearance(body, *made_surface(body));
  EXPECT_EQ(made.images.size(), 2u);
  EXPECT_NEAR(start_box(body)->size().x(), 0.7, 1e-12);
  FileModel file;
  file.file = "none.obj", file.made = "beach_ball";
  body.model = file;
  EXPECT_FALSE(made_appearance(body, *made_surface(body)).empty());
  body.model = SphereModel{1, 0.2};
  EXPECT_TRUE(made_appearance(body, *made_surface(body)).empty());
  body.model = MadeModel{"bunny", 1};
  EXPECT_TRUE(made_appearance(body, *made_surface(body)).empty());
}

struct Texels {
  render::Image8 image;
  std::array<int, 3> at(int x, int y) const {
    const auto first = 3 * (std::size_t(y) * std::size_t(image.width) + std::size_t(x));
    return {image.rgb[first], image.rgb[first + 1], image.rgb[first + 2]};
  }
};
Texels texels(const ImageFile& file) { return {render::decoded_image(file.bytes, file.name)}; }

TEST(BeachBall, ImagesAreSixPanelsAndTwoCapsThatGoOnAcrossTheSeam) {
  const Appearance a = beach_ball_appearance(make_beach_ball());
  const Texels colors = texels(a.images[0]), normals = texels(a.images[1]);
  const int width = colors.image.width, height = colors.image.height, panel = width / 6;
  ASSERT_EQ(normals.image.width, width);
  ASSERT_EQ(normals.image.height, height);
  const std::array<int, 3> flat = normals.at(panel / 2, height / 2);
  for (const int level : {flat[0], flat[1]}) EXPECT_EQ(level, 128);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      // Mirrored from north to south; grooves from east to west.
      ASSERT_EQ(colors.at(x, y), colors.at(x, height - 1 - y)) << x << ' ' << y;
      const std::array<int, 3> n = normals.at(x, y), west = normals.at(width - 1 - x, y),
                               south = normals.at(x, height - 1 - y);
      ASSERT_NEAR(n[0] - 127.5, 127.5 - west[0], 1.5) << x << ' ' << y;
      ASSERT_NEAR(n[1] - 127.5, 127.5 - south[1], 1.5) << x << ' ' << y;
      ASSERT_NEAR(Vec3(n[0] - 127.5, n[1] - 127.5, n[2] - 127.5).norm(), 127.5, 2) << x << ' ' << y;
      // Every panel has the same relief.
      ASSERT_EQ(n, normals.at((x + panel) % width, y)) << x << ' ' << y;
    }
  int other = 0;
  for (int p = 0; p < 6; ++p)
    other += colors.at(p * panel + panel / 2, height / 2) !=
             colors.at((p * panel + panel * 3 / 2) % width, height / 2);
  EXPECT_EQ(other, 6) << "neighbours have other colors";
  for (int x = 0; x < width; ++x) EXPECT_EQ(colors.at(x, 0), colors.at(0, 0)) << "a pole has one color";
  // East of a weld the surface falls towards it: to the west.
  EXPECT_LT(normals.at(panel + 4, height / 2)[0], 90);
  EXPECT_GT(normals.at(panel - 5, height / 2)[0], 165);
}

// Runs of all lengths, of bytes of both lengths of code, and noise.
TEST(PlainPng, IsReadAsWhatWasWritten) {
  Rng rng(17, 0);
  for (const int width : {1, 2, 3, 85, 86, 87, 400}) {
    Picture picture{width, 9, {}};
    for (int i = 0; i < 3 * width * picture.height; ++i)
      picture.rgb.push_back(i / 3 / width < 3 ? std::uint8_t(rng.below(256))
                                              : std::uint8_t(i / (1 + i / 300) * 77));
    const render::Image8 back = render::decoded_image(plain_png(picture), "made");
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.height, picture.height);
    EXPECT_EQ(back.rgb, picture.rgb) << width;
  }
}

}  // namespace
}  // namespace limber::scenes
