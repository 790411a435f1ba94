// Which convex parts to cut a solid into: few, and with little empty space in their hulls.
#pragma once

#include <vector>

#include "core/progress.h"
#include "meshing/detail/overshoot.h"
#include "meshing/detail/part.h"

namespace limber::meshing::detail {

struct PartLimits {
  int most = 0;              // parts
  double max_overshoot = 0;  // parts that stand off the model by no more are not cut; 0: only the count rules
};

// Cuts more parts than asked for, unites the cheapest again, and cuts anew what two neighbours hold together
// where that leaves less. New points are added to the model. Throws Interrupted.
std::vector<Part> find_parts(Model&, Part whole, InsideTest&, const SurfaceDistance&, const PartLimits&,
                             Progress&);
// Parts that are cut first; the total of the progress.
int parts_to_cut(int most);

}  // namespace limber::meshing::detail
