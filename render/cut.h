// What a plane leaves of a solid to be seen: the face that it cuts.
#pragma once

#include <span>

#include "core/mesh.h"

namespace limber::render {

// Whether every edge is passed as often one way as the other: the surface is closed and has an inside, where
// it winds round.
bool has_inside(const Triangles&);

// The part of a plane n·p + d = 0, as (n, d), that lies inside of a surface which has_inside(): where it
// winds round, so overlapping pieces are one, and hollows that face inward stay hollow. Triangles face the
// side n·p + d < 0 and share their vertices along common edges. Empty where the plane misses the surface.
SurfaceMesh cap_of(const Points&, const Triangles&, const Eigen::Vector4d& plane);

// What of it has n·p + d ≥ 0 for each of the planes. Triangles are cut, and share their vertices as before.
SurfaceMesh clipped(SurfaceMesh, std::span<const Eigen::Vector4d> planes);

// Its rim: the edges that one triangle has, row 2i to row 2i + 1.
Points rim_of(const SurfaceMesh&);

// Without the triangles whose middle has n·p + d < 0 for one of the planes, and with the caps of all: for
// what needs no sharp edge.
SurfaceMesh cut_coarsely(const SurfaceMesh&, std::span<const Eigen::Vector4d> planes);

}  // namespace limber::render
