// A coarse stand-in for a model, on which cuts are looked for.
#pragma once

#include "core/mesh.h"

namespace limber::meshing::detail {

struct Proxy {
  SurfaceMesh mesh;
  double cell = 0;  // side of the clusters that became one vertex; 0: the mesh itself
};

// Vertex clustering (Rossignac and Borrel 1993). The cell is the smallest, up to 3 %, that leaves few enough
// vertices; a mesh that has few is left as it is.
Proxy make_proxy(const SurfaceMesh&);

}  // namespace limber::meshing::detail
