// Where dark lines are drawn: on edges that are seen, and nowhere else.
#include "render/outline.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/render/shapes.h"

namespace limber::render {
namespace {

constexpr int width = 320, height = 240;

Camera camera_from(const Vec3& eye) {
  Camera camera;
  camera.eye = eye, camera.target = Vec3::Zero();
  return camera;
}

Passes passes_of(const std::vector<SurfaceMesh>& meshes, const Camera& camera, double crease_deg = 50) {
  RenderSettings look;
  look.width = width, look.height = height;
  Renderer renderer(look);
  for (const SurfaceMesh& mesh : meshes)
    renderer.add_mesh(mesh.triangles, mesh.positions, {.crease_angle_deg = crease_deg});
  Passes passes;
  renderer.draw_shown(camera, &passes);
  return passes;
}

// Pixels from the nearest of some lines (rows 2i to 2i + 1), of a place of the picture.
double distance_to(const Points& ends, const Camera& camera, const Eigen::Vector2d& place) {
  double least = 1e9;
  for (Eigen::Index row = 0; row < ends.rows(); row += 2) {
    const Eigen::Vector2d a = pixel_from_world(camera, ends.row(row), width, height).head<2>(),
                          b = pixel_from_world(camera, ends.row(row + 1), width, height).head<2>();
    const double along = std::clamp((place - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    least = std::min(least, (place - a - along * (b - a)).norm());
  }
  return least;
}

// The silhouette of a sphere of radius r at distance d: a circle of f r / √(d² − r²) pixels.
TEST(Outlines, OfASphereAreItsSilhouette) {
  const Camera camera = camera_from({0, -5, 0});
  const Passes passes = passes_of({sphere_mesh(Vec3::Zero(), 1, 60)}, camera, 180);
  const std::vector<float> lines = outlines_of(passes, 0.02);
  const double focal = 0.5 * height / std::tan(0.5 * camera.fov_deg * EIGEN_PI / 180),
               radius = focal / std::sqrt(24.0);
  double total = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float line = lines[std::size_t(y) * width + std::size_t(x)];
      total += double(line);
      if (line > 0) {
        EXPECT_NEAR(std::hypot(x + 0.5 - width / 2, y + 0.5 - height / 2), radius, 4);
      }
    }
  // A pixel wide at least, as wide as the depth jumps at most.
  EXPECT_GT(total, 2 * EIGEN_PI * radius);
  EXPECT_LT(total, 4 * 2 * EIGEN_PI * radius);
}

TEST(Outlines, OfABoxAreItsEdges) {
  const Camera camera = camera_from({3, -5, 2});
  const Box box{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  const std::vector<float> lines = outlines_of(passes_of({box_mesh(box.lower, box.upper)}, camera), 0.02);
  const Points edges = edges_of(box);
  double total = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float line = lines[std::size_t(y) * width + std::size_t(x)];
      total += double(line);
      if (line > 0) {
        EXPECT_LT(distance_to(edges, camera, {x + 0.5, y + 0.5}), 3) << x << " " << y;
      }
    }
  // Along each edge that is seen; that from the far lower corner and two more are not.
  const Vec3 near_corner = pixel_from_world(camera, {1, -1, 1}, width, height);
  EXPECT_GT(lines[std::size_t(near_corner.y() + 6) * width + std::size_t(near_corner.x())], 0.5);
  double seen = 0;
  for (Eigen::Index row = 0; row < edges.rows(); row += 2) {
    const Vec3 a = edges.row(row), b = edges.row(row + 1);
    const auto hidden = [](const Vec3& p) { return p.x() == -1 && p.y() == 1 && p.z() == -1; };
    if (!hidden(a) && !hidden(b))
      seen += (pixel_from_world(camera, a, width, height) - pixel_from_world(camera, b, width, height))
                  .head<2>()
                  .norm();
  }
  EXPECT_GT(total, 0.9 * seen);
}

// However it slants, and where one lies before another of the same slant by less than the step.
TEST(Outlines, APlaneHasNoneWithinIt) {
  for (const double slant : {0.0, 2.0, 8.0}) {
    const Camera camera = camera_from({0, -5, 0});
    const Vec3 up(0, slant, 1), right(1, 0, 0);
    const SurfaceMesh plane = quad_mesh(-0.4 * right - 0.4 * up, 0.4 * right - 0.4 * up,
                                        0.4 * right + 0.4 * up, -0.4 * right + 0.4 * up);
    const Passes passes = passes_of({plane}, camera);
    const std::vector<float> lines = outlines_of(passes, 0.02);
    int inside = 0;
    for (int y = 2; y < height - 2; ++y)
      for (int x = 2; x < width - 2; ++x) {
        bool within = true;
        for (int v = -2; v <= 2; ++v)
          for (int u = -2; u <= 2; ++u)
            within = within && passes.object[std::size_t(y + v) * width + std::size_t(x + u)] == 0;
        if (!within) continue;
        ++inside;
        ASSERT_EQ(lines[std::size_t(y) * width + std::size_t(x)], 0) << slant << ": " << x << " " << y;
      }
    EXPECT_GT(inside, 100);
  }
}

// The line is the nearer one's: the farther keeps its pixels.
TEST(Outlines, WhereOneHidesTheOtherTheNearerHasTheLine) {
  const Camera camera = camera_from({0, -5, 0});
  const auto square = [](double y, double half) {
    return quad_mesh({-half, y, -half}, {half, y, -half}, {half, y, half}, {-half, y, half});
  };
  const Passes passes = passes_of({square(-1, 0.4), square(1, 1.2)}, camera);
  const std::vector<float> lines = outlines_of(passes, 0.02);
  int on_far = 0, on_near = 0;
  for (int y = 80; y < 160; ++y)
    for (int x = 100; x < 220; ++x) {
      const std::size_t i = std::size_t(y) * width + std::size_t(x);
      if (lines[i] > 0) ++(passes.object[i] == 0 ? on_near : on_far);
    }
  EXPECT_GT(on_near, 100);
  EXPECT_EQ(on_far, 0);
}

// Pixels of other normals on a plane, as a crease finer than the pixels has them: single ones and short rows
// are none, a row that is long enough is one.
TEST(Outlines, SpecksAreNone) {
  const Camera camera = camera_from({0, -5, 0});
  const SurfaceMesh plane = quad_mesh({-9, 0, -9}, {9, 0, -9}, {9, 0, 9}, {-9, 0, 9});
  const Passes plain = passes_of({plane}, camera);
  const auto inked = [&](int length) {
    Passes passes = plain;
    for (int x = 0; x < length; ++x) {
      const std::size_t at = 3 * (120 * std::size_t(width) + 100 + std::size_t(x));
      passes.normal[at] = 1, passes.normal[at + 1] = passes.normal[at + 2] = 0;
    }
    double total = 0;
    for (const float line : outlines_of(passes, 0.02)) total += double(line);
    return total;
  };
  for (const int length : {0, 1, 2, 3}) EXPECT_EQ(inked(length), 0) << length;
  EXPECT_GT(inked(12), 12);
}

TEST(Outlines, AreInkOnWhatWasThere) {
  const Camera camera = camera_from({0, -5, 0});
  const Passes passes = passes_of({sphere_mesh(Vec3::Zero(), 1, 40)}, camera);
  const Image8 white = filled(width, height, Vec3(1, 1, 1));
  double ink = 0;
  for (const double line_width : {2.0, 3.0, 5.0}) {
    Image8 image = white;
    draw_outlines(image, passes, 0.02, line_width, Vec3::Zero());
    double sum = 0;
    for (const std::uint8_t level : image.rgb) sum += 255 - level;
    EXPECT_GT(sum, ink);  // wider, more
    ink = sum;
    EXPECT_EQ(image.rgb[0], 255);
    EXPECT_EQ(image.rgb[3 * (120 * width + 160)], 255);  // the middle of the sphere
  }
  // Thinner than a pixel they are paler: at a quarter half as dark.
  const auto darkest = [&](double line_width) {
    Image8 image = white;
    draw_outlines(image, passes, 0.02, line_width, Vec3::Zero());
    return 255 - *std::min_element(image.rgb.begin(), image.rgb.end());
  };
  EXPECT_NEAR(darkest(0.25), 0.5 * darkest(1), 1);
}

}  // namespace
}  // namespace limber::render
