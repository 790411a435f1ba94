#include "render/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/mesh.h"

namespace limber::render {

namespace {

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

// Rows: right, up, back.
Eigen::Matrix3d axes(const Vec3& back, const Vec3& up) {
  Eigen::Matrix3d rows;
  const Vec3 z = back.normalized(), x = up.cross(z).normalized();
  rows << x.transpose(), z.cross(x).transpose(), z.transpose();
  return rows;
}

}  // namespace

void validate(const Camera& camera) {
  const Vec3 back = camera.eye - camera.target;
  if (!camera.eye.allFinite() || !camera.target.allFinite() || !camera.up.allFinite())
    throw InputError("camera: a coordinate of eye, target or up is not finite");
  if (!(back.norm() > 0)) throw InputError("camera: eye and target are the same point");
  if (!(back.cross(camera.up).norm() > 1e-9 * back.norm() * camera.up.norm()))
    throw InputError(
        "camera: it looks along its own up, or that is zero; move its eye or its target a little aside");
  if (!(camera.fov_deg > 0 && camera.fov_deg < 170))
    throw InputError(fmt::format("camera: fov_deg is {}, but must lie between 0 and 170", camera.fov_deg));
}

Mat4 camera_from_world(const Camera& camera) {
  validate(camera);
  Mat4 m = Mat4::Identity();
  const Eigen::Matrix3d r = axes(camera.eye - camera.target, camera.up);
  m.topLeftCorner<3, 3>() = r;
  m.topRightCorner<3, 1>() = -(r * camera.eye);
  return m;
}

Mat4 clip_from_camera(double fov_deg, double aspect, double near_m, double far_m) {
  const double t = std::tan(0.5 * radians(fov_deg));
  Mat4 m = Mat4::Zero();
  m(0, 0) = 1 / (t * aspect);
  m(1, 1) = 1 / t;
  m(2, 2) = (near_m + far_m) / (near_m - far_m);
  m(2, 3) = 2 * near_m * far_m / (near_m - far_m);
  m(3, 2) = -1;
  return m;
}

Vec3 pixel_from_world(const Camera& camera, const Vec3& point, int width, int height) {
  const Vec3 p = (camera_from_world(camera) * point.homogeneous()).head<3>();
  const double half = 0.5 * height / std::tan(0.5 * radians(camera.fov_deg));  // pixels at depth 1
  return {0.5 * width - half * p.x() / p.z(), 0.5 * height + half * p.y() / p.z(), -p.z()};
}

// In camera axes, a point p is within the slope t of an eye e when |p.x − e.x| ≤ t (e.z − p.z). Each side
// bounds e.x + t e.z or e.x − t e.z by the extreme of a linear function of the points; so the least e.z is
// known in closed form.
Camera frame_automatically(const Points& everything, const Vec3& toward_eye, double aspect, double fov_deg,
                           double fill) {
  LIMBER_CHECK(everything.rows() > 0 && fill > 0 && fill <= 1 && aspect > 0, fill, aspect);
  Camera camera;
  camera.fov_deg = fov_deg;
  if (std::abs(toward_eye.normalized().z()) > 0.999) camera.up = {0, 1, 0};
  const Eigen::Matrix3d r = axes(toward_eye, camera.up);
  const double slope_y = fill * std::tan(0.5 * radians(fov_deg)), slope_x = slope_y * aspect;

  struct Side {
    double low = 1e300, high = -1e300;
    void include(double farther, double nearer) {
      low = std::min(low, farther), high = std::max(high, nearer);
    }
    double middle() const { return 0.5 * (low + high); }
  } x, y, z;
  for (Eigen::Index row = 0; row < everything.rows(); ++row) {
    const Vec3 p = r * everything.row(row).transpose();
    x.include(p.x() - slope_x * p.z(), p.x() + slope_x * p.z());
    y.include(p.y() - slope_y * p.z(), p.y() + slope_y * p.z());
    z.include(p.z(), p.z());
  }
  // What has no size: stand off by a metre.
  const double size = bounding_box(everything).diagonal();
  const double least = z.high + (size > 0 ? 1e-3 * size : 1.0);
  const Vec3 eye(x.middle(), y.middle(),
                 std::max({(x.high - x.low) / (2 * slope_x), (y.high - y.low) / (2 * slope_y), least}));
  camera.eye = r.transpose() * eye;
  camera.target = r.transpose() * Vec3(eye.x(), eye.y(), std::min(z.middle(), eye.z() - 1e-3));
  return camera;
}

Camera frame_automatically(const Box& everything, const Vec3& toward_eye, double aspect, double fov_deg,
                           double fill) {
  Points corners(8, 3);
  for (int i = 0; i < 8; ++i)
    corners.row(i) = everything.lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(everything.size());
  return frame_automatically(corners, toward_eye, aspect, fov_deg, fill);
}

Camera camera_at(const std::vector<CameraKey>& keys, double time_s) {
  if (keys.empty()) throw InputError("camera path: there is no keyframe");
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (!(keys[i - 1].time_s < keys[i].time_s))
      throw InputError(
          fmt::format("camera path: keyframe {} is at {} s, keyframe {} at {} s; times must ascend", i - 1,
                      keys[i - 1].time_s, i, keys[i].time_s));
  for (const CameraKey& key : keys) validate(key.camera);
  if (time_s <= keys.front().time_s) return keys.front().camera;
  if (time_s >= keys.back().time_s) return keys.back().camera;

  const std::size_t b =
      std::size_t(std::upper_bound(keys.begin(), keys.end(), time_s,
                                   [](double t, const CameraKey& k) { return t < k.time_s; }) -
                  keys.begin());
  const std::size_t a = b - 1;
  const double span = keys[b].time_s - keys[a].time_s, s = (time_s - keys[a].time_s) / span;
  const auto between = [&](auto field) {
    const auto slope = [&](std::size_t k) -> Vec3 {  // zero at the ends: the camera starts and stops softly
      if (k == 0 || k + 1 == keys.size()) return Vec3::Zero();
      return (field(keys[k + 1]) - field(keys[k - 1])) / (keys[k + 1].time_s - keys[k - 1].time_s);
    };
    const double s2 = s * s, s3 = s2 * s;
    return Vec3((2 * s3 - 3 * s2 + 1) * field(keys[a]) + (s3 - 2 * s2 + s) * span * slope(a) +
                (3 * s2 - 2 * s3) * field(keys[b]) + (s3 - s2) * span * slope(b));
  };
  Camera camera;
  camera.eye = between([](const CameraKey& k) { return k.camera.eye; });
  camera.target = between([](const CameraKey& k) { return k.camera.target; });
  camera.up = between([](const CameraKey& k) { return Vec3(k.camera.up.normalized()); });
  camera.fov_deg = between([](const CameraKey& k) { return Vec3(k.camera.fov_deg, 0, 0); }).x();
  return camera;
}

Camera turned(const Camera& camera, double angle_deg) {
  Camera c = camera;
  const Eigen::AngleAxisd turn(radians(angle_deg), Vec3::UnitZ());
  c.eye = camera.target + turn * Vec3(camera.eye - camera.target);
  c.up = turn * camera.up;
  return c;
}

}  // namespace limber::render
