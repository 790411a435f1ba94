// Arithmetic of the steppers, counted by running their own formulas with numbers that count.
#pragma once

#include "fem/world.h"

namespace limber::bench {

struct Operations {
  int sums = 0, products = 0;  // + and −, ×
  int divisions = 0, roots = 0;
  int comparisons = 0;  // with a choice; no part of flops()
  int flops() const { return sums + products + divisions + roots; }
};

struct OperationCounts {  // of one of each
  Operations of_kind[fem::detail::kinds], node;
};
OperationCounts count_operations();

// One pass over all elements and nodes that move, over the number of tets.
double flops_a_tet_step(const fem::World&, const OperationCounts&);

}  // namespace limber::bench
