// The edges of a triangle soup, sorted: every question about boundary, manifoldness and neighbours is a walk
// over it.
#pragma once

#include <span>
#include <vector>

#include "core/types.h"
#include "core/union_find.h"

namespace limber::meshing::detail {

// One side of one triangle. The side goes from corner `side` to corner `side`+1.
struct EdgeUse {
  int lower, upper;  // the edge's vertices, lower < upper
  int triangle, side;
  bool forward;  // the triangle goes from lower to upper
};

// Sorted by (lower, upper, triangle); sides whose two ends are the same vertex are left out.
std::vector<EdgeUse> edge_uses(const Triangles&);

// Calls visit(span of all uses of one edge), edge after edge.
template <class Visit>
void for_each_edge(const std::vector<EdgeUse>& uses, Visit visit) {
  for (std::size_t begin = 0, end; begin < uses.size(); begin = end) {
    for (end = begin + 1;
         end < uses.size() && uses[end].lower == uses[begin].lower && uses[end].upper == uses[begin].upper;)
      ++end;
    visit(std::span<const EdgeUse>(uses.data() + begin, end - begin));
  }
}

// For each triangle, the lowest triangle that it is joined to over shared edges.
std::vector<int> components(const Triangles&, const std::vector<EdgeUse>&);

}  // namespace limber::meshing::detail
