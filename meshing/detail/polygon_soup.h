// What a file says, before anything is mended: points, and polygons that name them; and how they look.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/appearance.h"
#include "core/file.h"
#include "core/types.h"

namespace limber::meshing::detail {

// An image that a material names: a path as the file has it, or the bytes themselves.
struct NamedImage {
  std::string path;
  std::string bytes;
};

struct PolygonSoup {
  std::vector<Vec3> positions;  // file units; may be infinite or not a number
  std::vector<int> corners;  // polygon i has corners[first_corner[i]] … corners[first_corner[i + 1] − 1]
  std::vector<int> first_corner{0};
  std::vector<std::string> warnings;  // what the reader left out, as sentences
  // How it looks; empty where the file says nothing of it.
  std::vector<Eigen::Vector2d> uvs;
  std::vector<int> corner_uv;              // (corners) of uvs; −1: none
  std::vector<Vec3> vertex_colors;         // (positions) linear
  std::vector<int> polygon_material;       // (polygons) of materials; −1: none
  std::vector<SurfaceMaterial> materials;  // their images are those of `images`
  std::vector<NamedImage> images;
  std::map<std::string, int> image_from_path;
  std::vector<std::string> material_files;  // that an OBJ names
  double rounding = 0;  // file units; how far single precision may have moved a coordinate; 0: doubles

  int polygon_count() const { return int(first_corner.size()) - 1; }
  // Each throws InputError when there are more than an int can number.
  int add_position(const Vec3&);
  void add_corner(int vertex);
  void end_polygon();         // the corners added since the last one
  int add_image(NamedImage);  // its place; the same for the same path
  bool has_image(const std::string& path) const { return image_from_path.contains(path); }
  void note_single_precision();  // all positions so far were floats: sets rounding
  // Throws InputError naming the first polygon that names a vertex that is not there.
  void require_indices(const std::string& file) const;
};

// Each reads the whole text of a file; `file` is its name for messages. Throws InputError with the place:
// "bunny.off:17: …".
PolygonSoup read_obj(std::string_view text, const std::string& file);
PolygonSoup read_off(std::string_view text, const std::string& file);
PolygonSoup read_ply(std::string_view bytes, const std::string& file);
PolygonSoup read_stl_text(std::string_view text, const std::string& file);
PolygonSoup read_stl_binary(std::string_view bytes, const std::string& file);

// Reads the materials that an OBJ names, from files beside it, into its soup. A file that is not there or
// cannot be read is a warning.
void read_materials(const fs::path& model, PolygonSoup&);

// Everything else, by assimp, in a process of its own: a crash or a hang there is an InputError here.
PolygonSoup read_by_assimp(const fs::path&);
std::vector<std::string> endings_of_assimp();  // ".3ds", …

}  // namespace limber::meshing::detail
