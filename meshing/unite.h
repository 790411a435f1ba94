// Makes one surface of several: of all that is inside any of them. Corefinement by CGAL (Loriot et al.,
// "Polygon Mesh Processing"). Method, and what is not united: docs/imaging.md.
#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing {

struct United {
  SurfaceMesh surface;  // in the order of the first element of each piece; what met nothing is as it was
  std::vector<std::vector<int>> together;  // elements that became one piece, ascending; two or more each
  // Elements that meet others and stay side by side with them, walls within and all: one that is not fit to
  // be united, or all of two pieces that could not be.
  struct Beside {
    std::vector<int> elements;  // ascending
    std::string why;            // the end of a sentence: "it is open", "what comes out …"
  };
  std::vector<Beside> beside;
};

// Each element must pass validate(), and be welded. A cavity is a shell that faces inward within another, and
// stays one. What is made is closed, faces outward, is a manifold and does not pass through itself, or is not
// taken. No vertex moves; those of the cut are new, and rounded. Same elements in the same order, same bytes,
// unless two of them take more than 600 CPU seconds, which is told. Throws Interrupted.
United unite(const std::vector<SurfaceMesh>& elements);

// Side by side: all of the second after all of the first.
void append(SurfaceMesh&, const SurfaceMesh&);

}  // namespace limber::meshing
