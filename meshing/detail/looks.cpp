#include "meshing/detail/looks.h"

#include <algorithm>
#include <map>
#include <set>

#include "core/appearance_file.h"
#include "core/error.h"
#include "meshing/detail/companions.h"

namespace limber::meshing::detail {

namespace {

constexpr double largest_uv = 1e5;  // beyond, floats are coarser than a hundredth of an image

bool is_color(const Vec3& c) { return c.allFinite() && c.minCoeff() >= 0 && c.maxCoeff() <= 1; }

// Of each image: the end of its path, no two the same.
std::vector<std::string> names_of_images(const PolygonSoup& soup) {
  std::vector<std::string> names;
  std::map<std::string, int> times;
  std::set<std::string> taken;
  for (const NamedImage& image : soup.images) {
    const std::string& path = image.path;
    const std::string end = tamed(path.substr(path.size() - std::min(path.size(), max_letters_of_names)));
    std::string name = end;
    while (!taken.insert(name).second) name = fmt::format("{} ({})", end, ++times[end] + 1);
    names.push_back(std::move(name));
  }
  return names;
}

bool is_grey(const auto& color) { return color.maxCoeff() - color.minCoeff() < 1e-3; }

// More than one grey all over.
bool says_something(const Appearance& a) {
  const auto is_new = [](const auto& color, const auto& first) {
    return !is_grey(color) || (color - first).cwiseAbs().maxCoeff() > 1e-3;
  };
  int first = -2;  // material
  for (const int m : a.material_from_triangle) {
    if (first == -2) first = m;
    if ((m < 0) != (first < 0)) return true;
    if (m < 0) continue;
    const SurfaceMaterial& material = a.materials[std::size_t(m)];
    if (material.image >= 0 || material.normal_image >= 0 ||
        is_new(material.color, a.materials[std::size_t(first)].color))
      return true;
  }
  for (Eigen::Index i = 0; i < a.colors.rows(); ++i)
    if (is_new(a.colors.row(i), a.colors.row(0))) return true;
  return false;
}

}  // namespace

Appearance appearance_of(const PolygonSoup& soup, const std::vector<TriangleOrigin>& triangles,
                         std::vector<std::string>& warnings) {
  Appearance a;
  const Eigen::Index corners = 3 * std::ssize(triangles);
  a.materials = soup.materials;
  for (SurfaceMaterial& m : a.materials) {
    m.name = tamed(m.name);
    if (!is_color(m.color))
      m.color = m.color.allFinite() ? Vec3(m.color.cwiseMax(0).cwiseMin(1)) : Vec3::Ones();
  }
  for (std::string& name : names_of_images(soup)) a.images.push_back({std::move(name), {}});
  const int of_colors = int(a.materials.size());  // of what has colors and no material
  if (!soup.vertex_colors.empty()) {
    a.materials.emplace_back();
    a.colors.resize(corners, 3);
  }
  if (!soup.corner_uv.empty()) a.uv.setZero(corners, 2);

  std::int64_t without_uv = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const TriangleOrigin& from = triangles[t];
    int material = soup.polygon_material.empty() ? -1 : soup.polygon_material[std::size_t(from.polygon)];
    if (material < 0 && !soup.vertex_colors.empty()) material = of_colors;
    bool has_uv = !soup.corner_uv.empty();
    for (int c = 0; c < 3; ++c) {
      const auto corner = std::size_t(from.corners[std::size_t(c)]);
      const Eigen::Index row = 3 * Eigen::Index(t) + c;
      if (a.colors.rows() > 0) {
        const Vec3& color = soup.vertex_colors[std::size_t(soup.corners[corner])];
        a.colors.row(row) = color.allFinite() ? Vec3(color.cwiseMax(0).cwiseMin(1)) : Vec3(Vec3::Ones());
      }
      if (!has_uv) continue;
      const int uv = soup.corner_uv[corner];
      has_uv = uv >= 0 && soup.uvs[std::size_t(uv)].cwiseAbs().maxCoeff() <= largest_uv;
      if (has_uv) a.uv.row(row) = soup.uvs[std::size_t(uv)];
    }
    if (!has_uv && material >= 0 &&
        (a.materials[std::size_t(material)].image >= 0 ||
         a.materials[std::size_t(material)].normal_image >= 0))
      material = -1, ++without_uv;
    a.material_from_triangle.push_back(material);
  }
  a.drop_unused();
  if (without_uv > 0)
    warnings.push_back(fmt::format(
        "{} of {} triangles should show an image, but have no usable texture coordinates: they are "
        "plain",
        without_uv, triangles.size()));
  if (!says_something(a)) return {};
  return a;
}

void read_images(const fs::path& model, const PolygonSoup& soup, Appearance& a,
                 std::vector<std::string>& warnings) {
  std::map<std::string, const NamedImage*> image_named;
  const std::vector<std::string> names = names_of_images(soup);
  for (std::size_t i = 0; i < names.size(); ++i) image_named[names[i]] = &soup.images[i];
  std::vector<bool> gone(a.images.size(), false);
  if (a.images.size() > max_images) {
    std::fill(gone.begin() + max_images, gone.end(), true);
    warnings.push_back(fmt::format("{} images are shown, and {} more are left out; what shows them is plain",
                                   max_images, a.images.size() - max_images));
  }
  for (std::size_t i = 0; i < std::min(a.images.size(), max_images); ++i) {
    ImageFile& image = a.images[i];
    const NamedImage* named = image_named.at(image.name);
    std::string complaint;
    if (!named->bytes.empty()) {
      image.bytes = named->bytes;
      if (image.bytes.size() > max_image_bytes)
        complaint = fmt::format("\"{}\" has {} bytes, more than 64 MiB", image.name, image.bytes.size());
    } else {
      Companion found = read_companion(model, named->path, max_image_bytes);
      if (found.bytes)
        image.bytes = std::move(*found.bytes);
      else
        complaint = found.complaint;
    }
    if (complaint.empty() && extension_of_image(image.bytes).empty())
      complaint = fmt::format("\"{}\" is neither PNG nor JPEG", image.name);
    if (complaint.empty()) continue;
    warnings.push_back(fmt::format("image {}; what shows it is plain", complaint));
    gone[i] = true;
  }
  a.drop_images(gone);
  a.drop_unused();
  if (!says_something(a)) a = {};
}

}  // namespace limber::meshing::detail
