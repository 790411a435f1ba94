// Figures that say how good the tets of a mesh are.
#pragma once

#include <array>

#include "core/mesh.h"

namespace limber::meshing {

// Smallest and largest dihedral angle of a tet, degrees; 0 and 180 where a face has no area.
struct DihedralRange {
  double min_deg, max_deg;
};
DihedralRange dihedral_range(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// All six, degrees, in no particular order; 0 where a face has no area.
std::array<double, 6> dihedral_angles(const std::array<Vec3, 4>& corners);

// Of a tet's four: the way from a corner to the plane of its opposite face. 0 for a flat tet.
double smallest_height(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// What every tet of a mesh is to keep.
struct TetLimits {
  DihedralRange dihedrals;
  double min_height_m = 0;
};
// Of a tet of positive volume, else false.
bool keeps_limits(const TetLimits&, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

struct TetQuality {
  int tets = 0;
  int vertices = 0;
  int boundary_triangles = 0;
  int components = 0;           // of tets joined by faces
  double min_dihedral_deg = 0;  // over all tets
  double max_dihedral_deg = 0;
  double median_min_dihedral_deg = 0;  // median over the tets of each one's smallest
  double share_under_5_deg = 0;        // of tets whose smallest dihedral is below 5 degrees
  double min_height_m = 0;             // an explicit time step is no longer than a wave needs for it
  double min_volume_m3 = 0;            // signed
  double volume_m3 = 0;
};
TetQuality measure_quality(const TetMesh&);

}  // namespace limber::meshing
