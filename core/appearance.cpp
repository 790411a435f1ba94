#include "core/appearance.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace limber {

namespace {

// Leaves the entries that keep[i] tells of; returns the new number of each, −1 where it went.
template <class T>
std::vector<int> keep_only(std::vector<T>& list, const std::vector<bool>& keep) {
  std::vector<int> now(list.size(), -1);
  std::vector<T> kept;
  for (std::size_t i = 0; i < list.size(); ++i)
    if (keep[i]) now[i] = int(kept.size()), kept.push_back(std::move(list[i]));
  list = std::move(kept);
  return now;
}

int renumbered(const std::vector<int>& now, int old) { return old < 0 ? -1 : now[std::size_t(old)]; }

}  // namespace

void Appearance::drop_images(const std::vector<bool>& gone) {
  const auto goes = [&](int image) { return image >= 0 && gone[std::size_t(image)]; };
  for (int& m : material_from_triangle)
    if (m >= 0 && goes(materials[std::size_t(m)].image)) m = -1;
  for (SurfaceMaterial& material : materials) {
    if (goes(material.image)) material.image = -1;
    if (goes(material.normal_image)) material.normal_image = -1;
  }
}

void Appearance::drop_unused() {
  std::vector<bool> has_triangle(materials.size(), false);
  for (const int m : material_from_triangle)
    if (m >= 0) has_triangle[std::size_t(m)] = true;
  const std::vector<int> material_now = keep_only(materials, has_triangle);
  for (int& m : material_from_triangle) m = renumbered(material_now, m);
  std::vector<bool> is_shown(images.size(), false);
  for (const SurfaceMaterial& material : materials)
    for (const int i : {material.image, material.normal_image})
      if (i >= 0) is_shown[std::size_t(i)] = true;
  const std::vector<int> image_now = keep_only(images, is_shown);
  for (SurfaceMaterial& material : materials) {
    material.image = renumbered(image_now, material.image);
    material.normal_image = renumbered(image_now, material.normal_image);
  }
  if (images.empty()) uv.resize(0, 2);
  if (materials.empty()) *this = {};
}

void validate(const Appearance& a, Eigen::Index triangles, std::string_view what) {
  const auto require = [&](bool good, const std::string& why) {
    if (!good) throw InputError(fmt::format("{}: {}", what, why));
  };
  if (a.empty()) return require(a.uv.rows() == 0 && a.colors.rows() == 0, "colors of no triangle");
  require(std::ssize(a.material_from_triangle) == triangles,
          fmt::format("materials of {} triangles, where there are {}", a.material_from_triangle.size(),
                      triangles));
  require(a.uv.rows() == 0 || a.uv.rows() == 3 * triangles,
          fmt::format("coordinates of {} corners, where there are {}", a.uv.rows(), 3 * triangles));
  require(a.colors.rows() == 0 || a.colors.rows() == 3 * triangles,
          fmt::format("colors of {} corners, where there are {}", a.colors.rows(), 3 * triangles));
  for (std::size_t t = 0; t < a.material_from_triangle.size(); ++t)
    require(
        a.material_from_triangle[t] >= -1 && a.material_from_triangle[t] < std::ssize(a.materials),
        fmt::format("triangle {} has material {} of {}", t, a.material_from_triangle[t], a.materials.size()));
  for (Eigen::Index i = 0; i < a.uv.rows(); ++i)
    require(a.uv.row(i).allFinite(), fmt::format("the coordinates of corner {} are not finite", i));
  for (Eigen::Index i = 0; i < a.colors.rows(); ++i)
    require(a.colors.row(i).minCoeff() >= 0 && a.colors.row(i).maxCoeff() <= 1,
            fmt::format("the color of corner {} is not from 0 to 1", i));
  for (const SurfaceMaterial& m : a.materials) {
    require(m.color.minCoeff() >= 0 && m.color.maxCoeff() <= 1,
            fmt::format("the color of material \"{}\" is not from 0 to 1", m.name));
    for (const int i : {m.image, m.normal_image})
      require(i >= -1 && i < std::ssize(a.images) && (i < 0 || a.uv.rows() > 0),
              fmt::format("material \"{}\" has image {} of {}", m.name, i, a.images.size()));
  }
}

CornerMap same_corners(Eigen::Index triangles) {
  CornerMap map;
  map.weights.resize(3 * triangles, 3);
  for (Eigen::Index t = 0; t < triangles; ++t) {
    map.triangle.push_back(int(t));
    map.weights.middleRows<3>(3 * t).setIdentity();
  }
  return map;
}

Appearance carried(const Appearance& from, const CornerMap& map) {
  Appearance to;
  if (from.empty()) return to;
  to.materials = from.materials, to.images = from.images;
  const auto carry = [&](const auto& old, auto& now) {
    if (old.rows() == 0) return;
    now.resize(map.weights.rows(), old.cols());
    for (std::size_t t = 0; t < map.triangle.size(); ++t)
      now.template middleRows<3>(3 * Eigen::Index(t)) =
          map.weights.middleRows<3>(3 * Eigen::Index(t)) *
          old.template middleRows<3>(3 * Eigen::Index(map.triangle[t]));
  };
  carry(from.uv, to.uv);
  carry(from.colors, to.colors);
  for (const int t : map.triangle)
    to.material_from_triangle.push_back(from.material_from_triangle[std::size_t(t)]);
  return to;
}

double linear_from_srgb(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

void round_to_floats(Appearance& a) {
  a.uv = a.uv.cast<float>().cast<double>().eval();
  a.colors = a.colors.cast<float>().cast<double>().cwiseMax(0).cwiseMin(1).eval();
}

std::string extension_of_image(std::string_view bytes) {
  return bytes.starts_with("\x89PNG\r\n\x1a\n") ? ".png" : bytes.starts_with("\xff\xd8\xff") ? ".jpg" : "";
}

}  // namespace limber
