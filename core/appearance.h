// What a surface shows beyond its shape: the images, colors and materials that its maker gave it.
#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"

namespace limber {

using Uvs = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

struct SurfaceMaterial {
  std::string name = {};
  Vec3 color = Vec3::Ones();  // linear; what follows and the corners' colors are multiplied by it
  int image = -1;             // of colors, sRGB; −1: none
  int normal_image = -1;      // of normals, x along u, y along v, as (n + 1) / 2; −1: none
};

struct ImageFile {
  std::string name;   // as the model calls it, for messages
  std::string bytes;  // of a PNG or JPEG
};

// Row 3t + c is of corner c of triangle t: at a seam the corners of one vertex differ.
struct Appearance {
  Uvs uv;         // (3F × 2); (0 0) is the lower left corner of an image, which is repeated; no rows: none
  Points colors;  // (3F × 3), linear; no rows: none
  std::vector<int> material_from_triangle;  // (F); −1: none, the surface is plain there
  std::vector<SurfaceMaterial> materials;
  std::vector<ImageFile> images;

  bool empty() const { return material_from_triangle.empty(); }
  // All that shows one of the images for which gone[i] becomes plain; what has its normals by it, smooth.
  void drop_images(const std::vector<bool>& gone);
  // Materials and images that no triangle has any more; the others keep their order. Empty where none is
  // left.
  void drop_unused();
};

// Throws InputError with `what` and the first bad element: rows that are not those of so many triangles,
// numbers that are not finite, a material or image that is not there.
void validate(const Appearance&, Eigen::Index triangles, std::string_view what);

// Where the corners of a mended or cut mesh were on the triangles of the mesh before.
struct CornerMap {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  std::vector<int> triangle;  // (F) of the mesh before
  Rows weights;               // (3F × 3) barycentric, of that triangle's corners
};
CornerMap same_corners(Eigen::Index triangles);
// The appearance of the new mesh: interpolated linearly on the triangles of the old.
Appearance carried(const Appearance&, const CornerMap&);

// The sRGB transfer curve (IEC 61966-2-1), a channel at a time, 0 … 1.
double linear_from_srgb(double);

// With the digits that files of a work folder hold.
void round_to_floats(Appearance&);

// ".png" or ".jpg", as the bytes begin; "" of what is neither.
std::string extension_of_image(std::string_view bytes);

}  // namespace limber
