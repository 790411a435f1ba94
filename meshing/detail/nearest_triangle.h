// The nearest triangle of a soup, to rounding.
#pragma once

#include <array>
#include <vector>

#include "meshing/detail/triangle_bvh.h"

namespace limber::meshing::detail {

// Of a point and the nearest of the triangle (a b c), which may be flat. Ericson, "Real-Time Collision
// Detection" (2005), 5.1.5.
Vec3 nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p);

class NearestTriangle {
 public:
  NearestTriangle(const Points&, const Triangles&);  // copies what it needs

  struct Nearest {
    double squared_distance;
    int triangle;  // −1: none is within the bound
  };
  // Of equally near ones the first. Looks no farther than `bound`, and where the distance is above `exact`
  // the answer may be 2 % too large. Squared, all of them. Safe to call from many threads.
  Nearest at(const Vec3& p, double bound = 1e300, double exact = 1e300) const;

 private:
  TriangleBvh bvh_;
  std::vector<std::array<Vec3, 3>> corners_;  // in the order of the leaves
};

}  // namespace limber::meshing::detail
