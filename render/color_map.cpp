#include "render/color_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/image.h"

namespace limber::render {

namespace {

// Linear sRGB to the cones' responses, and their cube roots to Oklab; both as Ottosson gives them.
const Eigen::Matrix3d cones_from_rgb =
    (Eigen::Matrix3d() << 0.4122214708, 0.5363325363, 0.0514459929, 0.2119034982, 0.6806995451, 0.1073969566,
     0.0883024619, 0.2817188376, 0.6299787005)
        .finished();
const Eigen::Matrix3d lab_from_roots =
    (Eigen::Matrix3d() << 0.2104542553, 0.7936177850, -0.0040720468, 1.9779984951, -2.4285922050,
     0.4505937099, 0.0259040371, 0.7827717662, -0.8086757660)
        .finished();

Vec3 mixed(const Oklab& from, const Oklab& to, double share) {
  const auto mix = [&](double a, double b) { return a + share * (b - a); };
  const Vec3 srgb =
      srgb_from_oklab({mix(from.lightness, to.lightness), mix(from.a, to.a), mix(from.b, to.b)});
  return srgb.cwiseMax(0).cwiseMin(1);
}

}  // namespace

Oklab oklab_from_srgb(const Vec3& srgb) {
  const Vec3 roots =
      (cones_from_rgb * linear_from_srgb(srgb)).unaryExpr([](double v) { return std::cbrt(v); });
  const Vec3 lab = lab_from_roots * roots;
  return {lab[0], lab[1], lab[2]};
}

Vec3 srgb_from_oklab(const Oklab& lab) {
  static const Eigen::Matrix3d roots_from_lab = lab_from_roots.inverse(),
                               rgb_from_cones = cones_from_rgb.inverse();
  const Vec3 roots = roots_from_lab * Vec3(lab.lightness, lab.a, lab.b);
  const Vec3 linear = rgb_from_cones * roots.cwiseProduct(roots).cwiseProduct(roots);
  return linear.unaryExpr([](double v) { return v < 0 ? v : srgb_from_linear(v); });
}

Vec3 sequential_srgb(double share) {
  // Lightness falls evenly while the hue turns from yellow over red to purple; the chroma is what screens
  // show of all these, and next to none at nothing.
  const double t = std::clamp(share, 0.0, 1.0);
  const double lightness = 0.87 - 0.54 * t, hue = (100 - 135 * t) * std::numbers::pi / 180;
  const double chroma = 0.012 + 0.15 * std::sin(0.78 * std::numbers::pi * std::pow(t, 0.85));
  const Vec3 srgb = srgb_from_oklab({lightness, chroma * std::cos(hue), chroma * std::sin(hue)});
  return srgb.cwiseMax(0).cwiseMin(1);
}

Vec3 diverging_srgb(double share) {
  static const Oklab blue{0.45, -0.035, -0.135}, grey{0.93, 0, 0}, red{0.45, 0.145, 0.07};
  const double t = std::clamp(share, 0.0, 1.0);
  return t < 0.5 ? mixed(blue, grey, 2 * t) : mixed(red, grey, 2 * (1 - t));
}

}  // namespace limber::render
