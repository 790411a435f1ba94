// A triangle soup made into a solid that can be cut: in work coordinates, welded, its holes filled, a flat
// one given thickness.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

// Between the user's coordinates and ones about 0 with a diagonal between 1/2 and 1. The scale is a power of
// two, so that it costs no bits.
struct Frame {
  Vec3 center = Vec3::Zero();
  double scale = 1;
  Vec3 work_from_user(const Vec3& p) const { return (p - center) * scale; }
  Vec3 user_from_work(const Vec3& p) const { return p / scale + center; }
};

struct Solid {
  Frame frame;
  double diagonal = 0;             // of the model, in work coordinates
  double flat_half_thickness = 0;  // what a flat model gets to either side
  SurfaceMesh mesh;                // to be cut: triangle t of the user's is t here
  int sheets = 1;                // 3 for a flat model: triangle t is also t + F and t + 2F, one on each side
  SurfaceMesh filled;            // the model itself, every simple hole closed by a fan
  std::vector<int> user_vertex;  // rows of mesh → a vertex of the user's; shorter than mesh.positions

  Triangles boundary;  // those of mesh that bound the volume: the middle sheet of a slab does not
};

// Throws InputError when all vertices are at one place.
Solid make_solid(const SurfaceMesh&);

}  // namespace limber::meshing::detail
