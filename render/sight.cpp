#include "render/sight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace limber::render {

Sight::Sight(int width_px, int height_px)
    : width(width_px),
      height(height_px),
      object(std::size_t(width_px) * std::size_t(height_px), -1),
      depth_m(object.size(), std::numeric_limits<float>::infinity()) {}

// One over the depth, and a plane's height over the depth, are linear on the picture.
void lay_over(Sight& sight, const Camera& camera, const Points& positions, const Triangles& triangles,
              int number, std::span<const Eigen::Vector4d> planes) {
  const Mat4 camera_from = camera_from_world(camera);
  const double pixels = 0.5 * sight.height / std::tan(0.5 * camera.fov_deg * std::numbers::pi / 180);
  Points seen(positions.rows(), 3);  // x, y in pixels, one over the depth; that is 0 behind the eye
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    const Vec3 p = (camera_from * Vec3(positions.row(v)).homogeneous()).head<3>();
    const double inverse = p.z() < 0 ? -1 / p.z() : 0;
    seen.row(v) << 0.5 * sight.width + pixels * p.x() * inverse,
        0.5 * sight.height - pixels * p.y() * inverse, inverse;
  }
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    std::array<Vec3, 3> c;
    for (int i = 0; i < 3; ++i) c[std::size_t(i)] = seen.row(triangles(t, i));
    if (std::min({c[0].z(), c[1].z(), c[2].z()}) <= 0) continue;
    const auto [left, right] = std::minmax({c[0].x(), c[1].x(), c[2].x()});
    const auto [top, bottom] = std::minmax({c[0].y(), c[1].y(), c[2].y()});
    const int x_0 = int(std::ceil(std::max(left, 0.0) - 0.5)),
              x_1 = int(std::floor(std::min(right, double(sight.width)) - 0.5)),
              y_0 = int(std::ceil(std::max(top, 0.0) - 0.5)),
              y_1 = int(std::floor(std::min(bottom, double(sight.height)) - 0.5));
    if (x_0 > x_1 || y_0 > y_1) continue;
    const Eigen::Vector2d a = (c[1] - c[0]).head<2>(), b = (c[2] - c[0]).head<2>();
    const double twice = a.x() * b.y() - a.y() * b.x();
    if (twice == 0) continue;
    for (int y = y_0; y <= y_1; ++y)
      for (int x = x_0; x <= x_1; ++x) {
        const Eigen::Vector2d p = Eigen::Vector2d(x + 0.5, y + 0.5) - c[0].head<2>();
        const double second = (p.x() * b.y() - p.y() * b.x()) / twice,
                     third = (a.x() * p.y() - a.y() * p.x()) / twice, first = 1 - second - third;
        if (first < 0 || second < 0 || third < 0) continue;
        const Vec3 shares(first * c[0].z(), second * c[1].z(), third * c[2].z());
        const auto depth = float(1 / shares.sum());
        const std::size_t at = sight.at(x, y);
        if (!(depth < sight.depth_m[at])) continue;
        const bool cut = std::any_of(planes.begin(), planes.end(), [&](const Eigen::Vector4d& plane) {
          double height = 0;
          for (int i = 0; i < 3; ++i)
            height += shares[i] * plane.dot(Vec3(positions.row(triangles(t, i))).homogeneous());
          return height < 0;
        });
        if (cut) continue;
        sight.object[at] = number, sight.depth_m[at] = depth;
      }
  }
}

// The distance transform of Rosenfeld and Pfaltz (1966): once down, once up.
std::vector<int> clearances(const Sight& sight) {
  const int far = sight.width + sight.height;
  std::vector<int> distance(sight.object.size(), far);
  const auto pull = [&](int x, int y, int dx, int dy) {
    const std::size_t here = sight.at(x, y);
    if (x + dx < 0 || x + dx >= sight.width || y + dy < 0 || y + dy >= sight.height) {
      distance[here] = 1;
      return;
    }
    const std::size_t there = sight.at(x + dx, y + dy);
    distance[here] =
        std::min(distance[here], sight.object[here] != sight.object[there] ? 1 : distance[there] + 1);
  };
  for (int y = 0; y < sight.height; ++y)
    for (int x = 0; x < sight.width; ++x)
      for (const auto& [dx, dy] : {std::pair(-1, 0), {0, -1}, {1, 0}, {0, 1}}) pull(x, y, dx, dy);
  for (int y = sight.height - 1; y >= 0; --y)
    for (int x = sight.width - 1; x >= 0; --x)
      for (const auto& [dx, dy] : {std::pair(-1, 0), {0, -1}, {1, 0}, {0, 1}}) pull(x, y, dx, dy);
  return distance;
}

}  // namespace limber::render
