// Organs out of ellipsoids, with the proportions of BodyParts3D's (a heart of 104 × 111 × 101 mm, lungs of
// 183 × 115 × 230 and 181 × 132 × 228, a liver of 159 × 210 × 155, a spine of 124 × 118 × 699); x to the
// front, y to the body's left, 1 m high. Each made as high as its model and with its box's middle where the
// model has it, no two overlap, as in the body.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "scenes/detail/ellipsoids.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

// Adds a closed tube round these points, no two of which are the same; it never runs straight up.
void add_tube(const std::vector<Vec3>& middles, double radius, SurfaceMesh& mesh) {
  constexpr int sides = 10;
  const int rings = int(middles.size()), first = int(mesh.positions.rows());
  const int back = first + rings * sides, front = back + 1;
  mesh.positions.conservativeResize(front + 1, 3);
  mesh.positions.row(back) = middles.front(), mesh.positions.row(front) = middles.back();
  std::vector<Eigen::Vector3i> triangles;
  for (int r = 0; r < rings; ++r) {
    const Vec3 along =
        middles[std::size_t(std::min(r + 1, rings - 1))] - middles[std::size_t(std::max(r - 1, 0))];
    const Vec3 across = along.cross(Vec3::UnitZ()).normalized(), up = along.cross(across).normalized();
    const double thick = radius * (r == 0 || r == rings - 1 ? 0.6 : 1);
    for (int s = 0; s < sides; ++s) {
      const double turn = 2 * std::numbers::pi * s / sides;
      mesh.positions.row(first + r * sides + s) =
          middles[std::size_t(r)] + thick * (std::cos(turn) * across + std::sin(turn) * up);
      const int a = first + r * sides + s, b = first + r * sides + (s + 1) % sides;
      if (r == 0) triangles.emplace_back(back, b, a);
      if (r == rings - 1)
        triangles.emplace_back(front, a, b);
      else
        triangles.emplace_back(a, b, b + sides), triangles.emplace_back(a, b + sides, a + sides);
    }
  }
  const Eigen::Index before = mesh.triangles.rows();
  mesh.triangles.conservativeResize(before + Eigen::Index(triangles.size()), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    mesh.triangles.row(before + Eigen::Index(t)) = triangles[t];
}

}  // namespace

SurfaceMesh make_heart() {
  const std::array parts = {
      Ellipsoid{{0.02, 0.02, -0.05}, {0.40, 0.44, 0.42}, 0, 25, 0.1},    // ventricles, the tip to the left
      Ellipsoid{{0.12, 0.26, -0.22}, {0.26, 0.26, 0.22}, 0, 25, 0.12},   // the tip
      Ellipsoid{{-0.16, 0.14, 0.24}, {0.26, 0.28, 0.20}, 0, 0, 0.1},     // left atrium
      Ellipsoid{{-0.02, -0.26, 0.14}, {0.26, 0.24, 0.26}, 0, 0, 0.1},    // right atrium
      Ellipsoid{{0.04, -0.04, 0.42}, {0.13, 0.13, 0.16}, -10, 0, 0.08},  // aorta
      Ellipsoid{{-0.10, -0.28, 0.40}, {0.10, 0.10, 0.16}, 0, 0, 0.06},   // vena cava
  };
  return join(parts, Sides::one, {{-0.7, -0.75, -0.75}, {0.7, 0.75, 0.75}}, 0.03);
}

SurfaceMesh make_lung(double side) {  // 1: the left one
  // In metres, as they stand in the body: what is left of five ellipsoids where heart, liver and spine lie.
  const auto at = [&](double x, double y_left, double y_right, double z) {
    return Vec3(x, side > 0 ? y_left : y_right, z);
  };
  const double top = side > 0 ? 0.049 : 0.0595;  // the right one reaches over the middle
  const std::array parts = {
      Ellipsoid{at(0.095, 0.073, -0.074, 1.205), {0.083, 0.052, 0.084}, 0, 0, 0.01},
      Ellipsoid{at(0.090, 0.060, -0.0535, 1.285), {0.062, top, 0.0665}, 0, 0, 0.03},
      Ellipsoid{at(0.150, 0.062, -0.060, 1.212), {0.045, 0.042, 0.066}, 0, 0, 0.02},  // the front edge
      Ellipsoid{at(0.088, 0.080, -0.080, 1.175), {0.070, 0.042, 0.050}, 0, 0, 0.02},  // the base
      Ellipsoid{at(0.055, 0.085, -0.088, 1.160), {0.038, 0.033, 0.0385}, 0, 0, 0.02},
      Ellipsoid{{0.122, 0.0205, 1.230}, {0.061, 0.069, 0.066}, 0, 0, 0.008, true},  // the heart's place
      Ellipsoid{{0.185, 0.018, 1.225}, {0.045, 0.034, 0.060}, 0, 0, 0.010, true},   // before it
      Ellipsoid{{0.050, 0, 1.22}, {0.045, 0.042, 0.30}, 0, 0, 0.008, true},         // the spine's
      Ellipsoid{{0.119, -0.054, 1.103}, {0.082, 0.068, 0.084}, 0, 0, 0.008, true},  // the liver's
      Ellipsoid{{0.146, 0.009, 1.130}, {0.067, 0.068, 0.054}, 0, -15, 0.008, true},
      Ellipsoid{{0.158, 0.056, 1.139}, {0.052, 0.050, 0.038}, 0, -15, 0.008, true},
  };
  return join(parts, Sides::one, {{-0.02, -0.15, 1.09}, {0.22, 0.15, 1.38}}, 0.006);
}

SurfaceMesh make_liver() {
  const std::array parts = {
      Ellipsoid{{-0.06, -0.26, -0.02}, {0.45, 0.36, 0.46}, 0, 0, 0.1},        // right lobe
      Ellipsoid{{0.12, 0.12, 0.14}, {0.34, 0.32, 0.24}, 0, -15, 0.2},         // left lobe
      Ellipsoid{{0.18, 0.40, 0.20}, {0.24, 0.22, 0.15}, 0, -15, 0.15},        // and its end
      Ellipsoid{{-0.40, 0.10, -0.05}, {0.34, 0.36, 0.90}, 0, 0, 0.05, true},  // before the spine
      Ellipsoid{{0.02, 0.50, -0.28}, {0.50, 0.55, 0.34}, 0, 0, 0.08, true},   // over the stomach
  };
  return join(parts, Sides::one, {{-0.8, -0.9, -0.75}, {0.8, 1.0, 0.75}}, 0.035);
}

SurfaceMesh make_spine() {
  std::vector<Ellipsoid> parts;
  constexpr int vertebrae = 22;
  for (int i = 0; i < vertebrae; ++i) {  // from below
    const double t = double(i) / (vertebrae - 1), height = t - 0.5;
    const double bend = 0.035 * std::sin(6.6 * t + 0.4);
    const double width = 0.040 - 0.008 * t;
    parts.push_back({{bend, 0, height}, {width, 1.1 * width, 0.03}, 0, 0, 0.02});
    parts.push_back(
        {{bend - 0.055, 0, height - 0.006}, {0.035, 0.016, 0.018}, -25, 0, 0.02});  // spinous process
  }
  return join(parts, Sides::one, {{-0.2, -0.12, -0.6}, {0.15, 0.12, 0.6}}, 0.018);
}

SurfaceMesh make_ribcage() {
  // Metres, as it stands in the body: ten ribs on either side, the lower ones without an end at the
  // breastbone.
  constexpr std::array tops = {1.3728, 1.3450, 1.3130, 1.2800, 1.2460,
                               1.2110, 1.1750, 1.1370, 1.0940, 1.0480};
  constexpr std::array widths = {0.108, 0.122, 0.132, 0.140, 0.142, 0.142, 0.142, 0.142, 0.140, 0.136};
  constexpr std::array depths = {0.082, 0.090, 0.098, 0.106, 0.113, 0.119, 0.121, 0.119, 0.114, 0.112};
  constexpr std::array middles_x = {0.094, 0.098, 0.102, 0.105, 0.107, 0.107, 0.107, 0.108, 0.109, 0.109};
  constexpr std::array ends = {0.92, 0.93, 0.93, 0.93, 0.93, 0.92, 0.90, 0.82, 0.70, 0.58};
  constexpr double fall = 0.030, begin = 0.12, radius = 0.005;
  constexpr int rings = 40;
  SurfaceMesh mesh;
  const auto power = [](double v) { return std::copysign(std::pow(std::abs(v), 0.8), v); };
  for (std::size_t rib = 0; rib < tops.size(); ++rib)
    for (const double side : {1.0, -1.0}) {
      std::vector<Vec3> middles;
      for (int i = 0; i <= rings; ++i) {
        const double share = begin + (ends[rib] - begin) * i / rings, turn = std::numbers::pi * share;
        middles.push_back({middles_x[rib] - depths[rib] * power(std::cos(turn)),
                           side * widths[rib] * power(std::sin(turn)), tops[rib] - 2 * fall * share});
      }
      add_tube(middles, radius, mesh);
    }
  std::vector<Vec3> breastbone;
  for (int i = 0; i <= rings; ++i) {
    const double share = double(i) / rings;
    breastbone.push_back({0.150 + 0.067 * std::sqrt(share), 0, 1.335 - 0.19 * share});
  }
  add_tube(breastbone, 0.007, mesh);
  const Box box = bounding_box(mesh.positions);
  mesh.positions.rowwise() -= box.center().transpose();
  mesh.positions /= box.size().z();
  return mesh;
}

}  // namespace limber::scenes
