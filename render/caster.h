// A coarse stand-in for a fine surface, to cast its shadows: a shadow map of hundreds of thousands of
// triangles costs as much as all the rest of a picture.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::render {

struct Caster {
  std::vector<Eigen::Index> vertices;  // of the fine surface: those that are left
  Triangles triangles;                 // rows of `vertices`
  Points positions(const Points& fine) const;
};

// Vertices in one cell of a grid become one of them, the nearest to their middle; triangles with two corners
// in one cell vanish. At most `triangles` are left, as many as a cell size gives. What was closed stays
// closed: each edge has an even number of triangles.
Caster coarse_caster(const SurfaceMesh& fine, int triangles);

}  // namespace limber::render
