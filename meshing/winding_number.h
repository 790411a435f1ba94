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
    double radius_squared = 0;             // of the ball about `center` that holds the group
    Vec3 area_vector = Vec3::Zero();       // ∫ n dA
    double trace = 0;                      // ∫ x·n dA
    std::array<double, 6> quadratic = {};  // of r ↦ ∫ (x·r) (n·r) dA: by xx, xy, xz, yy, yz, zz of r
    Vec3 contracted = Vec3::Zero();        // ∫ (x·x) n + 2 (x·n) x dA
    std::array<double, 10> cubic = {};  // of r ↦ ∫ (x·r)² (n·r) dA: of x³, x²y, x²z, xy² … z³
  };
  // Two triangles side by side, corner by corner; the second may be a point, which is seen under no angle.
  typedef double Two __attribute__((vector_size(16)));
  struct Pair {
    Two corners[3][3];
  };
  // The product of D + i N of triangles, N and D as in solid_angle_share(): its argument, and the turns that
  // it has gone round more than that shows, are half of all their solid angles.
  class Angles {
   public:
    void add(const Pair&, const Vec3& point);
    double share() const;  // of a whole sphere

   private:
    Two re_ = {1, 1}, im_ = {0, 0}, turns_ = {0, 0};
  };

  detail::TriangleBvh bvh_;
  std::vector<Expansion> expansions_;  // one a node
  std::vector<Pair> pairs_;            // in the order of the leaves, each of which begins a pair
  std::vector<int> first_pair_;        // of each node that is a leaf
};

}  // namespace limber::meshing
