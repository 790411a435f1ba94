// Where to cut a part: the plane that leaves the least volume in the hulls of the two sides.
#pragma once

#include "meshing/detail/part.h"

namespace limber::meshing::detail {

struct Cut {
  Plane plane;
  double gain = 0;  // volume of the part's hull less those of the two sides' hulls; 0: no cut helps
  bool is_first_of_two = false;  // the gain is the mean of this cut's and the next ones'
};

// Directions are those to the faces, edges and corners of a cube, the part's principal axes, and the normals
// of its large flat faces; the best are refined and tilted.
Cut best_cut(const Model&, const Part&, InsideTest&);
// As best_cut; but where no cut gains much and yet the hull is largely empty (a ring, a kettle), the one
// after which the next cuts gain most. Then is_first_of_two.
Cut best_cut_ahead(const Model&, const Part&, InsideTest&);
// Where none of these gains anything: of planes that go through a point of the part's hull, and into it there
// (across `outwards`), the one after which the next cuts gain most, or, of equals, across which it is
// longest.
Plane cut_through(const Model&, const Part&, const Vec3& point, const Vec3& outwards, InsideTest&);

}  // namespace limber::meshing::detail
