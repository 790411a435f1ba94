// A part in few points: what the search for cuts looks at. Clusters of vertices become one of them (Rossignac
// and Borrel 1993), so the hull of a sketch lies inside the part's. The cell is a share of the part, not of
// the model: a small part is seen as sharply as a large one.
#pragma once

#include <array>
#include <vector>

#include "meshing/detail/part.h"

namespace limber::meshing::detail {

struct Sketch {
  std::vector<Vec3> points;
  std::vector<std::array<int, 2>> edges;  // rows of points
  std::vector<char> buried;               // one a point: see Model
  double area = 0;                        // of the part's surface
};

// All of the part when it has no more than `most` points; else about `most`.
Sketch sketch_of(const Model&, const Part&, int most);
Sketch thinned(Sketch, int most);

}  // namespace limber::meshing::detail
