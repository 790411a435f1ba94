// What contact on the fine surface needs of a body, all at rest and made once: the signed distance to its
// surface on a grid, points of its surface, and where in each tet of its cage it is solid. Method:
// docs/contact.md.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/types.h"

namespace limber {

// Signed distance to a surface, negative inside, on a regular grid; trilinear between the nodes.
struct DistanceField {
  Vec3 lower_m = Vec3::Zero();           // where node (0, 0, 0) is
  double cell_m = 0;                     // distance of neighbouring nodes, the same on all axes
  std::array<int, 3> nodes = {0, 0, 0};  // ≥ 2 on each axis
  double unit_m = 0;                     // the distance at node (i, j, k) is unit_m × value
  std::vector<std::int16_t> values;      // [(k nodes[1] + j) nodes[0] + i]

  // Of a point that lies in the grid, else of the nearest that does.
  double at(const Vec3& point_m) const;
};

// Points of a surface, so many that what lies between two of them hides nothing of note.
struct SurfaceSamples {
  Points positions_m;               // (S × 3), ascending by tet
  Eigen::VectorXi tet_from_sample;  // (S) row of the cage's tets
  Weights weights;                  // (S × 4) barycentric in that tet
  Eigen::VectorXd area_m2;          // (S) of the surface that the sample stands for, > 0
};

struct ContactShape {
  DistanceField field;
  SurfaceSamples samples;
  // (T × 4): where a point of tet t can be inside the surface, its barycentric coordinate i is at least this;
  // > 1 in all four where none of the tet is inside.
  Weights min_weight;
  // Where false (a surface without an inside, or walls too thin for the field) there are no samples, nothing
  // is inside, and contact must go by the cage.
  bool usable = true;
};

}  // namespace limber
