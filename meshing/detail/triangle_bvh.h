// A binary tree of boxes over a triangle soup; the same soup always gives the same tree.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

struct TriangleBvh {
  struct Node {
    Box box;
    int begin, end;   // its triangles are order[begin … end)
    int left, right;  // rows of nodes; −1 in a leaf
    bool leaf() const { return left < 0; }
  };
  std::vector<Node> nodes;  // the root is first, a parent stands before its children; empty without triangles
  std::vector<int> order;   // rows of the Triangles it was built from
};

// Splits at the median along the longest side of the box of centroids, down to `leaf_size` triangles.
TriangleBvh build_triangle_bvh(const Points&, const Triangles&, int leaf_size);

}  // namespace limber::meshing::detail
