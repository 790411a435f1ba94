#include "meshing/detail/looks.h"

#include <algorithm>

#include "core/appearance_file.h"
#include "core/error.h"
#include "core/words.h"
#include "meshing/detail/companions.h"

namespace limber::meshing::detail {

namespace {

constexpr double largest_uv = 1e5;  // beyond, floats are coarser than a hundredth of an image
constexpr std::size_t most_letters = 100, most_images = 64;

bool is_color(const Vec3& c) { return c.allFinite() && c.minCoeff() >= 0 && c.maxCoeff() <= 1; }

// A text for messages and files: without control letters, and not without end.
std::string tamed(const std::string& name) {
  std::string plain = name.substr(0, most_letters);
  std::replace_if(
      plain.begin(), plain.end(), [](char c) { return std::uint8_t(c) < 32 || c == 127; }, '?');
  if (!is_utf8(plain))
    std::replace_if(
        plain.begin(), plain.end(), [](char c) { return std::uint8_t(c) > 127; }, '?');
  return plain;
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
  for (const NamedImage& image : soup.images) a.images.push_back({tamed(image.path), {}});
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
                 std::vector<std::string>& warnings, std::map<std::string, std::string>& companions) {
  for (std::size_t i = 0; i < a.images.size(); ++i) {
    ImageFile& image = a.images[i];
    const auto named = std::find_if(soup.images.begin(), soup.images.end(),
                                    [&](const NamedImage& other) { return tamed(other.path) == image.name; });
    LIMBER_CHECK(named != soup.images.end(), image.name);
    std::string complaint;
    if (i >= most_images) {
      complaint = fmt::format("\"{}\" is one of more than {}", image.name, most_images);
    } else if (!named->bytes.empty()) {
      image.bytes = named->bytes;
      if (image.bytes.size() > most_image_bytes)
        complaint = fmt::format("\"{}\" has {} bytes, more than 64 MiB", image.name, image.bytes.size());
    } else {
      Companion found = read_companion(model, named->path, most_image_bytes, companions);
      if (found.bytes)
        image.bytes = std::move(*found.bytes);
      else
        complaint = found.complaint;
    }
    if (complaint.empty() && extension_of_image(image.bytes).empty())
      complaint = fmt::format("\"{}\" is neither PNG nor JPEG", image.name);
    if (complaint.empty()) continue;
    warnings.push_back(fmt::format("image {}; what shows it is plain", complaint));
    a.drop_image(int(i));
  }
  a.drop_unused();
  if (!says_something(a)) a = {};
}

}  // namespace limber::meshing::detail
