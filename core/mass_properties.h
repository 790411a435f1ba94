// Volume, centre and moments of inertia of what closed surfaces and tets fill.
#pragma once

#include "core/mesh.h"

namespace limber {

// Every edge is run along as often one way as the other: the surface has an inside.
bool is_closed(const Triangles&);

struct MassProperties {
  double volume_m3 = 0;
  Vec3 center_m = Vec3::Zero();
  // About the centre, of density 1: ∫ (|x|² 1 − x xᵀ) dV, m⁵.
  Eigen::Matrix3d inertia_m5 = Eigen::Matrix3d::Zero();
};

// Of the inside of a closed, outward surface: the sum over the signed tets of its triangles and a point, with
// the second moments of a tet of Tonon, Explicit exact formulas for the 3-D tetrahedron inertia tensor in
// terms of its vertex coordinates (2004). Means nothing of an open one.
MassProperties mass_properties(const Points&, const Triangles&);
MassProperties mass_properties(const TetMesh&);

}  // namespace limber
