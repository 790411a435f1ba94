// How often a triangle soup winds round a point: 1 inside a closed surface seen counter-clockwise from
// outside, 0 outside, −1 inside one that is turned inside out, and in between near the hole of an open one. A
// half is the usual threshold.
// Barill, Dickson, Schmidt, Levin, Jacobson, "Fast winding numbers for soups and clouds" (SIGGRAPH 2018):
// far groups of triangles act as a dipole with its first two derivatives, near ones by their exact solid
// angle.
#pragma once

#include <array>
#include <vector>

#include "core/types.h"
#include "meshing/detail/triangle_bvh.h"

namespace limber::meshing {

// Signed solid angle of a triangle seen from a point, over 4π: positive when the point is on the clockwise
// side (inside), 0 in its plane. Van Oosterom and Strackee 1983.
double solid_angle_share(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point);

class WindingNumber {
 public:
  WindingNumber(const Points& positions, const Triangles&);  // copies what it needs
  // Within 1e-2 of exact, 2e-3 on average (docs/decomposition-measured.md). Safe to call from many threads.
  double at(const Vec3& point) const;
  bool inside(const Vec3& point) const { return at(point) > 0.5; }

 private:
  // Moments of the area vector n dA about the area-weighted center, x counted from there.
  struct Expansion {
    Vec3 center = Vec3::Zero();
    double radius_squared = 0;                         // of the ball about `center` that holds the group
    Vec3 area_vector = Vec3::Zero();                   // ∫ n dA
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();  // ∫ x nᵀ dA
    Vec3 contracted = Vec3::Zero();                    // ∫ (x·x) n + 2 (x·n) x dA
    std::array<Eigen::Matrix3d, 3> second_moment = {   // ∫ x xᵀ n_k dA, one matrix a component k of n
        Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  };
  detail::TriangleBvh bvh_;
  std::vector<Expansion> expansions_;         // one a node
  std::vector<std::array<Vec3, 3>> corners_;  // in the order of the leaves
};

}  // namespace limber::meshing
