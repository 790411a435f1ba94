// Long thin triangles that lie askew have boxes full of nothing: a tree of such boxes is no better than a
// list (of a rod with 4,000 triangles as long as itself, each question to the tree asked all of them). They
// are halved until their boxes are close: the early split clipping of Ernst and Greiner 2007.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

struct TrianglePiece {
  int triangle;
  Box box;  // of a part of it; the boxes of all its pieces cover it, whatever the rounding
};

// In the order of the triangles; most have one piece, with the triangle's own box. Some two million at most,
// besides one a triangle.
std::vector<TrianglePiece> pieces_of(const Points& positions, const Triangles&);

}  // namespace limber::meshing::detail
