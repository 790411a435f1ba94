#include "render/detail/grain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/types.h"

namespace limber::render::detail {

namespace {

// Towards the middles of a cube's edges, chosen by where the lattice point is (a multiplicative hash).
Vec3 lattice_gradient(int x, int y, int z, int period) {
  const auto wrapped = [&](int i) { return std::uint32_t((i % period + period) % period); };
  std::uint32_t hash = wrapped(x) * 0x8da6b343u ^ wrapped(y) * 0xd8163841u ^ wrapped(z) * 0xcb1ab31fu;
  hash = (hash ^ hash >> 15) * 0x2c1b3c6du;
  hash = (hash ^ hash >> 12) * 0x297a2d39u;
  const unsigned edge = (hash >> 16) % 12;
  Vec3 gradient = Vec3::Zero();
  gradient[int(edge / 4 + 1) % 3] = edge & 1 ? 1 : -1;
  gradient[int(edge / 4 + 2) % 3] = edge & 2 ? 1 : -1;
  return gradient;
}

double gradient_noise(const Vec3& p, int period) {
  const Eigen::Vector3i cell = p.array().floor().cast<int>();
  const Vec3 at = p - cell.cast<double>();
  const Vec3 fade = at.unaryExpr([](double t) { return t * t * t * (t * (6 * t - 15) + 10); });
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i step(corner & 1, corner >> 1 & 1, corner >> 2);
    double weight = 1;
    for (int i = 0; i < 3; ++i) weight *= step[i] ? fade[i] : 1 - fade[i];
    const Eigen::Vector3i point = cell + step;
    sum += weight * lattice_gradient(point.x(), point.y(), point.z(), period).dot(at - step.cast<double>());
  }
  return sum;
}

double height(const Vec3& waves, bool woven) {
  if (!woven) return gradient_noise(waves, grain_waves) + 0.4 * gradient_noise(2 * waves, 2 * grain_waves);
  const Vec3 a = 2 * std::numbers::pi * waves;
  return std::sin(a.x()) * std::cos(a.y()) + std::sin(a.y()) * std::cos(a.z()) +
         std::sin(a.z()) * std::cos(a.x());
}

}  // namespace

std::vector<std::uint8_t> grain_slopes(bool woven) {
  constexpr int n = grain_cells;
  const auto index = [](int x, int y, int z) {
    return std::size_t(((z + n) % n * n + (y + n) % n) * n + (x + n) % n);
  };
  std::vector<double> heights(std::size_t(n) * n * n);
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) heights[index(x, y, z)] = height(Vec3(x, y, z) * grain_waves / n, woven);
  std::vector<Vec3> slopes;
  slopes.reserve(heights.size());
  double steepest = 0;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        slopes.emplace_back(heights[index(x + 1, y, z)] - heights[index(x - 1, y, z)],
                            heights[index(x, y + 1, z)] - heights[index(x, y - 1, z)],
                            heights[index(x, y, z + 1)] - heights[index(x, y, z - 1)]);
        steepest = std::max(steepest, slopes.back().cwiseAbs().maxCoeff());
      }
  std::vector<std::uint8_t> levels;
  levels.reserve(4 * slopes.size());
  for (const Vec3& slope : slopes) {
    for (int i = 0; i < 3; ++i) levels.push_back(std::uint8_t(std::lround(128 + 127 * slope[i] / steepest)));
    levels.push_back(255);
  }
  return levels;
}

}  // namespace limber::render::detail
