#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <sstream>

#include "core/error.h"
#include "meshing/detail/own_process.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"

namespace limber::meshing::detail {

namespace {

constexpr int cpu_seconds = 60;
// A few nested instances can ask for more triangles than any memory holds.
constexpr std::size_t most_vertices = 100'000'000;

Eigen::Matrix4d matrix_of(const aiMatrix4x4& m) {
  Eigen::Matrix4d matrix;
  matrix << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
  return matrix;
}

void add_mesh(const aiMesh& mesh, const Eigen::Matrix4d& world_from_mesh, PolygonSoup& soup,
              int& lines_and_points) {
  if (soup.positions.size() + mesh.mNumVertices > most_vertices)
    throw InputError(
        fmt::format("the instances of the scene add up to more than {} vertices", most_vertices));
  const int first = int(soup.positions.size());
  const double stretch = world_from_mesh.topLeftCorner<3, 3>().norm();
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D& p = mesh.mVertices[v];
    soup.add_position((world_from_mesh * Eigen::Vector4d(p.x, p.y, p.z, 1)).head<3>());
    const double rounding = stretch * 0x1p-24 * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    if (std::isfinite(rounding)) soup.rounding = std::max(soup.rounding, rounding);
  }
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
  }
}

PolygonSoup soup_of(const aiScene& scene) {
  struct Visit {
    const aiNode* node;
    Eigen::Matrix4d world_from_parent;
  };
  PolygonSoup soup;
  int lines_and_points = 0;
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
  if (lines_and_points > 0)
    soup.warnings.push_back(fmt::format("{} lines and points were left out", lines_and_points));
  return soup;
}

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  const std::uint64_t size = values.size();
  bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
  bytes.append(reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size());
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

std::string bytes_of(const PolygonSoup& soup) {
  std::string bytes;
  append(bytes, soup.positions);
  append(bytes, soup.corners);
  append(bytes, soup.first_corner);
  append(bytes, std::vector<double>{soup.rounding});
  for (const std::string& warning : soup.warnings)
    append(bytes, std::vector<char>(warning.begin(), warning.end()));
  return bytes;
}
PolygonSoup soup_from(std::string_view bytes) {
  PolygonSoup soup;
  soup.positions = taken<Vec3>(bytes);
  soup.corners = taken<int>(bytes);
  soup.first_corner = taken<int>(bytes);
  soup.rounding = taken<double>(bytes).front();
  while (!bytes.empty()) {
    const std::vector<char> warning = taken<char>(bytes);
    soup.warnings.emplace_back(warning.begin(), warning.end());
  }
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

}  // namespace

PolygonSoup read_by_assimp(const fs::path& path) {
  const OwnProcessResult result = run_in_own_process([&] { return bytes_by_assimp(path); }, cpu_seconds);
  if (!result.finished)
    throw InputError(fmt::format("{}: the model cannot be read (assimp: {}); is it complete, and a 3D model?",
                                 path.filename().string(), result.bytes));
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
