// The signed distance to a surface at the nodes of a grid.
#pragma once

#include "core/contact_shape.h"
#include "meshing/detail/seen_surface.h"

namespace limber::meshing::detail {

// The grid of cells `cell_m` wide, or wider so that it has no more than `max_nodes` nodes, that covers the
// box and a cell more on each side; no values yet.
DistanceField grid_over(const Box&, double cell_m, std::int64_t max_nodes);

// Distance to the nearest of what is seen, exact at a cell and seldom too large by much beyond; nearer, such
// that the field between the nodes is as near to 0 on the surface as it can. Inside is where the winding
// number is above a half; holes are closed where it is just that, to a cell. `closed`: that it can change at
// the surface only. Returns the volume inside, by the share of each node's cell.
double fill(const SeenSurface&, const WindingNumber&, bool closed, DistanceField&);

}  // namespace limber::meshing::detail
