// The steps that make a triangle soup fit to compute with. None moves a vertex that stays. docs/import.md
// Where a CornerMap is given, its rows go with the triangles.
#pragma once

#include <vector>

#include "core/appearance.h"
#include "core/mesh.h"

namespace limber::meshing {

// A distance below which two vertices are one: `relative` of the diagonal of the box round all triangles, but
// at most a thousandth of the median side, so that one stray vertex far away does not melt the model. Zero
// for an empty mesh.
double weld_tolerance_m(const SurfaceMesh&, double relative);

// (V) for each vertex the lowest row among the vertices that it is welded to: those not further than
// tolerance_m, and those welded to them. Does not depend on the order of the vertices. Rows that are not
// finite are welded to nothing.
std::vector<int> weld(const Points&, double tolerance_m);

// Height of a triangle over its longest side; 0 when two corners are the same.
double thinness(const SurfaceMesh&, int triangle);

// Drops triangles that name a vertex twice. Returns how many.
int drop_collapsed(SurfaceMesh&, CornerMap* = nullptr);
// Drops triangles with the vertices of an earlier one, whichever way round. Returns how many.
int drop_duplicates(SurfaceMesh&, CornerMap* = nullptr);

struct Flattened {
  int flipped = 0;  // cut with the neighbour on the longest side by the quad's other diagonal
  int dropped = 0;  // where that was not possible
};
// Removes triangles thinner than tolerance_m. A flip keeps the surface where it is and watertight; its
// corners are those of the neighbour, for the flat triangle covered nothing.
Flattened remove_flat(SurfaceMesh&, double tolerance_m, CornerMap* = nullptr);

struct Orientation {
  int turned_triangles = 0;   // to agree with the larger part of their piece
  int turned_components = 0;  // whole ones, inside out before
  int cavities = 0;           // facing inward, inside another: left so
  int one_sided = 0;          // pieces like a Möbius strip, that cannot be oriented
  std::vector<Vec3> inner;    // a point on each closed or nearly closed component inside another
};
// Triangles joined over edges of two are made to agree, then closed and nearly closed components to face
// outward. One inside another is turned with it, so that a model that is inside out as a whole comes out
// right; if it then faces inward, and the winding number of the others round it is at least a half, it is a
// cavity and stays. Open sheets keep the side they have, unless more than half of the surface is turned.
Orientation orient(SurfaceMesh&, CornerMap* = nullptr);

// Drops vertices in no triangle; the others keep their order. Returns how many.
int drop_unused(SurfaceMesh&);

}  // namespace limber::meshing
