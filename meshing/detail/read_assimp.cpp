#include <assimp/GltfMaterial.h>
#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "core/error.h"
#include "meshing/detail/own_process.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"

namespace limber::meshing::detail {

namespace {

constexpr int cpu_seconds = 60;
// A few nested instances can ask for more triangles than any memory holds.
constexpr std::size_t max_vertices = 100'000'000;
constexpr std::size_t max_embedded_bytes = 256 << 20;  // of all images within the file

Eigen::Matrix4d matrix_of(const aiMatrix4x4& m) {
  Eigen::Matrix4d matrix;
  matrix << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
  return matrix;
}

// Its color and images; those within the file come with their bytes.
SurfaceMaterial material_of(const aiScene& scene, const aiMaterial& from, PolygonSoup& soup,
                            std::size_t& embedded_bytes) {
  SurfaceMaterial material{.name = from.GetName().C_Str()};
  aiColor4D color(1, 1, 1, 1);
  if (from.Get(AI_MATKEY_BASE_COLOR, color) != aiReturn_SUCCESS) from.Get(AI_MATKEY_COLOR_DIFFUSE, color);
  material.color = Vec3(color.r, color.g, color.b);
  const auto image = [&](std::initializer_list<aiTextureType> kinds) {
    for (const aiTextureType kind : kinds) {
      aiString path;
      if (from.GetTexture(kind, 0, &path) != aiReturn_SUCCESS || path.length == 0) continue;
      NamedImage named{.path = path.C_Str(), .bytes = {}};
      if (const aiTexture* within = scene.GetEmbeddedTexture(path.C_Str())) {
        if (within->mHeight != 0) {
          soup.warnings.push_back("an image within the file is no PNG or JPEG, and is left out");
          return -1;
        }
        const bool known = soup.has_image(named.path);
        if (!known && (embedded_bytes += within->mWidth) > max_embedded_bytes) {
          soup.warnings.push_back("the images within the file are larger than 256 MiB together; left out");
          return -1;
        }
        if (!known) named.bytes.assign(reinterpret_cast<const char*>(within->pcData), within->mWidth);
      }
      return soup.add_image(std::move(named));
    }
    return -1;
  };
  material.image = image({aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE});
  material.normal_image = image({aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA});
  return material;
}

// All corners have the coordinates of their vertex.
void add_looks(const aiMesh& mesh, PolygonSoup& soup) {
  const std::size_t before = soup.positions.size() - mesh.mNumVertices;
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  if (mesh.HasTextureCoords(0)) {
    soup.uvs.resize(before, Eigen::Vector2d(none, none));
    for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      soup.uvs.emplace_back(mesh.mTextureCoords[0][v].x, mesh.mTextureCoords[0][v].y);
  }
  if (mesh.HasVertexColors(0)) {
    soup.vertex_colors.resize(before, Vec3::Ones());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      soup.vertex_colors.emplace_back(mesh.mColors[0][v].r, mesh.mColors[0][v].g, mesh.mColors[0][v].b);
  }
}

void add_mesh(const aiMesh& mesh, const Eigen::Matrix4d& world_from_mesh, PolygonSoup& soup,
              int& lines_and_points) {
  if (soup.positions.size() + mesh.mNumVertices > max_vertices)
    throw InputError(fmt::format("the instances of the scene add up to more than {} vertices", max_vertices));
  const int first = int(soup.positions.size());
  const double stretch = world_from_mesh.topLeftCorner<3, 3>().norm();
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D& p = mesh.mVertices[v];
    soup.add_position((world_from_mesh * Eigen::Vector4d(p.x, p.y, p.z, 1)).head<3>());
    const double rounding = stretch * 0x1p-24 * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    if (std::isfinite(rounding)) soup.rounding = std::max(soup.rounding, rounding);
  }
  add_looks(mesh, soup);
  const bool mirrored = world_from_mesh.topLeftCorner<3, 3>().determinant() < 0;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices < 3) {
      ++lines_and_points;
      continue;
    }
    for (unsigned c = 0; c < face.mNumIndices; ++c) {
      const unsigned corner = face.mIndices[mirrored ? face.mNumIndices - 1 - c : c];
      if (corner >= mesh.mNumVertices)
        throw InputError(fmt::format("mesh \"{}\": face {} names vertex {}, but there are {} vertices",
                                     mesh.mName.C_Str(), f, corner, mesh.mNumVertices));
      soup.add_corner(first + int(corner));
    }
    soup.end_polygon();
    soup.polygon_material.push_back(mesh.mMaterialIndex < soup.materials.size() ? int(mesh.mMaterialIndex)
                                                                                : -1);
  }
}

PolygonSoup soup_of(const aiScene& scene) {
  struct Visit {
    const aiNode* node;
    Eigen::Matrix4d world_from_parent;
  };
  PolygonSoup soup;
  int lines_and_points = 0;
  std::size_t embedded_bytes = 0;
  for (unsigned m = 0; m < scene.mNumMaterials; ++m)
    soup.materials.push_back(material_of(scene, *scene.mMaterials[m], soup, embedded_bytes));
  std::vector<Visit> stack;
  if (scene.mRootNode) stack.push_back({scene.mRootNode, Eigen::Matrix4d::Identity()});
  while (!stack.empty()) {
    const Visit visit = stack.back();
    stack.pop_back();
    const Eigen::Matrix4d world_from_node = visit.world_from_parent * matrix_of(visit.node->mTransformation);
    for (unsigned m = 0; m < visit.node->mNumMeshes; ++m) {
      LIMBER_CHECK(visit.node->mMeshes[m] < scene.mNumMeshes, visit.node->mMeshes[m], scene.mNumMeshes);
      add_mesh(*scene.mMeshes[visit.node->mMeshes[m]], world_from_node, soup, lines_and_points);
    }
    for (unsigned c = visit.node->mNumChildren; c-- > 0;)
      stack.push_back({visit.node->mChildren[c], world_from_node});
  }
  if (!soup.uvs.empty()) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    soup.uvs.resize(soup.positions.size(), Eigen::Vector2d(none, none));
    soup.corner_uv = soup.corners;
  }
  if (!soup.vertex_colors.empty()) soup.vertex_colors.resize(soup.positions.size(), Vec3::Ones());
  if (lines_and_points > 0)
    soup.warnings.push_back(fmt::format("{} lines and points were left out", lines_and_points));
  return soup;
}

void append(std::string& bytes, const auto& values) {  // a vector or a text
  const std::uint64_t size = values.size();
  bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
  bytes.append(reinterpret_cast<const char*>(values.data()), sizeof values[0] * values.size());
}
template <class T>
std::vector<T> taken(std::string_view& bytes) {
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof size);
  std::vector<T> values(size);
  if (size > 0) std::memcpy(static_cast<void*>(values.data()), bytes.data() + sizeof size, sizeof(T) * size);
  bytes.remove_prefix(sizeof size + sizeof(T) * size);
  return values;
}

std::string text(std::string_view& bytes) {
  const std::vector<char> letters = taken<char>(bytes);
  return {letters.begin(), letters.end()};
}

std::string bytes_of(const PolygonSoup& soup) {
  std::string bytes;
  append(bytes, soup.positions);
  append(bytes, soup.corners);
  append(bytes, soup.first_corner);
  append(bytes, std::vector<double>{soup.rounding});
  append(bytes, soup.uvs);
  append(bytes, soup.corner_uv);
  append(bytes, soup.vertex_colors);
  append(bytes, soup.polygon_material);
  append(bytes, std::vector<std::uint64_t>{soup.materials.size(), soup.images.size()});
  for (const SurfaceMaterial& m : soup.materials) {
    append(bytes, m.name);
    append(bytes, std::vector<double>{m.color.x(), m.color.y(), m.color.z()});
    append(bytes, std::vector<int>{m.image, m.normal_image});
  }
  for (const NamedImage& image : soup.images) append(bytes, image.path), append(bytes, image.bytes);
  for (const std::string& warning : soup.warnings) append(bytes, warning);
  return bytes;
}
PolygonSoup soup_from(std::string_view bytes) {
  PolygonSoup soup;
  soup.positions = taken<Vec3>(bytes);
  soup.corners = taken<int>(bytes);
  soup.first_corner = taken<int>(bytes);
  soup.rounding = taken<double>(bytes).front();
  soup.uvs = taken<Eigen::Vector2d>(bytes);
  soup.corner_uv = taken<int>(bytes);
  soup.vertex_colors = taken<Vec3>(bytes);
  soup.polygon_material = taken<int>(bytes);
  const std::vector<std::uint64_t> counts = taken<std::uint64_t>(bytes);
  for (std::uint64_t m = 0; m < counts[0]; ++m) {
    SurfaceMaterial& material = soup.materials.emplace_back();
    material.name = text(bytes);
    const std::vector<double> color = taken<double>(bytes);
    material.color = Vec3(color[0], color[1], color[2]);
    const std::vector<int> images = taken<int>(bytes);
    material.image = images[0], material.normal_image = images[1];
  }
  for (std::uint64_t i = 0; i < counts[1]; ++i) {
    NamedImage image{.path = text(bytes), .bytes = {}};
    image.bytes = text(bytes);
    soup.add_image(std::move(image));
  }
  while (!bytes.empty()) soup.warnings.push_back(text(bytes));
  return soup;
}

// By the file's name first, which lets assimp find files beside it; then by content alone, for a name that
// lies. UTF-16 goes in as plain text, since some of assimp's readers take it for noise, or for another model.
std::string bytes_by_assimp(const fs::path& path) {
  const std::string content = read_file(path), text = without_byte_order_mark(content);
  const std::string hint = path.extension().empty() ? "" : path.extension().string().substr(1);
  Assimp::Importer importer;
  const aiScene* scene = nullptr;
  if (text.size() * 2 <= content.size())
    scene = importer.ReadFileFromMemory(text.data(), text.size(), 0, hint.c_str());
  if (!scene) scene = importer.ReadFile(path.string(), 0);
  const std::string complaint = importer.GetErrorString();
  if (!scene) scene = importer.ReadFileFromMemory(content.data(), content.size(), 0);
  if (!scene) throw InputError(complaint);
  return bytes_of(soup_of(*scene));
}

bool is_read_by_assimp(const std::string& ending) {
  return ending.empty() || Assimp::Importer().IsExtensionSupported(ending);
}

}  // namespace

PolygonSoup read_by_assimp(const fs::path& path) {
  const OwnProcessResult result = run_in_own_process([&] { return bytes_by_assimp(path); }, cpu_seconds);
  if (!result.finished) {
    const std::string file = path.filename().string(), ending = path.extension().string();
    if (!is_read_by_assimp(ending))  // what it then complains of is another format
      throw InputError(fmt::format(
          "{}: nothing here reads {} files, and by its content it is no other model either; export "
          "it as OBJ, PLY, STL or glTF",
          file, ending));
    throw InputError(fmt::format("{}: the model cannot be read (assimp: {}); is it complete, and a 3D model?",
                                 file, result.bytes));
  }
  return soup_from(result.bytes);
}

std::vector<std::string> endings_of_assimp() {
  std::string list;  // "*.3d;*.3ds;…"
  Assimp::Importer().GetExtensionList(list);
  std::vector<std::string> endings;
  std::istringstream words(list);
  for (std::string word; std::getline(words, word, ';');) endings.push_back(word.substr(1));
  return endings;
}

}  // namespace limber::meshing::detail
