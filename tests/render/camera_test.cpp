#include "render/camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/random.h"

namespace limber::render {
namespace {

Box some_box(Rng& rng) {
  Box box;
  for (int i = 0; i < 2; ++i) box.include(Vec3(rng.uniform(-5, 5), rng.uniform(-5, 5), rng.uniform(-5, 5)));
  return box;
}

TEST(Camera, FramingHoldsEveryCornerAndTouchesTwoOppositeEdges) {
  Rng rng(11, 0);
  const int width = 1600, height = 900;
  const double fill = 0.88;
  for (int trial = 0; trial < 200; ++trial) {
    const Box box = some_box(rng);
    const Camera camera =
        frame_automatically(box, rng.direction(), double(width) / height, rng.uniform(10, 90), fill);
    Vec3 low(1e9, 1e9, 1e9), high(-1e9, -1e9, -1e9);
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner = box.lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(box.size());
      const Vec3 p = pixel_from_world(camera, corner, width, height);
      low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
    EXPECT_GT(low.z(), 0);  // in front of the eye
    const double margin_x = 0.5 * (1 - fill) * width, margin_y = 0.5 * (1 - fill) * height;
    EXPECT_GE(low.x(), margin_x - 1e-6);
    EXPECT_LE(high.x(), width - margin_x + 1e-6);
    EXPECT_GE(low.y(), margin_y - 1e-6);
    EXPECT_LE(high.y(), height - margin_y + 1e-6);
    const double slack_x = high.x() - low.x() - fill * width, slack_y = high.y() - low.y() - fill * height;
    EXPECT_NEAR(std::max(slack_x, slack_y), 0, 1e-6) << "trial " << trial;
  }
}

TEST(Camera, FramingPointsIsTighterThanFramingTheirBox) {
  Rng rng(14, 0);
  const int width = 900, height = 1600;
  for (int trial = 0; trial < 100; ++trial) {
    Points points(40, 3);
    for (int i = 0; i < 40; ++i) points.row(i) = 2 * rng.direction();
    const Vec3 toward_eye = rng.direction();
    const Camera camera = frame_automatically(points, toward_eye, double(width) / height, 40, 0.7);
    Vec3 low(1e9, 1e9, 1e9), high(-1e9, -1e9, -1e9);
    for (int i = 0; i < 40; ++i) {
      const Vec3 p = pixel_from_world(camera, points.row(i), width, height);
      low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
    EXPECT_GT(low.z(), 0);
    EXPECT_NEAR(std::max((high.x() - low.x()) / width, (high.y() - low.y()) / height), 0.7, 1e-9);
    EXPECT_LT(std::max(std::abs(low.x() + high.x() - width), std::abs(low.y() + high.y() - height)), width);
    const Camera of_box =
        frame_automatically(bounding_box(points), toward_eye, double(width) / height, 40, 0.7);
    EXPECT_LT((camera.eye - camera.target).norm(), (of_box.eye - of_box.target).norm());
  }
}

TEST(Camera, TheTwoWaysToProjectAgree) {
  Rng rng(12, 0);
  const int width = 640, height = 480;
  for (int trial = 0; trial < 100; ++trial) {
    Camera camera;
    camera.eye = 5 * rng.direction(), camera.target = rng.direction(), camera.fov_deg = rng.uniform(10, 100);
    const Vec3 point = camera.target + 0.3 * rng.direction();
    const Eigen::Vector4d clip = clip_from_camera(camera.fov_deg, double(width) / height, 0.1, 100) *
                                 (camera_from_world(camera) * point.homogeneous());
    const Vec3 pixel = pixel_from_world(camera, point, width, height);
    EXPECT_NEAR(pixel.x(), (0.5 + 0.5 * clip.x() / clip.w()) * width, 1e-9);
    EXPECT_NEAR(pixel.y(), (0.5 - 0.5 * clip.y() / clip.w()) * height, 1e-9);
    EXPECT_NEAR(pixel.z(), clip.w(), 1e-12);
  }
  const Mat4 m = clip_from_camera(40, 1.5, 0.5, 20);
  EXPECT_NEAR((m * Eigen::Vector4d(0, 0, -0.5, 1)).hnormalized().z(), -1, 1e-12);
  EXPECT_NEAR((m * Eigen::Vector4d(0, 0, -20, 1)).hnormalized().z(), 1, 1e-12);
}

TEST(Camera, ThePathGoesThroughItsKeysAndHasNoKink) {
  Rng rng(13, 0);
  std::vector<CameraKey> keys;
  for (double t : {0.0, 0.7, 2.0, 2.5}) {
    Camera camera;
    camera.eye = 6 * rng.direction(), camera.target = rng.direction(), camera.fov_deg = rng.uniform(20, 60);
    keys.push_back({t, camera});
  }
  for (const CameraKey& key : keys) {
    EXPECT_LT((camera_at(keys, key.time_s).eye - key.camera.eye).norm(), 1e-12);
    EXPECT_NEAR(camera_at(keys, key.time_s).fov_deg, key.camera.fov_deg, 1e-12);
    const double h = 1e-5;
    const Vec3 before = camera_at(keys, key.time_s).eye - camera_at(keys, key.time_s - h).eye;
    const Vec3 after = camera_at(keys, key.time_s + h).eye - camera_at(keys, key.time_s).eye;
    EXPECT_LT((after - before).norm() / h, 1e-2);
  }
  EXPECT_EQ(camera_at(keys, -1).eye, keys.front().camera.eye);
  EXPECT_EQ(camera_at(keys, 99).eye, keys.back().camera.eye);
  EXPECT_THROW(camera_at({}, 0), InputError);
  std::swap(keys[1], keys[2]);
  EXPECT_THROW(camera_at(keys, 0), InputError);
}

TEST(Camera, TurningKeepsDistanceAndHeight) {
  Camera camera;
  camera.target = {1, 2, 3};
  const Camera quarter = turned(camera, 90);
  EXPECT_NEAR((quarter.eye - quarter.target).norm(), (camera.eye - camera.target).norm(), 1e-12);
  EXPECT_NEAR(quarter.eye.z(), camera.eye.z(), 1e-12);
  // From (−1, −7) beside the target, a quarter counter-clockwise seen from above leads to (7, −1).
  EXPECT_LT((quarter.eye - camera.target - Vec3(7, -1, -1)).norm(), 1e-12);
  EXPECT_LT((turned(camera, 360).eye - camera.eye).norm(), 1e-12);
  // One that looks straight down stays where it is, and its picture turns.
  const Camera above{.eye = {0, 0, 5}, .target = {0, 0, 0}, .up = {0, 1, 0}};
  EXPECT_LT((turned(above, 90).eye - above.eye).norm(), 1e-12);
  EXPECT_LT((turned(above, 90).up - Vec3(-1, 0, 0)).norm(), 1e-12);
}

TEST(Camera, BadCamerasAreRefused) {
  Camera camera;
  camera.eye = camera.target;
  EXPECT_THROW(validate(camera), InputError);
  camera = {}, camera.up = camera.eye - camera.target;
  EXPECT_THROW(validate(camera), InputError);
  camera = {}, camera.fov_deg = 180;
  EXPECT_THROW(validate(camera), InputError);
  camera = {}, camera.eye.x() = NAN;
  EXPECT_THROW(validate(camera), InputError);
}

}  // namespace
}  // namespace limber::render
