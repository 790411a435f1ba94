#pragma once

#include "core/mesh.h"

namespace limber {

// The unit cube, corner at the origin; vertex = x + 2y + 4z, the last tet in the middle.
inline TetMesh five_tet_cube() {
  TetMesh mesh;
  mesh.positions.resize(8, 3);
  for (int v = 0; v < 8; ++v) mesh.positions.row(v) << (v & 1), (v >> 1 & 1), (v >> 2 & 1);
  mesh.tets.resize(5, 4);
  mesh.tets << 0, 1, 2, 4, 3, 2, 1, 7, 5, 4, 7, 1, 6, 7, 4, 2, 1, 2, 4, 7;
  return mesh;
}

}  // namespace limber
