// How a file's polygons look, as an Appearance of the triangles that they are cut into.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/appearance.h"
#include "meshing/detail/polygon_soup.h"

namespace limber::meshing::detail {

struct TriangleOrigin {
  int polygon;
  std::array<int, 3> corners;  // of the soup's corners
};

// Images have their names only. Empty where the file says nothing: no image, no color, one grey for all.
Appearance appearance_of(const PolygonSoup&, const std::vector<TriangleOrigin>&,
                         std::vector<std::string>& warnings);

// Reads the images that are still shown, which the file holds or which lie beside it. One that is not there,
// too large, or neither PNG nor JPEG is a warning, and what shows it becomes plain.
void read_images(const fs::path& model, const PolygonSoup&, Appearance&, std::vector<std::string>& warnings);

}  // namespace limber::meshing::detail
