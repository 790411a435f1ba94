// Where to cut a part: the plane that leaves the least volume in the hulls of the two sides.
#pragma once

#include "meshing/detail/part.h"

namespace limber::meshing::detail {

struct Cut {
  Plane plane;
  double gain = 0;  // volume of the part's hull less those of the two sides' hulls; 0: no cut helps
};

struct CutSearch {
  bool diagonals = true;  // also try the directions to the edges and corners of a cube
  int offsets = 12;       // a direction, at first
  int refinements = 3;    // of the offset
  int tilt_rounds = 3;    // of the direction, four ways each
};

// Directions tried first: those to the faces, edges and corners of a cube, and the part's principal axes.
Cut best_cut(const Model&, const Part&, InsideTest&, const CutSearch&);
// As best_cut; but where no cut gains much and yet the hull is largely empty (a ring, a kettle), the one
// after which the next cuts gain most. Its gain is then the mean of the two levels.
Cut best_cut_ahead(const Model&, const Part&, InsideTest&, const CutSearch&);
// The best offset within plane.offset ± range, for that direction.
Cut best_offset(const Model&, const Part&, InsideTest&, const Plane&, double range);

}  // namespace limber::meshing::detail
